"""Widths where no helix fits."""

from __future__ import annotations

import numpy as np
import pytest

from tsvision.measures.helix import Edges
from tsvision.measures.width import is_tapered, width_between_knots


def bounded(width_px: np.ndarray) -> Edges:
    """What lies evenly about a line, found with noise."""
    noise = 0.3 * np.random.default_rng(1).standard_normal((2, width_px.size))
    half, sure = 0.5 * width_px, np.ones(width_px.size)
    return Edges(
        np.arange(width_px.size, dtype=float), half + noise[0], noise[1] - half, sure, sure
    )


S = np.arange(150.0)


@pytest.mark.parametrize("together", [0.2, -0.2])
def test_borders_that_run_together_are_those_of_two_legs(together: float) -> None:
    """Where they meet at the picture's border their distance was told as D, 30 px of 90 too wide
    (`wild 830`, and `796` where nothing fitted)."""
    legs = bounded(80.0 - together * (S - 75.0))
    assert is_tapered(legs)
    assert np.isnan(width_between_knots(legs, 90.0))


@pytest.mark.parametrize(
    "width_px",
    [80.0 - 0.01 * S, 40.0 + 15.0 * np.abs(np.cos(S / 30.0)), 80.0 + 40.0 * (S > 110)],
    ids=["seen aslant", "strands", "a knot at its end"],
)
def test_a_bundle_does_not_taper(width_px: np.ndarray) -> None:
    assert not is_tapered(bounded(width_px))
