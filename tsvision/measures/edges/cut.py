"""One frame cut along the recording's axis: its contrast and rough outline."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numba
import numpy as np

from tsvision.images.contrast import STANDS_OUT, black_contrast, noise_of, raw_contrast
from tsvision.images.ground import nan_median
from tsvision.images.linear import (
    grey_codes,
    light_of_codes,
    linear_signal,
    project,
    to_linear,
)
from tsvision.images.masks import MASK_LEVEL, mask_level, quiet
from tsvision.images.percentiles import median, percentile
from tsvision.images.shadow import NO_SHADE
from tsvision.images.sight import Sight
from tsvision.images.strip import Axis, Strip, cut_strip
from tsvision.measures.edges.dim import dim_edges, sunk_edges
from tsvision.measures.edges.falloff import falloff_along
from tsvision.measures.edges.strands import Silhouette, outline
from tsvision.measures.edges.tones import even_out

GROUND_FROM = 1.35  # widths from the axis
LOST = 0.5  # of the core's contrast in other frames, below which it is the ground's between legs
LEAST_LIGHT = 0.02  # of full light: what the ground's is taken for at least
FULL = 0.985  # of the highest code, for coding adds to it: there the sensor is full
BURNT_COLUMNS, BURNT_ROWS = 64, np.linspace(-0.3, 0.3, 5)  # looked at; across, in widths
BURNT_OUT = 0.2  # of a bundle's core, from which on its edges are those of a burnt-out one
NEEDED_PX = 3  # beside a strip, by what interpolates it
GROUND_STEP = 8  # columns apart that tell the ground's light
BLACK_STEP = 8  # columns apart that are asked what strands without light would show


@dataclass(frozen=True)
class Cut:
    """contrast (R, M): signal minus ground over the core's contrast; light (R, M): the signal
    itself, linear; s_px (M,); half_px: n of the last row; mask_levels: contrast at which strings
    begin above and below; dim: rows (M,) of the upper and lower
    borders of strands in the bundle's own shadow, NaN where none lie beyond the lit ones; sunk: on
    which side those are limbs darker than their ground, +1 above, -1 below, 0 on neither;
    in_colour: contrast is one of hue, not of luma; sampled (R, K) or (R, K, 3): what was
    straightened, linear, in every BLACK_STEP-th column; sight: that it was straightened by;
    core_share: contrast on the axis, of the ground's light there; saturated: share of the bundle's
    core where the sensor is full; colours (R, M, 3): linear light
    of strands of several colours, else None; picture: id of what it was cut of."""

    contrast: np.ndarray
    light: np.ndarray
    s_px: np.ndarray
    half_px: int
    silhouette: Silhouette
    core_level: float
    mask_levels: tuple[float, float]
    noise: float
    saturated: float
    dim: tuple[np.ndarray, np.ndarray]
    sunk: int
    in_colour: bool
    sampled: np.ndarray
    sight: Sight
    core_share: float
    colours: np.ndarray | None = None
    picture: int = 0

    @property
    def some_dim(self) -> bool:
        """Whether strands were found in the bundle's own shadow."""
        return any(bool(np.isfinite(side).any()) for side in self.dim)

    @cached_property
    def black(self) -> float:
        """The contrast of a strand without light, where that is known: asked for while a
        recording's looks are learnt."""
        n = np.arange(-self.half_px, self.half_px + 1)
        return _black(self.sampled, self.contrast[:, ::BLACK_STEP], n, self.sight)

    def strand_and_ground(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Linear colours (3,), blue, green, red, of the strands and of the ground beside them; None
        where they are not known."""
        if self.sampled.ndim == 2:
            return None
        n = np.arange(-self.half_px, self.half_px + 1)
        contrast = self.contrast[:, ::BLACK_STEP]
        strings, ground = _strings_and_ground(self.sampled, contrast, n, self.sight.width_px)
        return (np.median(strings, axis=0), ground) if strings.size else None


def cut_frame(pixels: np.ndarray, sight: Sight, strand_px: float, half_px: int) -> Cut | None:
    """Straighten one picture and outline its strings; None when there is no contrast."""
    low, high = sight.start_px - 2.0, sight.end_px + 2.0
    strip = strip_of(pixels, sight, (low, high), half_px)
    inner = GROUND_FROM * sight.width_px
    contrast = raw_contrast(strip.values, sight.signal, inner)
    light = project(strip.values, np.abs(sight.signal.weights))
    n = np.arange(-half_px, half_px + 1)
    core = nan_median(contrast[np.abs(n) <= max(0.2 * sight.width_px, 1.0)])
    columns = core[~np.isnan(core)] * sight.sense
    if columns.size == 0:
        return None
    # With few turns the axis lies between the legs most of the way: trust the brighter columns.
    level = sight.sense * percentile(columns, 80.0)
    beside = np.flatnonzero(np.abs(n) > inner)[::6]
    ground_noise = noise_of(contrast, beside)
    if np.isnan(ground_noise):
        return None  # no ground in view beside an axis this wide
    lit = light[beside, ::GROUND_STEP]
    ground_light = max(median(lit[np.isfinite(lit)]), LEAST_LIGHT)
    share = level / ground_light
    # With hardly any not even those are the bundle's, which shows what it did in other frames.
    if abs(share) < LOST * abs(sight.core_share):
        level = sight.core_share * ground_light
    if not np.isfinite(level) or abs(level) < max(1e-4, STANDS_OUT * ground_noise):
        return None
    _scale(contrast, level * falloff_along(core / level, sight.width_px))
    mask, shade = max(mask_level(contrast, inner), sight.shadow_level), sight.shade
    if sight.faint_tone < 1.0:
        contrast = even_out(contrast, sight.width_px, strand_px, sight.faint_tone)
        mask, shade = MASK_LEVEL, NO_SHADE
    shown = quiet(contrast, abs(ground_noise / level), sight.width_px)
    silhouette = outline(shown, sight.width_px, strand_px, 0, mask, shade)
    # What is told by its colour, or by being darker, does not vanish where no light falls.
    none = np.full(contrast.shape[1], np.nan)
    dim, sunk = (none, none), 0
    if sight.some_dim and sight.sense > 0 and not sight.signal.by_distance:
        if sight.sunk != 0 and not sight.signal.in_colour:
            dim = sunk_edges(contrast, silhouette, sight.width_px, strand_px, sight.sunk)
            found = int(np.isfinite(dim[0]).any()) - int(np.isfinite(dim[1]).any())
            sunk = sight.sunk or found
        if not sunk:
            dim = dim_edges(contrast, silhouette, sight.width_px, strand_px)
    return Cut(
        contrast,
        light,
        strip.s_px,
        half_px,
        silhouette,
        level,
        shade.levels(mask),
        abs(ground_noise / level),
        _saturated(pixels, sight, strip.s_px[silhouette.bundle]),
        dim,
        sunk,
        sight.signal.in_colour,
        strip.values[:, ::BLACK_STEP].copy(),
        sight,
        share,
        strip.values if sight.signal.by_distance and strip.values.ndim == 3 else None,
        id(pixels),
    )


def _saturated(pixels: np.ndarray, sight: Sight, s_px: np.ndarray) -> float:
    """Share of what lies about the axis at s_px (K,) where the sensor is full, in a channel or
    all."""
    s = s_px[:: max(1, s_px.size // BURNT_COLUMNS)]
    centre, along = sight.axis.at(s), sight.axis.tangent(s)
    off = sight.width_px * BURNT_ROWS
    whole = pixels.reshape(*pixels.shape[:2], -1)
    return float(_full_share(whole, centre, along, off, FULL * np.iinfo(pixels.dtype).max))


@numba.njit(cache=True)
def _full_share(pixels, centre, along, off, full):  # pragma: no cover - compiled
    """Share of what lies off (K,) px beside points (M, 2) of direction `along` (M, 2), and is in
    view, that reaches `full` in any channel."""
    height, width, channels = pixels.shape
    seen = reached = 0
    for m in range(centre.shape[0]):
        for away in off:
            x = int(np.rint(centre[m, 0] - away * along[m, 1]))
            y = int(np.rint(centre[m, 1] + away * along[m, 0]))
            if 0 <= x < width and 0 <= y < height:
                seen += 1
                for c in range(channels):
                    if pixels[y, x, c] >= full:
                        reached += 1
                        break
    return reached / max(seen, 1)


def _black(values: np.ndarray, contrast: np.ndarray, n: np.ndarray, sight: Sight) -> float:
    """The contrast of a strand without light, from the strip's values (R, M) or (R, M, 3) on the
    axis and beside it: below 0 where the ground beside bright strands is lit; NaN where no strands
    lie on the axis. What is told by a hue or by being darker does not fall below its ground."""
    strings, ground = _strings_and_ground(values, contrast, n, sight.width_px)
    if not strings.size:
        return float("nan")
    black = black_contrast(strings, ground, sight.signal)
    return max(black, 0.0) if sight.signal.in_colour or sight.sense < 0 else black


def _strings_and_ground(
    values: np.ndarray, contrast: np.ndarray, n: np.ndarray, width_px: float
) -> tuple[np.ndarray, np.ndarray]:
    """Linear colours (K, C) of what stands out on the axis, and the ground's (C,) beside it, from
    the strip's values (R, M) or (R, M, C)."""
    channels = 1 if values.ndim == 2 else values.shape[2]
    middle = np.abs(n) <= max(0.2 * width_px, 1.0)
    beside = np.flatnonzero(np.abs(n) > GROUND_FROM * width_px)[::6]
    strings = values[middle][contrast[middle] > 0.5].reshape(-1, channels)
    return strings, np.nanmedian(values[beside].reshape(-1, channels), axis=0)


@numba.njit(cache=True, error_model="numpy")
def _scale(contrast: np.ndarray, level: np.ndarray) -> None:  # pragma: no cover - compiled
    """Contrast (R, M) in units of a level (M,), 0 where it is not known, in place."""
    for r in range(contrast.shape[0]):
        for c in range(contrast.shape[1]):
            value = contrast[r, c] / level[c]
            contrast[r, c] = 0.0 if np.isnan(value) else value


def strip_of(
    pixels: np.ndarray, sight: Sight, s_range_px: tuple[float, float], half_px: int
) -> Strip:
    """The strip in linear light, of only the part of the picture that it touches: of the signal
    alone, (R, M), where that is a sum of light, for one channel is straightened in a third of the
    time; and of 8-bit codes as they are, which become light on the way."""
    axis, signal = sight.axis, sight.signal
    first, last = s_range_px
    s = np.linspace(first - NEEDED_PX, last + NEEDED_PX, 2 if axis.is_straight else 64)
    centre, t = axis.at(s), axis.tangent(s)
    normal = np.stack([-t[:, 1], t[:, 0]], 1)
    reach = half_px + NEEDED_PX
    corners = np.concatenate([centre - reach * normal, centre + reach * normal])
    x0, y0 = np.maximum(np.floor(corners.min(0)).astype(int), 0)
    x1, y1 = np.ceil(corners.max(0)).astype(int) + 1
    part = pixels[y0:y1, x0:x1]
    if part.size == 0:
        part, x0, y0 = pixels, 0, 0
    moved = Axis(axis.points_px - np.array([x0, y0], dtype=float), axis.arc_px)
    summed = not signal.by_distance and np.all(signal.weights >= 0.0)
    codes = grey_codes(part, signal.weights) if summed else None
    if codes is not None:
        return cut_strip(codes, moved, s_range_px, half_px, light_of_codes(sight.gamma))
    if summed:
        linear = linear_signal(part, signal.weights, sight.gamma)
    else:
        linear = to_linear(np.ascontiguousarray(part), sight.gamma)
    return cut_strip(linear, moved, s_range_px, half_px)
