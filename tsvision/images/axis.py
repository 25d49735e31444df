"""Find the bundle: the longest ridge of even width in the picture, whatever its colour or side.

For every direction the picture is turned so that lines lie along rows; a row scores where its
core differs from BOTH flanks in the same sense, so that the edge of a plate scores nothing and a
thread, a bundle or a coiled bundle does. Several frames of one recording vote together: the axis
stands still while the strands move.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numba
import numpy as np

from tsvision.images.linear import to_linear
from tsvision.images.shrink import shrunk

COARSE_PX = 240  # long side of the picture in which lines are sought
ANGLE_STEP_DEG = 3.0
DARK = 0.01  # of full light, all channels together: what is darker hardly shows a hue
LEVELS = 2.55  # of 8 bits, a unit of lightness
ABOUT_PX = 41  # coarse px: a square of which strings fill less than half
HALF_WIDTHS = np.array([1, 2, 3, 5, 7, 10, 14], dtype=np.int64)  # coarse px


@dataclass(frozen=True)
class Ridge:
    """A straight ridge: centre (x, y) px, direction angle in rad, width px, sense +1 bright on
    dark or -1, the channel it stood out in, and its score (coarse px of supported length)."""

    centre_px: tuple[float, float]
    angle_rad: float
    width_px: float
    sense: int
    channel: int
    score: float


@numba.njit(cache=True)
def _row_scores(rotated, valid, half_widths, threshold, scores):  # pragma: no cover
    """scores[k, sense, row] += supported length of every row at every half width."""
    rows, cols = rotated.shape
    total = np.zeros((rows + 1, cols), dtype=np.float32)
    for r in range(rows):
        for c in range(cols):
            total[r + 1, c] = total[r, c] + rotated[r, c]
    for k in range(half_widths.size):
        h = half_widths[k]
        gap = max(1, h // 2)  # the flank keeps off the blurred edge
        flank = h + 1
        reach = h + gap + flank
        for r in range(reach, rows - reach):
            bright = 0.0
            dark = 0.0
            for c in range(cols):
                if not (valid[r - reach, c] and valid[r + reach, c]):
                    continue
                core = (total[r + h + 1, c] - total[r - h, c]) / (2 * h + 1)
                low = (total[r - h - gap, c] - total[r - reach, c]) / flank
                high = (total[r + reach + 1, c] - total[r + h + gap + 1, c]) / flank
                up = min(core - low, core - high) / threshold
                down = min(low - core, high - core) / threshold
                if up > 0:
                    bright += min(up, 1.0)
                if down > 0:
                    dark += min(down, 1.0)
            scores[k, 0, r] += bright
            scores[k, 1, r] += dark


def find_channels(pixels: np.ndarray) -> list[np.ndarray]:
    """Coarse channels to seek in: lightness, and for colour pictures the two opponent colours.

    Each is (h, w) float32 in CIELAB units, where steps that look equal are equal.
    """
    small = _coarse(pixels)
    depth = 255.0 if small.dtype == np.uint8 else 65535.0
    if small.ndim == 2:
        return [(small.astype(np.float32) / depth) * 100.0]
    lab = cv2.cvtColor(small.astype(np.float32) / depth, cv2.COLOR_BGR2Lab)
    return [np.ascontiguousarray(lab[..., i]) for i in range(3)]


def _coarse(pixels: np.ndarray) -> np.ndarray:
    return shrunk(pixels, COARSE_PX / max(pixels.shape[:2]))


def hue_off_ground(pixels: np.ndarray) -> list[np.ndarray]:
    """One coarse channel, as `find_channels` makes them: how far the colour, without its lightness,
    lies from that of most of the picture. Strands of two colours stand out together here, where
    in the opponent colours each takes back what the other shows. None of a grey picture."""
    channels = find_channels(pixels)[1:]
    if not channels:
        return []
    opponents = np.stack(channels, axis=-1)
    away = opponents - np.median(opponents.reshape(-1, 2), axis=0)
    return [np.linalg.norm(away, axis=-1).astype(np.float32)]


def unshaded(pixels: np.ndarray) -> list[np.ndarray]:
    """Two coarse channels, as `find_channels` makes them: the shares of red and of blue in the
    light, which a shadow leaves as they are; in the opponent colours it is seen as well. None of a
    grey picture."""
    small = _coarse(pixels)
    if small.ndim == 2:
        return []
    light = to_linear(small)
    whole = light.sum(axis=2) + DARK
    return [np.ascontiguousarray(100.0 * light[..., c] / whole) for c in (2, 0)]


def off_surroundings(pixels: np.ndarray) -> list[np.ndarray]:
    """One coarse channel, as `find_channels` makes them: by how much the lightness differs from
    that of what lies about. Strands that are brighter than their ground on one side and as much
    darker on the other are as bright as that together."""
    lightness = find_channels(pixels)[0]
    levels = np.clip(np.rint(LEVELS * lightness), 0.0, 255.0).astype(np.uint8)
    about = cv2.medianBlur(levels, ABOUT_PX).astype(np.float32) / LEVELS
    return [np.abs(lightness - about)]


def _threshold(channel: np.ndarray) -> float:
    """Contrast that counts in full: well above noise, and a share of the strong thin contrasts."""
    kernel = np.ones((15, 15), np.uint8)
    thin = np.maximum(
        cv2.morphologyEx(channel, cv2.MORPH_TOPHAT, kernel),
        cv2.morphologyEx(channel, cv2.MORPH_BLACKHAT, kernel),
    )
    noise = 1.4826 * float(np.median(np.abs(np.diff(channel, axis=0)))) / np.sqrt(2.0)
    return max(0.35 * float(np.percentile(thin, 98.5)), 4.0 * noise, 1.0)


def find_ridges(
    pictures: list[np.ndarray],
    roi_px: tuple[int, int, int, int] | None = None,
    widths_px: tuple[float, float] | None = None,
    most: int = 4,
    channels: Callable[[np.ndarray], list[np.ndarray]] = find_channels,
) -> list[Ridge]:
    """The strongest distinct ridges common to all pictures (same size), best first.

    pictures: uint8/uint16, grey or BGR. roi_px: x, y, width, height to look in.
    widths_px: smallest and largest width to consider, when the rig tells. channels: of one picture,
    in which to seek.
    """
    x0, y0 = (roi_px[0], roi_px[1]) if roi_px else (0, 0)
    if roi_px:
        x, y, w, h = roi_px
        pictures = [p[y : y + h, x : x + w] for p in pictures]
    factor = min(1.0, COARSE_PX / max(pictures[0].shape[:2]))
    half_widths = _half_widths(widths_px, factor)
    stacks = [channels(p) for p in pictures]
    if not stacks[0]:
        return []
    thresholds = [max(_threshold(s[c]) for s in stacks) for c in range(len(stacks[0]))]
    small_h, small_w = stacks[0][0].shape
    middle = np.array([(small_w - 1) / 2, (small_h - 1) / 2])
    size = int(np.hypot(small_h, small_w)) + 3
    inside = np.ones((small_h, small_w), np.uint8)
    found: list[Ridge] = []
    for angle in np.arange(0.0, 180.0, ANGLE_STEP_DEG):
        turn = cv2.getRotationMatrix2D((float(middle[0]), float(middle[1])), angle, 1.0)
        turn[:, 2] = turn[:, 2] + (size - 1) / 2 - middle
        valid = cv2.warpAffine(inside, turn, (size, size), flags=cv2.INTER_NEAREST) > 0
        rad = np.deg2rad(angle)
        normal = np.array([-np.sin(rad), np.cos(rad)])
        for c, threshold in enumerate(thresholds):
            scores = np.zeros((half_widths.size, 2, size), dtype=np.float64)
            for stack in stacks:
                rotated = cv2.warpAffine(stack[c], turn, (size, size), flags=cv2.INTER_LINEAR)
                _row_scores(rotated, valid, half_widths, threshold, scores)
            scores /= len(pictures)
            for k, sense, row in _row_peaks(scores, len(pictures) > 1):
                centre = (middle + (row - (size - 1) / 2) * normal + 0.5) / factor - 0.5
                found.append(
                    Ridge(
                        centre_px=(float(centre[0]) + x0, float(centre[1]) + y0),
                        angle_rad=float(rad),
                        width_px=float((2 * half_widths[k] + 1) / factor),
                        sense=1 if sense == 0 else -1,
                        channel=c,
                        score=float(scores[k, sense, row]),
                    )
                )
    return _distinct(found, 0.12 * max(small_h, small_w), most)


def _half_widths(widths_px: tuple[float, float] | None, factor: float) -> np.ndarray:
    if widths_px is None:
        return HALF_WIDTHS
    wide = (2 * HALF_WIDTHS + 1) / factor
    keep = (wide > 0.6 * widths_px[0]) & (wide < 1.7 * widths_px[1])
    return HALF_WIDTHS[keep] if keep.any() else HALF_WIDTHS


def _row_peaks(scores: np.ndarray, centred: bool, most: int = 3) -> list[tuple[int, int, int]]:
    """(width, sense, row) of the best rows of one direction, a few rows apart."""
    flat = scores.reshape(-1, scores.shape[2])
    profile, which = flat.max(axis=0), flat.argmax(axis=0)
    peaks: list[tuple[int, int, int]] = []
    left = profile.copy()
    for _ in range(most):
        row = int(left.argmax())
        if left[row] <= 0:
            break
        # Scores are capped, hence flat over a wide line: take the middle, not the first.
        last = row
        while centred and last + 1 < left.size and left[last + 1] >= 0.98 * left[row]:
            last += 1
        row = (row + last) // 2
        k, sense = divmod(int(which[row]), scores.shape[1])
        peaks.append((k, sense, row))
        left[max(row - 8, 0) : row + 9] = 0.0
    return peaks


def _distinct(found: list[Ridge], least: float, most: int) -> list[Ridge]:
    """Best first, without those that run along one already taken (10 degrees and one width)."""
    taken: list[Ridge] = []
    for ridge in sorted(found, key=lambda r: -r.score):
        if ridge.score < least or len(taken) == most:
            break
        if not any(_alike(ridge, other) for other in taken):
            taken.append(ridge)
    return taken


def _alike(a: Ridge, b: Ridge) -> bool:
    turn = abs((a.angle_rad - b.angle_rad + np.pi / 2) % np.pi - np.pi / 2)
    normal = np.array([-np.sin(b.angle_rad), np.cos(b.angle_rad)])
    apart = abs(float((np.array(a.centre_px) - np.array(b.centre_px)) @ normal))
    return bool(turn < np.deg2rad(10.0) and apart < max(a.width_px, b.width_px))
