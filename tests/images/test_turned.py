"""Pictures turned along an axis: where every sample comes from."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from tsvision.images.turned import STEEPEST, turned

HALF, COUNT = 20, 150


def waves(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Light that is known everywhere, finest detail 25 px."""
    return np.sin(0.25 * x + 0.1) * np.cos(0.2 * y) + 0.01 * x - 0.02 * y


def places(origin: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    s, n = np.meshgrid(np.arange(COUNT), np.arange(-HALF, HALF + 1))
    return origin[0] + s * u[0] - n * u[1], origin[1] + s * u[1] + n * u[0]


@pytest.mark.parametrize("quarter", [0, 90, 180, 270])
@pytest.mark.parametrize("off", [-9.0, -2.3, -0.3, 0.0, 0.4, 6.0])
def test_every_sample_is_the_picture_s_own_light(quarter: int, off: float) -> None:
    angle = np.deg2rad(quarter + off)
    u = np.array([np.cos(angle), np.sin(angle)])
    origin = np.array([120.3, 119.6]) - 75.0 * u
    y, x = np.mgrid[0:240, 0:241].astype(float)
    strip = turned(waves(x, y).astype(np.float32), origin, u, COUNT, HALF)
    assert strip is not None and strip.shape == (2 * HALF + 1, COUNT)
    true = waves(*places(origin, u))
    # What the cubic leaves of a slope of 0.25 a px: 0.015. A 16th of a px off would be as much.
    assert np.abs(strip - true).max() < 0.02
    assert abs(float((strip - true).mean())) < 1e-3


def test_as_opencv_has_it_but_for_its_rounding() -> None:
    rng = np.random.default_rng(0)
    picture = cv2.GaussianBlur(rng.random((240, 240)), (0, 0), 1.5).astype(np.float32)
    u = np.array([np.cos(0.05), np.sin(0.05)])
    origin = np.array([40.2, 100.7])
    x, y = places(origin, u)
    corner = x[0, 0], y[0, 0]
    matrix = np.array([[u[0], -u[1], corner[0]], [u[1], u[0], corner[1]]])
    flags = cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP
    theirs = cv2.warpAffine(picture, matrix, (COUNT, 2 * HALF + 1), flags=flags)
    ours = turned(picture, origin, u, COUNT, HALF)
    assert ours is not None
    assert np.abs(ours - theirs).max() < 0.03 * picture.std()


def test_what_lies_outside_is_not_known() -> None:
    picture = np.ones((60, 100), np.float32)
    strip = turned(picture, np.array([20.0, 5.0]), np.array([1.0, 0.0]), 150, 10)
    assert strip is not None
    known = np.isfinite(strip)
    assert known[6:, :78].all() and not known[:5].any() and not known[:, 79:].any()


def test_a_slanting_axis_is_left_to_others() -> None:
    slanting = np.array([1.0, 1.1 * STEEPEST])
    slanting /= np.linalg.norm(slanting)
    assert turned(np.ones((60, 60), np.float32), np.zeros(2), slanting, 10, 5) is None


@pytest.mark.parametrize("angle", [0.0, 0.003, 0.1, -0.15, 1.5, -1.6, 3.1])
def test_codes_become_light_on_the_way(angle: float) -> None:
    """Of 8-bit codes as of their light, to the last bit, at the picture's borders, too."""
    random = np.random.default_rng(1)
    codes = random.integers(0, 256, (240, 241), dtype=np.uint8)
    light = np.linspace(0.0, 1.0, 256, dtype=np.float32) ** 2
    u = np.array([np.cos(angle), np.sin(angle)])
    origin = np.array([120.3, 125.6]) - 110.0 * u
    codes = np.ascontiguousarray(codes[:, ::-1])[:, :230]  # part of a picture
    found = turned(codes, origin, u, 2 * COUNT, HALF, light)
    assert found is not None
    np.testing.assert_array_equal(found, turned(light[codes], origin, u, 2 * COUNT, HALF))
    assert np.isfinite(found).any() and np.isnan(found).any()
