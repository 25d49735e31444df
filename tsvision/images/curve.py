"""The bundle's axis as a curve, for cords that hang or bow.

The strings are mapped (by colour where they are coloured, else by lightness), the map's piece on
the straight axis is followed from end to end along its middle, and a spline is laid through the
middles with knots several widths apart, so that it follows the bow and not the strands. An axis
counts as curved only when it leaves its own chord by more than half a width on a scale far above
that of coiling; a taut bundle keeps its straight axis to the bit.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tsvision.images.axis import find_ridges
from tsvision.images.candidates import line_of_ridge
from tsvision.images.colour import Ground, learn_ground
from tsvision.images.contrast import GROUND_FROM, straight_contrast
from tsvision.images.cord import SHORTEST_WIDTHS, cord_contrast, cord_map, core_mask, follow
from tsvision.images.linear import to_linear
from tsvision.images.masks import mask_level, quiet_strip, string_mask
from tsvision.images.runs import leg_columns, single_columns
from tsvision.images.shrink import shrunk
from tsvision.images.sight import SEARCH_PX, Sight
from tsvision.images.signal import LUMA
from tsvision.images.spline import KNOT_WIDTHS, arc_of, smooth, spline_axis
from tsvision.images.strip import Axis, cut_strip, straight_axis

FOLLOW_PX = 480  # long side of the picture in which the cord is followed
BOW_WIDTHS = 8.0  # between the axis' knots when it is asked whether it bows
ALONG = 0.5  # of the length that a cord lies on the straight axis: the least that is followed
BOWED = 0.5  # widths off the chord from which an axis counts as curved
SURELY_STRAIGHT = 0.3  # widths in the small picture below which no closer look is needed
CLOSED = 0.2  # widths between strands that are closed in masks along the straight axis
LEGS_WIDTHS = 2.0  # length of legs that makes a bundle a taut one


@dataclass(frozen=True)
class Curve:
    """A cord followed from end to end.

    axis in arc length; the cord runs from start_px to end_px of it. bow_px: farthest from the
    chord. ground: of coloured strings, else None. alike: the straight axis found the same cord.
    legs: strings run to a separator's holes, or plies part, at one end. sight: the straight axis
    that it was followed from.
    """

    axis: Axis
    width_px: float
    start_px: float
    end_px: float
    bow_px: float
    ground: Ground | None
    alike: bool
    legs: bool
    sight: Sight

    @property
    def bowed(self) -> bool:
        return self.bow_px > BOWED * self.width_px


def find_curve(
    pictures: list[np.ndarray],
    sight: Sight,
    roi_px: tuple[int, int, int, int] | None = None,
    closely: bool = False,
) -> Curve | None:
    """Follow the cord that `sight` found straight, in pictures of one size (uint8/uint16, grey or
    BGR); None where it cannot be followed over a few widths. A cord that is surely straight is
    looked at in small pictures only, unless its ends are wanted (`closely`).

    A line laid across a strong bow may miss the cord; then the ridges that it was chosen from are
    followed one by one.
    """
    # Strands of several colours, once told from the ground, are no shadow and no grain of wood.
    seen = _straight_px(pictures, sight, roi_px) if sight.signal.by_distance else 0.0
    found = _find_on(pictures, sight, roi_px, closely, seen)
    if found is not None:
        return found
    if seen > ALONG * (sight.end_px - sight.start_px):
        return None  # the line lies on a long straight cord: nothing was missed
    shape = pictures[0].shape[:2]
    others = [
        replace(
            sight,
            axis=line_of_ridge(ridge, shape, roi_px),
            width_px=ridge.width_px,
            sense=ridge.sense,
            signal=LUMA,
        )
        for ridge in find_ridges(pictures[:1], roi_px)
        if ridge.channel == 0
    ]
    tried = [_find_on(pictures, other, roi_px, closely) for other in others]
    # Only a cord that bows right across the view explains that the straight search missed it.
    across = 0.6 * max(roi_px[2:] if roi_px else shape)
    bowed = [c for c in tried if c and c.bowed and not c.legs and c.end_px - c.start_px > across]
    return max(bowed, key=lambda c: c.end_px - c.start_px, default=None)


def _find_on(
    pictures: list[np.ndarray],
    sight: Sight,
    roi_px: tuple[int, int, int, int] | None,
    closely: bool,
    least_px: float = 0.0,
) -> Curve | None:
    """The cord followed from one straight axis; None if shorter than most of `least_px`."""
    shape = pictures[0].shape[:2]
    x0, y0, w, h = roi_px if roi_px else (0, 0, shape[1], shape[0])
    parts = [p[y0 : y0 + h, x0 : x0 + w] for p in pictures]
    factor = min(1.0, FOLLOW_PX / max(parts[0].shape[:2]))
    linears = [to_linear(shrunk(p, factor), sight.gamma) for p in parts]
    bundle = _bundle_range(parts, sight, (x0, y0))
    line = _in_part(sight.axis, x0, y0, factor)
    coloured = learn_ground(linears[0])
    # Strands of several colours show in no one weighted sum of channels.
    grounds = [coloured] if coloured is None or sight.signal.by_distance else [coloured, None]
    for ground in grounds:
        maps = [cord_map(p, line, sight, factor, ground) for p in linears]
        path = follow(np.median(maps, axis=0), line, ground is not None)
        if path is None:
            continue
        points, width = path[0] / factor, path[1] / factor
        if float(arc_of(points)[-1]) < ALONG * least_px:
            continue  # a piece of something, where the straight line sees more
        points += 0.5 / factor - 0.5 + np.array([x0, y0])
        axis = spline_axis(points, width)
        rough = Curve(
            axis, width, 0.0, axis.length_px, _bow(axis, axis.arc_px, width, sight, bundle), ground,
            _alike(axis, sight, 0.5 * axis.length_px, width),
            bool(np.isfinite(bundle).any()),
            sight,
        )  # fmt: skip
        if not closely and rough.alike and rough.bow_px < SURELY_STRAIGHT * width:
            return rough
        full = [to_linear(p, sight.gamma) for p in pictures]
        found = _laid_through_runs(axis, width, full, sight, ground, (x0, y0, w, h), bundle)
        if found is not None and found.end_px - found.start_px > ALONG * least_px:
            return found
    return None


def _straight_px(
    pictures: list[np.ndarray], sight: Sight, roi_px: tuple[int, int, int, int] | None
) -> float:
    """Over what length a cord of its width lies on the straight axis, px of the picture."""
    x0, y0, w, h = roi_px if roi_px else (0, 0, *pictures[0].shape[1::-1])
    parts = [p[y0 : y0 + h, x0 : x0 + w] for p in pictures]
    line, contrasts = _straight_strips(parts, sight, (x0, y0), (sight.start_px, sight.end_px))
    lengths = []
    for contrast in contrasts:
        level = max(mask_level(contrast, GROUND_FROM * line.width_px), sight.shadow_level)
        mask = string_mask(contrast, CLOSED * line.width_px, level, sight.shade)
        lengths.append(single_columns(mask, line.half_px, line.width_px).sum())
    return float(np.median(lengths)) / line.factor


@dataclass(frozen=True)
class _Line:
    """The straight axis in small pictures: the strings' width there, rows to either side of a
    strip, and px of these pictures for one of the full ones."""

    width_px: float
    half_px: int
    factor: float


def _straight_strips(
    parts: list[np.ndarray], sight: Sight, corner: tuple[int, int], range_px: tuple[float, float]
) -> tuple[_Line, list[np.ndarray]]:
    """Contrast (R, M) along a range of the straight axis in small pictures of some parts, whose
    first px lies at `corner` (x, y) of the full ones."""
    factor = min(1.0, SEARCH_PX / max(parts[0].shape[:2]))
    ends = sight.axis.at(np.array(range_px)) - np.array(corner)
    ends = (ends + 0.5) * factor - 0.5
    axis, width = straight_axis(ends[0], ends[1]), sight.width_px * factor
    half = int(np.ceil(4.0 * width)) + 6
    contrasts = []
    for part in parts:
        linear = to_linear(shrunk(part, factor), sight.gamma)
        strip = cut_strip(linear, axis, (0.0, axis.length_px), half)
        contrasts.append(quiet_strip(straight_contrast(strip, sight.signal, width), width))
    return _Line(width, half, factor), contrasts


def _bundle_range(
    parts: list[np.ndarray], sight: Sight, corner: tuple[int, int]
) -> tuple[float, float]:
    """s of the straight axis between which no legs run.

    Legs are two thin lines symmetrical about the axis, over two widths or more in most pictures:
    strings on their way to the separator's holes, or plies that part at an end. A cord followed
    into one of them leaves the axis without being bowed.
    """
    line, contrasts = _straight_strips(parts, sight, corner, (0.0, sight.axis.length_px))
    width = line.width_px
    seen = []
    for contrast in contrasts:
        mask = string_mask(contrast, CLOSED * width, mask_level(contrast, GROUND_FROM * width))
        seen.append(leg_columns(mask, line.half_px, width))
    legs = np.mean(seen, axis=0) > 0.5
    first, last = _stretch(legs, int(width))
    if last - first < LEGS_WIDTHS * width:
        return -np.inf, np.inf
    before, after = first, legs.size - last
    margin = 0.5 * width
    if after > before:
        return (last + margin) / line.factor, np.inf
    return -np.inf, (first - margin) / line.factor


def _in_part(axis: Axis, x0: float, y0: float, factor: float) -> np.ndarray:
    """Points (K, 2) of the straight axis in the small picture, one px apart."""
    s = np.arange(0.0, axis.length_px, 1.0 / factor)
    return (axis.at(s) - np.array([x0, y0]) + 0.5) * factor - 0.5


@dataclass(frozen=True)
class _Runs:
    """Middles and widths (M,) of the run on the axis in each column, NaN for none; core: whether
    the column's core belongs to the cord."""

    s: np.ndarray
    middle: np.ndarray
    width: np.ndarray
    core: np.ndarray


