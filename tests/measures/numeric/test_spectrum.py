"""The spectrum between two rates."""

from __future__ import annotations

import numpy as np

from tsvision.measures.numeric.spectrum import spectrum


def test_a_spectrum_is_the_sum_it_stands_for() -> None:
    values = np.random.default_rng(3).normal(size=301)
    z = -40.5 + np.arange(301.0)
    rates = np.linspace(0.02, 0.7, 57)
    expected = np.exp(-1j * np.outer(rates, z)) @ values
    np.testing.assert_allclose(spectrum(values, -40.5, rates), expected, atol=1e-9)
    np.testing.assert_allclose(spectrum(values, -40.5, rates[:1]), expected[:1], atol=1e-9)
