"""Where strings stand out by colour, whatever the light: distance from the ground's chromaticity.

A shadow dims the ground and keeps its chromaticity, so that neither the shadow beside a cord nor
uneven light shows here, while plies of any two colours both do. No one weighted sum of channels
can promise that (red and green plies lie on either side of a brown ground).
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

FLOOR = 0.03  # linear light added before the logarithm, so that dark noise has no colour
COLOURED = 0.35  # distance (natural logarithm) from which strings count as coloured
SEPARATE = 6.0  # and how many spreads of the ground that must be


@dataclass(frozen=True)
class Ground:
    """The ground's mean log chromaticity (3,) and the distance from it at which strings lie."""

    mean: np.ndarray
    level: float


def log_chromaticity(linear: np.ndarray) -> np.ndarray:
    """log of each channel over the geometric mean of the three: (H, W, 3) linear BGR, same shape
    out. Multiplying the light leaves it as it is, but for the floor."""
    log = np.log(np.maximum(linear, 0.0) + FLOOR)
    return log - log.mean(axis=-1, keepdims=True)


def learn_ground(linear: np.ndarray) -> Ground | None:
    """The ground of a picture (H, W, 3) in linear light, when its strings are coloured.

    The ground is what most of the picture looks like. None for grey pictures and where nothing
    stands out by colour.
    """
    if linear.ndim == 2:
        return None
    colour = cv2.GaussianBlur(log_chromaticity(linear), (0, 0), 1.0).reshape(-1, 3)
    rough = np.linalg.norm(colour - np.nanmedian(colour, axis=0), axis=1)
    mean = colour[rough <= np.nanpercentile(rough, 60.0)].mean(axis=0)
    distance = np.linalg.norm(colour - mean, axis=1)
    top = float(np.percentile(distance, 99.5))
    codes = np.clip(255.0 * distance / max(top, 1e-9), 0, 255).astype(np.uint8)
    limit = cv2.threshold(codes, 0, 255, cv2.THRESH_OTSU)[0] / 255.0 * top
    out = distance > limit
    if not out.any() or out.mean() > 0.6:
        return None
    ground = float(np.median(distance[~out]))
    spread = 1.4826 * float(np.median(np.abs(distance[~out] - ground))) + 1e-6
    level = float(np.median(distance[out])) - ground
    return Ground(mean, level) if level > COLOURED and level > SEPARATE * spread else None


def colour_contrast(linear: np.ndarray, ground: Ground) -> np.ndarray:
    """Distance from the ground's colour in units of the strings': (H, W, 3) in, (H, W) out."""
    away = log_chromaticity(linear) - ground.mean.astype(linear.dtype)
    return np.linalg.norm(away, axis=-1) / ground.level
