"""What is taken for a move of the camera in a close-up that shows nothing but strings."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from tsvision.images.steadiness import edges_of, shift_px

WIDTH_PX, HEIGHT_PX = 960, 540


def close_up(apex_px: float, mottled: float, ground_px: float = 0.0) -> np.ndarray:
    """Two legs from the left that meet at `apex_px`, and the bundle behind; on a ground whose light
    varies by `mottled` (sd, of 255), moved by `ground_px` to the right."""
    random = np.random.default_rng(4)
    coarse = random.normal(0.0, 1.0, (HEIGHT_PX // 60, WIDTH_PX // 60 + 2)).astype(np.float32)
    ground = cv2.resize(coarse, (WIDTH_PX + 120, HEIGHT_PX), interpolation=cv2.INTER_CUBIC)
    shift = np.array([[1, 0, ground_px - 60.0], [0, 1, 0]], np.float32)
    ground = cv2.warpAffine(ground, shift, (WIDTH_PX, HEIGHT_PX))
    rows, columns = np.mgrid[0:HEIGHT_PX, 0:WIDTH_PX].astype(float)
    n, away = np.abs(rows - 270.0), apex_px - columns
    legs = np.abs(n - 8.0 - 0.3 * np.maximum(away, 0.0)) < 10.0
    bundle = n < 16.0 + 3.0 * np.cos(2.0 * np.pi * away / 40.0)
    picture = 60.0 + mottled * ground + 150.0 * np.where(away > 0.0, legs, bundle)
    noise = np.random.default_rng(round(apex_px)).normal(0.0, 1.5, picture.shape)
    noisy = cv2.GaussianBlur(picture, (0, 0), 1.0) + noise
    return np.clip(np.round(noisy), 0, 255).astype(np.uint8)


def test_an_apex_that_goes_along_the_bundle_is_no_move_where_the_ground_stands_still() -> None:
    """A film was cut in two there, and its first part measured 4 % thin."""
    before, now = edges_of(close_up(600.0, 8.0)), edges_of(close_up(520.0, 8.0))
    assert shift_px(before, now) == (0.0, 0.0)


@pytest.mark.parametrize("mottled", [0.0, 8.0])
def test_a_move_along_the_bundle_is_seen_where_the_ground_moves_or_has_no_marks(
    mottled: float,
) -> None:
    before = edges_of(close_up(600.0, mottled))
    now = edges_of(close_up(520.0, mottled, ground_px=-80.0))
    assert shift_px(before, now) == pytest.approx((-80.0, 0.0), abs=2.0)
