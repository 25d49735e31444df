"""Where a film moves: strands do, from turn to turn; cables, plates, rods and the ground do not."""

from __future__ import annotations

import cv2
import numpy as np

from tsvision.images.axis import COARSE_PX, find_channels
from tsvision.images.strip import Axis

FEWEST = 4  # pictures from which motion tells anything
MOVES = 0.2  # of the liveliest places' motion: what moves less stands still


def motion_picture(pictures: list[np.ndarray]) -> np.ndarray | None:
    """How much each place changes over some pictures of one size: (h, w) uint8, at most COARSE_PX
    long, 255 for the liveliest places; None for few pictures and where hardly anything moves."""
    if len(pictures) < FEWEST:
        return None
    channels = [find_channels(p) for p in pictures]
    squares = np.zeros(channels[0][0].shape, np.float64)
    noise = 0.0
    for stack in zip(*channels, strict=True):
        over = np.stack(stack)
        # Lamps flicker and exposures drift: the whole picture's level is no motion.
        over = over - np.median(over, axis=(1, 2), keepdims=True)
        squares += over.var(axis=0)
        noise += float(np.median(over.var(axis=0)))
    moves = np.sqrt(squares)
    top = float(np.percentile(moves, 99.5))
    if top < max(4.0 * np.sqrt(noise), 1.0):
        return None
    return np.clip(255.0 * moves / top, 0, 255).astype(np.uint8)


def moving_share(axis: Axis, width_px: float, motion: np.ndarray, long_px: int) -> float:
    """Share of the axis' length along which something within half a width of it moves. axis and
    width in a picture whose long side is `long_px`."""
    factor = min(1.0, COARSE_PX / long_px)
    band = max(round(width_px * factor) | 1, 1)
    most = cv2.dilate(motion, np.ones((band, band), np.uint8))
    s = np.arange(0.0, axis.length_px, 1.0 / factor)
    points = (axis.at(s) + 0.5) * factor - 0.5
    x = np.clip(np.round(points[:, 0]).astype(int), 0, motion.shape[1] - 1)
    y = np.clip(np.round(points[:, 1]).astype(int), 0, motion.shape[0] - 1)
    return float((most[y, x] > MOVES * 255.0).mean())
