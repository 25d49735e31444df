"""One frame cut along the recording's axis: contrast, rough outline, and sub-pixel edges."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numba
import numpy as np

from tsvision.images.contrast import black_contrast, raw_contrast
from tsvision.images.ground import nan_median
from tsvision.images.linear import linear_signal, project, to_linear
from tsvision.images.masks import MASK_LEVEL, mask_level
from tsvision.images.percentiles import median, percentile
from tsvision.images.sight import Sight
from tsvision.images.strip import Axis, cut_strip
from tsvision.measures.dim import dim_edges
from tsvision.measures.edges import match_edges, rows_per_px
from tsvision.measures.falloff import falloff_along
from tsvision.measures.helix import Edges
from tsvision.measures.line import slope_of
from tsvision.measures.shading import (
    EdgeProfile,
    Shading,
    edge_samples,
    inside_at,
    inside_px,
    mean_profile,
    undivided,
)
from tsvision.measures.shading_fit import fit_shading
from tsvision.measures.steep import match_steep
from tsvision.measures.strands import Silhouette, outline
from tsvision.measures.tones import even_out

GROUND_FROM = 1.35  # widths from the axis
LEAST_RISE = 0.3  # of the core's contrast, from the ground to within a strand
FOUND_BACK_PX = 1.5  # from how far off a match comes to the edge, ...
SEARCHED_PX = 2.5  # ... and how far it may go
SLOPE_SD_PX = 1.5  # over which the slope of a rough edge is told
STEPS_APART = 3  # columns: of the neighbours whose differences tell the noise
LOST = 0.5  # of the core's contrast in other frames, below which it is the ground's between legs
LEAST_LIGHT = 0.02  # of full light: what the ground's is taken for at least
FULL = 0.985  # of the highest code, for coding adds to it: there the sensor is full
BURNT_COLUMNS, BURNT_ROWS = 64, np.linspace(-0.3, 0.3, 5)  # looked at; across, in widths
BURNT_OUT = 0.2  # of a bundle's core, from which on its edges are those of a burnt-out one
GROUND_STEP = 8  # columns apart that tell the ground's light
BLACK_STEP = 8  # columns apart that are asked what strands without light would show
# Of the typical depth: what matches with less is a fibre. Told of fainter ones is up to 0.15 more
# than there is, for their step is held near the template's; but columns of a dark limb that hardly
# anything of the lamp reaches show no more than 0.4, and without them coils look full of knots.
LEAST_DEPTH, MOST_DEPTH = 0.33, 3.0


@dataclass(frozen=True)
class Cut:
    """contrast (R, M): signal minus ground over the core's contrast; light (R, M): the signal
    itself, linear; s_px (M,); half_px: n of the last row; dim: rows (M,) of the upper and lower
    borders of strands in the bundle's own shadow, NaN where none lie beyond the lit ones;
    in_colour: contrast is one of hue, not of luma; sampled (R, K) or (R, K, 3): what was
    straightened, linear, in every BLACK_STEP-th column; sight: that it was straightened by;
    core_share: contrast on the axis, of the ground's light there; saturated: share of the bundle's
    core where the sensor is full; colours (R, M, 3): linear light
    of strands of several colours, else None."""

    contrast: np.ndarray
    light: np.ndarray
    s_px: np.ndarray
    half_px: int
    silhouette: Silhouette
    core_level: float
    mask_level: float
    noise: float
    saturated: float
    dim: tuple[np.ndarray, np.ndarray]
    in_colour: bool
    sampled: np.ndarray
    sight: Sight
    core_share: float
    colours: np.ndarray | None = None

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


def cut_frame(pixels: np.ndarray, sight: Sight, strand_px: float, half_px: int) -> Cut | None:
    """Straighten one picture and outline its strings; None when there is no contrast."""
    low, high = sight.start_px - 2.0, sight.end_px + 2.0
    linear, axis = crop(pixels, sight, low, high, half_px)
    strip = cut_strip(linear, axis, (low, high), half_px)
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
    steps = _steps(contrast, beside)
    if steps.size == 0:
        return None  # no ground in view beside an axis this wide
    lit = light[beside, ::GROUND_STEP]
    ground_light = max(median(lit[np.isfinite(lit)]), LEAST_LIGHT)
    share = level / ground_light
    # With hardly any not even those are the bundle's, which shows what it did in other frames.
    if abs(share) < LOST * abs(sight.core_share):
        level = sight.core_share * ground_light
    ground_noise = 1.4826 * median(steps) / 1.41
    if not np.isfinite(level) or abs(level) < max(1e-4, 1.5 * ground_noise):
        return None
    _scale(contrast, level * falloff_along(core / level, sight.width_px))
    mask = max(mask_level(contrast, inner), sight.shadow_level)
    if sight.faint_tone < 1.0:
        contrast = even_out(contrast, sight.width_px, strand_px, sight.faint_tone)
        mask = MASK_LEVEL
    silhouette = outline(contrast, sight.width_px, strand_px, 0, mask)
    # What is told by its colour, or by being darker, does not vanish where no light falls.
    none = np.full(contrast.shape[1], np.nan)
    dim = (none, none)
    if sight.some_dim and sight.sense > 0 and not sight.signal.by_distance:
        dim = dim_edges(contrast, silhouette, sight.width_px, strand_px)
    return Cut(
        contrast,
        light,
        strip.s_px,
        half_px,
        silhouette,
        level,
        mask,
        abs(ground_noise / level),
        _saturated(pixels, sight, strip.s_px[silhouette.bundle]),
        dim,
        sight.signal.in_colour,
        strip.values[:, ::BLACK_STEP].copy(),
        sight,
        share,
        strip.values if sight.signal.by_distance and strip.values.ndim == 3 else None,
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


@numba.njit(cache=True)
def _steps(contrast, rows):  # pragma: no cover - compiled
    """By how much (K,) some neighbours differ along some rows of a contrast (R, M), where both are
    known."""
    columns = contrast.shape[1]
    out = np.empty(rows.size * columns, contrast.dtype)
    count = 0
    for r in rows:
        row = contrast[r]
        for c in range(0, columns - 1, STEPS_APART):
            out[count] = abs(row[c + 1] - row[c])
            count += np.isfinite(out[count])
    return out[:count]


def _black(values: np.ndarray, contrast: np.ndarray, n: np.ndarray, sight: Sight) -> float:
    """The contrast of a strand without light, from the strip's values (R, M) or (R, M, 3) on the
    axis and beside it: below 0 where the ground beside bright strands is lit; NaN where no strands
    lie on the axis. What is told by a hue or by being darker does not fall below its ground."""
    channels = 1 if values.ndim == 2 else 3
    middle = np.abs(n) <= max(0.2 * sight.width_px, 1.0)
    beside = np.flatnonzero(np.abs(n) > GROUND_FROM * sight.width_px)[::6]
    strings = values[middle][contrast[middle] > 0.5].reshape(-1, channels)
    if not strings.size:
        return float("nan")
    ground = np.nanmedian(values[beside].reshape(-1, channels), axis=0)
    black = black_contrast(strings, ground, sight.signal)
    return max(black, 0.0) if sight.signal.in_colour or sight.sense < 0 else black


@numba.njit(cache=True, error_model="numpy")
def _scale(contrast: np.ndarray, level: np.ndarray) -> None:  # pragma: no cover - compiled
    """Contrast (R, M) in units of a level (M,), 0 where it is not known, in place."""
    for r in range(contrast.shape[0]):
        for c in range(contrast.shape[1]):
            value = contrast[r, c] / level[c]
            contrast[r, c] = 0.0 if np.isnan(value) else value


def crop(
    pixels: np.ndarray, sight: Sight, low: float, high: float, half: int
) -> tuple[np.ndarray, Axis]:
    """Linear light of only the part of the picture that the strip touches; the signal alone,
    (H, W), where that is a sum of light: one channel is straightened in a third of the time."""
    axis = sight.axis
    s = np.linspace(low, high, 2 if axis.is_straight else 64)
    centre, t = axis.at(s), axis.tangent(s)
    normal = np.stack([-t[:, 1], t[:, 0]], 1)
    corners = np.concatenate([centre - (half + 3) * normal, centre + (half + 3) * normal])
    x0, y0 = np.maximum(np.floor(corners.min(0)).astype(int), 0)
    x1, y1 = np.ceil(corners.max(0)).astype(int) + 1
    part = pixels[y0:y1, x0:x1]
    if part.size == 0:
        part, x0, y0 = pixels, 0, 0
    moved = Axis(axis.points_px - np.array([x0, y0], dtype=float), axis.arc_px)
    signal = sight.signal
    if not signal.by_distance and np.all(signal.weights >= 0.0):
        return linear_signal(part, signal.weights, sight.gamma), moved
    return to_linear(np.ascontiguousarray(part), sight.gamma), moved


def rough_edges(cut: Cut) -> tuple[np.ndarray, np.ndarray]:
    """Rows of the outermost borders, upper and lower, (M,) each: of dim strands where there are."""
    both = zip(cut.dim, lit_edges(cut), strict=True)
    upper, lower = (np.where(np.isfinite(dim), dim, lit) for dim, lit in both)
    return upper, lower


def lit_edges(cut: Cut) -> tuple[np.ndarray, np.ndarray]:
    """Rows where the contrast falls through the mask level, upper and lower, (M,) each."""
    seen, level = cut.silhouette, np.float32(cut.mask_level)
    upper = _fallen(cut.contrast, seen.high + cut.half_px, 1, level)
    lower = _fallen(cut.contrast, seen.low + cut.half_px, -1, level)
    return upper, lower


@numba.njit(cache=True)
def _fallen(contrast, limit, step, level):  # pragma: no cover - compiled
    """Rows (M,) between the outermost row of the strings (M,) and the next, a `step` further, where
    the contrast falls to a level; NaN where there are none."""
    rows, columns = contrast.shape
    out = np.full(columns, np.nan)
    for c in range(columns):
        if np.isnan(limit[c]):
            continue
        row = min(max(int(limit[c]), 1), rows - 2)
        inside, outside = abs(contrast[row, c]), abs(contrast[row + step, c])
        part = (inside - level) / max(inside - outside, np.float32(1e-3))
        out[c] = row + step * min(max(part, np.float32(0.0)), np.float32(1.0))
    return out


def edge_profiles(
    cuts: list[Cut],
    rho_px: float,
    known: list[tuple[np.ndarray, np.ndarray]] | None = None,
) -> tuple[EdgeProfile, EdgeProfile] | None:
    """Mean edge profile of the upper and lower side over all cuts; None when too little is seen.

    known: rows of the upper and lower edge (M,) for each cut, NaN where unknown; the rough edges
    without it. Only edges that run nearly along the axis count: others are smeared across columns.
    """
    profiles = []
    for side, outward in ((0, 1), (1, -1)):
        samples = []
        for i, cut in enumerate(cuts):
            edge = rough_edges(cut)[side] if known is None else known[i][side]
            slope = slope_of(edge, np.isfinite(edge), SLOPE_SD_PX)
            flat = np.isfinite(edge) & (np.abs(slope) < 0.25) & ~cut.silhouette.cut
            flat &= ~np.isfinite(cut.dim[side])
            if flat.sum() < 10:
                continue
            samples.append(
                edge_samples(
                    cut.contrast[:, flat], edge[flat], slope[flat], outward, inside_px(rho_px)
                )
            )
        if not samples:
            return None
        profile = mean_profile(*(np.concatenate(v) for v in zip(*samples, strict=True)))
        if profile is None:
            return None
        profiles.append(profile)
    return profiles[0], profiles[1]


def learn_shading(cuts: list[Cut], rho_px: float) -> tuple[Shading, Shading] | None:
    """Upper and lower side's shading over some frames; None when too little edge is seen."""
    profiles = edge_profiles(cuts, rho_px)
    if profiles is None:
        return None
    upper, lower, _ = fit_shading(profiles, rho_px, black_of(cuts))
    return upper, lower