def _runs(
    axis: Axis, width: float, full: list[np.ndarray], sight: Sight, ground: Ground | None, box
) -> _Runs:
    half = int(np.ceil(2.0 * width)) + 4
    reach = 2.0 * width
    strips = [cut_strip(p, axis, (-reach, axis.length_px + reach), half) for p in full]
    maps = [cord_contrast(s.values, sight.signal.weights, ground, width) for s in strips]
    contrast = maps[0] if len(maps) == 1 else _median_of(maps)
    s = strips[0].s_px
    n = np.arange(-half, half + 1)
    mask = core_mask(np.nan_to_num(contrast), width, ground is not None)
    place = axis.at(s)
    x0, y0, w, h = box
    inside = (place[:, 0] >= x0 - 0.5) & (place[:, 0] <= x0 + w - 0.5)
    inside &= (place[:, 1] >= y0 - 0.5) & (place[:, 1] <= y0 + h - 0.5)
    core = (mask[np.abs(n) <= max(0.2 * width, 1.0)] > 0).mean(axis=0) > 0.3
    low = _walk(mask, half, -1)
    high = _walk(mask, half, 1)
    known = core & inside & (low > -half) & (high < half)
    gone = np.isnan(contrast)
    cut = gone[np.clip(low.astype(int) + half - 1, 0, 2 * half), np.arange(s.size)]
    cut |= gone[np.clip(high.astype(int) + half + 1, 0, 2 * half), np.arange(s.size)]
    known &= ~cut  # the picture's border is no edge
    size = np.where(known, high - low + 1.0, np.nan)
    return _Runs(s, np.where(known, 0.5 * (low + high), np.nan), size, core & inside)


