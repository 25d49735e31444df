"""Sub-pixel edges: a learnt edge profile matched to every column of a straightened strip.

The profile is a step at the limb and a ramp behind it, where lamps reach. On a lit limb the step is
nearly all, and tells its own height. On a dark one ramps differ from column to column, by what the
strands around leave of the lamp: scaled with its ramp the step is too low where the ramp is weak,
and the edge is found too far out. So each has its own depth, held near the template's where a
column does not tell.
"""

from __future__ import annotations

import numba
import numpy as np

from tsvision.measures.edges.shading import (
    TEMPLATE_GRID_PX,
    TEMPLATE_START_PX,
    TEMPLATE_STEP_PX,
    Shading,
    inside_at,
)

UNEXPLAINED = 0.03  # of the core's contrast: what a column shows besides the template
# Before a column is seen: of its step's height, in the template's, and of its ramp's, in that.
STEP_SD, RAMP_SD = 0.3, 2.0
# A step after which the next is far shorter, a short one, one too long to tell a bend by, the most.
ENOUGH_PX, NEARLY_PX, LONG_PX, MOST_PX = 3e-2, 0.05, 0.3, 0.5
LEAST_BEND, MOST_BEND = 0.35, 2.0  # of the curve that the template gives the cost
# A fibre, nowhere as bright as the template, is drawn further in by every step and comes to look
# deeper than it is: no more of them than an edge needs.
STEPS = 5
LIT = 0.25  # of the core's contrast: where the part begins that sends enough light to be matched


@numba.njit(cache=True, error_model="numpy")
def _match(
    values,
    start,
    outward,
    cosine,
    step,
    ramp,
    t0,
    dt,
    outside,
    inside,
    limit,
    iterations,
    hold_step,
    hold_ramp,
    edge,
    depth,
    residual,
):  # pragma: no cover - compiled
    """Gauss-Newton on (edge, depths of step and ramp, ground) of every column, which starts as far
    from its rough edge as the column before it ended."""
    rows, columns = values.shape
    # What is looked up in a window first is added up faster: light, the template's parts, slopes.
    lights, steps, ramps = np.empty(rows), np.empty(rows), np.empty(rows)
    step_slopes, ramp_slopes = np.empty(rows), np.empty(rows)
    table = np.empty((step.size - 1, 4))  # what a sample looks up lies side by side
    table[:, 0], table[:, 1] = step[:-1], ramp[:-1]
    table[:, 2], table[:, 3] = np.diff(step), np.diff(ramp)
    per_px = 1.0 / dt
    beside = 0.0  # from the start to the edge, in the column before
    for m in range(columns):
        edge[m] = np.nan
        depth[m] = np.nan
        residual[m] = np.nan
        e = start[m]
        if not abs(e) < 1e8:
            continue
        cos = cosine[m]
        steep = outward * cos * per_px
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
        seen, s, p = lights[window], steps[window], ramps[window]
        ds, dp = step_slopes[window], ramp_slopes[window]
        y1 = 0.0
        for r in range(r0, r1 + 1):
            y = float(values[r, m])
            good &= abs(y) < 1e8
            seen[r - r0] = y
            y1 += y
        if not good:
            continue
        e += beside
        beside = 0.0
        share = 1.0 / seen.size
        a = c = whole = light = 1.0
        rss = move = pull = 0.0
        for _iteration in range(iterations):
            first = (outward * (e - r0) * cos - t0) * per_px
            for k in range(seen.size):
                x = first - k * steep
                i = np.int32(x)
                w = x - i
                ds[k], dp[k] = table[i, 2], table[i, 3]
                s[k] = table[i, 0] + w * ds[k]
                p[k] = table[i, 1] + w * dp[k]
            s1 = p1 = ss = sp = pp = sy = py = 0.0
            for k in range(seen.size):
                s1 += s[k]
                p1 += p[k]
                ss += s[k] * s[k]
                sp += s[k] * p[k]
                pp += p[k] * p[k]
                sy += s[k] * seen[k]
                py += p[k] * seen[k]
            # the ground projected out
            s_mean, p_mean = s1 * share, p1 * share
            ss -= s1 * s_mean
            pp -= p1 * p_mean
            sp -= s1 * p_mean
            sy -= y1 * s_mean
            py -= y1 * p_mean
            whole = ss + 2.0 * sp + pp
            if whole <= 1e-12:
                good = False
                break
            light = sy + py
            # the step's depth held near 1, the ramp's near it
            ss += hold_step + hold_ramp
            pp += hold_ramp
            sp -= hold_ramp
            sy += hold_step
            det = ss * pp - sp * sp
            if det <= 1e-12:
                good = False
                break
            per_det = 1.0 / det
            a = (pp * sy - sp * py) * per_det
            c = (ss * py - sp * sy) * per_det
            if c < 0.0:
                a, c = sy / ss, 0.0
            g = (y1 - a * s1 - c * p1) * share
            d1 = dd = sd = pd = off_d = rss = 0.0
            for k in range(seen.size):
                d = steep * (a * ds[k] + c * dp[k])
                off = seen[k] - g - a * s[k] - c * p[k]
                d1 += d
                dd += d * d
                sd += d * s[k]
                pd += d * p[k]
                off_d += d * off
                rss += off * off
            # the edge's move, depths and ground projected out; what holds the depths pulls it too
            sd -= d1 * s_mean
            pd -= d1 * p_mean
            of_c = hold_ramp * (a - c)
            of_a = hold_step * (1.0 - a) - of_c
            curve = dd - d1 * d1 * share
            if c > 0.0:
                curve -= (pp * sd * sd - 2.0 * sp * sd * pd + ss * pd * pd) * per_det
                off_d += (of_a * (pp * sd - sp * pd) + of_c * (ss * pd - sp * sd)) * per_det
            else:
                curve -= sd * sd / ss
                off_d += of_a * sd / ss
            if curve <= 1e-12:
                good = False
                break
            # What the template leaves unexplained bends the cost too, by up to a half of this: how
            # much less pulls after a short step tells the whole.
            bend = (pull - off_d) / move if 0.0 < abs(move) < LONG_PX else curve
            move = off_d / (bend if LEAST_BEND * curve < bend < MOST_BEND * curve else curve)
            move = min(max(move, -MOST_PX), MOST_PX)
            pull = off_d
            e += move
            if abs(e - start[m]) > limit:
                good = False
                break
            if abs(move) < ENOUGH_PX:
                break
        if good:
            edge[m], beside = e, e - start[m] if abs(move) < NEARLY_PX else 0.0
            depth[m] = light / whole
            residual[m] = np.sqrt(rss * share)


