"""A shaded, blurred tube drawn from the formula, for what has to find its edge."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from tsvision.measures.edges.shading import EdgeProfile, Shading, inside_px
from tsvision.measures.helix.uncertainty import blur_sd_px, light_sd_px

FINE = 0.01
ROUGH = 1.0 / 3.0  # loss at the limb of a rough string of plastic: what the light's model assumes


def tube(
    offsets_px: np.ndarray,
    rho_px: float,
    blur_px: float,
    a: float,
    b: float,
    c: float,
    loss: float = 0.0,
) -> np.ndarray:
    """Brightness at `offsets_px` inside a tube's edge; light is never negative."""
    t = np.arange(-14.0, 30.0, FINE)
    x = np.clip(1.0 - t / rho_px, -1.0, 1.0)
    facing = np.sqrt(1.0 - x * x)
    light = (a + np.maximum(b * facing + c * x, 0.0)) * (1.0 - loss * (1.0 - facing) ** 5)
    inside = np.where(np.abs(t) < 0.5 * FINE, 0.5, t > 0.0)
    soft = gaussian_filter1d(inside * light, blur_px / FINE)
    return np.interp(offsets_px, t, soft)


def px_tube(
    offsets_px: np.ndarray,
    rho_px: float,
    blur_px: float,
    a: float,
    b: float,
    c: float,
    loss: float = ROUGH,
) -> np.ndarray:
    """The same as a mean profile shows it, each value over one px."""
    over = np.linspace(-0.5, 0.5, 41)
    return np.mean([tube(offsets_px + d, rho_px, blur_px, a, b, c, loss) for d in over], axis=0)


def seen(rho_px: float, profile: np.ndarray, offsets_px: np.ndarray) -> EdgeProfile:
    return EdgeProfile(offsets_px, profile, np.full(profile.size, 0.002))


def offsets_for(rho_px: float) -> np.ndarray:
    return np.arange(-5.0, inside_px(rho_px) + 1e-9, 0.25)


def edge_model_sd_px(shading: tuple[Shading, Shading]) -> float:
    """What is stated of a width for light and blur at both its limbs, px."""
    return float(np.hypot(light_sd_px(shading), blur_sd_px(shading)))
