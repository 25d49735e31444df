"""The lens's blur: one Gaussian in the plane of focus, wider away from it."""

from __future__ import annotations

import cv2
import numpy as np

from synth.camera import View, project, to_camera
from synth.settings import Settings

GROUND_DEPTH_MM = -6.0  # of the surface behind the rig, camera z at the axis


def soften(image: np.ndarray, sigma: float) -> np.ndarray:
    """Gaussian PSF of (h, w, C); nothing below 0.05 px."""
    if sigma <= 0.05:
        return image
    size = 2 * int(np.ceil(3.5 * sigma)) + 1
    soft = cv2.GaussianBlur(image, (size, size), sigma, borderType=cv2.BORDER_REPLICATE)
    return soft.reshape(image.shape)


def reach_px(settings: Settings, view: View) -> float:
    """How far light of one pixel may spread."""
    return 3.5 * float(_sigma_map(settings, view, (0, 0, view.width, view.height)).max()) + 1.0


def focus_blur(
    settings: Settings, view: View, image: np.ndarray, box: tuple[int, int, int, int]
) -> np.ndarray:
    """PSF of the crop `box` (left, top, right, bottom); depth of field by blended levels."""
    if settings.camera.defocus_px_per_mm <= 0.0:
        return soften(image, settings.camera.blur_px)
    sigma = _sigma_map(settings, view, box)
    levels = np.linspace(sigma.min(), sigma.max() + 1e-6, 5)
    soft = [soften(image, float(level)) for level in levels]
    place = (sigma - levels[0]) / (levels[1] - levels[0])
    low = np.clip(place.astype(int), 0, 3)
    part = (place - low)[..., None].astype(np.float32)
    out = np.zeros_like(image)
    for k in range(4):
        here = (low == k)[..., None]
        out += here * (soft[k] * (1.0 - part) + soft[k + 1] * part)
    return out


def _sigma_map(settings: Settings, view: View, box: tuple[int, int, int, int]) -> np.ndarray:
    """Blur sigma (h, w) of things in the axis's plane: linear in depth, depth linear along it."""
    camera = settings.camera
    left, top, right, bottom = box
    ends = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]]) + view.look_mm
    seen = to_camera(view, ends)
    start, stop = project(view, seen)
    along = (stop - start) / np.linalg.norm(stop - start)
    slope = (seen[1, 2] - seen[0, 2]) / np.linalg.norm(stop - start)
    x = np.arange(left, right)[None, :] - start[0]
    y = np.arange(top, bottom)[:, None] - start[1]
    depth = seen[0, 2] + slope * (x * along[0] + y * along[1]) - camera.focus_mm
    return np.hypot(camera.blur_px, camera.defocus_px_per_mm * depth)


def ground_sigma(settings: Settings) -> float:
    """Extra blur of the surface behind, px."""
    return settings.camera.defocus_px_per_mm * abs(GROUND_DEPTH_MM - settings.camera.focus_mm)
