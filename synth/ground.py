"""What lies behind the strands and how evenly the lens passes light."""

from __future__ import annotations

import cv2
import numpy as np

from synth.camera import View
from synth.dirt import add_dust
from synth.settings import Settings

GRAINS = ((1.2, 0.5), (5.0, 0.6), (60.0, 1.2))  # (sigma px, weight) of the ground's texture


def ground_of(settings: Settings, view: View) -> np.ndarray:
    """Ground (h, w, 3) in linear light: colour, gradient, texture, dust."""
    look = settings.look
    u = np.linspace(-0.5, 0.5, view.width, dtype=np.float32)[None, :]
    v = np.linspace(-0.5, 0.5, view.height, dtype=np.float32)[:, None]
    slope = look.ground_gradient
    level: np.ndarray = np.maximum(1.0 + slope[0] * u + slope[1] * v, 0.05)
    if look.ground_texture > 0.0:
        level = level * np.clip(1.0 + look.ground_texture * _grain(settings, view), 0.1, 3.0)
    ground = level[..., None] * np.array(look.ground_rgb, np.float32)
    return add_dust(settings, ground.astype(np.float32)).astype(np.float32)


def _grain(settings: Settings, view: View) -> np.ndarray:
    random = np.random.default_rng([settings.seed, 11])
    grain: np.ndarray = np.zeros((view.height, view.width), np.float32)
    for sigma, weight in GRAINS:
        white = random.standard_normal((view.height, view.width), dtype=np.float32)
        noise = cv2.GaussianBlur(white, (0, 0), sigma)
        grain = grain + weight * noise / max(float(noise.std()), 1e-9)
    return grain


def vignette_of(settings: Settings, view: View) -> np.ndarray | None:
    """Gain (h, w) that falls off towards the corners, or None."""
    if settings.look.vignetting <= 0.0:
        return None
    x = (np.arange(view.width) - view.centre_px[0]) / view.half_diagonal_px
    y = (np.arange(view.height) - view.centre_px[1]) / view.half_diagonal_px
    square = x[None, :] ** 2 + y[:, None] ** 2
    return (1.0 - settings.look.vignetting * square).astype(np.float32)