def match_edges(
    values: np.ndarray,
    start_row: np.ndarray,
    outward: int,
    shading: Shading,
    slope: np.ndarray,
    limit_px: float = 1.5,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Match the shading's template to every column: its step and the rest, each with its depth.

    values (R, M) in units of the core's contrast; start_row (M,) rough edges in rows, NaN to skip;
    outward +1 when larger rows lie outside; slope (M,) d edge / d s. Returns edge row, depth of the
    template as a whole, which nothing holds, and residual rms, (M,) each, NaN where the match left
    `limit_px` or the picture.
    """
    columns = values.shape[1]
    edge, depth, residual = (np.empty(columns) for _ in range(3))
    outside, inside = _window_px(shading, limit_px)
    cosine = 1.0 / rows_per_px(slope)
    _match(
        values,
        start_row,
        outward,
        cosine,
        shading.step,
        shading.template - shading.step,
        TEMPLATE_START_PX,
        TEMPLATE_STEP_PX,
        outside,
        inside,
        limit_px,
        STEPS,
        (UNEXPLAINED / STEP_SD) ** 2,
        (UNEXPLAINED / RAMP_SD) ** 2,
        edge,
        depth,
        residual,
    )
    return edge, depth, residual


def rows_per_px(slope: np.ndarray) -> np.ndarray:
    """Rows by which an edge of this slope moves in its column for 1 px square to itself."""
    return np.asarray(np.sqrt(1.0 + np.clip(slope, -1.5, 1.5) ** 2))


def _window_px(shading: Shading, limit_px: float) -> tuple[float, float]:
    """How far outside and inside of an edge, which may move by `limit_px`, the template is compared
    with the picture: no farther than there is template, for compiled code checks no index."""
    outside = 2.5 * shading.blur_px + 1.5
    # Further in, gleam and the strands in front differ from column to column.
    inside = min(0.8 * shading.rho_px, 2.0 * shading.blur_px + 0.5)
    inside = max(inside, 1.5 * shading.blur_px + 1.0)
    # Where a limb sends hardly any light, what can be matched is the border of the lit part.
    lit = inside_at(shading, LIT)
    if lit > inside:
        inside = min(lit + shading.blur_px, shading.rho_px)
    end_px = float(TEMPLATE_GRID_PX[-2])  # between neighbours is looked up: from there to the last
    return min(outside, -TEMPLATE_START_PX - limit_px), min(inside, end_px - limit_px)


def reach_px(shading: Shading, limit_px: float) -> float:
    """How far from an edge, to either side, a match looks that may move it by `limit_px`."""
    return max(_window_px(shading, limit_px))