def _walk(mask: np.ndarray, half: int, step: int) -> np.ndarray:
    """Row (n) of the last px of the run that starts at the core, going up or down, (M,)."""
    rows = mask[half:] if step > 0 else mask[half::-1]
    start = np.argmax(rows > 0, axis=0)  # the core px nearest to the axis
    shifted = np.arange(rows.shape[0])[:, None] < start[None, :]
    ended = (rows == 0) & ~shifted
    length = np.where(ended.any(axis=0), np.argmax(ended, axis=0), rows.shape[0])
    return step * (length - 1.0)


def _laid_through_runs(
    axis: Axis,
    width: float,
    full: list[np.ndarray],
    sight: Sight,
    ground: Ground | None,
    box: tuple[int, int, int, int],
    bundle: tuple[float, float],
) -> Curve | None:
    """Lay the axis through the runs' middles at full size, twice, and find both ends."""
    for _ in range(3):
        runs = _runs(axis, width, full, sight, ground, box)
        good = np.isfinite(runs.width) & (np.abs(runs.middle) < 0.6 * width)
        good &= (runs.width > 0.4 * width) & (runs.width < 1.6 * width)
        if good.sum() < SHORTEST_WIDTHS * width:
            return None
        width = float(np.median(runs.width[good]))
        first, last = _stretch(runs.core, int(1.2 * width))
        s = runs.s[good]
        middle = smooth(s, runs.middle[good], np.ones(s.size), KNOT_WIDTHS * width)
        grid = np.arange(runs.s[first], runs.s[last] + 1e-9, 2.0)
        if grid.size < 8:
            return None
        # Beyond the last middle seen the line goes on straight: cubics run away.
        held = np.clip(grid, s[0], s[-1])
        offset = middle(held) + (grid - held) * middle.derivative()(held)
        t = axis.tangent(grid)
        points = axis.at(grid) + offset[:, None] * np.stack([-t[:, 1], t[:, 0]], axis=1)
        axis = Axis(points, arc_of(points))
    runs = _runs(axis, width, full, sight, ground, box)
    first, last = _stretch(runs.core, int(1.2 * width))
    start, end = float(runs.s[first]), float(runs.s[last])
    good = np.isfinite(runs.width) & (runs.width > 0.4 * width) & (runs.width < 1.6 * width)
    good &= (runs.s >= start) & (runs.s <= end)
    if end - start < SHORTEST_WIDTHS * width or good.sum() < SHORTEST_WIDTHS * width:
        return None
    single = _single(runs, good, width)
    bow = _bow(axis, runs.s[single], width, sight, bundle)
    alike = _alike(axis, sight, 0.5 * (start + end), width)
    legs = bool(np.isfinite(bundle).any())
    return Curve(axis, width, start, end, bow, ground, alike, legs, sight)


