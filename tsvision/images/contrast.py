"""How far what is seen stands out from its ground, in units of the strings' core."""

from __future__ import annotations

import numba
import numpy as np

from tsvision.images.ground import above_ground, nan_median
from tsvision.images.linear import project
from tsvision.images.percentiles import median
from tsvision.images.signal import Signal, Way
from tsvision.images.strip import Strip, averaged
from tsvision.images.telling import of_bundle

DIM = 0.4  # of the core's light: a limb's
ROUGH = 0.6  # of the strongest contrast: a core that the axis may lie beside
BESIDE = 24  # rows of it that are asked what a column shows there
STEPS_APART = 3  # columns: of the neighbours whose differences tell the noise
STANDS_OUT = 1.5  # times a pixel's noise, at least, that a core of strings differs from its ground
GROUND_FROM = 1.3  # widths from the axis; nearer lie the strings, and no legs yet


def raw_contrast(values: np.ndarray, signal: Signal, inner_px: float) -> np.ndarray:
    """Signal minus ground of a strip (R, M) or (R, M, 3), linear light, (R, M).

    By distance: the length of the colour difference. A half-covered pixel lies halfway between
    ground and strand, so that the length is linear in coverage too, whatever the strand's colour.
    """
    if not signal.by_distance:
        return above_ground(project(values, signal.weights), inner_px)
    values = averaged(values, signal.averaged_px)
    if values.ndim == 2:
        return np.abs(above_ground(values, inner_px))
    squares = np.zeros(values.shape[:2], np.float32)
    along = np.zeros(values.shape[:2], np.float32)
    for c in range(3):
        channel = np.ascontiguousarray(values[..., c])
        away = above_ground(channel, inner_px)
        squares += away**2
        along += away * signal.weights[c]
    return _distance(squares, along, signal)


def _distance(squares: np.ndarray, along: np.ndarray, signal: Signal) -> np.ndarray:
    """Lengths of colour differences from their squares, less what lies `along` the ground's own
    direction where that does not count."""
    if signal.way is Way.ACROSS:
        squares = np.maximum(squares - along**2, 0.0)
    return np.sqrt(squares)


def raw_of_black(ground: np.ndarray, signal: Signal) -> float:
    """Raw contrast of a place without light on a ground of colour (1,) or (3,), linear."""
    if signal.by_distance:
        return 0.0 if signal.way is Way.ACROSS else float(np.linalg.norm(ground))
    return -float(ground @ signal.weights) if ground.size == 3 else -float(ground[0])


def black_contrast(strings: np.ndarray, ground: np.ndarray, signal: Signal) -> float:
    """Contrast of a place without light, in units of that of the strings: what they show at DIM of
    their light, drawn on to none. A weighted sum of channels goes straight there; a distance from
    the ground's colour falls and rises again on the way, and limbs are dim but hardly ever black.

    strings (n, 3): colours on the axis; ground (3,): beside it; linear light. One channel likewise.
    """

    def typical(light: float) -> float:
        away = light * strings - ground
        if away.shape[1] == 1:
            return float(np.mean(np.abs(away) if signal.by_distance else away))
        along = away @ signal.weights
        if not signal.by_distance:
            return float(np.mean(along))
        return float(np.mean(_distance((away**2).sum(axis=1), along, signal)))

    lit = typical(1.0)
    return (typical(DIM) / lit - DIM) / (1.0 - DIM) if lit else 0.0


def core_of(strips: list[Strip], signal: Signal, width: float, between: bool = False) -> float:
    """Signal of the core less that of the ground, the median over some strips; NaN where no strip
    shows one. between: whether the axis may run between legs most of the way."""
    levels = []
    for strip in strips:
        n = np.arange(-strip.half_px, strip.half_px + 1)
        values = raw_contrast(strip.values, signal, GROUND_FROM * width)
        columns = nan_median(values[np.abs(n) < 0.2 * width])
        levels.append(_typical(columns, _beside(values, width) if between else None))
    known = np.array(levels)[np.isfinite(levels)]
    return float(np.median(known)) if known.size else float("nan")


def _beside(values: np.ndarray, width: float) -> np.ndarray:
    """What a strip's columns (M,) show beside the strings."""
    n = np.abs(np.arange(values.shape[0]) - values.shape[0] // 2)
    rows = np.flatnonzero(n > GROUND_FROM * width)
    return nan_median(values[rows[:: max(1, rows.size // BESIDE)]])


def _typical(columns: np.ndarray, beside: np.ndarray | None) -> float:
    """Contrast on the axis, typical of the columns (M,), or between legs, where it is known what
    lies `beside` each, of those that show the bundle; NaN of none. A plate that lies across the
    strip stands out by as much beside it."""
    known = np.isfinite(columns)
    if not known.any():
        return float("nan")
    columns = columns[known]
    if beside is not None:
        columns = columns[of_bundle(np.abs(columns - np.nan_to_num(beside[known])))]
    return float(np.median(columns))


def noise_of(contrast: np.ndarray, rows: np.ndarray) -> float:
    """sd of the pixels' noise in some rows of a contrast (R, M), from what neighbours differ by:
    however uneven the ground is. NaN where none are known."""
    steps = _steps(contrast, rows)
    return float(1.4826 * median(steps) / 1.41) if steps.size else float("nan")


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


def straight_contrast(strip: Strip, signal: Signal, width: float) -> np.ndarray:
    """Contrast in units of the core's median contrast (core is about +1)."""
    return scaled_contrast(strip, signal, width)[0]


def scaled_contrast(
    strip: Strip, signal: Signal, width: float, rough: bool = False, between: bool = False
) -> tuple[np.ndarray, float, float]:
    """`straight_contrast`, what pure black would have: how far shadows reach, and the core's own in
    units of the signal.

    rough: the axis may lie beside the core yet; each column's strongest contrast counts. between:
    whether the axis may run between legs most of the way.
    """
    values = raw_contrast(strip.values, signal, GROUND_FROM * width)
    n = np.arange(-strip.half_px, strip.half_px + 1)
    beside = _beside(values, width) if between else None
    if rough:
        core = np.nan_to_num(values[np.abs(n) <= max(0.6 * width, 2.0)])
        strongest = np.take_along_axis(core, np.abs(core).argmax(axis=0)[None], axis=0)
        level = ROUGH * _typical(strongest[0], beside)
    else:
        level = _typical(nan_median(values[np.abs(n) <= max(0.2 * width, 1.0)]), beside)
    level = level if abs(level) > 1e-6 else 1e-6
    ground = strip.values[np.abs(n) > GROUND_FROM * width]
    if ground.size == 0 or np.isnan(ground).all():
        return values / level, 0.0, level
    plain = np.nanmedian(ground.reshape(ground.shape[0] * ground.shape[1], -1), axis=0)
    return values / level, float(raw_of_black(plain, signal) / level), level
