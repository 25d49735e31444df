"""How strings stand out from their ground, where little else than ground lies on the axis."""

from __future__ import annotations

import numpy as np
import pytest

from tsvision.images.contrast import core_of, scaled_contrast
from tsvision.images.signal import LUMA
from tsvision.images.strip import Strip

BUNDLE_PX, HALF_PX = 20.0, 60
GROUND, STRINGS, PLATE = 0.3, 0.4, 0.05


@pytest.fixture
def close_up() -> Strip:
    """A dark plate across the first fifth of a strip, legs that meet, and a bundle."""
    n, s = np.mgrid[-HALF_PX : HALF_PX + 1, 0:500].astype(float)
    light = np.full(n.shape, GROUND)
    light[np.abs(np.abs(n) - np.maximum(0.2 * (250.0 - s), 5.0)) <= 5.0] = STRINGS
    light[s < 100.0] = PLATE
    light += np.random.default_rng(3).normal(0.0, 0.002, n.shape)
    return Strip(light.astype(np.float32), 0.0, HALF_PX)


def test_a_plate_across_the_strip_is_not_what_the_core_shows(close_up: Strip) -> None:
    """It stood out by more than a tenth of the columns did, and strings were taken to be darker
    than their ground: nothing was found of a film of green strings (`wild 523`)."""
    core = core_of([close_up], LUMA, BUNDLE_PX, between=True)
    assert core == pytest.approx(STRINGS - GROUND, abs=0.01)
    contrast, *_ = scaled_contrast(close_up, LUMA, BUNDLE_PX, between=True)
    assert np.median(contrast[HALF_PX, 300:]) == pytest.approx(1.0, abs=0.05)
