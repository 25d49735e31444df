"""How files encode light, told by their sensor's noise.

Photons arrive at random: where light is I, the variance of what a sensor counts is K I + R, of shot
noise and of reading out. A file that holds linear light shows just that. One encoded for the eye
(sRGB and its like, about the root of 2.2) spreads dark levels and squeezes bright ones, and its
noise is nearly the same at all levels. Machine vision cameras write the first kind unless told
otherwise, nearly everything else the second; where the one is taken for the other, edges lie up to
a pixel off.

Noise is what is left at the highest frequency along both rows and columns, which no lens passes.
Coding (JPEG, video) does not pass it either: then nothing is told. What scenes add there, texture
in one picture and motion from one to the next, is seldom in both.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.optimize import nnls

from tsvision.images.depth import bits_of
from tsvision.images.linear import decoded

SRGB = math.nan  # as `to_linear` takes it
SECOND = np.array([1.0, -2.0, 1.0]) / math.sqrt(6.0)  # of unit gain for white noise
FINEST = np.outer(SECOND, SECOND)
HALF = np.kron(FINEST, [[1.0, 0.0], [0.0, 0.0]])[:-1, :-1]  # the same at half the frequency
WHITE = 0.5  # of the noise at half the frequency: less at the finest means that coding took it
MOST_PICTURES = 4
LEVELS = np.geomspace(4.0, 250.0, 32) / 255.0  # above them pixels may be clipped
LEVEL_SIGMA_PX = 1.5
FLAT = (2.0 / 255.0, 0.02)  # steepest slope a px, and of the level: steeper ones are edges
FEWEST_PX = 1000  # of a level
FEWEST_LEVELS, LEVEL_RANGE = 6, 2.5  # how many, and the ratio of the highest and the lowest
SEEN_CODES = 0.45  # of noise, sd: half as much again as rounding to 8 bit makes
LEVEL_SHARE = 0.05  # of a level's variance: what it is told within, beside counting
# The curve is sRGB unless that misses the variances by so many times what the best one does, which
# has to describe them.
CONTRADICTED, DESCRIBED = 4.0, 5.0
# What is known before: a file that is not sRGB holds linear light, or a root about USUAL.
USUAL, USUAL_SD = 2.2, 0.2  # the sd of its logarithm
ROOTS = (1.2, 1.4, 1.6, 1.8, 2.0, 2.2, 2.4, 2.6, 2.8, 3.0)
GROWS = 1.5  # times the variance of the darkest levels in the brightest, where light is linear
FAR, WITHIN = 2.5, 0.9776  # sds beyond which noise counts as at; the variance that is left so
ROUNDED = 0.3 / 255.0  # sd of what is left of no noise at all
STEP = 1e-4  # of full scale, over which a curve's slope is taken
TOGETHER = 2.0  # levels that are off together


@dataclass(frozen=True)
class Noise:
    """Levels (K,) in 0..1, the noise's variance there and the sd of that."""

    level: np.ndarray
    variance: np.ndarray
    sd: np.ndarray


def gamma_of(pictures: list[np.ndarray]) -> float:
    """The exponent that decodes some pictures of one recording, grey or BGR, uint8 or uint16: 1
    where they hold linear light. NaN where they are sRGB or their noise does not say otherwise."""
    noise = noise_of(pictures)
    if noise is None:
        return SRGB
    cost = {gamma: misfit(noise, gamma) for gamma in (SRGB, 1.0, *ROOTS)}
    best = min(cost.values())
    # Noise that is alike at all levels may have been added to a picture of any curve.
    usual = min(cost[SRGB], _misfit(noise, np.ones((noise.level.size, 1))))
    if best > DESCRIBED or usual < CONTRADICTED * max(best, 1.0):
        return SRGB
    if np.median(noise.variance[-3:]) < GROWS * np.median(noise.variance[:3]):
        cost[1.0] = math.inf
    worth = noise.level.size / (2.0 * TOGETHER * max(best, 1.0))
    return min((1.0, *ROOTS), key=lambda gamma: worth * cost[gamma] + _unlikely(gamma))


