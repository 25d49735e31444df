"""Did the camera, or the rig before it, move between two frames?

What moves in a recording is the bundle; plate, connector and ground stand still, and they hold
most of the picture's edges. So the shift between two frames is read off all edges together (phase
correlation of the gradients' size), and believed only if undoing it makes the frames alike.

Close to a separator that is out of view there is nothing but strings: as they twist, the place
where the legs meet goes along the bundle, and so does all that has edges. There the ground says
whether it stands still, if it shows any texture at all; whether a rig was pushed before a ground
that stood still it does not say, so that it is asked about shifts along the edges only.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

WIDTH_PX = 480  # pictures are brought down to this before they are compared
LEAST_PX = 1.5  # of the full picture: a smaller shift does no harm
GAIN = 0.65  # undone, the shift must leave less than this share of the difference
MOST = 0.15  # of the picture's width: legs that close look like the same legs farther along
ALONG = 0.95  # cosine between a shift and most edges, from which legs that close may be all it is
BUSY_PX = 9  # about edges nothing is ground
STILL = 0.7  # of what is left when the shift is undone, at most, if the ground stands still


@dataclass(frozen=True)
class Edges:
    """Sizes of the gradients (h, w) of a reduced picture, its light (h, w), and the direction (2,)
    that most edges have; `factor` full pixels a pixel."""

    size: np.ndarray
    light: np.ndarray
    along: np.ndarray
    factor: float


def edges_of(pixels: np.ndarray) -> Edges:
    """Gradients' sizes of a grey or BGR picture (8 or 16 bit), compressed so that none rules."""
    grey = pixels if pixels.ndim == 2 else pixels[..., 1]
    factor = max(grey.shape[1] / WIDTH_PX, 1.0)
    shrink = {"fx": 1.0 / factor, "fy": 1.0 / factor, "interpolation": cv2.INTER_AREA}
    few = cv2.resize(grey, None, **shrink).astype(np.float32)  # type: ignore[call-overload]
    small = cv2.GaussianBlur(few, (0, 0), 1.0)
    gx, gy = cv2.Sobel(small, cv2.CV_32F, 1, 0), cv2.Sobel(small, cv2.CV_32F, 0, 1)
    steep = np.hypot(gx, gy)
    ground = float(np.median(steep)) + 1e-6 * float(steep.max()) + 1e-9
    twice = complex(float((gx**2 - gy**2).mean()), 2.0 * float((gx * gy).mean()))
    across = 0.5 * np.angle(twice)
    return Edges(
        np.log1p(steep / (4.0 * ground)).astype(np.float32),
        small,
        np.array([-np.sin(across), np.cos(across)]),
        factor,
    )


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
    along = abs(float(now.along @ (dx, dy))) / float(np.hypot(dx, dy))
    if along > ALONG and _ground_stands(before, now, move, inner):
        return 0.0, 0.0
    return dx * now.factor, dy * now.factor


def _ground_stands(before: Edges, now: Edges, move: np.ndarray, inner: tuple[slice, slice]) -> bool:
    """Whether the ground is much more alike as it stands than moved by `move` (2, 3)."""
    size = now.size.shape[1::-1]
    moved, edges = (cv2.warpAffine(a, move, size) for a in (before.light, before.size))
    busy = np.maximum(np.maximum(before.size, now.size), edges)
    busy = cv2.dilate(busy, np.ones((BUSY_PX, BUSY_PX)))[inner]
    plain = busy <= np.median(busy)
    still, gone = (_apart((a - now.light)[inner], plain) for a in (before.light, moved))
    return still < STILL * gone


def _apart(difference: np.ndarray, where: np.ndarray) -> float:
    """Mean size of a difference (h, w) in some pixels less the plane through it: a lens that
    darkens towards the corners differs by one when it is moved, and light that wanes does too."""
    rows, columns = np.nonzero(where)
    design = np.stack([np.ones(rows.size), rows, columns], axis=1)
    values = difference[where].astype(float)
    plane, *_ = np.linalg.lstsq(design, values, rcond=None)
    return float(np.abs(values - design @ plane).mean())
