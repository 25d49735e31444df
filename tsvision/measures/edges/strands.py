"""From a contrast strip to the silhouette: which columns hold the bundle, where its edges lie."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from tsvision.images.masks import string_mask
from tsvision.images.shadow import NO_SHADE, Shade
from tsvision.measures.numeric.line import line_through

# What two legs bound: wider than so many bundles, for so many widths at least; how much either runs
# towards the axis, and how straight it is, of a width. Knots are lumps.
LEGS_WIDE, LEGS_LONG, LEGS_SLOPE, LEGS_STRAIGHT = 1.3, 0.3, 0.1, 0.08


@dataclass(frozen=True)
class Silhouette:
    """Rough outline in a strip. low, high (M,): outermost rows of the strings (NaN: none);
    bundle (M,): columns of the twisted part; apex_column: where the legs have met (float, NaN if
    out of view); cut (M,): columns in which fibres or dust were cut off."""

    low: np.ndarray
    high: np.ndarray
    bundle: np.ndarray
    apex_column: float
    cut: np.ndarray


@numba.njit(cache=True)
def _runs(changes, columns):  # pragma: no cover - compiled
    """Runs of a mask (R, M), (3, K): column, first row and the row after the last, column by
    column. changes (L,): flat places, in order, where a row of it differs from the row before."""
    begins = np.zeros(columns + 1, np.int64)
    for place in changes:
        begins[place % columns + 1] += 1
    begins = np.cumsum(begins)
    ordered, next_of = np.empty(changes.size, np.int64), begins[:-1].copy()
    for place in changes:
        column = place % columns
        ordered[next_of[column]] = place // columns
        next_of[column] += 1
    out = np.empty((3, changes.size // 2), np.int64)
    for c in range(columns):
        for k in range(begins[c] // 2, begins[c + 1] // 2):
            out[0, k], out[1, k], out[2, k] = c, ordered[2 * k], ordered[2 * k + 1]
    return out


@numba.njit(cache=True)
def _root(parent, k):  # pragma: no cover - compiled
    while parent[k] != k:
        parent[k] = parent[parent[k]]
        k = parent[k]
    return k


@numba.njit(cache=True)
def _components(runs):  # pragma: no cover - compiled
    """Which component (K,) each run is of: those that touch, corners included, are of one."""
    count = runs.shape[1]
    parent = np.arange(count)
    before = 0
    for k in range(count):
        column, low, high = runs[:, k]
        while before < k and (
            runs[0, before] < column - 1 or (runs[0, before] < column and runs[2, before] < low)
        ):
            before += 1
        other = before
        while other < k and runs[0, other] < column and runs[1, other] <= high:
            if runs[2, other] >= low:
                parent[_root(parent, other)] = _root(parent, k)
            other += 1
    for k in range(count):
        parent[k] = _root(parent, k)
    return parent


@numba.njit(cache=True)
def _columns(runs, columns, half, core, least):  # pragma: no cover - compiled
    """Of every column (5, M): first and last n of what belongs to the strings; of the run of it
    nearest to the axis too, and that run's distance. Strings are the components that hold more
    than `least` samples less than `core` + 1 rows off the axis."""
    component = _components(runs)
    share = np.zeros(component.size)
    for k in range(component.size):
        held = min(runs[2, k], half + core + 1) - max(runs[1, k], half - core)
        share[component[k]] += max(held, 0)
    out = np.full((5, columns), np.nan)
    for k in range(component.size):
        if not share[component[k]] > least:
            continue
        c, low, high = runs[0, k], runs[1, k] - half, runs[2, k] - 1 - half
        if np.isnan(out[0, c]):
            out[0, c] = low
        out[1, c] = high
        distance = 0.0 if low <= 0 <= high else float(min(abs(low), abs(high)))
        if not distance >= out[4, c]:
            out[2, c], out[3, c], out[4, c] = low, high, distance
    return out


@numba.njit(cache=True)
def _lit(contrast, above):  # pragma: no cover - compiled
    """How many samples of every column (M,) have a contrast above a level. Row by row, as pictures
    lie in memory."""
    out = np.zeros(contrast.shape[1], np.int32)
    for r in range(contrast.shape[0]):
        row = contrast[r]
        for c in range(out.size):
            out[c] += row[c] > above
    return out


def outline(
    contrast: np.ndarray,
    width_px: float,
    strand_px: float,
    start: int,
    level: float,
    shade: Shade = NO_SHADE,
) -> Silhouette:
    """Rough outline of the strings in a contrast strip (R, M), core about 1.

    width_px: bundle's outer width; strand_px: one strand; start: first column to consider; level,
    shade: see `string_mask`.
    """
    half, columns = contrast.shape[0] // 2, contrast.shape[1]
    mask = string_mask(contrast, max(0.4 * strand_px, 1.5), level, shade)
    framed = np.zeros((mask.shape[0] + 2, columns), np.uint8)
    framed[1:-1] = mask
    changes = np.flatnonzero(framed[1:] != framed[:-1])
    core = max(int(0.15 * width_px), 1)
    found = _columns(_runs(changes, columns), columns, half, core, 0.5 * width_px)
    low, high, run_low, run_high, distance = found
    raw = _lit(contrast, np.float32(1.5 * max(level, shade.level)))
    with np.errstate(invalid="ignore"):
        cut = raw > (high - low + 1) + 0.25 * strand_px
        single = (distance < 0.3 * width_px) & (run_high - run_low + 1 > 0.3 * width_px)
        # beyond the apex the outermost rows belong to the legs, the central run to the bundle
        split = (high - low) - (run_high - run_low) > 0.25 * strand_px
    bundle, apex = _twisted_part(single & ~split, width_px, start)
    if bundle.any():
        first = int(apex)
        apex += _between_legs(low[first:], high[first:], width_px, half)
        bundle[first : int(apex)] = False
        apex = apex if bundle.any() else float("nan")
    # What reaches from border to border has no ground beside it: that lies in a shadow there.
    clear = bundle & ~((run_low <= -half) & (run_high >= half))
    if (bundle & ~clear).any():
        bundle, first_clear = _twisted_part(clear, width_px, start)
        apex = apex if first_clear == apex else float("nan")
    low = np.where(bundle, low, np.nan)
    high = np.where(bundle, high, np.nan)
    return Silhouette(low, high, bundle, apex, cut & bundle)


@numba.njit(cache=True)
def _between_legs(low, high, width_px, half):  # pragma: no cover - compiled
    """How many of the first columns hold two legs, and ground between them, or beyond, that looks
    like strings beside a bright plate: what is wider than a bundle there, and on either side has no
    border or a straight one that runs towards the axis. low, high (M,): outermost rows; half:
    where the strip ends."""
    wide = 0
    while wide < low.size and not high[wide] - low[wide] + 1 <= LEGS_WIDE * width_px:
        wide += 1
    for inwards, border in ((1.0, low[:wide]), (-1.0, high[:wide])):
        s = np.flatnonzero(np.abs(border) < half).astype(np.float64)
        if s.size < LEGS_LONG * width_px:
            if s.size > 0.5 * wide:
                return 0
            continue
        seen = border[s.astype(np.int64)]
        constant, slope = line_through(s, seen)
        off = np.median(np.abs(seen - constant - slope * s))
        if not (inwards * slope > LEGS_SLOPE and off < LEGS_STRAIGHT * width_px):
            return 0
    return wide


@numba.njit(cache=True)
def _longest(good: np.ndarray, gap: int) -> tuple[int, int]:  # pragma: no cover - compiled
    """First and last of the longest stretch of columns, gaps bridged; (0, -1) where there is
    none."""
    best_first, best_last, first, last = 0, -1, -1, -1
    for c in range(good.size):
        if good[c]:
            if first < 0 or c - last - 1 > gap:
                first = c
            last = c
            if last - first > best_last - best_first:
                best_first, best_last = first, last
    return best_first, best_last


def _twisted_part(clean: np.ndarray, width_px: float, start: int) -> tuple[np.ndarray, float]:
    """The longest stretch of columns with one run, gaps up to 1.2 widths bridged (a tight coil
    leaves the axis for a moment); its first column is where the legs have met."""
    good = clean.copy()
    good[: max(start, 0)] = False
    first, last = _longest(good, max(int(1.2 * width_px), 3))
    bundle = np.zeros(clean.size, dtype=bool)
    if last < first:
        return bundle, float("nan")
    bundle[first : last + 1] = True
    return bundle, float(first)