def black_of(cuts: list[Cut]) -> float:
    """The contrast of a strand without light, the typical one of the cuts that show one; 0 where
    none does, as before a black ground."""
    known = [cut.black for cut in cuts if np.isfinite(cut.black)]
    return float(np.median(known)) if known else 0.0


def find_edges(cut: Cut, shading: tuple[Shading, Shading]) -> Edges:
    """Sub-pixel edges of every column of the bundle, weighted by how well the model matched."""
    found = []
    shades = _rising(shading)
    if cut.in_colour:  # a hue fades at a limb for other reasons than that no lamp reaches it
        shades = undivided(shades[0]), undivided(shades[1])
    for rough, dim, outward, shade in zip(lit_edges(cut), cut.dim, (1, -1), shades, strict=True):
        # Under a wide blur the rough edge lies further out than a match finds back from, before a
        # limb without light further in. Not all the way: what lies between two strands is found
        # from outside.
        reached = inside_at(shade, cut.mask_level)
        back = float(np.sign(reached)) * max(abs(reached) - FOUND_BACK_PX, 0.0)
        edge, weight = _matched(cut, rough, rough + outward * back, outward, shade)
        if reached > shade.rho_px:  # a dark limb, or a level that this side hardly has
            here, well = _matched(cut, rough, rough, outward, shade)
            edge, weight = (here, well) if well.sum() > weight.sum() else (edge, weight)
        is_dim = np.isfinite(dim)
        if is_dim.any():
            # Where no edge matches near a dim border, what does further in is where light ends.
            further, well = _matched(cut, dim, dim, outward, shade)
            edge, weight = np.where(is_dim, further, edge), np.where(is_dim, well, weight)
        found.append((np.where(weight > 0, edge - cut.half_px, 0.0), weight))
    (upper, upper_weight), (lower, lower_weight) = found
    # Colour is coded in blocks: what smears it along the axis is not what a mean edge shows of it.
    blur_px = 0.0 if cut.in_colour else shading[0].blur_px
    light = cut.light if cut.in_colour or cut.sight.faint_tone < 1.0 else cut.contrast
    return Edges(cut.s_px, upper, lower, upper_weight, lower_weight, blur_px=blur_px, light=light)


