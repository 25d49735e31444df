"""From which contrast on something is a strand and no shadow: strands end sharply, shadows softly.

Where strings are darker than the ground, or differ from it by colour, the shadow that they cast
on the ground counts in the same sense as they do and lies along them. Its border is a penumbra of
many pixels; a strand's is as sharp as the lens.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from statistics import mode

import cv2
import numpy as np
from scipy.stats import norm

DEEPEST = 0.7  # a mask that begins higher would lose the strands' own limbs
DARKENS = 0.25  # contrast that black must have before shadows can be mistaken for strings
SOFT = 0.35  # of the sharp edges' steepness: what is less steep is no strand's border
MOST_SOFT = 0.2  # share of borders that may be soft
NEARLY = 0.8  # of the steepness half way up: levels there tell how sharp borders are
BLACKEST = 0.8  # of black's contrast: a limb that no lamp reaches gets light from the ground still


@dataclass(frozen=True)
class Shade:
    """Strings on whose one side, where n is larger (side 1) or smaller (-1), nothing below `level`
    counts: their shadow lies there, nearly as dark as they are; 0: on neither."""

    side: int = 0
    level: float = 0.0

    def reversed(self) -> Shade:
        return Shade(-self.side, self.level)

    def levels(self, level: float) -> tuple[float, float]:
        """Contrast at which strings begin where n is larger, and where it is smaller; `level` where
        no more is asked."""
        deep = max(level, self.level)
        return (deep if self.side > 0 else level), (deep if self.side < 0 else level)


NO_SHADE = Shade()


@dataclass(frozen=True)
class Shadow:
    """level: contrast below which a cast shadow could be taken for strings. deep: that below which
    borders are soft, a shadow's or not. soft: share of the borders there which are soft all the
    same: much where there is little but shadow. least: contrast that the ground varies by, below
    which nothing was looked for. shade: on which side more is asked."""

    level: float
    deep: float
    soft: float
    least: float
    shade: Shade = NO_SHADE

    @property
    def none_found(self) -> bool:
        """Whether it is the ground alone that says from which contrast on strings are seen."""
        return self.deep <= self.least


NO_SHADOW = Shadow(0.0, 0.0, 0.0, 0.0)


def typical_shadow(shadows: list[Shadow]) -> Shadow:
    """The median of some pictures' shadows, which fall to one side as long as the lamp stays; none
    where no picture tells."""
    if not shadows:
        return NO_SHADOW
    side = mode(s.shade.side for s in shadows)
    like = [s for s in shadows if s.shade.side == side]

    def typical(value: Callable[[Shadow], float]) -> float:
        return float(np.median([value(s) for s in like]))

    return Shadow(
        level=typical(lambda s: s.level),
        deep=typical(lambda s: s.deep),
        soft=typical(lambda s: s.soft),
        least=typical(lambda s: s.least),
        shade=Shade(side, typical(lambda s: s.shade.level)),
    )


def find_shadow(
    contrast: np.ndarray,
    inner_px: float,
    least: float,
    deepest: float = DEEPEST,
    cast: float = DEEPEST,
    black: float = 0.0,
) -> Shadow:
    """The lowest contrast from `least` to `deepest` at which hardly any border of a contrast strip
    (R, M; strings about 1) within |n| < inner_px is soft. cast: contrast that a cast shadow has at
    most; black: that of strings without light. Where that is more than what lit strings have,
    their limbs on the shadow's side may show it, and the shadow too nearly: that side alone is then
    asked for more."""
    half = contrast.shape[0] // 2
    reach = max(int(inner_px), 4)
    part = np.nan_to_num(contrast[max(half - reach, 0) : half + reach + 1]).astype(np.float32)
    if min(part.shape) < 4:
        return Shadow(least, least, 0.0, least)
    part = cv2.GaussianBlur(part, (3, 3), 0.6)
    levels = _levels(least, deepest)
    steps = [_steps(part, float(level)) for level in levels]
    if steps[0].size < 20:
        return Shadow(least, least, 0.0, least)
    # A blurred step is steepest half way up. Far from there rows apart see more of one that is as
    # sharp as they lie close, and would call all else soft.
    shape = _shape(levels)
    known = [(s, f) for s, f in zip(steps, shape, strict=True) if s.size >= 20]
    half_up = NEARLY * max(f for _, f in known)
    limit = SOFT * max(float(np.percentile(s, 75.0) / f) for s, f in known if f >= half_up)
    share = np.array(
        [(s < limit * f).mean() if s.size >= 20 else 1.0 for s, f in zip(steps, shape, strict=True)]
    )
    deep = _hardly_soft(share)
    level = _hardly_soft(share[levels <= max(cast, least)])
    found = Shadow(float(levels[level]), float(levels[deep]), float(share[deep]), float(levels[0]))
    deeper = _levels(found.deep, BLACKEST * black)[1:]
    if found.soft < MOST_SOFT or not deeper.size:
        return found
    return _on_one_side(part, found, deeper, limit, black)


def _levels(least: float, most: float) -> np.ndarray:
    return np.arange(least, max(most, least) + 0.01, 0.05)


def _on_one_side(
    part: np.ndarray, found: Shadow, levels: np.ndarray, limit: float, black: float
) -> Shadow:
    """The same, or with the lowest of some more levels at which the borders on the softer side of
    the strings are sharp. limit: steepness of a border half way up."""
    soft = {side: float((_steps(part, found.deep, side) < limit).mean()) for side in (1, -1)}
    side = max(soft, key=soft.__getitem__)
    for level in levels:
        steps = _steps(part, float(level), side)
        share = float((steps < limit * _shape(level / black)).mean()) if steps.size >= 20 else 1.0
        if share < MOST_SOFT:
            # What has nothing as dark on that side is shadow: the other borders are the strings'.
            return replace(found, level=found.least, soft=share, shade=Shade(side, float(level)))
    return found


def _shape(levels: np.ndarray) -> np.ndarray:
    """How steep a blurred step is at some shares of its height, of what it is half way up."""
    return np.asarray(norm.pdf(norm.ppf(np.clip(levels, 0.05, 0.95))) / norm.pdf(0.0))


def _hardly_soft(share: np.ndarray) -> int:
    """The first of some shares (K,) of soft borders that is small, or the smallest."""
    few = np.flatnonzero(share < MOST_SOFT)
    return int(few[0] if few.size else share.argmin())


def _steps(part: np.ndarray, level: float, side: int = 0) -> np.ndarray:
    """Steepness across, contrast a px, wherever the strip crosses `level`, or only where what lies
    above it ends towards one side; 0 where that does not end within the strip."""
    above = part > level
    ends = above[1:] != above[:-1]
    if side:
        ends &= above[:-1] if side > 0 else above[1:]
    row, column = np.nonzero(ends)
    low, high = np.maximum(row - 1, 0), np.minimum(row + 2, part.shape[0] - 1)
    steep = np.abs(part[high, column] - part[low, column]) / (high - low)
    outermost = {0: [0, -1], 1: [-1], -1: [0]}[side]
    return np.concatenate([steep, np.zeros(int(above[outermost].sum()))])
