"""How sharp a picture is, by the straight edges of a plate."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from tsvision.images.linear import encoded
from tsvision.images.sharpness import sharpness_px

FINE = 8  # times as fine as the picture that is drawn first
GROUND, GREY, WHITE = 0.12, 0.5, 1.3  # light; 1 fills the sensor
PIXEL_PX = 12.0**-0.5  # sd of a pixel's own width


def plates(*drawn: tuple[float, float], light: float = GREY, noise: float = 0.004) -> np.ndarray:
    """A picture (240, 320), 8 bit, of plates turned by some degrees, each blurred by some px."""
    height, width = 240, 320
    seen = np.full((height, width), GROUND)
    for k, (degrees, blur_px) in enumerate(drawn):
        middle = (FINE * (80.0 + 160.0 * k), FINE * 120.0)
        corners = cv2.boxPoints((middle, (FINE * 70.0, FINE * 130.0), degrees))
        mask = np.zeros((FINE * height, FINE * width), np.float32)
        cv2.fillPoly(mask, [np.round(corners).astype(np.int32)], 1.0)
        mask = cv2.GaussianBlur(mask, (0, 0), FINE * blur_px)
        share = mask.reshape(height, FINE, width, FINE).mean(axis=(1, 3))
        seen += (light - GROUND) * share
    seen += np.random.default_rng(0).normal(0.0, noise, seen.shape)
    return np.asarray(np.round(255.0 * encoded(seen, float("nan"))).astype(np.uint8))


@pytest.mark.parametrize("blur_px", [0.6, 1.0, 1.6, 2.4])
@pytest.mark.parametrize("degrees", [0.0, 3.0, 27.0])
def test_a_plates_edges_tell_the_blur(blur_px: float, degrees: float) -> None:
    seen_px = sharpness_px([plates((degrees, blur_px))])
    assert seen_px == pytest.approx(np.hypot(blur_px, PIXEL_PX), rel=0.05)


def test_what_is_out_of_focus_tells_nothing() -> None:
    seen_px = sharpness_px([plates((5.0, 0.9), (12.0, 2.2))])
    assert seen_px == pytest.approx(np.hypot(0.9, PIXEL_PX), rel=0.05)


def test_a_coloured_file_keeps_its_brightness_sharp() -> None:
    """JPEG blurs colour; edges by brightness stay as they are."""
    grey = plates((8.0, 1.0))
    coloured = np.stack([grey // 4, grey // 3, grey], axis=2)
    _, file = cv2.imencode(".jpg", coloured, [cv2.IMWRITE_JPEG_QUALITY, 75])
    seen_px = sharpness_px([cv2.imdecode(file, cv2.IMREAD_COLOR)])
    assert seen_px == pytest.approx(np.hypot(1.0, PIXEL_PX), rel=0.08)


def test_a_full_sensor_tells_nothing() -> None:
    """What a sensor cuts off makes an edge look sharper than it is."""
    assert np.isnan(sharpness_px([plates((4.0, 1.0), light=WHITE)]))


def test_noise_has_no_edges() -> None:
    assert np.isnan(sharpness_px([plates(noise=0.03)]))
    assert np.isnan(sharpness_px([np.full((60, 80), 7, np.uint8)]))
