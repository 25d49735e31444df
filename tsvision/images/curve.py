"""The bundle's axis as a curve, for cords that hang or bow.

The strings are mapped (by colour where they are coloured, else by lightness), the map's piece on
the straight axis is followed from end to end along its middle, and a spline is laid through the
middles with knots several widths apart, so that it follows the bow and not the strands. An axis
counts as curved only when it leaves its own chord by more than half a width on a scale far above
that of coiling; a taut bundle keeps its straight axis to the bit.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from scipy.interpolate import LSQUnivariateSpline
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from tsvision.images.axis import find_ridges
from tsvision.images.candidates import line_of_ridge
from tsvision.images.colour import Ground, colour_contrast, learn_ground
from tsvision.images.contrast import straight_contrast
from tsvision.images.ground import above_ground
from tsvision.images.linear import LUMA_BGR, project, to_linear
from tsvision.images.masks import leg_columns, mask_level, single_columns, string_mask
from tsvision.images.sight import SEARCH_PX, Sight
from tsvision.images.strip import Axis, cut_strip, straight_axis

FOLLOW_PX = 480  # long side of the picture in which the cord is followed
LEVEL = 0.35  # share of the core's contrast at which strings begin
KNOT_WIDTHS = 4.0  # the axis' knots lie so many widths apart
BOW_WIDTHS = 8.0  # and these when it is asked whether the axis bows
ALONG = 0.5  # of the length that a cord lies on the straight axis: the least that is followed
BOWED = 0.5  # widths off the chord from which an axis counts as curved
SURELY_STRAIGHT = 0.3  # widths in the small picture below which no closer look is needed
SHORTEST_WIDTHS = 4.0
FIBRE = 0.35  # of the width: what is thinner is no strand of the core
LEGS_WIDTHS = 2.0  # length of legs that makes a bundle a taut one
EDGE = 0.5  # share of the core's contrast at which the cord ends at full size, fuzz left out


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
    seen = _straight_px(pictures, sight, roi_px) if sight.by_distance else 0.0
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
            weights=LUMA_BGR,
            by_distance=False,
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
    linears = [to_linear(_small(p, factor), sight.gamma) for p in parts]
    bundle = _bundle_range(parts, sight, (x0, y0))
    line = _in_part(sight.axis, x0, y0, factor)
    coloured = learn_ground(linears[0])
    # Strands of several colours show in no one weighted sum of channels.
    grounds = [coloured] if coloured is None or sight.by_distance else [coloured, None]
    for ground in grounds:
        maps = [_cord_map(p, line, sight, factor, ground) for p in linears]
        path = _follow(np.median(maps, axis=0), line, ground is not None)
        if path is None:
            continue
        points, width = path[0] / factor, path[1] / factor
        if float(_arc(points)[-1]) < ALONG * least_px:
            continue  # a piece of something, where the straight line sees more
        points += 0.5 / factor - 0.5 + np.array([x0, y0])
        axis = _spline_axis(points, width)
        rough = Curve(
            axis, width, 0.0, axis.length_px, _bow(axis, axis.arc_px, width, sight, bundle), ground,
            _alike(axis, sight, 0.5 * axis.length_px, width),
            bool(np.isfinite(bundle).any()),
            sight,
        )  # fmt: skip
        if not closely and rough.alike and rough.bow_px < SURELY_STRAIGHT * width:
            return rough
        full = [to_linear(p, sight.gamma) for p in pictures]
        found = _settle(axis, width, full, sight, ground, (x0, y0, w, h), bundle)
        if found is not None and found.end_px - found.start_px > ALONG * least_px:
            return found
    return None


def _straight_px(
    pictures: list[np.ndarray], sight: Sight, roi_px: tuple[int, int, int, int] | None
) -> float:
    """Over what length a cord of its width lies on the straight axis, px of the picture."""
    x0, y0, w, h = roi_px if roi_px else (0, 0, *pictures[0].shape[1::-1])
    factor = min(1.0, SEARCH_PX / max(w, h))
    ends = sight.axis.at(np.array([sight.start_px, sight.end_px])) - np.array([x0, y0])
    ends = (ends + 0.5) * factor - 0.5
    axis, width = straight_axis(ends[0], ends[1]), sight.width_px * factor
    half = int(np.ceil(4.0 * width)) + 6
    lengths = []
    for picture in pictures:
        linear = to_linear(_small(picture[y0 : y0 + h, x0 : x0 + w], factor), sight.gamma)
        strip = cut_strip(linear, axis, (0.0, axis.length_px), half)
        contrast = straight_contrast(strip, sight.weights, width, sight.by_distance)
        level = max(mask_level(contrast, 1.3 * width), sight.shadow_level)
        lengths.append(single_columns(string_mask(contrast, 0.2 * width, level), half, width).sum())
    return float(np.median(lengths)) / factor


def _bundle_range(
    parts: list[np.ndarray], sight: Sight, corner: tuple[int, int]
) -> tuple[float, float]:
    """s of the straight axis between which no legs run.

    Legs are two thin lines symmetrical about the axis, over two widths or more in most pictures:
    strings on their way to the separator's holes, or plies that part at an end. A cord followed
    into one of them leaves the axis without being bowed.
    """
    factor = min(1.0, SEARCH_PX / max(parts[0].shape[:2]))
    ends = sight.axis.at(np.array([0.0, sight.axis.length_px])) - np.array(corner)
    ends = (ends + 0.5) * factor - 0.5
    axis, width = straight_axis(ends[0], ends[1]), sight.width_px * factor
    half = int(np.ceil(4.0 * width)) + 6
    seen = []
    for part in parts:
        linear = to_linear(_small(part, factor), sight.gamma)
        strip = cut_strip(linear, axis, (0.0, axis.length_px), half)
        contrast = straight_contrast(strip, sight.weights, width, sight.by_distance)
        mask = string_mask(contrast, 0.2 * width, mask_level(contrast, 1.3 * width))
        seen.append(leg_columns(mask, half, width))
    legs = np.mean(seen, axis=0) > 0.5
    first, last = _stretch(legs, int(width))
    if last - first < LEGS_WIDTHS * width:
        return -np.inf, np.inf
    before, after = first, legs.size - last
    margin = 0.5 * width
    if after > before:
        return (last + margin) / factor, np.inf
    return -np.inf, (first - margin) / factor


def cord_contrast(
    values: np.ndarray, weights: np.ndarray, ground: Ground | None, width_px: float
) -> np.ndarray:
    """Contrast (R, M) of a strip's linear light (R, M) or (R, M, 3), core about 1."""
    if ground is not None:
        return colour_contrast(values, ground)
    signal = project(values, weights)
    contrast = above_ground(signal, 0.9 * width_px)
    half = values.shape[0] // 2
    core = contrast[np.abs(np.arange(-half, half + 1)) <= max(0.2 * width_px, 1.0)]
    level = float(np.nanmedian(core)) if np.isfinite(core).any() else 1.0
    return contrast / (level if abs(level) > 1e-6 else 1e-6)


