"""S or Z from ridges drawn as sloping stripes."""

from __future__ import annotations

import numpy as np
import pytest

from tests.measures.pictures import picture
from tsvision.measures import sense
from tsvision.measures.handedness import handedness_of, ridge_slope
from tsvision.measures.recording import Measurer
from tsvision.records import Frame, Rig, Strings, View


def stripes(slope: float, coil_px: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Bright ridges n = slope * s, carried along a coiling centre line; and that line's rows."""
    s = np.arange(400.0)
    centre = 30.0 + coil_px * np.sin(2 * np.pi * s / 90.0)
    n = np.arange(61.0)[:, None] - centre[None, :]
    return 0.4 + 0.3 * np.cos(2 * np.pi * (n - slope * s) / 14.0), centre


@pytest.mark.parametrize("coil_px", [0.0, 6.0])
@pytest.mark.parametrize(("slope", "hand"), [(0.4, "Z"), (-0.4, "S")])
def test_ridges_that_fall_to_the_right_are_z(slope: float, hand: str, coil_px: float) -> None:
    light, centre = stripes(slope, coil_px)
    assert handedness_of(ridge_slope(light, centre, 8.0)) == hand


def test_a_mirror_swaps_the_sign_and_a_half_turn_does_not() -> None:
    light, centre = stripes(0.4)
    here = ridge_slope(light, centre, 8.0)
    assert ridge_slope(light[::-1], 60.0 - centre, 8.0) == pytest.approx(-here, rel=0.02)
    assert ridge_slope(light[::-1, ::-1], 60.0 - centre[::-1], 8.0) == pytest.approx(here, rel=0.02)


def test_channels_that_contradict_each_other_tell_no_sense() -> None:
    """Chenille of red, yellow, blue and pink: blue's borders run one way, green's the other, and
    the sum of all was told as surely as any, and wrong. Where they agree one alone is as good."""
    (one, centre), (other, _) = stripes(0.4), stripes(-0.4)
    flat = np.full_like(one, 0.4)
    assert abs(ridge_slope(np.stack([one, other, flat], axis=2), centre, 8.0)) < 0.02
    alone = ridge_slope(one, centre, 8.0)
    assert ridge_slope(np.stack([one, one, flat], axis=2), centre, 8.0) == pytest.approx(alone)


def test_shading_across_alone_has_no_sense() -> None:
    n = np.arange(61.0)[:, None] - 30.0
    light = np.repeat(0.5 + 0.01 * n, 400, axis=1)
    assert abs(ridge_slope(light, np.full(400, 30.0), 8.0)) < 1e-6


@pytest.mark.parametrize(("faint", "hand"), [(-0.1, "Z"), (-0.5, "S")])
def test_a_faint_sense_gives_way_to_that_of_the_frames_learnt_from(
    faint: float, hand: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two turns of a thin bundle show ridges along the light's own slope as easily as the strands';
    a plain slope stands, for a motor may turn the other way."""
    pixels = picture()
    measurer = Measurer(Rig(strings=Strings(count=2), view=View(separator_side="none")))
    measurer.prime([pixels])
    assert measurer.looks is not None and measurer.looks.slope_sum > 0.2
    monkeypatch.setattr(sense, "slope_between", lambda *_: faint)
    assert measurer.measure(Frame(0, "picture.png", pixels)).row.handedness == hand
