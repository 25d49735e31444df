"""What stands still in a recording, found once: axis, separator's side, connector, the signal.

The camera does not move, the strands do. A few frames spread over the recording vote; every later
frame is cut along the same axis and only its strands are measured anew.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass, replace

import cv2
import numba
import numpy as np

from tsvision.images.axis import Ridge, find_ridges
from tsvision.images.ground import ground_level, nan_median
from tsvision.images.linear import LUMA_BGR, best_weights, project, to_linear
from tsvision.images.motion import motion_picture, moving_share
from tsvision.images.shadow import DARKENS, DEEPEST, NO_SHADOW, Shadow, find_shadow
from tsvision.images.strip import Axis, Strip, cut_strip, straight_axis

OTHER_HUE = 4.0  # spreads of the ground's hue from which strings are of another
SEVERAL_HUES = 0.45  # spread of the colour's direction from which strands are of several colours
PARALLEL = 0.1  # sine of the angle between strings and their shadow on a ground beneath
CAST_D, CAST_SHARE = 4.0, 0.4  # widths beside them; what speaks for them over what for the shadow
APART = 1.5  # spreads between strings and ground from which nothing speaks against a line
SWINGS = 0.06  # share of a bundle's outline that changes between frames, at least
ACROSS = 0.4  # of the ground's light: how far strings stand out across its colour, to rely on it
MOVING_SHARE = 0.4  # of the axis' length that moves, from which nothing speaks against it
DEEPEST_CHROMA = 0.25  # contrast to which blocks of compressed colour reach beside strands
FEWEST_PX = 24  # on a picture's or region's short side
ROUGH = 0.6  # of the strongest contrast: a core that the axis may lie beside
SEARCH_PX = 640  # long side of the pictures in which candidate axes are weighed
MASK_LEVEL = 0.35  # highest share of the core's contrast at which strings begin


@dataclass(frozen=True)
class Sight:
    """How to look at every frame of one recording.

    axis: s = 0 where the strings' side of the picture begins (refined to the separator's face by
    the measures), growing towards the motor connector. weights (3,): channel weights of the
    signal. sense: +1 strings brighter than the ground. width_px: rough outer width of the bundle.
    by_distance: the signal is the distance from the ground's colour, not a weighted sum.
    shadow_level: contrast below which cast shadows could be taken for strings (0: nowhere).
    start_px, end_px: s between which strings may lie. connector_px: s of the connector's face,
    NaN when out of view. legs_seen: whether the separator's side was decided by the legs.
    """

    axis: Axis
    weights: np.ndarray
    sense: int
    width_px: float
    start_px: float
    end_px: float
    connector_px: float
    legs_seen: bool
    separation: float
    gamma: float
    by_distance: bool = False
    shadow_level: float = 0.0

    def reversed(self) -> Sight:
        """The same sight seen from the other end: s runs back, n changes its sign."""
        length = self.axis.length_px
        return replace(
            self,
            axis=self.axis.reversed(),
            start_px=length - self.end_px,
            end_px=length - self.start_px,
            connector_px=float("nan"),
        )


def mask_level(contrast: np.ndarray, inner_px: float) -> float:
    """Contrast at which strings begin: low enough for the shadow side of a front-lit strand, which
    may keep a tenth of the core's contrast, and above what the ground itself varies by."""
    half = contrast.shape[0] // 2
    ground = contrast[np.abs(np.arange(-half, half + 1)) > inner_px][::2, ::3]
    ground = ground[np.isfinite(ground)]
    if ground.size == 0:
        return MASK_LEVEL
    spread = 1.4826 * float(np.median(np.abs(ground - np.median(ground))))
    return float(np.clip(5.0 * spread, 0.09, MASK_LEVEL))


