"""Colour that was stored in full, and at half its resolution."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from tsvision.images.chroma import colour_in_full


def noisy(sd: float) -> np.ndarray:
    """A red bar before grey, seen by a sensor, (120, 160, 3)."""
    light = np.full((120, 160, 3), 110.0)
    light[50:70] = (60.0, 70.0, 190.0)
    light = cv2.GaussianBlur(light, (0, 0), 1.0)
    return np.clip(light + np.random.default_rng(4).normal(0.0, sd, light.shape), 0, 255)


@pytest.mark.parametrize("sd", [1.5, 4.0])
def test_colour_noise_of_single_pixels_is_colour_in_full(sd: float) -> None:
    assert colour_in_full(np.round(noisy(sd)).astype(np.uint8))
    assert colour_in_full(np.round(257.0 * noisy(sd)).astype(np.uint16))


@pytest.mark.parametrize("quality", [60, 85, 97])
@pytest.mark.parametrize("sd", [1.5, 4.0, 10.0])
def test_colour_of_a_jpeg_is_not(quality: int, sd: float) -> None:
    picture = np.round(noisy(sd)).astype(np.uint8)
    options = [cv2.IMWRITE_JPEG_QUALITY, quality]
    stored = cv2.imdecode(cv2.imencode(".jpg", picture, options)[1], cv2.IMREAD_COLOR)
    assert not colour_in_full(stored)


def test_without_noise_or_colour_it_is_not_known() -> None:
    assert not colour_in_full(np.round(noisy(0.0)).astype(np.uint8))
    assert not colour_in_full(np.full((9, 9), 100, np.uint8))
