"""Strands that lie in their own bundle's shadow.

Under light from one side the strands on the far side get what the surroundings scatter, a tenth of
the light, and so does the ground beside them. They stand off that ground by less than the level at
which lit strands are outlined, by no more than shadows and stains on the ground do, but they end as
sharply as the lens draws, and by many times the noise. Shadows end softly; fibres are thin and few.

Before a ground that is lit, a limb that no lamp reaches is darker than that ground: sunk. What is
brighter than the ground ends well inside such a limb; the limb ends, as sharply, where it rises to
the ground again.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numba
import numpy as np

from tsvision.images.percentiles import median, percentile
from tsvision.measures.edges.strands import Silhouette
from tsvision.measures.numeric.closing import closed, opened
from tsvision.measures.numeric.smoothing import bridged

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
# Sunk limbs: of a strand, and of the bundle, what lies beyond the lit border at most until a
# recording is known to have some, or within it at most; over how many rows at least; of how much of
# the bundle. Lobes reach out over less than a strand: of that, what is narrower is no limb.
SUNK_STRAND, SUNK_D, SUNK_WITHIN_PX, SUNK_PX, SUNK_SHARE = 0.9, 0.4, 2, 2, 0.4
SUNK_THIN = 0.25
SUNK_SHARP = 0.6  # as SHARP: nothing lit lies right inside, and an even slope has 0.5


def dim_edges(
    contrast: np.ndarray, lit: Silhouette, width_px: float, strand_px: float
) -> tuple[np.ndarray, np.ndarray]:
    """Rows (M,), NaN where none, of the borders of dim strands beyond the lit ones: at larger and
    at smaller n. Light that leaves one side dark lights the other: one of the two at most.

    contrast (R, M): strings about 1 and brighter than their ground, about 0.
    """
    smooth = _mean_of_three(contrast)
    dim = _Kind(
        reach_px=REACH_D * width_px,
        within_px=0,
        beyond_px=max(BEYOND_D * width_px, BEYOND_PX),
        thick_px=max(round(THICK * strand_px), 2),
        bridged_px=0,
        thin_px=max(round(THIN * strand_px), 3),
        sharp=SHARP,
        lit=LIT,
        either=False,  # beside strands darker than ground is none of theirs: a colour's ringing
    )
    upper, lower = (_on_side(way, smooth, lit, width_px, strand_px, dim) for way in (1, -1))
    return _one_side(upper, lower, lit.bundle, LEAST_SHARE)


def sunk_edges(
    contrast: np.ndarray, lit: Silhouette, width_px: float, strand_px: float, side: int | None
) -> tuple[np.ndarray, np.ndarray]:
    """Rows (M,), NaN where none, of the borders of limbs darker than their ground, beyond the lit
    ones, as `dim_edges`; on a side (+1 at larger n, -1) that is known to have some, or on either
    (None), where enough of the bundle has."""
    reach_px = REACH_D * width_px
    if side is None:
        reach_px = max(SUNK_STRAND * strand_px, SUNK_D * width_px)
    # What is much darker than its ground was outlined as strings are, roughly: its own border is
    # that outline. What rises to the ground falls to it in the negative.
    sunk = _Kind(
        reach_px=reach_px,
        within_px=FALL_PX,
        beyond_px=FALL_PX - SUNK_WITHIN_PX,
        thick_px=SUNK_PX,
        bridged_px=round(strand_px),
        thin_px=max(round(SUNK_THIN * strand_px), 3),
        sharp=SUNK_SHARP,
        lit=np.inf,
        either=True,  # lit parts of theirs lie within
    )
    negative, none = -_mean_of_three(contrast), np.full(contrast.shape[1], np.nan)
    upper, lower = (
        none if side == -way else _on_side(way, negative, lit, width_px, strand_px, sunk)
        for way in (1, -1)
    )
    return (upper, lower) if side else _one_side(upper, lower, lit.bundle, SUNK_SHARE)


@dataclass(frozen=True)
class _Kind:
    """Of borders: how far beyond the lit ones they are sought, from how far within those on, and by
    how much beyond that they lie at least; over how many rows what they bound stands off the ground
    at least; gaps shorter than `bridged_px` columns lie between two of them; what reaches out over
    less than `thin_px` columns is a fibre or a speck; `sharp` and `lit` as SHARP and LIT;
    either: what lies between may stand off the ground to either side."""

    reach_px: float
    within_px: int
    beyond_px: float
    thick_px: int
    bridged_px: int
    thin_px: int
    sharp: float
    lit: float
    either: bool


def _on_side(
    side: int, smooth: np.ndarray, lit: Silhouette, width_px: float, strand_px: float, kind: _Kind
) -> np.ndarray:
    """Borders (M,) at larger (side +1) or at smaller n (-1) of what stands off the ground beyond
    the lit strands."""
    half = smooth.shape[0] // 2
    if not lit.bundle.any():
        return np.full(smooth.shape[1], np.nan)
    if side > 0:
        return _beyond(smooth, lit.high + half, lit.bundle, width_px, strand_px, kind)
    mirrored = smooth[::-1], half - lit.low
    return 2 * half - _beyond(*mirrored, lit.bundle, width_px, strand_px, kind)


def _one_side(
    upper: np.ndarray, lower: np.ndarray, bundle: np.ndarray, least: float
) -> tuple[np.ndarray, np.ndarray]:
    """Of borders (M,) on either side those of the one that far more of a bundle's columns have, a
    share of at least so much of them; NaN else."""
    none = np.full(bundle.size, np.nan)
    columns = max(int(bundle.sum()), 1)
    above, below = (int(np.isfinite(side)[bundle].sum()) / columns for side in (upper, lower))
    if above > max(least, TIMES * below):
        return upper, none
    if below > max(least, TIMES * above):
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
    contrast: np.ndarray,
    border: np.ndarray,
    bundle: np.ndarray,
    width_px: float,
    strand_px: float,
    kind: _Kind,
) -> np.ndarray:
    """The same at larger rows, every column for itself, but for bridged gaps; border (M,): last lit
    row."""
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
    border = border - kind.within_px
    reach_px = kind.reach_px + kind.within_px
    asked = kind.thick_px, kind.sharp, kind.lit, kind.either
    place = _last_borders(contrast, border, least, reach_px, *asked)
    if kind.bridged_px > 1:
        seen = np.isfinite(place)
        bridges = closed(seen.astype(float), kind.bridged_px) > 0.5
        place = np.where(bridges, bridged(place, seen), np.nan)
    held = opened(np.nan_to_num(np.fmax(place, border)), kind.thin_px)
    further: np.ndarray = held > border + kind.beyond_px
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
    contrast: np.ndarray,
    border: np.ndarray,
    least: float,
    reach: float,
    thick: int,
    sharp: float,
    lit_enough: float,
    either: bool,
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
            _is_joined(column, lit, row, 0.25 * least, either)
            and _is_thick(column, row, fall, thick)
            and _is_sharp(column, row, sharp, lit_enough)
        ):
            out[c] = row + 0.5
    return out


@numba.njit(cache=True)
def _is_joined(
    column: np.ndarray, lit: float, row: int, least: float, either: bool
) -> bool:  # pragma: no cover - compiled
    """Whether most of what lies between two rows stands off the ground beyond, above it or to
    `either` side: strands do; before a fibre there is ground."""
    ground = column[min(row + FALL_PX, column.size - 1)]
    between = gaps = 0
    for r in range(max(int(np.floor(lit)) + 1, 0), row):
        off = column[r] - ground
        between += 1
        gaps += (abs(off) if either else off) < least
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
def _is_sharp(
    column: np.ndarray, row: int, sharp: float, lit: float
) -> bool:  # pragma: no cover - compiled
    """Whether what ends at a row ends as a strand does, and not as a shadow or a smear."""
    last, half = column.size - 1, FALL_PX // 2
    near = column[max(row - half + 1, 0)] - column[min(row + half, last)]
    far = column[max(row - FALL_PX + 1, 0)] - column[min(row + FALL_PX, last)]
    return near > sharp * far or column[max(row - FALL_PX, 0)] > lit
