"""Strands that lie in their own bundle's shadow.

Under light from one side the strands on the far side get what the surroundings scatter, a tenth of
the light, and so does the ground beside them. They stand off that ground by less than the level at
which lit strands are outlined, by no more than shadows and stains on the ground do, but they end as
sharply as the lens draws, and by many times the noise. Shadows end softly; fibres are thin and few.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import grey_opening, uniform_filter1d

from tsvision.measures.strands import Silhouette

FALL_PX = 4  # over which a strand's border falls, whatever the lens
FAINTEST = 0.035  # of the core's contrast: what falls by less is no border
NOISES = 4.5  # of such falls on the ground beside
GROUND_SHARE = 90.0  # percentile of how steeply the ground itself falls, by light and shadow
FEWEST = 100  # samples of the ground that tell that
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
    smooth = uniform_filter1d(contrast, 3, axis=1)
    upper = _beyond(smooth, lit.high + half, lit.bundle, width_px, strand_px)
    lower = 2 * half - _beyond(smooth[::-1], half - lit.low, lit.bundle, width_px, strand_px)
    above, below = (float(np.isfinite(side)[lit.bundle].mean()) for side in (upper, lower))
    if above > max(LEAST_SHARE, TIMES * below):
        return upper, none
    if below > max(LEAST_SHARE, TIMES * above):
        return none, lower
    return none, none


def _beyond(
    contrast: np.ndarray, border: np.ndarray, bundle: np.ndarray, width_px: float, strand_px: float
) -> np.ndarray:
    """The same at larger rows, every column for itself; border (M,): last lit row."""
    first = max(int(np.nanmin(border[bundle]) - strand_px) - 2 * FALL_PX, 0)  # further in is lit
    contrast, border = contrast[first:], border - first
    fall = contrast[:-FALL_PX] - contrast[FALL_PX:]
    away = np.arange(fall.shape[0])[:, None] - np.where(bundle, border, np.nan)
    beside = (away > REACH_D * width_px) & (away < 2.0 * REACH_D * width_px)
    if beside.sum() < FEWEST:
        return np.full(border.size, np.nan)
    slow = uniform_filter1d(fall, max(round(2.0 * width_px), 3), axis=1)
    noise = 1.4826 * float(np.median(np.abs((fall - slow)[beside])))
    ground = float(np.percentile(slow[beside], GROUND_SHARE))
    least = max(NOISES * noise + ground, FAINTEST)
    falls = (fall > least) & (away > 0.0) & (away < REACH_D * width_px)
    last = fall.shape[0] - 1 - falls[::-1].argmax(axis=0)
    column = np.arange(border.size)
    # From further in, else the last of a lit border's blur would pass for a border of its own.
    rows = np.clip(last + np.arange(-2, FALL_PX)[:, None], 0, contrast.shape[0] - 2)
    steepest = (contrast[rows, column] - contrast[rows + 1, column]).argmax(axis=0)
    place = np.take_along_axis(rows, steepest[None], axis=0)[0] + 0.5
    strand = _is_joined(contrast, border, place, 0.25 * least)
    strand &= _is_thick(contrast, place, fall[last, column], strand_px)
    strand &= _is_sharp(contrast, place) & falls.any(axis=0) & bundle
    reached = np.nan_to_num(np.where(strand, np.fmax(place, border), border))
    held = grey_opening(reached, size=max(round(THIN * strand_px), 3), mode="nearest")
    further: np.ndarray = held > border + max(BEYOND_D * width_px, BEYOND_PX)
    return np.where(further, held + first, np.nan)


def _is_joined(
    contrast: np.ndarray, border: np.ndarray, place: np.ndarray, least: float
) -> np.ndarray:
    """(M,) whether most of what lies between two rows stands off the ground beyond: strands do;
    before a fibre there is ground."""
    rows = np.arange(contrast.shape[0])[:, None]
    beyond = np.clip(place.astype(int) + FALL_PX, 0, contrast.shape[0] - 1)
    ground = contrast[beyond, np.arange(border.size)]
    between = (rows > border) & (rows < place - 1.0)
    gaps = (between & (contrast < ground + least)).sum(axis=0)
    joined: np.ndarray = gaps <= MOST_GAPS * between.sum(axis=0)
    return joined


def _is_thick(
    contrast: np.ndarray, place: np.ndarray, fall: np.ndarray, strand_px: float
) -> np.ndarray:
    """(M,) whether what ends at a row is nearly as thick as a strand."""
    column, last = np.arange(place.size), contrast.shape[0] - 1
    row = place.astype(int)
    within = np.clip(row - np.arange(max(round(THICK * strand_px), 2))[:, None], 0, last)
    ground = contrast[np.clip(row + FALL_PX, 0, last), column]
    thick: np.ndarray = (contrast[within, column] > ground + 0.5 * fall).mean(axis=0) > BODY
    return thick


def _is_sharp(contrast: np.ndarray, place: np.ndarray) -> np.ndarray:
    """(M,) whether what ends at a row ends as a strand does, and not as a shadow or a smear."""
    column, last = np.arange(place.size), contrast.shape[0] - 1
    row = place.astype(int)

    def fall(reach: int) -> np.ndarray:
        inner = contrast[np.clip(row - reach + 1, 0, last), column]
        outer: np.ndarray = contrast[np.clip(row + reach, 0, last), column]
        return inner - outer

    sharp: np.ndarray = fall(FALL_PX // 2) > SHARP * fall(FALL_PX)
    return sharp | (contrast[np.clip(row - FALL_PX, 0, last), column] > LIT)