def _unlikely(gamma: float) -> float:
    """How much less likely than linear light an exponent is beforehand: minus its logarithm."""
    if gamma == 1.0:
        return 0.0
    return 0.5 * (math.log(gamma / USUAL) / USUAL_SD) ** 2


def noise_of(pictures: list[np.ndarray]) -> Noise | None:
    """The noise of some pictures; None where too little of it is seen, at too few levels."""
    chosen = pictures[:: max(1, len(pictures) // MOST_PICTURES)]
    codes = float(2 ** bits_of(chosen) - 1)
    planes = [(p if p.ndim == 2 else p[..., 1]).astype(np.float32) / codes for p in chosen]
    fine = [cv2.filter2D(p, -1, FINEST) for p in planes]
    half = [cv2.filter2D(p, -1, HALF) for p in planes]
    places = [_levels(p) for p in planes]
    rows = []
    for number in range(1, LEVELS.size):
        here = [place == number for place in places]
        count = sum(int(np.count_nonzero(h)) for h in here)
        if count < FEWEST_PX:
            continue
        texture = _robust_sd(fine, here)
        if texture < WHITE * _robust_sd(half, here):
            continue
        motion = [
            _robust_sd([(a - b) / math.sqrt(2.0)], [h & g])
            for a, b, h, g in zip(fine, fine[1:], here, here[1:], strict=False)
            if np.count_nonzero(h & g) >= FEWEST_PX
        ]
        mean = np.concatenate([p[h] for p, h in zip(planes, here, strict=True)]).mean()
        rows.append((mean, min([texture, *motion]), count))
    if len(rows) < FEWEST_LEVELS or rows[-1][0] < LEVEL_RANGE * rows[0][0]:
        return None
    level, sd, count = np.array(rows).T
    if np.median(sd[-3:]) * codes < SEEN_CODES:
        return None
    rounding = 1.0 / 12.0 / codes**2
    told = sd**2 * np.hypot(LEVEL_SHARE, np.sqrt(2.0 / count))
    return Noise(level, sd**2 - rounding, told)


def misfit(noise: Noise, gamma: float) -> float:
    """Mean square by which K I + R, as it shows in a file so encoded, misses the variances, in
    their sd."""
    light = decoded(noise.level, gamma)
    rise = decoded(noise.level + STEP, gamma) - decoded(noise.level - STEP, gamma)
    code_per_light = 2.0 * STEP / rise
    shapes = np.stack([light, np.ones_like(light)], axis=1)
    return _misfit(noise, code_per_light[:, None] ** 2 * shapes)


def _misfit(noise: Noise, shapes: np.ndarray) -> float:
    """The same for variances that are a sum of some shapes (K, n), none of them negative."""
    design = shapes / noise.sd[:, None]
    design /= design.max(axis=0)
    target = noise.variance / noise.sd
    found, _ = nnls(design, target)
    return float(np.mean((design @ found - target) ** 2))


def _levels(plane: np.ndarray) -> np.ndarray:
    """Number of the level that each pixel belongs to; 0 on edges and where it may be clipped."""
    smooth = cv2.GaussianBlur(plane, (0, 0), LEVEL_SIGMA_PX)
    across, down = (cv2.Sobel(smooth, -1, *d, scale=0.125) for d in ((1, 0), (0, 1)))
    steepest, share = FLAT
    flat = np.hypot(across, down) < np.maximum(steepest, share * smooth)
    flat &= cv2.dilate(plane, np.ones((5, 5), np.uint8)) < LEVELS[-1]
    number = np.digitize(smooth, LEVELS)
    return np.where(flat & (number < LEVELS.size), number, 0)


def _robust_sd(values: list[np.ndarray], here: list[np.ndarray]) -> float:
    """Of noise with outliers. What is counted in whole codes has a coarse median: it only says what
    counts as far out."""
    size = np.abs(np.concatenate([v[h] for v, h in zip(values, here, strict=True)]))
    far = FAR * max(1.4826 * float(np.median(size)), ROUNDED)
    return math.sqrt(float(np.mean(np.minimum(size, far) ** 2)) / WITHIN)
