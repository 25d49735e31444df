"""Which pixels of a strip are strings, and what their runs say: axis, width, legs, extent."""

from __future__ import annotations

from dataclasses import astuple, dataclass

import cv2
import numba
import numpy as np

from tsvision.images.contrast import GROUND_FROM, ROUGH, scaled_contrast
from tsvision.images.percentiles import median
from tsvision.images.shadow import DARKENS, DEEPEST, NO_SHADOW, Shadow, find_shadow
from tsvision.images.signal import Signal, Way
from tsvision.images.strip import Axis, Strip, straight_axis
from tsvision.images.telling import find_hue, find_signal

DEEPEST_CHROMA = 0.25  # contrast to which blocks of compressed colour reach beside strands
DEEP_SHADOW = 0.3  # contrast to which it reaches: dim limbs of strings have no more
WITH_SHADOW = 1.1  # times as wide as by a hue, from which a bundle may be seen with its shadow
# sd from which a hue tells strings from ground, and from which it does by far.
HUE_APART, FAR_APART = 1.5, 3.0
# Of a shadow's depth, at most, that a hue may show still which does not tell strings by far: it may
# be that of one of several colours, and the shadow be the others.
SHALLOWER = 0.75
FADED = 1.5  # times as wide by a hue as by brightness, from which lit limbs are as bright as ground
WIDEST = 2.5  # times a bundle's width, beyond which a run is hardware's: it coils up to 2.2 times
MASK_LEVEL = 0.35  # highest share of the core's contrast at which strings begin


def mask_level(contrast: np.ndarray, inner_px: float) -> float:
    """Contrast at which strings begin: low enough for the shadow side of a front-lit strand, which
    may keep a tenth of the core's contrast, and above what the ground itself varies by."""
    half = contrast.shape[0] // 2
    outside = np.flatnonzero(np.abs(np.arange(-half, half + 1)) > inner_px)
    ground = contrast[outside[::3], ::4]
    ground = ground[np.isfinite(ground)]
    if ground.size == 0:
        return MASK_LEVEL
    spread = 1.4826 * median(np.abs(ground - median(ground)))
    return float(np.clip(5.0 * spread, 0.09, MASK_LEVEL))


def string_mask(contrast: np.ndarray, thin_px: float, level: float) -> np.ndarray:
    """Where strings lie in a contrast strip (core about 1): uint8 0/1, same shape.

    Valleys between strands are closed, fibres thinner than `thin_px` opened away. The shadow side
    of a strand can be darker than the ground (the negative part); a shadow on the ground is soft
    and must be twice as strong to count.
    """
    raw = _stands_out(contrast, contrast.dtype.type(level))
    k = max(1, round(thin_px)) | 1
    kernel = np.ones((k, k), np.uint8)  # a square is separable, hence fast
    return cv2.morphologyEx(cv2.morphologyEx(raw, cv2.MORPH_CLOSE, kernel), cv2.MORPH_OPEN, kernel)


@numba.njit(cache=True)
def _stands_out(contrast, level):  # pragma: no cover - compiled
    out = np.empty(contrast.shape, np.uint8)
    for r in range(contrast.shape[0]):
        for c in range(contrast.shape[1]):
            value = contrast[r, c]  # NaN is no string
            out[r, c] = (value > level) | (value < -2 * level)
    return out


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
    least = [mask_level(c, GROUND_FROM * width) for c, _ in scaled]
    # Strands of several colours stand out by several amounts: only what is soft far down may go.
    deepest = (DEEPEST_CHROMA if signal.by_distance else DEEPEST) / (ROUGH if rough else 1.0)
    shadows = [
        find_shadow(c, GROUND_FROM * width, low, deepest)
        if signal.in_colour or black > DARKENS
        else NO_SHADOW
        for (c, black), low in zip(scaled, least, strict=True)
    ]
    shadow = Shadow(*(float(v) for v in np.median([astuple(s) for s in shadows], axis=0)))
    return [
        string_mask(c, 0.2 * width, max(low, shadow.level))
        for (c, _), low in zip(scaled, least, strict=True)
    ], shadow


@dataclass(frozen=True)
class Seen:
    """What tells strings from ground in some strips: see `find_signal`; and their masks."""

    signal: Signal
    separation: float
    masks: list[np.ndarray]
    shadow: Shadow


