"""The mean profile of an edge, from every pixel beside many columns of it."""

from __future__ import annotations

import numba
import numpy as np

from tsvision.measures.edges.shading import OUTSIDE_PX, EdgeProfile

BIN_PX = 0.25
BINS_A_PX = 4
FEWEST_IN_BIN, FEWEST_IN_PX = 2, 16  # samples
FEWEST_MEANS = 8
GROUND_PX = 3.5, OUTSIDE_PX + 2.0  # outside the edge: from, to; beyond its blur
DEEP = 0.4  # of how far inside is looked: from there on a column's depth is told
SHALLOW = 0.4  # of the typical depth: what has less is left out


def edge_samples(
    contrast: np.ndarray,
    edge_row: np.ndarray,
    slope: np.ndarray,
    outward: int,
    inside: float,
    unscaled: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Every pixel near an edge: its distance inside the edge (K,) and its signal (K,), each column
    without its ground and scaled to the columns' median depth, or `unscaled` where the signal so
    far inside tells no column's depth: of limbs darker than their ground, or as bright as that.

    contrast (R, M); edge_row, slope (M,). Nothing is interpolated, which would add to the blur.
    """
    ground, depth, near = _levels(contrast, edge_row, slope, outward, inside)
    good = near > 0
    if not good.any():
        return np.empty(0), np.empty(0)
    scale = np.ones(depth.size)
    if not unscaled:
        typical = float(np.median(depth[good]))
        good &= depth > SHALLOW * typical if typical > 0 else False
        scale = typical / np.where(good, depth, 1.0)
    count = int(near[good].sum())
    return _samples(contrast, edge_row, slope, outward, inside, ground, scale, good, count)


@numba.njit(cache=True, error_model="numpy")
def _levels(contrast, edge_row, slope, outward, inside):  # pragma: no cover - compiled
    """Of every column (M,) its ground, its depth over that, and how many pixels lie near its edge:
    0 where any of them is not known, or too few tell ground and depth."""
    columns = edge_row.size
    ground, depth, near = np.zeros(columns), np.zeros(columns), np.zeros(columns, np.int64)
    for c in range(columns):
        per_px = 1.0 / np.sqrt(1.0 + slope[c] ** 2)
        far = deep = 0
        far_sum = deep_sum = 0.0
        known = True
        for r in range(contrast.shape[0]):
            t = outward * (edge_row[c] - r) * per_px
            if not (-GROUND_PX[1] < t < inside):
                continue
            value = contrast[r, c]
            if t < -GROUND_PX[0]:
                far += 1
                far_sum += value
            elif t > DEEP * inside:
                deep += 1
                deep_sum += value
            if t >= -OUTSIDE_PX:
                near[c] += 1
                known &= not np.isnan(value)
        if not known or far < 2 or deep < 1:
            near[c] = 0
            continue
        ground[c] = far_sum / far
        depth[c] = deep_sum / deep - ground[c]
        if np.isnan(depth[c]):
            near[c] = 0
    return ground, depth, near


@numba.njit(cache=True, error_model="numpy")
def _samples(
    contrast, edge_row, slope, outward, inside, ground, scale, good, count
):  # pragma: no cover - compiled
    """Distance inside the edge and signal (count,) of all pixels near it in the `good` columns."""
    t_px, value = np.empty(count), np.empty(count)
    k = 0
    for c in range(edge_row.size):
        if not good[c]:
            continue
        per_px = 1.0 / np.sqrt(1.0 + slope[c] ** 2)
        for r in range(contrast.shape[0]):
            t = outward * (edge_row[c] - r) * per_px
            if -OUTSIDE_PX <= t < inside:
                t_px[k], value[k] = t, (contrast[r, c] - ground[c]) * scale[c]
                k += 1
    return t_px, value


def mean_profile(t_px: np.ndarray, value: np.ndarray) -> EdgeProfile | None:
    """Mean over every px of trimmed means of samples in bins of a quarter px; None with few of
    them.

    A column has a sample in every fourth bin: along edges that run with the rows, what the columns
    of one sub-pixel phase differ in from those of another repeats from px to px, ten times what the
    light leaves unexplained. A whole px holds every column once, wherever it lies.
    """
    if t_px.size == 0:
        return None
    order = np.lexsort((value, np.floor(t_px / BIN_PX)))
    number, count, place, mean, variance = _bins(t_px[order], value[order])
    means = []
    for first in range(len(number)):
        px = slice(first, int(np.searchsorted(number, number[first] + BINS_A_PX)))
        if number[-1] - number[first] < BINS_A_PX - 1 or count[px].sum() < FEWEST_IN_PX:
            continue
        # Neighbouring means share all bins but one: each has the sd of one bin, so that together
        # they count as often as their bins do.
        means.append((place[px].mean(), mean[px].mean(), np.sqrt(variance[px].mean())))
    return EdgeProfile(*np.array(means).T) if len(means) >= FEWEST_MEANS else None


@numba.njit(cache=True)
def _bins(t_px, value):  # pragma: no cover - compiled
    """Of samples sorted by their bin, and by value there: of the bins that have enough (5, B) their
    number, how many samples, mean place, trimmed mean value, and its variance."""
    number = np.floor(t_px / BIN_PX)
    out = np.empty((5, t_px.size // FEWEST_IN_BIN + 1))
    found = first = 0
    while first < t_px.size:
        end = first
        while end < t_px.size and number[end] == number[first]:
            end += 1
        size = end - first
        if size >= FEWEST_IN_BIN:
            trim = size // 10
            out[0, found], out[1, found] = number[first], size
            out[2, found] = t_px[first:end].mean()
            out[3, found] = value[first + trim : end - trim].mean()
            out[4, found] = value[first:end].var() / size
            found += 1
        first = end
    return out[:, :found]
