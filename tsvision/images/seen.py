"""What is seen along a line: by which signal, which pixels are strings, and what shadow is in them.

`find_signal` goes by colours on the axis and beside it alone. What it finds may show the strings'
shadow as well; a hue that shadows do not change may show less of that, or less of the strings.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tsvision.images.contrast import GROUND_FROM
from tsvision.images.masks import masks_of
from tsvision.images.shadow import Shadow
from tsvision.images.signal import DISTANCE, Signal, Way
from tsvision.images.strip import Strip
from tsvision.images.telling import find_hue, find_signal

DEEP_SHADOW = 0.3  # contrast to which it reaches: dim limbs of strings have no more
WITH_SHADOW = 1.1  # times as wide as by a hue, from which a bundle may be seen with its shadow
# sd from which a hue tells strings from ground, and from which it does by far.
HUE_APART, FAR_APART = 1.5, 3.0
# Of a shadow's depth, at most, that a hue may show still which does not tell strings by far: it may
# be that of one of several colours, and the shadow be the others.
SHALLOWER = 0.75
# An uneven ground hides a shadow in what one hue shows. Another may show strings from that part of
# the contrast on, and stand out by that part of the separation.
CLEARER, AS_WELL = 0.5, 0.8
FADED = 1.5  # times as wide by a hue as by brightness, from which lit limbs are as bright as ground


@dataclass(frozen=True)
class Seen:
    """Strings in some strips. signal and separation: see `find_signal`; masks (R, M) of each strip;
    shadow: which could be in them."""

    signal: Signal
    separation: float
    masks: list[np.ndarray]
    shadow: Shadow


def seen_in(strips: list[Strip], width: float, rough: bool, between: bool = False) -> Seen:
    """The strings in some strips: by what tells them from the ground, or where a deep shadow may
    be told from it as well, by a hue that it leaves as it is. rough: whether the axis may lie
    beside them yet; between: whether it may run between legs most of the way."""
    signal, separation = find_signal(strips, 0.5 * width, between)
    first = Seen(signal, separation, *masks_of(strips, signal, width, rough, between))
    if not (_may_be_shadowed(first) or first.signal.way is Way.HUE):
        return first
    hue, apart = find_hue(strips, 0.5 * width, between)
    if apart <= _least_apart(first):
        return first
    by_hue = Seen(hue, apart, *masks_of(strips, hue, width, rough, between))
    if not (_may_be_shadowed(first) or is_clearer(by_hue, first)):
        return first
    return by_hue if _shows_more(by_hue, first, width, between) else first


def seen_by_hue(strips: list[Strip], width: float) -> Seen:
    """The strings in some strips by a hue alone, of which no shadow is a part."""
    # Ground on the axis, between legs, is told from strings by what lies beside it.
    hue, apart = find_hue(strips, 0.5 * width, between=True)
    return Seen(hue, apart, *masks_of(strips, hue, width, rough=False))


def is_told(seen: Seen) -> bool:
    """Whether any strip shows strings, and ground as well: where strands are brighter than it on
    one side and as much darker on the other, all of a strip is as bright as their core."""
    return any(0.0 < mask.mean() < 1.0 for mask in seen.masks)


def seen_by_any(strips: list[Strip], width: float, between: bool = False) -> Seen:
    """The strings in some strips by whatever differs from the ground; nobody knows how far."""
    masks, shadow = masks_of(strips, DISTANCE, width, False, between)
    return Seen(DISTANCE, float("nan"), masks, shadow)


def _may_be_shadowed(seen: Seen) -> bool:
    """Whether the masks may hold the strings' shadow. What lies across the ground's colour holds
    none; a distance shows whatever is there."""
    if seen.signal.way is Way.ACROSS:
        return False
    return seen.signal.by_distance or seen.shadow.deep > DEEP_SHADOW


def is_clearer(by_hue: Seen, first: Seen) -> bool:
    """Whether the ground is much more even by one hue than by another, which tells strings no
    better to speak of."""
    return (
        first.signal.way is Way.HUE
        and by_hue.shadow.level <= CLEARER * first.shadow.level
        and by_hue.separation >= AS_WELL * first.separation
    )


def _least_apart(first: Seen) -> float:
    """sd by which a hue has to tell strings to be asked at all. Of several colours a distance shows
    what one hue does not, unless that tells them by far."""
    if not first.signal.by_distance:
        return -np.inf
    return FAR_APART if first.shadow.none_found else HUE_APART


def _shows_more(by_hue: Seen, first: Seen, width: float, between: bool) -> bool:
    """Whether a hue shows the strings as well as the signal before it, with less of a shadow."""
    by_distance = first.signal.by_distance
    plain = by_hue.separation > HUE_APART or (
        not by_distance and _wider(by_hue.masks, first.masks, width) > FADED
    )
    helps = by_hue.shadow.none_found or by_hue.separation > FAR_APART
    deepest = first.shadow.deep if helps else SHALLOWER * first.shadow.deep
    if not plain:
        # With few turns ground lies on the axis most of the way, and nothing stands out there by
        # much: then the better of both serves where it is free of deep shadow itself.
        if not by_hue.separation > first.separation:
            return False
        deepest = min(deepest, DEEP_SHADOW)
    if by_hue.shadow.deep >= deepest:
        return False
    # An uneven ground hides shadows; but what is no wider than where they do not count shows none.
    # Between legs ground lies on the axis, and says less of what is seen there.
    if between or by_distance or not first.shadow.none_found:
        return True
    return _wider(first.masks, by_hue.masks, width) >= WITH_SHADOW


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
