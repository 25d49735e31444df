"""The curved axis against the curve that was drawn."""

from __future__ import annotations

import numpy as np
import pytest

from tests.measures.cord import bow, draw_cord
from tsvision.images.colour import colour_contrast, learn_ground
from tsvision.images.curve import find_curve
from tsvision.images.linear import to_linear
from tsvision.images.sight import find_sight


def apart(points: np.ndarray, curve: np.ndarray) -> np.ndarray:
    """Distance of each point (K, 2) from a finely drawn curve."""
    fine = np.stack(
        [
            np.interp(np.linspace(0, len(curve) - 1, 8000), np.arange(len(curve)), curve[:, i])
            for i in (0, 1)
        ],
        axis=1,
    )
    return np.array([np.min(np.linalg.norm(fine - p, axis=1)) for p in points])


@pytest.mark.parametrize("turned", [False, True])
def test_the_axis_follows_the_drawn_curve(turned: bool) -> None:
    curve = bow(620, 80.0, 140.0)
    picture = draw_cord(curve, 3, 30.0, 36.0, hairs=60)
    if turned:
        picture = np.ascontiguousarray(np.rot90(picture))
        curve = np.stack([curve[:, 1], 359.0 - curve[:, 0]], axis=1)
    sight = find_sight([picture])
    assert sight is not None
    found = find_curve([picture], sight)
    assert found is not None
    assert found.bowed
    s = np.linspace(found.start_px + 20, found.end_px - 20, 60)
    # Three plies swing the middle of the outline by 1.5 px to either side every 36 px.
    assert np.median(apart(found.axis.at(s), curve)) < 0.5
    assert np.max(apart(found.axis.at(s), curve)) < 2.0
    inside = curve[(curve >= 0).all(axis=1) & (curve[:, 0] < 620) & (curve[:, 1] < 620)]
    length = np.linalg.norm(np.diff(inside, axis=0), axis=1).sum()
    assert found.end_px - found.start_px == pytest.approx(length, rel=0.02)
    assert np.allclose(np.diff(found.axis.arc_px), 2.0, atol=0.1)  # arc length


def test_a_straight_cord_does_not_bow() -> None:
    straight = np.stack([np.linspace(120, 240, 80), np.linspace(-20, 640, 80)], axis=1)
    picture = draw_cord(straight, 2, 30.0, 45.0)
    sight = find_sight([picture])
    assert sight is not None
    found = find_curve([picture], sight, closely=True)
    assert found is not None
    assert found.alike
    assert not found.bowed


def test_shadow_has_no_colour_and_plies_of_any_colour_have() -> None:
    picture = np.full((40, 60, 3), (120, 150, 165), np.uint8)
    picture[:, 30:40] = (60, 75, 82)  # the same ground in shadow
    picture[:, 10:14] = (40, 40, 230)
    picture[:, 14:18] = (230, 60, 40)
    linear = to_linear(picture)
    ground = learn_ground(linear)
    assert ground is not None
    contrast = colour_contrast(linear, ground)
    assert contrast[20, 33:37].max() < 0.15
    assert contrast[20, 11:17].min() > 0.6


def test_a_grey_picture_has_no_coloured_strings() -> None:
    picture = np.full((40, 60, 3), 40, np.uint8)
    picture[:, 20:30] = 220
    assert learn_ground(to_linear(picture)) is None
    assert learn_ground(to_linear(picture[..., 0])) is None
