"""The radius with which a bundle coils, all along it, from how far its middle swings.

A fit knows the radius where it was made; a bundle that overtwists locally coils wider and narrower
from place to place, within less than a coil. The middle of the edges swings at the coils' known
rate: how far, is a least-squares wave about every place. But the strands' lobes swing the middle,
too; where they keep step with the coils, they add to them here and take from them there. Only what
swings as such a coil does nowhere, the fit drawn with its strands at all phases, has another radius
than the fit's. (The envelope does not tell a radius within a coil, and beats with the lobes, too.)
"""

from __future__ import annotations

from dataclasses import replace

import numba
import numpy as np
from scipy.ndimage import maximum_filter1d

from tsvision.images.percentiles import median, percentile
from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.bundle import BundleFit
from tsvision.measures.helix.fit import HelixFit
from tsvision.measures.helix.silhouette import KC, RC, SLOPE, Y0, K
from tsvision.measures.numeric.smoothing import bridged, convolved, smoothed, taps

LONGEST_COIL = 10.0  # D: what is slower is no coil
A_COIL = 16  # places told apart
# Of a coil, sd of the weights: the line that it swings about, and the wave itself.
LINE_SD, WAVE_SD = 1.2, 0.3
SEEN = 0.05  # of full weight
# What swings by EVEN more or less than the fit does anywhere may still be it; by UNEVEN more still,
# shares of what is typical, it counts in full.
EVEN, UNEVEN = 0.05, 0.15
SHOULDER = 0.5  # of a coil, which shows its crests no closer
COILS = 10  # drawn of a fit
# Of the strands' repeat, by which they move on from coil to coil: ten coils show ten phases.
MOVES_ON = np.array([-0.1, 0.1, 0.3, 0.7, 0.9, 1.1])
LEAST, MOST = 5.0, 95.0  # per cent of what is drawn
RIDGE = 1e-4  # of full weight, where nothing is seen
HELD = 0.5  # D from legs and connector, which hold the axis, that it takes to coil


def coil_px(rate: float, diameter_px: float) -> float:
    """Length of a coil along the axis. A fit against the strands' sense has a rate below 0."""
    return 2.0 * np.pi / max(abs(rate), 2.0 * np.pi / (LONGEST_COIL * diameter_px))


def held(
    s_px: np.ndarray, seen_px: np.ndarray, start_px: float, end_px: float, diameter_px: float
) -> np.ndarray:
    """Share (M,) of a coil's radius that legs and connector leave it: at s (M,) between two s, of
    which some are seen."""
    soon = HELD * diameter_px
    first, last = (float(seen_px[0]), float(seen_px[-1])) if seen_px.size else (start_px, end_px)
    grown = (s_px - start_px) / max(first - start_px, soon)
    shrunk = (end_px - s_px) / max(end_px - last, soon)
    return np.asarray(np.clip(np.minimum(grown, shrunk), 0.0, 1.0))


def radius_like(edges: Edges, fit: HelixFit) -> np.ndarray:
    """Radius (M,) px at edges' s of a bundle that is twisted as the coil of another stretch."""
    at, swings = _swings(edges, float(fit.p[KC]), fit.diameter_px, -np.inf, np.inf)
    drawn = _drawn_swings(fit)
    level = median(swings) / median(drawn) if swings.size else np.nan
    if not level > 0.0:
        return np.full(edges.s_px.shape, np.nan)
    off = _off(swings / level, median(drawn), drawn)
    return np.asarray(level * float(fit.p[RC]) * (1.0 + np.interp(edges.s_px, at, off)))


def radius_along(
    found: BundleFit, edges: Edges, s_px: np.ndarray, start_px: float, end_px: float
) -> np.ndarray:
    """Radius (M,) px at s (M,) of a bundle between two s, by a coiled fit to a part of it."""
    fit = found.fit
    radius, rate = float(fit.p[RC]), float(fit.p[KC])
    at, swings = _swings(edges, rate, fit.diameter_px, start_px, end_px)
    there = swings[(at >= found.s_low_px) & (at <= found.s_high_px)]
    typical = median(there) if there.size else np.nan
    if not typical > 0.0:
        return np.full(s_px.shape, radius)
    off = _off(swings, typical, _drawn_swings(fit))
    return np.asarray(radius * (1.0 + np.interp(s_px, at, off)))