def core_mask(contrast: np.ndarray, width_px: float, coloured: bool) -> np.ndarray:
    """Where the cord's core lies in a strip's contrast: uint8 0/1, same shape.

    Fibres thinner than a third of the width, and meshes of them, are opened away before the
    valleys between strands are closed: closing first would fill the meshes. Plies of two colours
    are unlike the ground by unlike amounts, so that colour counts from a lower level on.
    """
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (max(int(FIBRE * width_px), 1) | 1,) * 2)
    mask = (contrast > (LEVEL if coloured else EDGE)).astype(np.uint8)
    opened = cv2.morphologyEx(mask, cv2.MORPH_OPEN, disc)
    return cv2.morphologyEx(opened, cv2.MORPH_CLOSE, disc)


def _small(part: np.ndarray, factor: float) -> np.ndarray:
    if factor >= 1.0:
        return part
    return cv2.resize(part, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)


def _in_part(axis: Axis, x0: float, y0: float, factor: float) -> np.ndarray:
    """Points (K, 2) of the straight axis in the small picture, one px apart."""
    s = np.arange(0.0, axis.length_px, 1.0 / factor)
    return (axis.at(s) - np.array([x0, y0]) + 0.5) * factor - 0.5


def _cord_map(
    linear: np.ndarray, line: np.ndarray, sight: Sight, factor: float, ground: Ground | None
) -> np.ndarray:
    """How much each px of a small picture looks like the cord, core about 1."""
    if ground is not None:
        return colour_contrast(linear, ground).astype(np.float32)
    signal = cv2.GaussianBlur(sight.sense * project(linear, sight.weights), (0, 0), 0.8)
    size = int(2.0 * sight.width_px * factor) | 1
    stands_out = cv2.morphologyEx(signal, cv2.MORPH_TOPHAT, np.ones((size, size), np.uint8))
    h, w = signal.shape
    at = np.round(line).astype(int)
    at = at[(at[:, 0] >= 0) & (at[:, 0] < w) & (at[:, 1] >= 0) & (at[:, 1] < h)]
    # The line may lie on a bowed cord for a fifth of its way only.
    along = np.percentile(stands_out[at[:, 1], at[:, 0]], [80.0, 95.0]) if len(at) else (0.0, 0.0)
    level = float(max(along[0], 0.8 * along[1]))
    return stands_out / max(level, 1e-6)


