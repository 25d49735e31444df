"""Lines smoothed and bridged, and sums, to the last bit as scipy and numpy do."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from tsvision.measures.numeric.smoothing import blurred, bridged, smoothed
from tsvision.measures.numeric.sums import deviation, summed


@pytest.mark.parametrize("count", [1, 4, 57, 400])
@pytest.mark.parametrize("sd", [0.3, 1.0, 7.0, 40.0])
def test_smoothed(count: int, sd: float) -> None:
    line = np.random.default_rng(count).normal(size=count)
    assert np.array_equal(smoothed(line, sd), gaussian_filter1d(line, sd))
    level = gaussian_filter1d(line, sd, mode="nearest", truncate=3.0)
    assert np.array_equal(smoothed(line, sd, 3.0, mirrored=False), level)


@pytest.mark.parametrize("share", [0.02, 0.5, 1.0])
def test_bridged(share: float) -> None:
    rng, at = np.random.default_rng(3), np.arange(200)
    line, known = rng.normal(size=200), rng.random(200) < share
    known[17] = True
    assert np.array_equal(bridged(line, known), np.interp(at, at[known], line[known]))


def test_nothing_bridges_nothing() -> None:
    assert np.isnan(bridged(np.ones(5), np.zeros(5, bool))).all()


@pytest.mark.parametrize("count", [1, 7, 8, 9, 127, 128, 129, 1777])
def test_sums(count: int) -> None:
    values = np.random.default_rng(count).normal(size=count)
    assert summed(values) == values.sum()
    assert deviation(values) == np.std(values)


@pytest.mark.parametrize("sd", [0.7, 7.0, 60.0])
def test_blurred(sd: float) -> None:
    lines = np.cumsum(np.random.default_rng(3).normal(size=(4, 300)), axis=1)
    known = gaussian_filter1d(lines, sd, axis=1, mode="nearest", truncate=3.5)
    np.testing.assert_allclose(blurred(lines, sd, truncate=3.5), known, atol=1e-9)
