"""A picture turned until an axis runs along its rows, by cubic interpolation in two passes.

Where the axis runs nearly along the rows or the columns of the picture, interpolating along the one
and then along the other takes 4 + 4 samples in place of 4 x 4, side by side in memory, and places
them exactly: OpenCV rounds places to a 32nd of a pixel. The two passes are Catmull and Smith's; at
greater angles the first would leave too few samples to the second.
"""

from __future__ import annotations

import cv2
import numba
import numpy as np

LEVEL = 0.01  # slope below which what lies side by side along the rows is most of a row
STEEPEST = 0.17  # slope of the axis against rows or columns: beyond, one pass is as quick
SHARP = np.float32(-0.75)  # of the cubic, as of OpenCV's


def turned(
    picture: np.ndarray,
    origin_px: np.ndarray,
    along: np.ndarray,
    count: int,
    half: int,
    light: np.ndarray | None = None,
) -> np.ndarray | None:
    """(2 half + 1, count) float32 of a float32 picture (H, W), or of one of codes, uint8, that
    stand for `light` (256,) float32: columns `along` (unit vector) from `origin_px` (x, y) on, rows
    from -half to half along (-along_y, along_x); NaN where a sample needed lies outside. None where
    the axis runs too far off rows and columns."""
    if min(abs(along)) > STEEPEST * max(abs(along)):
        return None
    picture, (x, y), (c, s) = _levelled(picture, origin_px, along)
    # Rows of the strip cut every column of the picture: first along the columns, ...
    first, width = y - x * (s / c) - half / c, picture.shape[1]
    by_row = np.empty((2 * half + 1, width), np.float32)
    if abs(s / c) < LEVEL:
        linear = picture if light is None else cv2.LUT(np.ascontiguousarray(picture), light)
        _sloping(linear, first, 1.0 / c, s / c, by_row)
    else:
        _by_columns(picture, light, first, 1.0 / c, s / c, by_row)
    # ... then along the rows.
    out = np.empty((2 * half + 1, count), np.float32)
    _resampled(by_row, x - np.arange(-half, half + 1) * s, c, out)
    return out


def _levelled(
    picture: np.ndarray, origin_px: np.ndarray, along: np.ndarray
) -> tuple[np.ndarray, tuple[float, float], tuple[float, float]]:
    """Turned by quarter turns until the axis runs to the right, more or less."""
    (x, y), (c, s) = map(float, origin_px), map(float, along)
    right, down = picture.shape[1] - 1.0, picture.shape[0] - 1.0
    if abs(s) > abs(c) and s < 0.0:
        return cv2.rotate(picture, cv2.ROTATE_90_CLOCKWISE), (down - y, x), (-s, c)
    if abs(s) > abs(c):
        return cv2.rotate(picture, cv2.ROTATE_90_COUNTERCLOCKWISE), (y, right - x), (s, -c)
    if c < 0.0:
        return cv2.rotate(picture, cv2.ROTATE_180), (right - x, down - y), (-c, -s)
    return picture, (x, y), (c, s)


@numba.njit(cache=True, error_model="numpy")
def _between(before, here, after, beyond, begun, drift, out):  # pragma: no cover - compiled
    """Cubic through four neighbours of each sample (K,), `begun` of the way from `here` to `after`
    at the first, `drift` more at each, into out (K,)."""
    one, two, three = np.float32(1.0), np.float32(2.0), np.float32(3.0)
    for j in range(out.size):
        t = begun + np.float32(j) * drift
        u = one - t
        w_before, w_beyond = SHARP * t * u * u, SHARP * u * t * t
        w_here = ((SHARP + two) * t - (SHARP + three)) * t * t + one
        w_after = one - w_here - w_before - w_beyond
        out[j] = w_before * before[j] + w_here * here[j] + w_after * after[j] + w_beyond * beyond[j]


@numba.njit(cache=True, error_model="numpy")
def _sloping(picture, first, apart, slope, out):  # pragma: no cover - compiled
    """A picture (H, W) along parallel lines that begin at rows first, first + apart, ... and fall
    by `slope` a column, into out (R, W); NaN where a sample needed lies outside."""
    height, width = picture.shape
    falls = np.float32(slope)
    for r in range(out.shape[0]):
        begun, row = first + r * apart, out[r]
        c = 0
        while c < width:
            # As long as a line lies between the same rows, samples lie side by side.
            at = int(np.floor(begun + c * slope))
            end = width
            if slope > 0.0:
                end = int(min(np.ceil((at + 1 - begun) / slope), width))
            elif slope < 0.0:
                end = int(min(np.floor((at - begun) / slope) + 1, width))
            end = max(end, c + 1)
            if at < 1 or at > height - 3:
                row[c:end] = np.nan
            else:
                before, here = picture[at - 1, c:end], picture[at, c:end]
                after, beyond = picture[at + 1, c:end], picture[at + 2, c:end]
                part, into = row[c:end], np.float32(begun + c * slope - at)
                _between(before, here, after, beyond, into, falls, part)
            c = end


@numba.njit(cache=True, error_model="numpy")
def _by_columns(picture, light, first, apart, slope, out):  # pragma: no cover - compiled
    """A picture (H, W), of codes where there is `light` that they stand for, along the same lines
    one column after the other, which as many rows of a cache hold; into out (R, W)."""
    height, width = picture.shape
    lines = out.shape[0]
    column, done = np.empty(int((lines - 1) * apart) + 6, np.float32), np.empty(lines, np.float32)
    for c in range(width):
        place = first + c * slope
        above = int(np.floor(place)) - 1
        inside = above >= 0 and above + column.size <= height
        for k in range(column.size):
            r = above + k
            if not inside and not 0 <= r < height:
                column[k] = np.nan
            elif light is None:
                column[k] = picture[r, c]
            else:
                column[k] = light[picture[r, c]]
        _line(column, place - above, apart, done)
        for r in range(lines):
            out[r, c] = done[r]


@numba.njit(cache=True, error_model="numpy")
def _resampled(lines, first, step, out):  # pragma: no cover - compiled
    """Every line (R, M) at first, first + step, ... (R,), into out (R, K); NaN beyond its ends."""
    for r in range(lines.shape[0]):
        _line(lines[r], first[r], step, out[r])


@numba.njit(cache=True, error_model="numpy")
def _line(line, first, step, out):  # pragma: no cover - compiled
    """A line (M,) at first, first + step, ..., into out (K,); NaN beyond its ends."""
    last, count = line.size - 2, out.size
    drift = np.float32(step - 1.0)
    k = 0
    while k < count:
        # As long as whole px and samples keep step, samples lie side by side.
        off = int(np.floor(first + k * step)) - k
        end = count
        if step > 1.0:
            end = int(min(np.ceil((off + 1 - first) / (step - 1.0)), count))
        elif step < 1.0:
            end = int(min(np.floor((first - off) / (1.0 - step)) + 1, count))
        end = max(end, k + 1)
        low, high = max(k, 1 - off), min(end, last - off)
        out[k : min(low, end)] = np.nan
        out[max(high, k) : end] = np.nan
        if low < high:
            at = low + off
            before, here = line[at - 1 : high + off - 1], line[at : high + off]
            after, beyond = line[at + 1 : high + off + 1], line[at + 2 : high + off + 2]
            part, begun = out[low:high], np.float32(first + low * step - at)
            _between(before, here, after, beyond, begun, drift, part)
        k = end
