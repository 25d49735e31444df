"""Strands that lie in their own bundle's shadow.

Under light from one side the strands on the far side get what the surroundings scatter, a tenth of
the light, and so does the ground beside them. They stand off that ground by less than the level at
which lit strands are outlined, by no more than shadows and stains on the ground do, but they end as
sharply as the lens draws, and by many times the noise. Shadows end softly; fibres are thin and few.
"""

from __future__ import annotations

import cv2
import numba
import numpy as np

from tsvision.images.percentiles import median, percentile
from tsvision.measures.edges.strands import Silhouette
from tsvision.measures.numeric.closing import opened

FALL_PX = 4  # over which a strand's border falls, whatever the lens
FAINTEST = 0.035  # of the core's contrast: what falls by less is no border
NOISES = 4.5  # of such falls on the ground beside
GROUND_SHARE = 90.0  # percentile of how steeply the ground itself falls, by light and shadow
SOME, FEWEST = 6, 34  # which columns' ground tells that, and of how many samples at least
REACH_D = 1.0  # how far beyond the lit strands dim ones are sought
BEYOND_D, BEYOND_PX = 0.1, 2.0  # nearer to the lit border it is that border itself
MOST_GAPS = 0.4  # share of what lies between lit and dim border that may be as dark as the ground
THICK, BODY = 0.5, 0.6  # of a strand, across, and the share of that which stands off: else a fibre
THIN = 1.0  # of a strand: what is narrower along the bundle is a fibre or a speck
# A border of which less than SHARP of its fall within 2 FALL_PX falls within FALL_PX is a shadow's,
# unless strands lit to LIT lie right inside.
SHARP, LIT = 0.45, 0.3
LEAST_SHARE, TIMES = 0.18, 2.0  # of the bundle, and of the other side's share: fewer are fibres


def dim_edges(
    contrast: np.ndarray, lit: Silhouette, width_px: float, strand_px: float
) -> tuple[np.ndarray, np.ndarray]:
    """Rows (M,), NaN where none, of the borders of dim strands beyond the lit ones: at larger and
    at smaller n. Light that leaves one side dark lights the other: one of the two at most.

    contrast (R, M): strings about 1 and brighter than their ground, about 0.
    """
    half = contrast.shape[0] // 2
    none = np.full(contrast.shape[1], np.nan)
    if not lit.bundle.any():
        return none, none
    smooth = _mean_of_three(contrast)
    upper = _beyond(smooth, lit.high + half, lit.bundle, width_px, strand_px)
    lower = 2 * half - _beyond(smooth[::-1], half - lit.low, lit.bundle, width_px, strand_px)
    above, below = (float(np.isfinite(side)[lit.bundle].mean()) for side in (upper, lower))
    if above > max(LEAST_SHARE, TIMES * below):
        return upper, none
    if below > max(LEAST_SHARE, TIMES * above):
        return none, lower
    return none, none


def _averaged(values: np.ndarray, columns: int) -> np.ndarray:
    """Mean over neighbouring columns, (R, M)."""
    return cv2.blur(values, (columns, 1), borderType=cv2.BORDER_REFLECT)


@numba.njit(cache=True)
def _mean_of_three(values: np.ndarray) -> np.ndarray:  # pragma: no cover - compiled
    """`_averaged` over three columns, of (R, M): the whole strip is."""
    rows, columns = values.shape
    out, last = np.empty_like(values), columns - 1
    for r in range(rows):
        row = values[r]
        for c in range(1, last):
            out[r, c] = (float(row[c - 1]) + float(row[c]) + float(row[c + 1])) / 3.0
        out[r, 0] = (2.0 * row[0] + row[min(1, last)]) / 3.0
        out[r, last] = (2.0 * row[last] + row[max(last - 1, 0)]) / 3.0
    return out


def _beyond(
    contrast: np.ndarray, border: np.ndarray, bundle: np.ndarray, width_px: float, strand_px: float
) -> np.ndarray:
    """The same at larger rows, every column for itself; border (M,): last lit row."""
    rows = border[bundle]
    first = max(int(np.fmin.reduce(rows) - strand_px) - 2 * FALL_PX, 0)  # further in is lit
    contrast, border = contrast[first:], np.where(bundle, border - first, np.nan)
    near = int(np.fmin.reduce(rows) - first + REACH_D * width_px)
    far = int(np.fmax.reduce(rows) - first + 2.0 * REACH_D * width_px) + 1
    fall = _falls(contrast[near : far + FALL_PX])
    if not fall.size:  # the strip ends before the ground that would tell
        return np.full(border.size, np.nan)
    slow = _averaged(fall, max(round(2.0 * width_px / SOME), 3))
    beside = near - border[::SOME]
    off, steeps = _beside(fall, slow, beside, REACH_D * width_px, 2.0 * REACH_D * width_px)
    if off.size < FEWEST:
        return np.full(border.size, np.nan)
    noise = 1.4826 * median(off)
    steep = percentile(steeps, GROUND_SHARE)
    least = max(NOISES * noise + steep, FAINTEST)
    thick = max(round(THICK * strand_px), 2)
    place = _last_borders(contrast, border, least, REACH_D * width_px, thick)
    held = opened(np.nan_to_num(np.fmax(place, border)), max(round(THIN * strand_px), 3))
    further: np.ndarray = held > border + max(BEYOND_D * width_px, BEYOND_PX)
    return np.where(further, held + first, np.nan)