def _rising(shading: tuple[Shading, Shading]) -> tuple[Shading, Shading]:
    """The shading of either side, the other side's where one was not learnt: where a shadow touches
    the strings all along, what was fitted to that side may not even rise."""
    upper, lower = shading
    rises = [side.template.max(initial=0.0) > LEAST_RISE for side in shading]
    return (
        upper if rises[0] or not rises[1] else lower,
        lower if rises[1] or not rises[0] else upper,
    )


def _matched(
    cut: Cut, rough: np.ndarray, start: np.ndarray, outward: int, shade: Shading
) -> tuple[np.ndarray, np.ndarray]:
    """Rows of the edges matched about rough ones, and their weights, 0 where none was."""
    slope = slope_of(rough, np.isfinite(rough), SLOPE_SD_PX)
    edge, depth, residual = match_edges(cut.contrast, start, outward, shade, slope, SEARCHED_PX)
    typical = median(depth[np.isfinite(depth)])
    steep = match_steep(cut.contrast, rough, slope, outward, shade, SEARCHED_PX)
    if steep is not None:
        both = zip((edge, depth, residual), steep.matched, strict=True)
        edge, depth, residual = (np.where(steep.columns, new, old) for old, new in both)
    weight = _quality(depth, residual, typical)
    if shade.beyond_px:
        edge = edge + outward * shade.beyond_px * rows_per_px(slope)
    return edge, weight


@numba.njit(cache=True)
def _quality(depth, residual, typical):  # pragma: no cover - compiled
    """Weights (M,) of matches by what their profile left unexplained; 0 where there was none, or
    one of another depth than most."""
    out = np.zeros(depth.size)
    for m in range(depth.size):
        if LEAST_DEPTH * typical < depth[m] < MOST_DEPTH * typical:
            quality = 1.0 / (1.0 + (residual[m] / (0.12 * depth[m])) ** 2)
            out[m] = 0.0 if np.isnan(quality) else quality
    return out