def _follow(cord: np.ndarray, line: np.ndarray, anywhere: bool) -> tuple[np.ndarray, float] | None:
    """Points (K, 2) along the middle of the map's best piece from end to end, and its width.

    anywhere: the piece need not lie on the line (coloured strings, whose shadow may have been
    taken for them)."""
    over = (cord > LEVEL).astype(np.uint8)
    mask: np.ndarray = cv2.morphologyEx(over, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    piece = _piece(mask, line, anywhere)
    if piece is None:
        return None
    depth = _depth(piece)
    width = 2.0 * float(np.percentile(depth[piece > 0], 90.0))
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (max(int(0.45 * width), 1) | 1,) * 2)
    piece = _piece(
        cv2.morphologyEx(_bordered(piece), cv2.MORPH_OPEN, kernel)[8:-8, 8:-8], line, anywhere
    )
    if piece is None:
        return None
    depth = _depth(piece)
    ys, xs = np.nonzero(piece)
    path = _longest_path(xs, ys, depth[ys, xs], piece.shape)
    width = 2.0 * float(np.median(depth[ys[path], xs[path]]))
    if len(path) < SHORTEST_WIDTHS * width:
        return None
    return np.stack([xs[path], ys[path]], axis=1).astype(float), width


def _bordered(piece: np.ndarray) -> np.ndarray:
    """The piece carried on beyond the picture's border, where it is cut and does not end."""
    return cv2.copyMakeBorder(piece, 8, 8, 8, 8, cv2.BORDER_REPLICATE)


def _depth(piece: np.ndarray) -> np.ndarray:
    """Distance of every px to the piece's edge; the picture's border is no edge."""
    return cv2.distanceTransform(_bordered(piece), cv2.DIST_L2, 5)[8:-8, 8:-8]


