"""From which contrast on something is a strand and no shadow: strands end sharply, shadows softly.

Where strings are darker than the ground, or differ from it by colour, the shadow that they cast
on the ground counts in the same sense as they do and lies along them. Its border is a penumbra of
many pixels; a strand's is as sharp as the lens.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.stats import norm

DEEPEST = 0.7  # a mask that begins higher would lose the strands' own limbs
DARKENS = 0.25  # contrast that black must have before shadows can be mistaken for strings
SOFT = 0.35  # of the sharp edges' steepness: what is less steep is no strand's border
MOST_SOFT = 0.2  # share of borders that may be soft
NEARLY = 0.8  # of the steepness half way up: levels there tell how sharp borders are


@dataclass(frozen=True)
class Shadow:
    """level: contrast below which a cast shadow could be taken for strings. deep: that below which
    borders are soft, a shadow's or not. soft: share of the borders there which are soft all the
    same: much where there is little but shadow. least: contrast that the ground varies by, below
    which nothing was looked for."""

    level: float
    deep: float
    soft: float
    least: float

    @property
    def none_found(self) -> bool:
        """Whether it is the ground alone that says from which contrast on strings are seen."""
        return self.deep <= self.least


NO_SHADOW = Shadow(0.0, 0.0, 0.0, 0.0)


def find_shadow(
    contrast: np.ndarray,
    inner_px: float,
    least: float,
    deepest: float = DEEPEST,
    cast: float = DEEPEST,
) -> Shadow:
    """The lowest contrast from `least` to `deepest` at which hardly any border of a contrast strip
    (R, M; strings about 1) within |n| < inner_px is soft. cast: contrast that a cast shadow has at
    most."""
    half = contrast.shape[0] // 2
    reach = max(int(inner_px), 4)
    part = np.nan_to_num(contrast[max(half - reach, 0) : half + reach + 1]).astype(np.float32)
    if min(part.shape) < 4:
        return Shadow(least, least, 0.0, least)
    part = cv2.GaussianBlur(part, (3, 3), 0.6)
    levels = np.arange(least, max(deepest, least) + 0.01, 0.05)
    steps = [_steps(part, float(level)) for level in levels]
    if steps[0].size < 20:
        return Shadow(least, least, 0.0, least)
    # A blurred step is steepest half way up. Far from there rows apart see more of one that is as
    # sharp as they lie close, and would call all else soft.
    shape = norm.pdf(norm.ppf(np.clip(levels, 0.05, 0.95))) / norm.pdf(0.0)
    known = [(s, f) for s, f in zip(steps, shape, strict=True) if s.size >= 20]
    half_up = NEARLY * max(f for _, f in known)
    limit = SOFT * max(float(np.percentile(s, 75.0) / f) for s, f in known if f >= half_up)
    share = np.array(
        [(s < limit * f).mean() if s.size >= 20 else 1.0 for s, f in zip(steps, shape, strict=True)]
    )
    deep = _hardly_soft(share)
    level = _hardly_soft(share[levels <= max(cast, least)])
    return Shadow(float(levels[level]), float(levels[deep]), float(share[deep]), float(levels[0]))


def _hardly_soft(share: np.ndarray) -> int:
    """The first of some shares (K,) of soft borders that is small, or the smallest."""
    few = np.flatnonzero(share < MOST_SOFT)
    return int(few[0] if few.size else share.argmin())


def _steps(part: np.ndarray, level: float) -> np.ndarray:
    """Steepness across, contrast a px, wherever the strip crosses `level`; 0 where what lies above
    it does not end within the strip."""
    above = part > level
    row, column = np.nonzero(above[1:] != above[:-1])
    low, high = np.maximum(row - 1, 0), np.minimum(row + 2, part.shape[0] - 1)
    steep = np.abs(part[high, column] - part[low, column]) / (high - low)
    return np.concatenate([steep, np.zeros(int(above[[0, -1]].sum()))])
