"""What tells strings from their ground: brightness, a hue, or the distance from its colour."""

from __future__ import annotations

import numpy as np

from tsvision.images.cloud import central_cloud
from tsvision.images.ground import above_ground, nan_median
from tsvision.images.linear import LUMA_BGR, best_weights, project, shadeless_weights
from tsvision.images.strip import Strip

FEWEST = 10  # samples
OTHER_HUE = 4.0  # spreads of the ground's hue from which strings are of another
SEVERAL_HUES = 0.45  # spread of the colour's direction from which strands are of several colours
# Per cent of the samples on strands of several colours that may lie where two of them meet: there
# yellow and blue make grey, and more so in the blur of thin strands.
MIXED = 35.0
ACROSS = 0.4  # of the ground's light: how far strings stand out across its colour, to rely on it
# Strands of the ground's own hue, white on grey or black, stand out along its colour alone: by so
# many times its light, which no mixture of hues does, or darker than a shadow leaves it; and the
# share of the samples on strings that may.
BRIGHTER, DARKER, OF_ITS_HUE = 2.0, 0.6, 0.15
OFF = 5.0  # spreads of the ground's colour from which a sample is not of it
# Spreads of the ground's light from which strands are brighter or darker; the least share of either
# in a window of so many half cores where both wind about each other; how many windows show both.
CLEARLY, OF_EITHER, WINDOW, MOSTLY_MIXED = 4.0, 0.2, 6.0, 0.4
DIM = 0.4  # of the core's light: a limb's
ROUGH = 0.6  # of the strongest contrast: a core that the axis may lie beside
# With few turns the axis runs between legs most of the way: what shows half of what the strongest
# tenth of the columns do is the bundle's.
STRONGEST, BUNDLE = 90.0, 0.5


def find_signal(
    strips: list[Strip], half_core: float, between: bool = False
) -> tuple[np.ndarray, float, bool]:
    """Channel weights, separation in sd, and whether strings differ from the ground in ways that
    no one weighted sum shows (strands of several colours): then distance in colour serves.
    between: whether the axis may run between legs most of the way."""
    if strips[0].values.ndim == 2:
        return LUMA_BGR, float("nan"), are_both_ways(strips, half_core)
    inner, outer = _samples(strips, half_core, between)
    if min(len(inner), len(outer)) < FEWEST:
        return LUMA_BGR, float("nan"), False  # no ground in view beside a candidate this wide
    weights, separation = best_weights(central_cloud(inner), central_cloud(outer))
    if not many_coloured(inner, outer):
        if are_both_ways(strips, half_core):
            return LUMA_BGR, separation, True
        return weights, separation, False
    return _shadowless(inner, outer), separation, True


def find_hue(
    strips: list[Strip], half_core: float, between: bool = False
) -> tuple[np.ndarray, float]:
    """Channel weights that shadows on the ground do not change, and the separation in sd that they
    reach; 0 where there is no colour."""
    inner, outer = np.zeros((0, 3)), np.zeros((0, 3))
    if strips[0].values.ndim == 3:
        inner, outer = _samples(strips, half_core, between)
    if min(len(inner), len(outer)) < FEWEST:
        return LUMA_BGR, 0.0
    return shadeless_weights(central_cloud(inner), central_cloud(outer))


