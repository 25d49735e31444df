"""Sub-pixel edges: a learnt edge profile matched to every column of a straightened strip."""

from __future__ import annotations

import numba
import numpy as np

from tsvision.measures.shading import (
    TEMPLATE_START_PX,
    TEMPLATE_STEP_PX,
    Shading,
    inside_at,
)

LIT = 0.25  # of the core's contrast: where the part begins that sends enough light to be matched


@numba.njit(cache=True, error_model="numpy")
def _match(
    values,
    start,
    outward,
    cosine,
    template,
    t0,
    dt,
    outside,
    inside,
    limit,
    iterations,
    edge,
    depth,
    residual,
):  # pragma: no cover - compiled
    """Gauss-Newton on (edge, depth, ground) of every column."""
    rows, columns = values.shape
    # Light, template and its slope in the window: what is looked up first is added up faster.
    lights, shapes, slopes = np.empty(rows), np.empty(rows), np.empty(rows)
    ahead = template[1:]
    for m in range(columns):
        edge[m] = np.nan
        depth[m] = np.nan
        residual[m] = np.nan
        e = start[m]
        if not abs(e) < 1e8:
            continue
        cos = cosine[m]
        reach_out = outside / cos
        reach_in = inside / cos
        # rows of the window, fixed while iterating so that the cost stays comparable
        if outward > 0:
            r0 = int(np.ceil(e - reach_in))
            r1 = int(np.floor(e + reach_out))
        else:
            r0 = int(np.ceil(e - reach_out))
            r1 = int(np.floor(e + reach_in))
        if r0 < 0 or r1 > rows - 1 or r1 - r0 < 4:
            continue
        good = True
        window = slice(r1 - r0 + 1)
        seen, shape, slope = lights[window], shapes[window], slopes[window]
        sy = syy = 0.0
        for r in range(r0, r1 + 1):
            y = float(values[r, m])
            good &= abs(y) < 1e8
            seen[r - r0] = y
            sy += y
            syy += y * y
        if not good:
            continue
        a = 1.0
        rss = 0.0
        s1 = float(seen.size)
        for _iteration in range(iterations):
            st = stt = sd = sdd = sdt = sty = sdy = 0.0
            for k in range(seen.size):
                x = (outward * (e - (r0 + k)) * cos - t0) / dt
                i = np.int32(x)
                w = x - i
                shape[k] = (1 - w) * template[i] + w * ahead[i]
                slope[k] = ahead[i] - template[i]
            for k in range(seen.size):
                f, d, y = shape[k], slope[k], seen[k]
                st += f
                stt += f * f
                sd += d
                sdd += d * d
                sdt += d * f
                sty += f * y
                sdy += d * y
            det = s1 * stt - st * st
            if det <= 1e-12:
                good = False
                break
            a = (s1 * sty - st * sy) / det
            g = (sy - a * st) / s1
            rss = max(syy - a * sty - g * sy, 0.0)
            # step of the edge with depth and ground projected out
            steep = a * outward * cos / dt
            j1, jt = steep * sd, steep * sdt
            jr = steep * (sdy - g * sd - a * sdt)
            b0 = (stt * j1 - st * jt) / det
            b1 = (s1 * jt - st * j1) / det
            curve = steep * steep * sdd - b0 * j1 - b1 * jt
            if curve <= 1e-12:
                good = False
                break
            move = jr / curve
            if move > 0.5:
                move = 0.5
            elif move < -0.5:
                move = -0.5
            e += move
            if abs(e - start[m]) > limit:
                good = False
                break
            if abs(move) < 1e-3:
                break
        if good:
            edge[m] = e
            depth[m] = a
            residual[m] = np.sqrt(rss / (r1 - r0 + 1))


def match_edges(
    values: np.ndarray,
    start_row: np.ndarray,
    outward: int,
    shading: Shading,
    slope: np.ndarray,
    limit_px: float = 1.5,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Match the shading's template to every column.

    values (R, M) float; start_row (M,) rough edges in rows, NaN to skip; outward +1 when larger
    rows lie outside; slope (M,) d edge / d s. Returns edge row, depth and residual rms, (M,) each,
    NaN where the match left `limit_px` or the picture.
    """
    columns = values.shape[1]
    edge, depth, residual = (np.empty(columns) for _ in range(3))
    outside, inside = _window_px(shading)
    cosine = 1.0 / rows_per_px(slope)
    _match(
        values,
        start_row,
        outward,
        cosine,
        shading.template,
        TEMPLATE_START_PX,
        TEMPLATE_STEP_PX,
        outside,
        inside,
        limit_px,
        8,
        edge,
        depth,
        residual,
    )
    return edge, depth, residual


def rows_per_px(slope: np.ndarray) -> np.ndarray:
    """Rows by which an edge of this slope moves in its column for 1 px square to itself."""
    return np.asarray(np.sqrt(1.0 + np.clip(slope, -1.5, 1.5) ** 2))


def _window_px(shading: Shading) -> tuple[float, float]:
    """How far outside and inside of an edge the template is compared with the picture."""
    outside = 2.5 * shading.blur_px + 1.5
    # Further in, gleam and the strands in front differ from column to column.
    inside = min(0.8 * shading.rho_px, 2.0 * shading.blur_px + 0.5)
    inside = max(inside, 1.5 * shading.blur_px + 1.0)
    # Where a limb sends hardly any light, what can be matched is the border of the lit part.
    lit = inside_at(shading, LIT)
    if lit > inside:
        inside = min(lit + shading.blur_px, shading.rho_px)
    return outside, inside


def reach_px(shading: Shading) -> float:
    """How far from an edge, to either side, a match looks."""
    return max(_window_px(shading))
