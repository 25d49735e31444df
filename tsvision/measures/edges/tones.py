"""Strands of two brightnesses in one bundle: the fainter ones brought to the core's contrast.

A black strand beside a cream one before a grey ground, or a blue beside a white one before black,
shows a tenth of the contrast, and would be lost as a shadow or a fibre: half of the lobes with it.
What is just within the outline tells, column by column and side by side, which strand lies there.
"""

from __future__ import annotations

import cv2
import numba
import numpy as np

from tsvision.images.contrast import GROUND_FROM
from tsvision.images.percentiles import median
from tsvision.measures.edges.strands import Silhouette, outline
from tsvision.measures.numeric.closing import opened

NEAR_D, FAR_D = 0.1, 0.5  # widths from the axis: rows of the strand that makes one side's outline
GROUND_D = 1.0  # widths further out: as many rows of ground
FAINT_PERCENTILE, BRIGHT_PERCENTILE = 20.0, 90.0  # of the columns: of either strand's
FAINT = 0.3  # of the bright strands' contrast: those that show more are found as they are
ABOVE_GROUND = 2.0  # times what the ground varies by, from which a strand lies there
# Of a faint strand's contrast: where it begins, above what a ground varies by if it has to be.
BEGINS, LATE = 0.15, 0.6
SMOOTH_PX = 1.0  # sd over which is looked for them: noise may be as strong
SPREADS = 5.0  # of the ground, that what is no ground differs by
DEEP = 0.8  # of a strand, from the outline, within which it shows all it has, ...
GROWS = 1.2  # times a px at most: more and its border is still rising, or a brighter one begins
ACROSS = 1.5  # strands along the axis: what stands out over less is a fibre
NOWHERE = -1e6  # a row that stands in where there is no border
LEAST_COLUMNS = 20


def faint_tone(
    contrasts: list[np.ndarray], silhouettes: list[Silhouette], width_px: float
) -> float:
    """Contrast of the fainter strands in some strips (R, M), core about 1, of the brighter ones';
    1 where all are about alike, or where what is fainter is not told from the ground."""
    told = []
    for contrast, silhouette in zip(contrasts, silhouettes, strict=True):
        if np.count_nonzero(silhouette.bundle) < LEAST_COLUMNS:
            continue
        near = _sides(contrast, width_px, 0.0)[:, silhouette.bundle]
        ground = _sides(contrast, width_px, GROUND_D)[:, silhouette.bundle]
        bright = np.percentile(near, BRIGHT_PERCENTILE, axis=1)
        faint = np.percentile(near, FAINT_PERCENTILE, axis=1)
        seen = faint > ABOVE_GROUND * np.median(ground, axis=1)
        told += list(np.where(seen, faint / bright, 1.0))
    tone = float(np.median(told)) if told else 1.0
    return tone if tone < FAINT else 1.0


def _sides(contrast: np.ndarray, width_px: float, further_d: float) -> np.ndarray:
    """Strongest contrast (2, M) of some rows on either side of the axis, upper and lower."""
    half = contrast.shape[0] // 2
    near, far = round((NEAR_D + further_d) * width_px), round((FAR_D + further_d) * width_px)
    near, far = max(near, 1), min(max(far, near + 1), half)
    even = cv2.blur(np.abs(contrast).astype(np.float32), (3, 3))
    upper, lower = even[half + near : half + far + 1], even[half - far : half - near + 1]
    return np.stack([upper.max(axis=0), lower.max(axis=0)])


def even_out(contrast: np.ndarray, width_px: float, strand_px: float, tone: float) -> np.ndarray:
    """Contrast (R, M) in units of what the strand just within either border shows, told from it
    smoothed; as it was where no bundle is outlined. tone: of the faint strands."""
    smooth = cv2.GaussianBlur(np.abs(contrast).astype(np.float32), (0, 0), SMOOTH_PX)
    half = contrast.shape[0] // 2
    beside = np.flatnonzero(np.abs(np.arange(-half, half + 1)) > GROUND_FROM * width_px)
    ground = smooth[beside[::3], ::4].ravel()
    middle = median(ground)
    begins = middle + SPREADS * 1.4826 * median(np.abs(ground - middle))
    begins = float(np.clip(begins, BEGINS * tone, LATE * tone))
    silhouette = outline(smooth, width_px, strand_px, 0, begins)
    deep = max(round(DEEP * strand_px), 3)
    high = _without_fibres(silhouette.high, strand_px)
    low = -_without_fibres(-silhouette.low, strand_px)
    axis = np.nan_to_num(0.5 * (low + high)) + half
    out = contrast.astype(np.float32, copy=True)
    upper = _within(smooth, high + half, -1, deep)
    lower = _within(smooth, low + half, 1, deep)
    _divide(out, _told(upper, tone), _told(lower, tone), axis)
    return out


def _without_fibres(border: np.ndarray, strand_px: float) -> np.ndarray:
    """An upper border (M,) without what stands out of it over no more than ACROSS strands."""
    known = np.nan_to_num(border, nan=NOWHERE)
    even = opened(known, max(round(ACROSS * strand_px), 1))
    return np.where(np.isnan(border) | (even <= NOWHERE), np.nan, even)


def _told(level: np.ndarray, tone: float) -> np.ndarray:
    """Levels (M,) of either side as what divides its contrast: 1 where none is known."""
    return np.where(np.isfinite(level), np.clip(level, LATE * tone, 1.0), 1.0).astype(np.float32)


@numba.njit(cache=True)
def _within(even, limit, step, deep):  # pragma: no cover - compiled
    """Contrast (M,) at which it stops rising, no more than `deep` rows inwards from a border's rows
    (M,); NaN where there is none."""
    rows, columns = even.shape
    out = np.full(columns, np.nan)
    for c in range(columns):
        if np.isnan(limit[c]):
            continue
        best = even[int(limit[c]), c]
        for k in range(1, deep):
            row = min(max(int(limit[c]) + k * step, 0), rows - 1)
            rises = even[row, c] > GROWS * best
            best = max(best, even[row, c])
            if not rises:
                break
        out[c] = best
    return out


@numba.njit(cache=True)
def _divide(contrast, upper, lower, axis):  # pragma: no cover - compiled
    for r in range(contrast.shape[0]):
        for c in range(contrast.shape[1]):
            contrast[r, c] /= upper[c] if r > axis[c] else lower[c]
