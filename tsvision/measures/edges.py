"""Sub-pixel edges of round, shaded, blurred strands in a straightened strip.

A strand is a tube: towards its limb the surface turns away, so that its brightness falls before
the edge is reached and every half-level edge lies inside the true one, by 0.5 to 2 px where the
light comes from one side. What is seen near the limb of a tube of radius rho, t px inside its
edge, is to first order

    I(t) = ground + [a + b sqrt(1 - x^2) + c x] for t > 0,  x = 1 - t / rho,

blurred by the camera: `a` light from everywhere, `b` light from the camera's side, `c` light from
across (negative on the shadow side). The average of many edges, aligned on themselves, is almost
free of noise; a, b, c, the ground, the blur and the true edge's place are fitted to it once per
side (`fit_shading`), and the blurred model is then matched to every column (`match_edges`).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numba
import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import least_squares, lsq_linear

TEMPLATE_STEP_PX = 0.05
# Ramp and place of an edge trade against each other: a pull to a plain step that is too strong puts
# shaded edges up to 0.6 px too far inside, none at all 0.2 px too far outside.
RAMP_PULL = 0.005
_T = np.arange(-14.0, 30.0, TEMPLATE_STEP_PX)


@dataclass(frozen=True)
class Shading:
    """How the edge of one side looks: blur sd px, strand radius px, light a, b, c (units of the
    bundle's core contrast) and residual of the fit."""

    blur_px: float
    rho_px: float
    light: tuple[float, float, float]
    residual: float = 0.0
    template: np.ndarray = field(default_factory=lambda: np.empty(0))


def shading_basis(rho_px: float, blur_px: float) -> np.ndarray:
    """Blurred step, limb darkening and cross light, (3, T) on the template's grid."""
    # The sample on the edge itself counts half, else every edge lies half a step off.
    inside = np.clip(0.5 + _T / TEMPLATE_STEP_PX, 0.0, 1.0)
    x = np.clip(1.0 - _T / rho_px, -1.0, 1.0)
    shapes = (np.ones_like(_T), np.sqrt(1.0 - x * x), x)
    sd = max(blur_px, 0.2) / TEMPLATE_STEP_PX
    return np.stack([gaussian_filter1d(inside * f, sd, mode="nearest") for f in shapes])


def make_shading(
    rho_px: float, blur_px: float, light: tuple[float, float, float], residual: float = 0.0
) -> Shading:
    """Shading with its template, scaled so that the full depth is about one."""
    template = np.asarray(light) @ shading_basis(rho_px, blur_px)
    return Shading(blur_px, rho_px, light, residual, template)


def sample_profiles(
    values: np.ndarray, edge_row: np.ndarray, outward: int, offsets_px: np.ndarray
) -> np.ndarray:
    """values (R, M) read at edge_row - outward * offsets (offset > 0 lies inside): (M, K)."""
    rows = edge_row[:, None] - outward * offsets_px[None, :]
    low = np.clip(np.floor(rows).astype(int), 0, values.shape[0] - 2)
    part = rows - low
    column = np.arange(values.shape[1])[:, None]
    out = (1.0 - part) * values[low, column] + part * values[low + 1, column]
    out[(rows < 0) | (rows > values.shape[0] - 1)] = np.nan
    return out


def fit_shading(
    profiles: tuple[np.ndarray, np.ndarray],
    offsets_px: np.ndarray,
    rho_px: float,
    sense: int = 1,
    blur_start_px: float = 1.0,
) -> tuple[Shading, Shading, np.ndarray]:
    """Fit both sides' mean edge profiles with one blur.

    profiles: upper and lower, each (K,) in units of the core's contrast, at `offsets_px` from the
    edges as known so far, > 0 inside. sense: +1 strings brighter than the ground, -1 darker.
    Returns upper and lower shading and (2,) the true edges' places on the offsets' axis
    (negative: the true edge lies outside the one assumed).

    Light is never negative: seen as contrast, limb darkening b has the sign of `sense`, and cross
    light c cannot take away more than is there.
    """
    spans = [max(float(np.ptp(p)), 1e-6) for p in profiles]
    low_b, high_b = (0.0, 1.5) if sense > 0 else (-1.5, 0.0)
    bounds = ([0.05, low_b, -0.8, -0.5], [1.6, high_b, 0.8, 0.5])
    pull = RAMP_PULL * np.sqrt(len(offsets_px))
    ridge = np.diag([0.0, pull, pull, 0.0])

    def solve(q: np.ndarray) -> tuple[list[np.ndarray], np.ndarray]:
        basis = shading_basis(rho_px, q[0])
        found, residuals = [], []
        for side, profile in enumerate(profiles):
            design = np.array([np.interp(offsets_px - q[1 + side], _T, b) for b in basis])
            design = np.vstack([design, np.ones_like(offsets_px)]).T
            full = np.vstack([design, ridge])
            target = np.concatenate([profile / spans[side], np.zeros(4)])
            light = lsq_linear(full, target, bounds=bounds).x
            found.append(light)
            residuals.append(full @ light - target)
        return found, np.concatenate(residuals)

    fit = least_squares(
        lambda q: solve(q)[1],
        np.array([blur_start_px, 0.0, 0.0]),
        bounds=([0.35, -2.5, -2.5], [6.0, 2.5, 2.5]),
        diff_step=1e-3,
        x_scale=[0.2, 0.2, 0.2],
        max_nfev=40,
    )
    lights, residuals = solve(fit.x)
    rms = float(np.sqrt(np.mean(residuals**2)))
    sides = [
        make_shading(rho_px, float(fit.x[0]), (float(v[0]), float(v[1]), float(v[2])), rms)
        for v in lights
    ]
    return sides[0], sides[1], fit.x[1:]


@numba.njit(cache=True, fastmath=True)
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
        for r in range(r0, r1 + 1):
            if not abs(values[r, m]) < 1e8:
                good = False
        if not good:
            continue
        a = 1.0
        g = 0.0
        rss = 0.0
        for _iteration in range(iterations):
            s1 = st = stt = sy = sty = 0.0
            for r in range(r0, r1 + 1):
                t = outward * (e - r) * cos
                x = (t - t0) / dt
                i = int(x)
                w = x - i
                f = (1 - w) * template[i] + w * template[i + 1]
                y = values[r, m]
                s1 += 1.0
                st += f
                stt += f * f
                sy += y
                sty += f * y
            det = s1 * stt - st * st
            if det <= 1e-12:
                good = False
                break
            a = (s1 * sty - st * sy) / det
            g = (sy - a * st) / s1
            # step of the edge with depth and ground projected out
            jj = jr = j1 = jt = 0.0
            rss = 0.0
            for r in range(r0, r1 + 1):
                t = outward * (e - r) * cos
                x = (t - t0) / dt
                i = int(x)
                w = x - i
                f = (1 - w) * template[i] + w * template[i + 1]
                df = (template[i + 1] - template[i]) / dt * a * outward * cos
                res = values[r, m] - g - a * f
                rss += res * res
                jj += df * df
                jr += df * res
                j1 += df
                jt += df * f
            b0 = (stt * j1 - st * jt) / det
            b1 = (s1 * jt - st * j1) / det
            curve = jj - b0 * j1 - b1 * jt
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
    outside = 2.5 * shading.blur_px + 1.5
    inside = min(0.8 * shading.rho_px, 3.0 * shading.blur_px + 2.0)
    inside = max(inside, 1.5 * shading.blur_px + 1.0)
    cosine = 1.0 / np.sqrt(1.0 + np.clip(slope, -1.5, 1.5) ** 2)
    _match(
        values,
        start_row,
        outward,
        cosine,
        shading.template,
        float(_T[0]),
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
