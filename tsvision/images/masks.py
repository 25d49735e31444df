"""Which pixels of a strip are strings."""

from __future__ import annotations

import cv2
import numba
import numpy as np

from tsvision.images.contrast import GROUND_FROM, ROUGH, STANDS_OUT, noise_of, scaled_contrast
from tsvision.images.percentiles import median
from tsvision.images.shadow import (
    DARKENS,
    DEEPEST,
    NO_SHADE,
    NO_SHADOW,
    Shade,
    Shadow,
    find_shadow,
    typical_shadow,
)
from tsvision.images.signal import Signal
from tsvision.images.strip import Strip, averaged

DEEPEST_CHROMA = 0.25  # contrast to which blocks of compressed colour reach beside strands
MASK_LEVEL = 0.35  # highest share of the core's contrast at which strings begin
# sds of the noise that MASK_LEVEL lies above: beyond them is a pixel in forty, one in each square
# that masks are closed over. Of a bundle's width, what squares may average over.
BEYOND_NOISE, SMALL = 2.0, 0.15
# Of the core's contrast in most strips: less is the ground's, between legs of hardly a turn.
SHOWN, MOST = 0.5, 75.0


def mask_level(contrast: np.ndarray, inner_px: float) -> float:
    """Contrast at which strings begin: low enough for the shadow side of a front-lit strand, which
    may keep a tenth of the core's contrast, and above what the ground itself varies by."""
    ground = contrast[_outside(contrast, inner_px), ::4]
    ground = ground[np.isfinite(ground)]
    if ground.size == 0:
        return MASK_LEVEL
    spread = 1.4826 * median(np.abs(ground - median(ground)))
    return float(np.clip(5.0 * spread, 0.09, MASK_LEVEL))


def _outside(contrast: np.ndarray, inner_px: float) -> np.ndarray:
    """Every third of the rows (K,) of a strip that lie farther than that from its axis."""
    half = contrast.shape[0] // 2
    return np.flatnonzero(np.abs(np.arange(-half, half + 1)) > inner_px)[::3]


def quiet(contrast: np.ndarray, noise: float, width: float) -> np.ndarray:
    """A contrast strip (R, M) to outline strings in: averaged over squares, much smaller than they,
    where the noise of a pixel would reach the level at which they begin. Noise so dense closes to
    one mask, and strings that anybody sees are not seen. noise: sd, core 1; width: the bundle's."""
    side = int(np.ceil(BEYOND_NOISE * noise / MASK_LEVEL))
    return averaged(contrast, min(side | 1, max(round(SMALL * width), 1) | 1) if side > 1 else 1)


def string_mask(
    contrast: np.ndarray, thin_px: float, level: float, shade: Shade = NO_SHADE
) -> np.ndarray:
    """Where strings lie in a contrast strip (core about 1): uint8 0/1, same shape.

    Valleys between strands are closed, fibres thinner than `thin_px` opened away. The shadow side
    of a strand can be darker than the ground (the negative part); a shadow on the ground is soft
    and must be twice as strong to count. shade: on which side they end where they do not reach
    more.
    """
    k = max(1, round(thin_px)) | 1
    kernel = np.ones((k, k), np.uint8)  # a square is separable, hence fast

    def solid(level: float) -> np.ndarray:
        raw = _stands_out(contrast, contrast.dtype.type(level))
        closed = cv2.morphologyEx(raw, cv2.MORPH_CLOSE, kernel)
        return cv2.morphologyEx(closed, cv2.MORPH_OPEN, kernel)

    mask = solid(level)
    if shade.side:
        _end_at(mask, solid(shade.level), shade.side)
    return mask


@numba.njit(cache=True)
def _end_at(mask, deep, side):  # pragma: no cover - compiled
    """Take from every run of a mask's columns what lies beyond its last `deep` sample on one side:
    all of it where there is none."""
    rows, columns = mask.shape
    reached = np.zeros(columns, np.bool_)
    for i in range(rows):
        r = rows - 1 - i if side > 0 else i
        for c in range(columns):
            reached[c] = mask[r, c] > 0 and (reached[c] or deep[r, c] > 0)
            mask[r, c] = reached[c]


@numba.njit(cache=True)
def _stands_out(contrast, level):  # pragma: no cover - compiled
    out = np.empty(contrast.shape, np.uint8)
    for r in range(contrast.shape[0]):
        for c in range(contrast.shape[1]):
            value = contrast[r, c]  # NaN is no string
            out[r, c] = (value > level) | (value < -2 * level)
    return out


def _shadow_in(
    contrast: np.ndarray, inner_px: float, least: float, black: float, signal: Signal, rough: bool
) -> Shadow:
    """What shadow could be in a contrast: none has more of it than black has. What else is soft,
    limbs that little light falls on and colours coded in blocks, is the strands'."""
    if not (signal.in_colour or black > DARKENS):
        return NO_SHADOW
    core = 1.0 / ROUGH if rough else 1.0
    # Strands of several colours stand out by several amounts: only what is soft far down may go.
    deepest = core * (DEEPEST_CHROMA if signal.by_distance else DEEPEST)
    cast = deepest if signal.by_distance else core * max(black, MASK_LEVEL)
    # Colours in blocks are soft as shadows are.
    blackest = 0.0 if signal.in_colour else core * black
    return find_shadow(contrast, inner_px, least, deepest, cast, blackest)


def quiet_strip(contrast: np.ndarray, width: float) -> np.ndarray:
    """`quiet`, of a strip along a line that may be any, and whose noise is not known yet."""
    noise = noise_of(contrast, _outside(contrast, GROUND_FROM * width))
    # What stands out by less is no core of strings; nor is anything known where noise is NaN.
    return quiet(contrast, noise, width) if STANDS_OUT * noise < 1.0 else contrast


def masks_of(
    strips: list[Strip],
    signal: Signal,
    width: float,
    rough: bool,
    between: bool = False,
) -> tuple[list[np.ndarray], Shadow]:
    """Masks of the strings in some strips, and what shadow could be in them. between: whether the
    axis may run between legs most of the way."""
    scaled = [scaled_contrast(s, signal, width, rough, between) for s in strips]
    least = [mask_level(c, GROUND_FROM * width) for c, _, _ in scaled]
    levels = np.abs([level for _, _, level in scaled])
    shown = levels >= SHOWN * np.percentile(levels, MOST)
    shadows = [
        _shadow_in(c, GROUND_FROM * width, low, black, signal, rough)
        for (c, black, _), low, shows in zip(scaled, least, shown, strict=True)
        if shows
    ]
    shadow = typical_shadow(shadows)
    return [
        string_mask(quiet_strip(c, width), 0.2 * width, max(low, shadow.level), shadow.shade)
        for (c, _, _), low in zip(scaled, least, strict=True)
    ], shadow