def string_mask(contrast: np.ndarray, thin_px: float, level: float) -> np.ndarray:
    """Where strings lie in a contrast strip (core about 1): uint8 0/1, same shape.

    Valleys between strands are closed, fibres thinner than `thin_px` opened away. The shadow side
    of a strand can be darker than the ground (the negative part); a shadow on the ground is soft
    and must be twice as strong to count.
    """
    known = np.nan_to_num(contrast)
    raw = ((known > level) | (known < -2.0 * level)).astype(np.uint8)
    k = max(1, round(thin_px)) | 1
    kernel = np.ones((k, k), np.uint8)  # a square is separable, hence fast
    return cv2.morphologyEx(cv2.morphologyEx(raw, cv2.MORPH_CLOSE, kernel), cv2.MORPH_OPEN, kernel)


def find_sight(
    pictures: list[np.ndarray],
    roi_px: tuple[int, int, int, int] | None = None,
    widths_px: tuple[float, float] | None = None,
    gamma: float = float("nan"),
    side: str = "auto",
    along_px: tuple[tuple[float, float], ...] = (),
) -> Sight | None:
    """Look at some frames of one recording (same size) and find what stands still.

    pictures: uint8/uint16, grey or BGR. widths_px: smallest and largest bundle width that the rig
    makes possible. side: left | right | top | bottom | auto. along_px: two points on the axis, the
    separator's first, as a person gave them; the line is then only refined, not sought. None when
    no bundle is in view.
    """
    if min(*pictures[0].shape[:2], *(roi_px[2:] if roi_px else ())) < FEWEST_PX:
        return None
    # Not the ends: a film that winds and unwinds begins and ends with hardly a turn, legs alone.
    few = [pictures[i] for i in sorted({len(pictures) * k // 4 for k in (1, 2, 3)})]
    ridges = find_ridges(few, roi_px, widths_px)
    motion = motion_picture(pictures)
    if motion is not None:
        ridges += _moving_ridges(motion, pictures[0].shape[:2], roi_px, widths_px)
    if along_px:
        ridges = [_given_ridge(along_px, ridges)]
    if not ridges:
        return None
    shape = pictures[0].shape[:2]
    # Candidates are weighed on small pictures: only the winner is followed at full size.
    factor = min(1.0, SEARCH_PX / max(shape))
    small = [to_linear(_shrunk(p, factor), gamma) for p in few]
    trials = [
        _settle(small, _scaled(_axis_of(r, shape, roi_px), factor), r.width_px * factor)
        for r in [*ridges, *_bisectors(ridges, shape)]
    ]

    def merit(trial: _Trial) -> float:
        support = trial.support * _plausible(trial.width_px / factor, widths_px)
        if motion is not None:
            # Near its middle: beside a cable that lies by the strings something moves as well.
            across, size = 0.5 * trial.width_px, round(factor * max(shape))
            share = moving_share(trial.axis, across, motion, size)
            support *= float(np.clip(share / MOVING_SHARE, 0.02, 1.0))
        return support

    alone = [merit(t) for t in trials]
    merits = []
    for trial, own in zip(trials, alone, strict=True):
        rivals = [m for t, m in zip(trials, alone, strict=True) if _could_cast(trial, t)]
        merits.append(0.0 if max(rivals, default=0.0) > CAST_SHARE * own else own)
    best = trials[int(np.argmax(merits))]
    linears = [to_linear(p, gamma) for p in pictures]
    found = _settle(linears, _scaled(best.axis, 1.0 / factor), best.width_px / factor, turns=1)
    axis, width = found.axis, found.width_px
    half = int(np.ceil(4.0 * width)) + 6
    strips = [cut_strip(p, axis, (0.0, axis.length_px), half) for p in linears]
    weights, separation, by_distance = _signal(strips, 0.5 * width)
    core = np.nanmedian([np.nanmedian(_raw_core(s, weights, width)) for s in strips])
    sense = 1 if core >= 0 or by_distance else -1
    masks, shadow = _masks(strips, weights, width, by_distance, False)
    near, far = _leg_columns(masks, half, width)
    legs = near != far
    flip = far > near if side == "auto" else _needs_flip(axis, side)
    if along_px:
        flip = bool(np.subtract(along_px[1], along_px[0]) @ axis.tangent(np.array(0.0)) < 0)
    if flip:
        axis = axis.reversed()
        masks = [m[::-1, ::-1] for m in masks]
    start, end, connector = _extent(masks, half, width)
    return Sight(
        axis=axis,
        weights=np.asarray(weights),
        sense=sense,
        width_px=width,
        start_px=start,
        end_px=end,
        connector_px=connector,
        legs_seen=bool(legs),
        separation=separation,
        gamma=gamma,
        by_distance=by_distance,
        shadow_level=shadow.level,
    )


def _moving_ridges(
    motion: np.ndarray,
    shape: tuple[int, int],
    roi_px: tuple[int, int, int, int] | None,
    widths_px: tuple[float, float] | None,
) -> list[Ridge]:
    """Lines along which a film moves, as ridges of its pictures."""
    big = cv2.resize(motion, (shape[1], shape[0]), interpolation=cv2.INTER_LINEAR)
    return [r for r in find_ridges([big], roi_px, widths_px, most=3) if r.sense > 0]


def _given_ridge(along_px: tuple[tuple[float, float], ...], found: list[Ridge]) -> Ridge:
    """The line through two given points, as wide as the found ridge that lies nearest to it."""
    (x0, y0), (x1, y1) = along_px
    length = float(np.hypot(x1 - x0, y1 - y0))
    u = np.array([x1 - x0, y1 - y0]) / length

    def away(ridge: Ridge) -> float:
        d = np.array(ridge.centre_px) - (x0, y0)
        turn = abs(np.sin(ridge.angle_rad - np.arctan2(u[1], u[0])))
        return float(abs(u[0] * d[1] - u[1] * d[0]) + 0.5 * length * turn)

    near = min(found, key=away, default=None)
    wide = near.width_px if near is not None and away(near) < 0.1 * length else 0.02 * length
    centre = (0.5 * (x0 + x1), 0.5 * (y0 + y1))
    return Ridge(centre, float(np.arctan2(u[1], u[0])), wide, 1, 0, 0.0)


def _shrunk(picture: np.ndarray, factor: float) -> np.ndarray:
    if factor >= 1.0:
        return picture
    return cv2.resize(picture, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)


def _scaled(axis: Axis, factor: float) -> Axis:
    """The axis in a picture resized by `factor` (pixel centres at integers)."""
    points = (axis.points_px + 0.5) * factor - 0.5
    return straight_axis(points[0], points[1])


def _bisectors(ridges: list[Ridge], shape: tuple[int, int]) -> list[Ridge]:
    """Lines halfway between two crossing ridges: with few turns the legs outshine the bundle, and
    the bundle goes on where they meet, between them."""
    lines = []
    for i, a in enumerate(ridges):
        for b in ridges[:i]:
            ua = np.array([np.cos(a.angle_rad), np.sin(a.angle_rad)])
            ub = np.array([np.cos(b.angle_rad), np.sin(b.angle_rad)])
            if ua @ ub < 0:
                ub = -ub
            opening = float(np.arccos(np.clip(ua @ ub, -1.0, 1.0)))
            alike = 0.5 < a.width_px / b.width_px < 2.0 and a.channel == b.channel
            if not alike or opening < np.deg2rad(8.0):
                continue
            t, _ = np.linalg.solve(
                np.stack([ua, -ub], 1), np.array(b.centre_px) - np.array(a.centre_px)
            )
            meet = np.array(a.centre_px) + t * ua
            if not (0 <= meet[0] < shape[1] and 0 <= meet[1] < shape[0]):
                continue
            middle = ua + ub
            angle = float(np.arctan2(middle[1], middle[0]))
            width = 0.5 * (a.width_px + b.width_px)
            lines.append(
                Ridge((float(meet[0]), float(meet[1])), angle, width, a.sense, a.channel, 0.0)
            )
    return lines[:3]


@dataclass(frozen=True)
class _Trial:
    """A candidate axis, its width, how many columns speak for it, and whether it is nothing but
    darker than the ground, as shadows are."""

    axis: Axis
    width_px: float
    support: float
    darker: bool


def _settle(linears: list[np.ndarray], axis: Axis, width: float, turns: int = 3) -> _Trial:
    """Refine a candidate axis on some frames and say how much speaks for it.

    What speaks for a bundle: columns with one run of its width on the axis, and beyond them
    columns with a leg on either side. A leg taken for the axis has neither behind the apex. A
    shadow's borders are soft, and what hardly differs from the ground is no bundle.
    """
    support = 0.0
    for turn in range(turns):
        half = int(np.ceil(3.2 * width)) + 6
        strips = [cut_strip(p, axis, (0.0, axis.length_px), half) for p in linears]
        weights, separation, by_distance = _signal(strips, 0.5 * width)
        rough = turn < turns - 1 and len(linears) > 1
        masks, shadow = _masks(strips, weights, width, by_distance, rough)
        if turn == turns - 1:
            support = sum(_support(m, half, width) for m in masks) / len(masks)
            support *= _liveliness(masks, half, width) * (1.0 - shadow.soft)
            support *= float(np.nan_to_num(np.clip(separation / APART, 0.05, 1.0), nan=1.0))
            core = np.median([np.nanmedian(_raw_core(s, weights, width)) for s in strips])
            darker = not by_distance and np.array_equal(weights, LUMA_BGR) and core < 0
        axis, width = _refine(axis, masks, half, width)
    return _Trial(axis, width, support, bool(darker))


def _could_cast(trial: _Trial, other: _Trial) -> bool:
    """Whether what is darker than the ground may be the shadow of something beside it that is not:
    a shadow coils and knots as its strings do, and may stand out by more than they."""
    if not trial.darker or other.darker or not 0.5 < trial.width_px / other.width_px < 2.0:
        return False
    middle = other.axis.at(np.array([0.5 * other.axis.length_px]))[0]
    half = np.array([0.5 * trial.axis.length_px])
    along = trial.axis.tangent(half)[0]
    away = middle - trial.axis.at(half)[0]
    aside = abs(float(along[0] * away[1] - along[1] * away[0]))
    there = other.axis.tangent(np.array([0.0]))[0]
    turned = abs(float(along[0] * there[1] - along[1] * there[0]))
    return turned < PARALLEL and 0.8 * trial.width_px < aside < CAST_D * trial.width_px


def _liveliness(masks: list[np.ndarray], half: int, width: float) -> float:
    """From about 0 for an outline that stands still between frames to 1 for one that swings as
    twisting strings do: a plate's edge or a rod is as long and even as a bundle, but still."""
    if len(masks) < 2:
        return 1.0
    reach = max(int(width), 2)
    stack = np.stack([m[max(half - reach, 0) : half + reach + 1] > 0 for m in masks])
    area = max(float(stack.mean(axis=0).sum()), 1.0)
    changed = float((stack.any(axis=0) & ~stack.all(axis=0)).sum()) / area
    return float(np.clip(changed / SWINGS, 0.05, 1.0))


def _plausible(width: float, possible: tuple[float, float] | None) -> float:
    """1 for a width that the rig's strings can have, less for one they cannot (d is rarely known
    to better than a third)."""
    if possible is None:
        return 1.0
    low, high = 0.6 * possible[0], 1.4 * possible[1]
    return 1.0 if low <= width <= high else 0.1


def single_columns(mask: np.ndarray, half: int, width: float) -> np.ndarray:
    """Columns (M,) bool with one run of about the bundle's width on the axis."""
    low, high = _scan(mask, half, 0.25 * width)[:2]
    size, centre = high - low + 1, 0.5 * (low + high)
    with np.errstate(invalid="ignore"):
        return (np.abs(centre) < 0.3 * width) & (size > 0.35 * width) & (size < 1.7 * width)


def _support(mask: np.ndarray, half: int, width: float) -> float:
    single = single_columns(mask, half, width)
    legs = _legs(mask, half, width)
    middle = np.median(np.flatnonzero(single)) if single.any() else 0.0
    s = np.arange(mask.shape[1])
    one_end = max(legs[s < middle].sum(), legs[s >= middle].sum())
    return float(single.sum() + 2.0 * one_end)


def _axis_of(ridge: Ridge, shape: tuple[int, int], roi) -> Axis:
    """The ridge's line across the picture (or the region), from left to right or top to bottom."""
    x0, y0, w, h = roi if roi else (0, 0, shape[1], shape[0])
    u = np.array([np.cos(ridge.angle_rad), np.sin(ridge.angle_rad)])
    if u[0] < -1e-9 or (abs(u[0]) <= 0.5 and u[1] < 0):
        u = -u
    return _clip_line(np.array(ridge.centre_px), u, (x0, y0, x0 + w - 1, y0 + h - 1))


def _clip_line(point: np.ndarray, u: np.ndarray, box: tuple[float, float, float, float]) -> Axis:
    low, high = -np.inf, np.inf
    for i, (a, b) in enumerate(((box[0], box[2]), (box[1], box[3]))):
        if abs(u[i]) < 1e-12:
            continue
        t = sorted(((a - point[i]) / u[i], (b - point[i]) / u[i]))
        low, high = max(low, t[0]), min(high, t[1])
    return straight_axis(point + low * u, point + high * u)


def _signal(strips: list[Strip], half_core: float) -> tuple[np.ndarray, float, bool]:
    """Channel weights, separation in sd, and whether strings differ from the ground in ways that
    no one weighted sum shows (strands of several colours): then distance in colour serves."""
    if strips[0].values.ndim == 2:
        return LUMA_BGR, float("nan"), False
    core, ground = [], []
    for strip in strips:
        n = np.arange(-strip.half_px, strip.half_px + 1)
        inner = strip.values[np.abs(n) < max(0.5 * half_core, 1.0)].reshape(-1, 3)
        outer = strip.values[np.abs(n) > 3.0 * half_core].reshape(-1, 3)
        core.append(inner[:: max(1, len(inner) // 1500)])
        ground.append(outer[:: max(1, len(outer) // 1500)])
    inner, outer = np.concatenate(core), np.concatenate(ground)
    inner, outer = inner[~np.isnan(inner).any(1)], outer[~np.isnan(outer).any(1)]
    if min(len(inner), len(outer)) < 10:
        return LUMA_BGR, float("nan"), False  # no ground in view beside a candidate this wide
    everything = inner
    # Keep to what the strings look like most of the way: separator and connector are elsewhere.
    for _ in range(2):
        inner = inner[_near_median(inner)]
        outer = outer[_near_median(outer)]
    weights, separation = best_weights(inner, outer)
    if not _many_coloured(everything, outer):
        return weights, separation, False
    return _shadowless(everything, outer), separation, True


def _shadowless(inner: np.ndarray, outer: np.ndarray) -> np.ndarray:
    """The ground's direction in colour (3,) where strings of several colours stand out across it,
    so that light and shadow on the ground need not count; LUMA_BGR (count all) elsewhere."""
    ground = np.median(outer, axis=0)
    unit = ground / max(float(np.linalg.norm(ground)), 1e-9)
    away = inner - ground
    across = np.linalg.norm(away - (away @ unit)[:, None] * unit, axis=1)
    noise = np.median(np.linalg.norm(outer - (outer @ unit)[:, None] * unit, axis=1))
    strings = across[np.linalg.norm(away, axis=1) > 0.3 * np.linalg.norm(away, axis=1).max()]
    enough = np.percentile(strings, 25.0) > max(ACROSS * np.linalg.norm(ground), 5.0 * noise)
    return unit.astype(np.float32) if enough else LUMA_BGR


def _many_coloured(inner: np.ndarray, outer: np.ndarray) -> bool:
    """Whether the samples on the strings are of several hues: their chromaticity, which shading
    leaves alone, spreads. inner, outer: (n, 3) linear BGR on the axis and beside it."""
    ground = np.median(outer, axis=0)
    spread = 1.4826 * np.median(np.abs(outer - ground), axis=0) + 2e-3
    far = np.sqrt((((inner - ground) / spread) ** 2).mean(axis=1)) > 3.0
    if _hues(inner[far & (inner.sum(axis=1) > 0.06)], len(inner), 0.2) > SEVERAL_HUES:
        return True
    # On a ground of uneven brightness strings are told by hue alone, and then most of them.
    plain = _hue_of(outer)
    middle = np.median(plain, axis=0)
    away = np.linalg.norm(_hue_of(inner) - middle, axis=1)
    typical = 1.4826 * float(np.median(np.linalg.norm(plain - middle, axis=1))) + 2e-3
    coloured = (away > OTHER_HUE * typical) & (inner.sum(axis=1) > 0.06)
    return _hues(inner[coloured], len(inner), 0.5) > SEVERAL_HUES


def _hue_of(samples: np.ndarray) -> np.ndarray:
    return samples / np.maximum(np.linalg.norm(samples, axis=1, keepdims=True), 1e-9)


def _hues(strings: np.ndarray, of: int, least_share: float) -> float:
    """How far the hues of samples (n, 3) spread; 0 when they are too few of all."""
    if len(strings) < max(least_share * of, 4):
        return 0.0
    low, high = np.percentile(_hue_of(strings), [25.0, 75.0], axis=0)
    return float(np.linalg.norm(high - low))


def _near_median(samples: np.ndarray) -> np.ndarray:
    distance = np.linalg.norm(samples - np.median(samples, axis=0), axis=1)
    return distance <= 2.5 * np.median(distance) + 1e-9


def _raw_core(strip: Strip, weights: np.ndarray, width: float) -> np.ndarray:
    n = np.arange(-strip.half_px, strip.half_px + 1)
    contrast = raw_contrast(strip.values, weights, False, 1.3 * width)
    return nan_median(contrast[np.abs(n) < 0.2 * width])


def raw_contrast(
    values: np.ndarray, weights: np.ndarray, by_distance: bool, inner_px: float
) -> np.ndarray:
    """Signal minus ground of a strip (R, M) or (R, M, 3), linear light, (R, M).

    By distance: the length of the colour difference. A half-covered pixel lies halfway between
    ground and strand, so that the length is linear in coverage too, whatever the strand's colour.
    Where `weights` is the ground's direction in colour (not LUMA_BGR), what lies along it does not
    count: light and shadow on the ground.
    """
    if not by_distance:
        signal = project(values, weights)
        return signal - ground_level(signal, inner_px)
    squares = np.zeros(values.shape[:2], np.float32)
    along = np.zeros(values.shape[:2], np.float32)
    for c in range(3):
        channel = np.ascontiguousarray(values[..., c])
        away = channel - ground_level(channel, inner_px)
        squares += away**2
        along += away * weights[c]
    if not np.array_equal(weights, LUMA_BGR):
        squares = np.maximum(squares - along**2, 0.0)
    return np.sqrt(squares)


def _contrast(
    strip: Strip,
    weights: np.ndarray,
    width: float,
    by_distance: bool = False,
    roughly: bool = False,
) -> np.ndarray:
    """Contrast in units of the core's median contrast (core is about +1).

    roughly: the axis may lie beside the core yet; each column's strongest contrast counts.
    """
    return _scaled_contrast(strip, weights, width, by_distance, roughly)[0]


def _scaled_contrast(
    strip: Strip, weights: np.ndarray, width: float, by_distance: bool, roughly: bool
) -> tuple[np.ndarray, float]:
    """`_contrast`, and what pure black would have: how far shadows reach."""
    values = raw_contrast(strip.values, weights, by_distance, 1.3 * width)
    n = np.arange(-strip.half_px, strip.half_px + 1)
    if roughly:
        core = np.nan_to_num(values[np.abs(n) <= max(0.6 * width, 2.0)])
        strongest = np.take_along_axis(core, np.abs(core).argmax(axis=0)[None], axis=0)
        level = ROUGH * np.median(strongest)
    else:
        level = np.nanmedian(nan_median(values[np.abs(n) <= max(0.2 * width, 1.0)]))
    level = level if abs(level) > 1e-6 else 1e-6
    ground = strip.values[np.abs(n) > 1.3 * width]
    if ground.size == 0 or np.isnan(ground).all():
        return values / level, 0.0
    plain = np.nanmedian(ground.reshape(ground.shape[0] * ground.shape[1], -1), axis=0)
    black = raw_of_black(plain, weights, by_distance)
    return values / level, float(black / level)


def raw_of_black(ground: np.ndarray, weights: np.ndarray, by_distance: bool) -> float:
    """Raw contrast of a place without light on a ground of colour (1,) or (3,), linear."""
    if by_distance:
        return float(np.linalg.norm(ground)) if np.array_equal(weights, LUMA_BGR) else 0.0
    return -float(ground @ weights) if ground.size == 3 else -float(ground[0])


def _masks(
    strips: list[Strip], weights: np.ndarray, width: float, by_distance: bool, rough: bool
) -> tuple[list[np.ndarray], Shadow]:
    """Masks of the strings in some strips, and what shadow could be in them."""
    scaled = [_scaled_contrast(s, weights, width, by_distance, rough) for s in strips]
    least = [mask_level(c, 1.3 * width) for c, _ in scaled]
    # Strands of several colours stand out by several amounts: only what is soft far down may go.
    by_colour = by_distance or not np.array_equal(weights, LUMA_BGR)
    deepest = (DEEPEST_CHROMA if by_distance else DEEPEST) / (ROUGH if rough else 1.0)
    shadows = [
        find_shadow(c, 1.3 * width, low, deepest) if by_colour or black > DARKENS else NO_SHADOW
        for (c, black), low in zip(scaled, least, strict=True)
    ]
    shadow = Shadow(*(float(v) for v in np.median([astuple(s) for s in shadows], axis=0)))
    return [
        string_mask(c, 0.2 * width, max(low, shadow.level))
        for (c, _), low in zip(scaled, least, strict=True)
    ], shadow


@numba.njit(cache=True)
def _scan(mask, half, near):  # pragma: no cover - compiled
    """Runs of mask nearest to the axis: out (6, M) = central low, high, then the nearest run
    below (low, high) and above (low, high) where no run comes within `near` of n = 0."""
    rows, columns = mask.shape
    out = np.full((6, columns), np.nan)
    for c in range(columns):
        r = 0
        best = 1e9
        while r < rows:
            if mask[r, c] == 0:
                r += 1
                continue
            first = r
            while r < rows and mask[r, c] > 0:
                r += 1
            low, high = first - half, r - 1 - half
            distance = 0.0 if low <= 0 <= high else float(min(abs(low), abs(high)))
            if distance <= near and distance < best:
                best = distance
                out[0, c], out[1, c] = low, high
            if high < -near:
                out[2, c], out[3, c] = low, high
            elif low > near and np.isnan(out[4, c]):
                out[4, c], out[5, c] = low, high
        if not np.isnan(out[0, c]):
            out[2:, c] = np.nan
    return out


def _refine(axis: Axis, masks: list[np.ndarray], half: int, width: float) -> tuple[Axis, float]:
    """Robust line through the runs' middles of all frames, and the bundle's typical outer width.

    Where two legs run beside the axis their midpoint counts: it lies on the axis too.
    """
    s_all, c_all, w_all = [], [], []
    for mask in masks:
        low, high, below_low, below_high, above_low, above_high = _scan(mask, half, 0.25 * width)
        size, centre = high - low + 1, 0.5 * (low + high)
        with np.errstate(invalid="ignore"):
            ok = (size > 0.25 * width) & (size < 1.8 * width) & (np.abs(centre) < 0.5 * width)
            thin = np.maximum(below_high - below_low, above_high - above_low) < 1.2 * width
        between = 0.25 * (below_low + below_high + above_low + above_high)
        legs = np.isfinite(between) & thin
        s_all += [np.flatnonzero(ok).astype(float), np.flatnonzero(legs).astype(float)]
        c_all += [centre[ok], between[legs]]
        w_all.append(size[ok])
    s, c, w = (np.concatenate(v) for v in (s_all, c_all, w_all))
    if s.size < 20 or w.size < 5:
        return axis, width
    typical = float(np.percentile(w, 75))
    weight = np.ones_like(s)
    line = np.zeros(2)
    for _ in range(12):
        design = np.stack([s, np.ones_like(s)], 1) * weight[:, None]
        line, *_ = np.linalg.lstsq(design, c * weight, rcond=None)
        r = (c - s * line[0] - line[1]) / (0.3 * typical)
        weight = 1.0 / (1.0 + r * r)
    ends = np.array([0.0, axis.length_px])
    u = axis.tangent(np.array(0.0))
    normal = np.array([-u[1], u[0]])
    points = axis.at(ends) + (ends * line[0] + line[1])[:, None] * normal
    return straight_axis(points[0], points[1]), float(np.clip(typical, 3.0, 1.5 * width))


def _legs(mask: np.ndarray, half: int, width: float) -> np.ndarray:
    """Columns (M,) bool with a thin run on either side of the axis and a gap between."""
    _, _, below_low, below_high, above_low, above_high = _scan(mask, half, 0.1 * width)
    with np.errstate(invalid="ignore"):
        thin = np.maximum(below_high - below_low, above_high - above_low) < 1.2 * width
        alike = np.abs(below_high + above_low) < 0.35 * (above_low - below_high) + 0.3 * width
    return thin & alike


def _leg_columns(masks: list[np.ndarray], half: int, width: float) -> tuple[float, float]:
    """How many leg columns lie before and after the middle of the single-run columns."""
    inner = np.abs(np.arange(-half, half + 1)) < 0.2 * width
    near = far = 0.0
    for mask in masks:
        legs = _legs(mask, half, width)
        single = np.flatnonzero((mask[inner] > 0).mean(0) > 0.8)
        if single.size:
            s = np.arange(mask.shape[1])
            near += float(legs[s < np.median(single)].sum())
            far += float(legs[s > np.median(single)].sum())
    return near, far


def _needs_flip(axis: Axis, side: str) -> bool:
    u = axis.tangent(np.array(0.0))
    forward = {"left": u[0], "right": -u[0], "top": u[1], "bottom": -u[1]}
    return forward.get(side, 1.0) < 0.0


def _extent(masks: list[np.ndarray], half: int, width: float) -> tuple[float, float, float]:
    """(start, end, connector) along s: where strings may lie, and the connector's face if seen.

    The connector is wide, and it stands still while the strands' edges swing from frame to frame.
    """
    columns = masks[0].shape[1]
    lows, highs = zip(*(_scan(m, half, 0.25 * width)[:2] for m in masks), strict=True)
    low, high = np.array(lows), np.array(highs)
    size = high - low + 1
    with np.errstate(all="ignore"):
        import warnings

        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            typical = np.nanmedian(size, axis=0)
            swing = np.nanstd(low, axis=0) + np.nanstd(high, axis=0)
    seen = np.isfinite(size).mean(axis=0) > 0.5
    wide = seen & (typical > 1.6 * width)
    if len(masks) >= 3:
        wide &= swing < 0.12 * width
    connector = float("nan")
    end = float(columns - 1)
    # Walk inwards from the far end: the connector reaches from some column to the picture's edge.
    hold = max(int(0.3 * width), 3)
    s = columns - 1
    while s > 0 and not seen[s]:
        s -= 1
    if s > hold and wide[max(s - 3 * hold, 0) : s + 1].mean() > 0.5:
        face = s
        misses = 0
        while face > 0 and misses <= hold:
            face -= 1
            misses = 0 if wide[face] else misses + 1
        connector = float(face + misses)
        end = connector
    else:
        end = float(s)
    first = int(np.argmax(seen)) if seen.any() else 0
    return float(first), end, connector
