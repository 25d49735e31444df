"""What a strip shows above its ground, whose light is told from what lies beside the strings."""

from __future__ import annotations

import numba
import numpy as np

from tsvision.images.percentiles import median

ROWS, COLUMNS = 10, 200  # of the ground on either side that are looked at, about
SETTLED = 0.001  # of the noise: a parabola that moves by less moves no more


def above_ground(values: np.ndarray, inner_px: float) -> np.ndarray:
    """A strip (R, M) less the ground under every sample, told from what lies outside
    |n| > inner_px.

    A parabola along s on each side, fitted so that separator, legs and connector count as
    outliers, and a straight line across. NaN-safe.
    """
    return np.asarray(_above(values, float(inner_px)))


@numba.njit(cache=True)
def _above(values, inner_px):  # pragma: no cover - compiled
    half, count = values.shape[0] // 2, values.shape[1]
    along = np.linspace(-1.0, 1.0, count)
    step = max(1, count // COLUMNS)
    low, high = np.empty(count, np.float32), np.empty(count, np.float32)
    for level, sign in ((low, -1), (high, 1)):
        # Rows -half to half; the outermost alone where none lies farther out.
        first = min(int(inner_px) + 1, half)
        rows = half + sign * np.arange(first, half + 1)
        seen = _column_medians(values[:, ::step][np.sort(rows)[:: max(1, rows.size // ROWS)]])
        constant, slope, bend = _robust_parabola(along[::step], seen.astype(np.float64))
        level[:] = constant + along * (slope + along * bend)
    return _less(values, low, high)


@numba.njit(cache=True)
def _less(values, low, high):  # pragma: no cover - compiled
    """Values (R, M) less what lies between two lines, low (M,) under the first row and high (M,)
    under the last: in one pass, for these are the most numbers that a frame is made of."""
    out, last = np.empty_like(values), max(values.shape[0] - 1.0, 1.0)
    for r in range(values.shape[0]):
        part = np.float32(r / last)
        for c in range(values.shape[1]):
            out[r, c] = values[r, c] - (low[c] + (high[c] - low[c]) * part)
    return out


def nan_median(rows: np.ndarray) -> np.ndarray:
    """Median (M,) of what is known of the rows (R, M) at every column, NaN where nothing is."""
    return _column_medians(np.ascontiguousarray(rows, dtype=np.float32))


@numba.njit(cache=True)
def _column_medians(rows: np.ndarray) -> np.ndarray:  # pragma: no cover - compiled
    out = np.full(rows.shape[1], np.float32(np.nan))
    ordered = np.empty(rows.shape[0], np.float32)
    for c in range(rows.shape[1]):
        count = 0
        for r in range(rows.shape[0]):
            value = rows[r, c]
            if np.isnan(value):
                continue
            k = count
            while k > 0 and ordered[k - 1] > value:
                ordered[k] = ordered[k - 1]
                k -= 1
            ordered[k] = value
            count += 1
        if count == 0:
            continue
        out[c] = np.float32(0.5) * (ordered[(count - 1) // 2] + ordered[count // 2])
    return out


@numba.njit(cache=True)
def _robust_parabola(x, y):  # pragma: no cover - compiled
    """Coefficients (3,), constant first, of a parabola through most of y (M,), where some may be
    NaN; a constant where little is known. Cauchy weights whose scale shrinks to the noise's."""
    known = ~np.isnan(y)
    xs, ys = x[known], y[known]
    found = np.zeros(3)
    if xs.size == 0:
        return found
    middle = median(ys)
    found[0] = middle
    if xs.size < 8:
        return found
    spread = 1.4826 * median(np.abs(ys - middle))
    noise = 1.4826 * median(np.abs(np.diff(ys))) + 1e-4
    scale = max(1.5 * spread, 2.0 * noise)
    ridge = 1e-9 * xs.size
    normal, right, powers = np.zeros((3, 3)), np.zeros(3), np.ones(3)
    for _ in range(15):
        normal[:], right[:] = 0.0, 0.0
        for i in range(xs.size):
            r = (ys[i] - found[0] - xs[i] * (found[1] + xs[i] * found[2])) / scale
            w = 1.0 / (1.0 + r * r)
            w *= w
            powers[1], powers[2] = xs[i], xs[i] * xs[i]
            for a in range(3):
                right[a] += w * powers[a] * ys[i]
                for b in range(3):
                    normal[a, b] += w * powers[a] * powers[b]
        for a in range(3):
            normal[a, a] += ridge
        before = found.copy()
        found[:] = np.linalg.solve(normal, right)
        if scale <= 2.0 * noise and np.abs(found - before).sum() < SETTLED * noise:
            break
        scale = max(0.7 * scale, 2.0 * noise)
    return found