def _off(swings: np.ndarray, typical: float, drawn: np.ndarray) -> np.ndarray:
    """Share (K,) by which a radius is another than the fit's, by what swings (K,) otherwise than an
    even coil, drawn (L,), does anywhere."""
    least = (1.0 - EVEN) * min(typical, percentile(drawn, LEAST))
    most = (1.0 + EVEN) * max(typical, percentile(drawn, MOST))
    other = np.clip(np.maximum(least - swings, swings - most) / (UNEVEN * typical), 0.0, 1.0)
    # What is plainly of another radius goes over into the fit's, and is not cut off at the range.
    plain = maximum_filter1d(np.floor(other), 2 * int(SHOULDER * A_COIL) + 1)
    return np.asarray((swings / typical - 1.0) * np.maximum(other, plain))


def _drawn_swings(fit: HelixFit) -> np.ndarray:
    """By how much (K,) the middle of a fit's own edges swings, with its strands at all phases."""
    p = fit.p.copy()
    p[Y0] = p[SLOPE] = 0.0
    coil, repeat = coil_px(float(p[KC]), fit.diameter_px), 2.0 * np.pi / fit.section.fold
    moves_on = (float(p[K]) * coil / repeat) % 1.0
    p[K] += (MOVES_ON[np.argmin(np.abs(MOVES_ON - moves_on))] - moves_on) * repeat / coil
    half = (0.5 * COILS + 1.0) * coil
    s, ones = np.arange(-half, half), np.ones(int(np.ceil(2.0 * half)))
    upper, lower = replace(fit, p=p).seen_edges(-half, s.size)
    drawn = Edges(s, upper, lower, ones, ones)
    at, swings = _swings(drawn, float(p[KC]), fit.diameter_px, -np.inf, np.inf)
    return swings[np.abs(at) <= half - coil]


def _swings(
    edges: Edges, rate: float, diameter_px: float, start_px: float, end_px: float
) -> tuple[np.ndarray, np.ndarray]:
    """s (K,) and by how much (K,) the middle of the edges swings there at a rate; NaN throughout
    where none is seen."""
    step = max(int(coil_px(rate, diameter_px) / A_COIL), 1)
    count = edges.s_px.size // step
    inside = (edges.s_px > start_px) & (edges.s_px < end_px)
    each = np.minimum(edges.upper_weight, edges.lower_weight) * inside
    middle = np.where(each > 0.0, 0.5 * (edges.upper_px + edges.lower_px), 0.0)
    weight, summed, s = (
        line[: count * step].reshape(count, step).sum(axis=1)
        for line in (each, each * middle, edges.s_px)
    )
    s, middle, weight = s / step, summed / np.maximum(weight, 1e-9), weight / step
    coil = coil_px(rate, diameter_px) / step
    waves = np.stack([np.cos(rate * s), np.sin(rate * s)])
    line = _about_each(np.stack([np.ones_like(s), *waves]), middle, weight, LINE_SD * coil)[:, 0]
    amplitude = np.hypot(*_about_each(waves, middle - line, weight, WAVE_SD * coil).T)
    return s, bridged(amplitude, smoothed(weight, WAVE_SD * coil) > SEEN)


def _about_each(basis: np.ndarray, values: np.ndarray, weight: np.ndarray, sd: float) -> np.ndarray:
    """Coefficients (K, B) of the basis (B, K) that fit values (K,) best about each place, with
    weights that fall off as a Gaussian of `sd` places."""
    return np.asarray(_solved(basis, values, weight, taps(sd)))


@numba.njit(cache=True)
def _solved(basis, values, weight, half):  # pragma: no cover - compiled
    """`_about_each`, the Gaussian told by one half of it."""
    size, count = basis.shape
    normal, along = np.empty((count, size, size)), np.empty((count, size))
    for i in range(size):
        weighted = weight * basis[i]
        along[:, i] = convolved(weighted * values, half, True)
        for j in range(i + 1):
            summed = convolved(weighted * basis[j], half, True)
            normal[:, i, j] = summed
            normal[:, j, i] = summed
    for i in range(size):
        normal[:, i, i] += RIDGE
    # Eliminated at all places at a time: systems of two or three cost LAPACK more to call.
    for i in range(size):
        for j in range(i + 1, size):
            part = normal[:, j, i] / normal[:, i, i]
            for k in range(i + 1, size):
                normal[:, j, k] -= part * normal[:, i, k]
            along[:, j] -= part * along[:, i]
    for i in range(size - 1, -1, -1):
        for j in range(i + 1, size):
            along[:, i] -= normal[:, i, j] * along[:, j]
        along[:, i] /= normal[:, i, i]
    return along