def _samples(strips: list[Strip], half_core: float, between: bool) -> tuple[np.ndarray, np.ndarray]:
    """Colours (K, 3) on the axis of some strips, and (L, 3) on the ground beside it."""
    core, ground = [], []
    for strip in strips:
        n = np.arange(-strip.half_px, strip.half_px + 1)
        axis = strip.values[np.abs(n) < max(0.5 * half_core, 1.0)]
        outer = strip.values[np.abs(n) > 3.0 * half_core].reshape(-1, 3)
        inner = (_off_ground(axis, outer) if between else axis).reshape(-1, 3)
        core.append(inner[:: max(1, len(inner) // 1500)])
        ground.append(outer[:: max(1, len(outer) // 1500)])
    inner, outer = np.concatenate(core), np.concatenate(ground)
    return inner[~np.isnan(inner).any(1)], outer[~np.isnan(outer).any(1)]


def _off_ground(axis: np.ndarray, outer: np.ndarray) -> np.ndarray:
    """Those columns of what lies on the axis (K, M, 3) that are unlike the ground (n, 3)."""
    ground = outer[~np.isnan(outer).any(axis=1)]
    if not len(ground):
        return axis
    away = np.linalg.norm(np.median(axis, axis=0) - np.median(ground, axis=0), axis=1)
    known = np.isfinite(away)
    if not known.any():
        return axis
    return axis[:, known][:, _of_bundle(away[known])]


def _of_bundle(strengths: np.ndarray) -> np.ndarray:
    """Which columns (M,) stand out as the bundle does, and not as ground between legs."""
    return np.asarray(strengths >= BUNDLE * np.percentile(strengths, STRONGEST))


def _shadowless(inner: np.ndarray, outer: np.ndarray) -> np.ndarray:
    """The ground's direction in colour (3,) where strings of several colours stand out across it,
    so that light and shadow on the ground need not count; LUMA_BGR (count all) elsewhere."""
    ground = np.median(outer, axis=0)
    unit = ground / max(float(np.linalg.norm(ground)), 1e-9)
    away = inner - ground
    # However bright the brightest on the axis is - a connector, strands of the other colour.
    plain = float(np.median(np.linalg.norm(outer - ground, axis=1)))
    out = np.linalg.norm(away, axis=1) > OFF * plain
    away = away[out] if out.any() else away
    along, light = away @ unit, float(np.linalg.norm(ground))
    across = np.linalg.norm(away - along[:, None] * unit, axis=1)
    noise = np.median(np.linalg.norm(outer - (outer @ unit)[:, None] * unit, axis=1))
    least = max(ACROSS * light, 5.0 * noise)
    of_its_hue = (across < least) & ((along > BRIGHTER * light) | (along < -DARKER * light))
    enough = np.percentile(across, MIXED) > least and of_its_hue.mean() < OF_ITS_HUE
    return unit.astype(np.float32) if enough else LUMA_BGR


def are_both_ways(strips: list[Strip], half_core: float) -> bool:
    """Whether strands brighter than the ground wind about darker ones, black and white on grey.

    Both are then found in every few widths of the axis; a connector and the strings before it, or
    the gleam of dark strings, are not.
    """
    mixed = []
    for strip in strips:
        luma = project(strip.values, LUMA_BGR)
        n = np.abs(np.arange(-strip.half_px, strip.half_px + 1))
        axis, outer = luma[n < max(0.5 * half_core, 1.0)], luma[n > 3.0 * half_core]
        outer = outer[np.isfinite(outer)]
        if not outer.size:
            continue
        ground = float(np.median(outer))
        least = CLEARLY * (1.4826 * float(np.median(np.abs(outer - ground))) + 2e-3)
        window = max(round(WINDOW * half_core), 1)
        for first in range(0, axis.shape[1] - window + 1, window):
            some = axis[:, first : first + window] - ground
            mixed.append(min((some > least).mean(), (some < -least).mean()) > OF_EITHER)
    return len(mixed) > 0 and float(np.mean(mixed)) > MOSTLY_MIXED


def many_coloured(inner: np.ndarray, outer: np.ndarray) -> bool:
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


def told_by_colour(weights: np.ndarray, by_distance: bool) -> bool:
    """Whether strings stand out in a hue, or across the ground's, and not by luma."""
    return by_distance or not np.array_equal(weights, LUMA_BGR)


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
        return above_ground(signal, inner_px)
    if values.ndim == 2:
        return np.abs(above_ground(values, inner_px))
    squares = np.zeros(values.shape[:2], np.float32)
    along = np.zeros(values.shape[:2], np.float32)
    for c in range(3):
        channel = np.ascontiguousarray(values[..., c])
        away = above_ground(channel, inner_px)
        squares += away**2
        along += away * weights[c]
    return _distance(squares, along, weights)


def _distance(squares: np.ndarray, along: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Lengths of colour differences from their squares, less what lies along `weights` where these
    are the ground's direction."""
    if not np.array_equal(weights, LUMA_BGR):
        squares = np.maximum(squares - along**2, 0.0)
    return np.sqrt(squares)


def raw_of_black(ground: np.ndarray, weights: np.ndarray, by_distance: bool) -> float:
    """Raw contrast of a place without light on a ground of colour (1,) or (3,), linear."""
    if by_distance:
        return float(np.linalg.norm(ground)) if np.array_equal(weights, LUMA_BGR) else 0.0
    return -float(ground @ weights) if ground.size == 3 else -float(ground[0])


def black_contrast(
    strings: np.ndarray, ground: np.ndarray, weights: np.ndarray, by_distance: bool
) -> float:
    """Contrast of a place without light, in units of that of the strings: what they show at DIM of
    their light, drawn on to none. A weighted sum of channels goes straight there; a distance from
    the ground's colour falls and rises again on the way, and limbs are dim but hardly ever black.

    strings (n, 3): colours on the axis; ground (3,): beside it; linear light. One channel likewise.
    """

    def typical(light: float) -> float:
        away = light * strings - ground
        if not by_distance:
            return float(np.mean(away @ weights if away.shape[1] == 3 else away))
        along = away @ weights if away.shape[1] == 3 else away[:, 0]
        return float(np.mean(_distance((away**2).sum(axis=1), along, weights)))

    lit = typical(1.0)
    return (typical(DIM) / lit - DIM) / (1.0 - DIM) if lit else 0.0


def core_of(strips: list[Strip], weights: np.ndarray, width: float, between: bool = False) -> float:
    """Signal of the core less that of the ground, the median over some strips; NaN where no strip
    shows one. between: whether the axis may run between legs most of the way."""
    levels = []
    for strip in strips:
        n = np.arange(-strip.half_px, strip.half_px + 1)
        core = raw_contrast(strip.values, weights, False, 1.3 * width)[np.abs(n) < 0.2 * width]
        columns = nan_median(core)
        columns = columns[np.isfinite(columns)]
        if columns.size:
            levels.append(_typical(columns, between))
    return float(np.median(levels)) if levels else float("nan")


def _typical(columns: np.ndarray, between: bool) -> float:
    """Contrast on the axis, typical of the columns (M,), or between legs of those that show the
    bundle; NaN of none."""
    columns = columns[np.isfinite(columns)]
    if not columns.size:
        return float("nan")
    if between:
        columns = columns[_of_bundle(np.abs(columns))]
    return float(np.median(columns))


def straight_contrast(
    strip: Strip,
    weights: np.ndarray,
    width: float,
    by_distance: bool = False,
    roughly: bool = False,
) -> np.ndarray:
    """Contrast in units of the core's median contrast (core is about +1).

    roughly: the axis may lie beside the core yet; each column's strongest contrast counts.
    """
    return scaled_contrast(strip, weights, width, by_distance, roughly)[0]


def scaled_contrast(
    strip: Strip,
    weights: np.ndarray,
    width: float,
    by_distance: bool,
    roughly: bool,
    between: bool = False,
) -> tuple[np.ndarray, float]:
    """`straight_contrast`, and what pure black would have: how far shadows reach. between: whether
    the axis may run between legs most of the way."""
    values = raw_contrast(strip.values, weights, by_distance, 1.3 * width)
    n = np.arange(-strip.half_px, strip.half_px + 1)
    if roughly:
        core = np.nan_to_num(values[np.abs(n) <= max(0.6 * width, 2.0)])
        strongest = np.take_along_axis(core, np.abs(core).argmax(axis=0)[None], axis=0)
        level = ROUGH * _typical(strongest[0], between)
    else:
        level = _typical(nan_median(values[np.abs(n) <= max(0.2 * width, 1.0)]), between)
    level = level if abs(level) > 1e-6 else 1e-6
    ground = strip.values[np.abs(n) > 1.3 * width]
    if ground.size == 0 or np.isnan(ground).all():
        return values / level, 0.0
    plain = np.nanmedian(ground.reshape(ground.shape[0] * ground.shape[1], -1), axis=0)
    black = raw_of_black(plain, weights, by_distance)
    return values / level, float(black / level)