@numba.njit(cache=True)
def _falls(ground):  # pragma: no cover - compiled
    """By how much every SOME-th column of the ground (R, M) falls over FALL_PX rows."""
    rows, columns = max(ground.shape[0] - FALL_PX, 0), (ground.shape[1] + SOME - 1) // SOME
    out = np.empty((rows, columns), ground.dtype)
    for r in range(rows):
        for c in range(columns):
            out[r, c] = ground[r, c * SOME] - ground[r + FALL_PX, c * SOME]
    return out


@numba.njit(cache=True)
def _beside(fall, slow, away, nearest, farthest):  # pragma: no cover - compiled
    """Of falls (R, M) and their means along the bundle, where they are told from the ground beside
    it: how far off the mean they are, and that mean (K,). away (M,): of the first row from the
    strings."""
    rows, columns = fall.shape
    off, means = np.empty(fall.size, fall.dtype), np.empty(fall.size, fall.dtype)
    count = 0
    for r in range(rows):
        for c in range(columns):
            if nearest < away[c] + r < farthest:
                off[count], means[count] = abs(fall[r, c] - slow[r, c]), slow[r, c]
                count += 1
    return off[:count], means[:count]


@numba.njit(cache=True)
def _last_borders(
    contrast: np.ndarray, border: np.ndarray, least: float, reach: float, thick: int
) -> np.ndarray:  # pragma: no cover - compiled
    """Rows (M,) of the outermost border of a strand within `reach` beyond the lit one; NaN where
    none of strands is, or the lit border itself is unknown."""
    rows, columns = contrast.shape
    out = np.full(columns, np.nan)
    for c in range(columns):
        lit = border[c]
        if np.isnan(lit):
            continue
        last = min(rows - FALL_PX - 1, int(np.ceil(lit + reach)) - 1)
        while last > lit and not contrast[last, c] - contrast[last + FALL_PX, c] > least:
            last -= 1
        if not last > lit:
            continue
        # From further in, else the last of a lit border's blur would pass for a border of its own.
        row, steepest = 0, -np.inf
        for r in range(max(last - 2, 0), min(last + FALL_PX, rows - 1)):
            step = contrast[r, c] - contrast[r + 1, c]
            if step > steepest:
                row, steepest = r, step
        column = contrast[:, c]
        fall = column[last] - column[last + FALL_PX]
        if (
            _is_joined(column, lit, row, 0.25 * least)
            and _is_thick(column, row, fall, thick)
            and _is_sharp(column, row)
        ):
            out[c] = row + 0.5
    return out


@numba.njit(cache=True)
def _is_joined(
    column: np.ndarray, lit: float, row: int, least: float
) -> bool:  # pragma: no cover - compiled
    """Whether most of what lies between two rows stands off the ground beyond: strands do; before a
    fibre there is ground."""
    ground = column[min(row + FALL_PX, column.size - 1)]
    between = gaps = 0
    for r in range(max(int(np.floor(lit)) + 1, 0), row):
        between += 1
        gaps += column[r] < ground + least
    return gaps <= MOST_GAPS * between


@numba.njit(cache=True)
def _is_thick(
    column: np.ndarray, row: int, fall: float, thick: int
) -> bool:  # pragma: no cover - compiled
    """Whether what ends at a row is nearly as thick as a strand."""
    ground = column[min(row + FALL_PX, column.size - 1)]
    body = 0
    for back in range(thick):
        body += column[max(row - back, 0)] > ground + 0.5 * fall
    return body > BODY * thick


@numba.njit(cache=True)
def _is_sharp(column: np.ndarray, row: int) -> bool:  # pragma: no cover - compiled
    """Whether what ends at a row ends as a strand does, and not as a shadow or a smear."""
    last, half = column.size - 1, FALL_PX // 2
    near = column[max(row - half + 1, 0)] - column[min(row + half, last)]
    far = column[max(row - FALL_PX + 1, 0)] - column[min(row + FALL_PX, last)]
    return near > SHARP * far or column[max(row - FALL_PX, 0)] > LIT