def _median_of(maps: list[np.ndarray]) -> np.ndarray:
    """Median of some maps (R, M) place by place, over those that know it; NaN where none does."""
    ordered = np.sort(np.stack(maps), axis=0)  # NaN last
    known = np.isfinite(ordered).sum(axis=0)
    low, high = np.maximum(known - 1, 0) // 2, known // 2
    high = np.minimum(high, np.maximum(known - 1, 0))
    pick = [np.take_along_axis(ordered, i[None], axis=0)[0] for i in (low, high)]
    return 0.5 * (pick[0] + pick[1])


def _stretch(core: np.ndarray, gap: int) -> tuple[int, int]:
    """First and last column of the longest stretch of core, gaps up to `gap` bridged."""
    at = np.flatnonzero(core)
    if at.size == 0:
        return 0, 0
    breaks = np.flatnonzero(np.diff(at) > gap)
    firsts = np.concatenate([[0], breaks + 1])
    lasts = np.concatenate([breaks, [at.size - 1]])
    best = int(np.argmax(at[lasts] - at[firsts]))
    return int(at[firsts[best]]), int(at[lasts[best]])


def _single(runs: _Runs, good: np.ndarray, width: float) -> np.ndarray:
    """Columns (bool) of the cord proper: of about its width, legs and hardware left out."""
    typical = np.median(runs.width[good])
    proper = good & (runs.width > 0.55 * typical) & (runs.width < 1.5 * typical)
    first, last = _stretch(proper, int(1.2 * width))
    proper[:first] = False
    proper[last + 1 :] = False
    return proper


def _bow(
    axis: Axis, s: np.ndarray, width: float, sight: Sight, bundle: tuple[float, float]
) -> float:
    """How far the axis leaves its chord over s, on a scale far above coiling's, px; only where the
    straight axis' s lies within `bundle`."""
    u = sight.axis.tangent(np.array(0.0))
    along = (axis.at(s) - sight.axis.at(np.array(0.0))) @ u
    s = s[(along >= bundle[0]) & (along <= bundle[1])]
    if s.size < SHORTEST_WIDTHS * width:
        return 0.0
    points = axis.at(s)
    points = points - points.mean(axis=0)
    u = np.linalg.svd(points, full_matrices=False)[2][0]
    along, off = points @ u, points @ np.array([-u[1], u[0]])
    order = np.argsort(along)
    along, off = along[order], off[order]
    keep = np.concatenate([[True], np.diff(along) > 1e-9])
    slow = smooth(along[keep], off[keep], np.ones(int(keep.sum())), BOW_WIDTHS * width)(along)
    return float(np.ptp(slow) / 2.0)


def _alike(axis: Axis, sight: Sight, middle: float, width: float) -> bool:
    """Whether the straight axis lies on this cord at its middle and found about its width."""
    apart = axis.at(np.array(middle)) - sight.axis.at(np.array(0.0))
    u = sight.axis.tangent(np.array(0.0))
    off = abs(float(apart @ np.array([-u[1], u[0]])))
    return off < 0.5 * width and 0.5 < sight.width_px / width < 1.6
