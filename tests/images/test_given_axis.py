"""A line that a person drew is refined, not sought: it decides which bundle is meant, which way."""

from __future__ import annotations

import numpy as np
import pytest

from tsvision.errors import InputError
from tsvision.images.sight import Told, find_sight
from tsvision.rig import load_rig


def two_ropes(height: int = 240, width: int = 480) -> np.ndarray:
    """Two lobed ropes, the upper one thicker, on a dark ground."""
    picture = np.full((height, width), 30.0)
    x, y = np.arange(width), np.arange(height)[:, None]
    for centre, size in ((70.0, 9.0), (170.0, 6.0)):
        half = size * (0.8 + 0.2 * np.cos(2 * np.pi * x / 31))
        picture += 170 * np.clip(half - np.abs(y - centre) + 0.5, 0, 1)
    return np.clip(picture, 0, 255).astype(np.uint8)


@pytest.mark.parametrize("row", [70.0, 170.0])
def test_the_rope_meant_is_taken_and_the_line_put_right(row: float) -> None:
    sight = find_sight([two_ropes()], Told(along_px=((30.0, row + 5), (440.0, row - 3))))
    assert sight is not None
    points = sight.axis.at(np.array([50.0, 200.0, 400.0]))
    np.testing.assert_allclose(points[:, 1], row, atol=0.5)
    assert points[0, 0] < points[-1, 0]


def test_the_first_point_tells_where_the_separator_is() -> None:
    sight = find_sight([two_ropes()], Told(along_px=((440.0, 170.0), (30.0, 170.0))))
    assert sight is not None
    assert sight.axis.tangent(np.array(0.0))[0] == pytest.approx(-1, abs=0.01)


@pytest.mark.parametrize("text", ["1,2", "1,2 3,4 5,6", "10,10 12,10"])
def test_anything_but_two_points_apart_is_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"view\.axis_px"):
        load_rig(None, {"view.axis_px": text})