def seen_in(strips: list[Strip], width: float, rough: bool, between: bool = False) -> Seen:
    """The strings in some strips: by what tells them from the ground, or where a deep shadow may
    be told from it as well, by a hue that it leaves as it is."""
    signal, separation = find_signal(strips, 0.5 * width, between)
    masks, shadow = masks_of(strips, signal, width, rough, between)
    seen = Seen(signal, separation, masks, shadow)
    if signal.way is Way.ACROSS or (not signal.by_distance and shadow.level <= DEEP_SHADOW):
        return seen
    hue, apart = find_hue(strips, 0.5 * width, between)
    # Of several colours a distance shows what one hue does not, unless that tells them by far.
    if signal.by_distance and apart <= (FAR_APART if shadow.none_found else HUE_APART):
        return seen
    fainter, there = masks_of(strips, hue, width, rough, between)
    faded = not signal.by_distance and _wider(fainter, masks, width) > FADED
    plain = apart > HUE_APART or faded
    # With few turns ground lies on the axis most of the way, and nothing stands out there by much:
    # then the better of both serves where it is free of deep shadow itself.
    if not (plain or apart > separation):
        return seen
    helps = there.none_found or apart > FAR_APART
    deepest = shadow.level if helps else SHALLOWER * shadow.level
    if there.level >= (deepest if plain else min(deepest, DEEP_SHADOW)):
        return seen
    # An uneven ground hides shadows; but what is no wider than where they do not count shows none.
    # Between legs ground lies on the axis, and says less of what is seen there.
    plainly = not between and not signal.by_distance and shadow.none_found
    if plainly and _wider(masks, fainter, width) < WITH_SHADOW:
        return seen
    return Seen(hue, apart, fainter, there)


def _wider(masks: list[np.ndarray], others: list[np.ndarray], width: float) -> float:
    """How many times as many rows near the axis masks (R, M) have as others where these have any
    on it, the median over columns; infinity where they have none."""
    shares = []
    for mask, other in zip(masks, others, strict=True):
        half, near = mask.shape[0] // 2, int(GROUND_FROM * width)
        rows, fewer = (m[max(half - near, 0) : half + near + 1] for m in (mask, other))
        seen = other[half] > 0
        shares.append(rows[:, seen].sum(axis=0) / fewer[:, seen].sum(axis=0))
    ratios = np.concatenate(shares)
    return float(np.median(ratios)) if ratios.size else float("inf")


def single_columns(mask: np.ndarray, half: int, width: float) -> np.ndarray:
    """Columns (M,) bool with one run of about the bundle's width on the axis."""
    low, high = _scan(mask, half, 0.25 * width)[:2]
    size, centre = high - low + 1, 0.5 * (low + high)
    with np.errstate(invalid="ignore"):
        return (np.abs(centre) < 0.3 * width) & (size > 0.35 * width) & (size < 1.7 * width)


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


def leg_columns(mask: np.ndarray, half: int, width: float) -> np.ndarray:
    """Columns (M,) bool with a thin run on either side of the axis and a gap between."""
    _, _, below_low, below_high, above_low, above_high = _scan(mask, half, 0.1 * width)
    with np.errstate(invalid="ignore"):
        thin = np.maximum(below_high - below_low, above_high - above_low) < 1.2 * width
        alike = np.abs(below_high + above_low) < 0.35 * (above_low - below_high) + 0.3 * width
    return thin & alike


def leg_spread(masks: list[np.ndarray], half: int, width: float) -> tuple[float, float]:
    """How many leg columns lie before and after the middle of those with one run on the axis, no
    wider than a bundle: behind a plate that stands out as well lie the legs of hardly a turn."""
    inner = np.abs(np.arange(-half, half + 1)) < 0.2 * width
    near = far = 0.0
    for mask in masks:
        legs = leg_columns(mask, half, width)
        low, high = _scan(mask, half, 0.25 * width)[:2]
        with np.errstate(invalid="ignore"):
            single = np.flatnonzero(
                ((mask[inner] > 0).mean(0) > 0.8) & (high - low < WIDEST * width)
            )
        if single.size:
            s = np.arange(mask.shape[1])
            near += float(legs[s < np.median(single)].sum())
            far += float(legs[s > np.median(single)].sum())
    return near, far


def refine(axis: Axis, masks: list[np.ndarray], half: int, width: float) -> tuple[Axis, float]:
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


def extent_of(masks: list[np.ndarray], half: int, width: float) -> tuple[float, float, float]:
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
