"""From a contrast strip to the silhouette: which columns hold the bundle, where its edges lie."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from tsvision.images.masks import string_mask


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
def _columns(labels, keep, contrast, above, half):  # pragma: no cover - compiled
    """Of every column (6, M): first and last n of what is kept; of the run of it nearest to the
    axis too, and that run's distance; how many samples have a contrast above a level. Row by row,
    as pictures lie in memory."""
    rows, columns = labels.shape
    out = np.full((6, columns), np.nan)
    lit = np.zeros(columns, np.int32)
    for r in range(rows):
        for c in range(columns):
            lit[c] += contrast[r, c] > above
    out[5] = lit
    begun = np.full(columns, -1)
    for r in range(rows + 1):
        for c in range(columns):
            if r < rows and keep[labels[r, c]]:
                if begun[c] < 0:
                    begun[c] = r
                continue
            if begun[c] < 0:
                continue
            low, high = begun[c] - half, r - 1 - half
            begun[c] = -1
            if np.isnan(out[0, c]):
                out[0, c] = low
            out[1, c] = high
            distance = 0.0 if low <= 0 <= high else float(min(abs(low), abs(high)))
            if not distance >= out[4, c]:
                out[2, c], out[3, c], out[4, c] = low, high, distance
    return out


def outline(
    contrast: np.ndarray, width_px: float, strand_px: float, start: int, level: float
) -> Silhouette:
    """Rough outline of the strings in a contrast strip (R, M), core about 1.

    width_px: bundle's outer width; strand_px: one strand; start: first column to consider.
    """
    import cv2

    half = contrast.shape[0] // 2
    mask = string_mask(contrast, max(0.4 * strand_px, 1.5), level)
    count, labels = cv2.connectedComponents(mask, connectivity=8)
    core = labels[half - max(int(0.15 * width_px), 1) : half + max(int(0.15 * width_px), 1) + 1]
    share = np.bincount(core.ravel(), minlength=count)
    keep = share > 0.5 * width_px
    keep[0] = False
    found = _columns(labels, keep, contrast, np.float32(1.5 * level), half)
    low, high, run_low, run_high, distance, raw = found
    with np.errstate(invalid="ignore"):
        cut = raw > (high - low + 1) + 0.25 * strand_px
        single = (distance < 0.3 * width_px) & (run_high - run_low + 1 > 0.3 * width_px)
        # beyond the apex the outermost rows belong to the legs, the central run to the bundle
        split = (high - low) - (run_high - run_low) > 0.25 * strand_px
    bundle, apex = _twisted_part(single & ~split, width_px, start)
    low = np.where(bundle, low, np.nan)
    high = np.where(bundle, high, np.nan)
    return Silhouette(low, high, bundle, apex, cut & bundle)


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
