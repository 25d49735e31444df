"""Did the camera, or the rig before it, move between two frames?

What moves in a recording is the bundle; plate, connector and ground stand still, and they hold
most of the picture's edges. So the shift between two frames is read off all edges together (phase
correlation of the gradients' size), and believed only if undoing it makes the frames alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

WIDTH_PX = 480  # pictures are brought down to this before they are compared
LEAST_PX = 1.5  # of the full picture: a smaller shift does no harm
GAIN = 0.65  # undone, the shift must leave less than this share of the difference
MOST = 0.15  # of the picture's width: legs that close look like the same legs farther along


@dataclass(frozen=True)
class Edges:
    """Sizes of the gradients (h, w) of a reduced picture; `factor` full pixels a pixel."""

    size: np.ndarray
    factor: float


def edges_of(pixels: np.ndarray) -> Edges:
    """Gradients' sizes of a grey or BGR picture (8 or 16 bit), compressed so that none rules."""
    grey = pixels if pixels.ndim == 2 else pixels[..., 1]
    factor = max(grey.shape[1] / WIDTH_PX, 1.0)
    shrink = {"fx": 1.0 / factor, "fy": 1.0 / factor, "interpolation": cv2.INTER_AREA}
    few = cv2.resize(grey, None, **shrink).astype(np.float32)  # type: ignore[call-overload]
    small = cv2.GaussianBlur(few, (0, 0), 1.0)
    steep = np.hypot(cv2.Sobel(small, cv2.CV_32F, 1, 0), cv2.Sobel(small, cv2.CV_32F, 0, 1))
    ground = float(np.median(steep)) + 1e-6 * float(steep.max()) + 1e-9
    return Edges(np.log1p(steep / (4.0 * ground)).astype(np.float32), factor)


def shift_px(before: Edges, now: Edges) -> tuple[float, float]:
    """(x, y) by which the scene moved from `before` to `now`, px of the full picture; (0, 0)
    where no common shift explains the change. Both pictures have the same size."""
    if before.size.shape != now.size.shape:
        return 0.0, 0.0
    height, width = now.size.shape
    window = np.outer(np.hanning(height), np.hanning(width)).astype(np.float32)
    # copies: OpenCV 5 leaves the window multiplied into what it is given
    (dx, dy), _ = cv2.phaseCorrelate(before.size.copy(), now.size.copy(), window)
    if not LEAST_PX / now.factor <= np.hypot(dx, dy) <= MOST * width:
        return 0.0, 0.0
    move = np.array([[1, 0, dx], [0, 1, dy]], dtype=np.float32)
    moved = cv2.warpAffine(before.size, move, (width, height))
    mx, my = int(np.ceil(abs(dx))) + 2, int(np.ceil(abs(dy))) + 2
    inner = (slice(my, height - my), slice(mx, width - mx))
    left = float(np.abs(moved - now.size)[inner].mean())
    if left > GAIN * float(np.abs(before.size - now.size)[inner].mean()):
        return 0.0, 0.0
    return dx * now.factor, dy * now.factor