def _piece(mask: np.ndarray, line: np.ndarray, anywhere: bool) -> np.ndarray | None:
    """The connected piece, holes filled, that lies most along the line; None without any."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    if count < 2:
        return None
    near = np.zeros(mask.shape, np.uint8)
    cv2.polylines(near, [np.round(line).astype(np.int32)], False, 1, 3)
    on_line = np.bincount(labels[near > 0], minlength=count).astype(float)
    long = np.hypot(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT])
    score = on_line + 0.5 * long * ((on_line > 0) | anywhere)
    score[0] = 0.0
    best = int(np.argmax(score))
    if score[best] <= 0:
        return None
    piece = (labels == best).astype(np.uint8)
    outlines = cv2.findContours(piece, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
    return cv2.drawContours(np.zeros_like(piece), outlines, -1, 1, cv2.FILLED)


def _longest_path(
    xs: np.ndarray, ys: np.ndarray, depth: np.ndarray, shape: tuple[int, ...]
) -> np.ndarray:
    """Indices of the px along the cheapest way between the two ends farthest apart, where px near
    the edge cost more (a geodesic along the middle)."""
    number = np.full(shape, -1)
    number[ys, xs] = np.arange(xs.size)
    middle = float(np.percentile(depth, 90.0))
    cost = (middle / np.maximum(depth, 0.5)) ** 2
    rows, columns, costs = [], [], []
    for dx, dy in ((1, 0), (0, 1), (1, 1), (1, -1)):
        x, y = xs + dx, ys + dy
        inside = (x < shape[1]) & (y >= 0) & (y < shape[0])
        a = np.flatnonzero(inside)
        b = number[y[a], x[a]]
        a, b = a[b >= 0], b[b >= 0]
        rows.append(a)
        columns.append(b)
        costs.append(np.hypot(dx, dy) * 0.5 * (cost[a] + cost[b]))
    a, b, c = (np.concatenate(v) for v in (rows, columns, costs))
    graph = coo_matrix((c, (a, b)), shape=(xs.size, xs.size)).tocsr()
    far = dijkstra(graph, directed=False, indices=int(np.argmax(depth)))
    one = int(np.argmax(np.where(np.isfinite(far), far, -1.0)))
    far, before = dijkstra(graph, directed=False, indices=one, return_predecessors=True)
    at = int(np.argmax(np.where(np.isfinite(far), far, -1.0)))
    path = []
    while at >= 0:
        path.append(at)
        at = int(before[at])
    return np.array(path)


def _arc(points: np.ndarray) -> np.ndarray:
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def smooth(s: np.ndarray, y: np.ndarray, weight: np.ndarray, spacing: float) -> LSQUnivariateSpline:
    """Cubic spline through y(s) with knots at least `spacing` apart, outliers weighted down."""
    pieces = max(int((s[-1] - s[0]) / spacing), 1)
    knots = np.linspace(s[0], s[-1], pieces + 1)[1:-1]
    held = np.diff(np.searchsorted(s, np.concatenate([[s[0]], knots, [s[-1] + 1.0]]))) > 5
    knots = knots[held[:-1] & held[1:]]  # a gap without points cannot hold a piece of its own
    w = weight.copy()
    spline = LSQUnivariateSpline(s, y, knots, w=w, k=3)
    for _ in range(6):
        r = y - spline(s)
        scale = 2.0 * 1.4826 * float(np.median(np.abs(r))) + 1e-3
        w = weight / (1.0 + (r / scale) ** 2) + 1e-6
        spline = LSQUnivariateSpline(s, y, knots, w=w, k=3)
    return spline


def _spline_axis(points: np.ndarray, width: float) -> Axis:
    """Axis in arc length through noisy points (K, 2), left to right or top to bottom."""
    arc = _arc(points)
    grid = np.linspace(0.0, arc[-1], max(int(arc[-1] / 2.0), 8))
    one = np.ones(arc.size)
    spacing = KNOT_WIDTHS * width
    even = np.stack([smooth(arc, points[:, i], one, spacing)(grid) for i in (0, 1)], axis=1)
    across = even[-1] - even[0]
    if across[0] < 0 if abs(across[0]) > 0.5 * np.linalg.norm(across) else across[1] < 0:
        even = even[::-1]
    return Axis(np.ascontiguousarray(even), _arc(even))


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
    maps = [cord_contrast(s.values, sight.weights, ground, width) for s in strips]
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


def _settle(
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
        axis = Axis(points, _arc(points))
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
