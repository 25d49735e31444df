"""Which signal tells strings from their ground, by the colours on the axis and beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from tsvision.images.cloud import Cloud, central_cloud
from tsvision.images.ground import nan_median
from tsvision.images.linear import (
    LUMA_BGR,
    best_weights,
    lightless_weights,
    project,
    shadeless_weights,
)
from tsvision.images.signal import DISTANCE, LUMA, Signal, Way, summed
from tsvision.images.strip import Strip, averaged

FEWEST = 10  # samples
CALM = 6.0  # a half core in sides of the squares over which noise is averaged
CALMER = 3.0  # the same where strands brighter and darker than the ground are looked for
# Difference of neighbours on the ground, of what strings differ from it by, from which pictures are
# noisy (1.4 times the noise of a pixel), and every which row of it is asked.
NOISY, NEIGHBOURS = 0.14, 3
SAMPLES = 1500  # of a strip, on the axis and beside it
ROWS = 24  # beside it, of which the ground's colour is asked for
CORE, GROUND = 0.5, 3.0  # half cores from the axis within and beyond which they lie
FLOOR = 2e-3  # of full light: what the ground varies by at least
# With few turns the axis runs between legs most of the way: what shows half of what the strongest
# tenth of the columns do is the bundle's.
STRONGEST, BUNDLE = 90.0, 0.5

OTHER_HUE = 4.0  # spreads of the ground's hue from which strings are of another
SEVERAL_HUES = 0.35  # spread of the colour's direction from which strands are of several colours
OFTEN = 0.3  # share of the windows of the axis that show several, where strings do
FAR = 3.0  # spreads of the ground's colour beyond which a sample's hue is asked for
LIT = 0.06  # of full light, in all channels: what is darker shows no hue
OF_WINDOW = 0.3  # share of a window's samples that have to show theirs
BLACK = 0.1  # share of a window's samples that have to be too dark to have one
# What is dark is a limb if its hue is by so much nearer to the strings' than to none: 0.03 of it in
# drawn limbs, 2 to 11 times as far in path-traced black strands beside red, blue and orange ones.
NO_HUE, LIKE_STRINGS = np.full(3, 3.0**-0.5), 0.5

# Per cent of the samples on strands of several colours that may lie where two of them meet: there
# yellow and blue make grey, and more so in the blur of thin strands.
MIXED = 35.0
ACROSS = 0.4  # of the ground's light: how far strings stand out across its colour, to rely on it
SHADOWS = 0.15  # of how far strings stand out: a ground with less light has no shadow that counts
# Strands of the ground's own hue, white on grey or black, stand out along its colour alone: by so
# many times its light, which no mixture of hues does, or darker than a shadow leaves it; and the
# share of the samples on strings that may.
BRIGHTER, DARKER, OF_ITS_HUE = 2.0, 0.5, 0.15
OFF = 5.0  # spreads of the ground's colour from which a sample is not of it

# Of the strings' light: sd across their own colour, that gleams and chroma's blocks may make of one
# colour (up to 0.16 in drawn and path-traced films); strands of two show 0.25 and more.
ONE_COLOUR = 0.2

LIMB = 0.25  # of the strings' light
AS_FAR = 0.9  # of the separation that one hue reaches: from which another may show limbs better

# Spreads of the ground's light from which strands are brighter or darker; the least share of either
# in a window of so many half cores where both wind about each other.
CLEARLY, OF_EITHER, WINDOW = 4.0, 0.2, 6.0
# Of what two kinds differ by, what the two sides of the axis differ by in the mean of all windows
# where one lies beside the other: strings and their shadow, or ground. Strands change sides.
BESIDE = 0.6


def find_signal(
    strips: list[Strip], half_core: float, between: bool = False
) -> tuple[Signal, float]:
    """The signal in which strings stand out, and the separation in sd that a weighted sum of
    channels reaches; NaN without colour, or without ground beside a candidate this wide.

    Strands of several colours differ from the ground in ways that no one weighted sum shows: their
    distance from its colour does. between: whether the axis may run between legs most of the way.
    """
    calm = [_calmed(strip, half_core) for strip in strips]
    signal, separation = _told(strips, calm, half_core, between)
    # What lies across the ground's colour stands out by several times its noise, or is not taken.
    if signal.way is Way.DISTANCE and _is_noisy(strips, calm, half_core):
        signal = replace(signal, averaged_px=_side_px(half_core))
    return signal, separation


def _told(
    strips: list[Strip], calm: list[Strip], half_core: float, between: bool
) -> tuple[Signal, float]:
    """`find_signal`, however noisy the pictures are. calm: the strips without their noise."""
    if strips[0].values.ndim == 2:
        return DISTANCE if are_both_ways(strips, half_core) else LUMA, float("nan")
    inner, outer = _samples(strips, half_core, between)
    if min(len(inner), len(outer)) < FEWEST:
        return LUMA, float("nan")
    strings, ground = central_cloud(inner), central_cloud(outer)
    weights, separation = best_weights(strings, ground)
    _, calm_outer = _samples(calm, half_core, between)
    if len(calm_outer) >= FEWEST and black_among(_windows(calm, half_core), calm_outer):
        return DISTANCE, separation
    if many_coloured(_windows(strips, half_core), outer):
        return distance_for(inner, outer), separation
    if are_both_ways(strips, half_core):
        return DISTANCE, separation
    if loses_limbs(weights, strings, ground):
        hue, apart = shadeless_weights(strings, ground)
        if apart > AS_FAR * separation:
            return summed(hue), apart
    return summed(weights), separation


def colours_of(
    strips: list[Strip], half_core: float, between: bool
) -> tuple[np.ndarray, np.ndarray] | None:
    """Linear colours (3,), blue, green, red, of strings and of the ground beside them; None without
    colour or ground, and of strings of several colours. between: whether the axis may run between
    legs most of the way."""
    if strips[0].values.ndim == 2:
        return None
    inner, outer = _samples(strips, half_core, between)
    if min(len(inner), len(outer)) < FEWEST:
        return None
    strings, ground = central_cloud(inner), central_cloud(outer)
    light = float(np.linalg.norm(strings.mean))
    shaded = strings.mean @ strings.scatter @ strings.mean / light**2
    off = np.sqrt(max(np.trace(strings.scatter) - shaded, 0.0))
    return (strings.mean, ground.mean) if off < ONE_COLOUR * light else None


def loses_limbs(weights: np.ndarray, strings: Cloud, ground: Cloud) -> bool:
    """Whether strands of LIMB of their light are as bright as their ground by a hue's weights (3,),
    which show that brighter than black."""
    if summed(weights) is LUMA:
        return False
    limb = LIMB * strings.mean
    return bool((weights @ (strings.mean - ground.mean)) * (weights @ (limb - ground.mean)) < 0.0)


def find_hue(strips: list[Strip], half_core: float, between: bool = False) -> tuple[Signal, float]:
    """A signal that shadows on the ground do not change, and the separation in sd that it reaches;
    0 where there is no colour."""
    return _by_clouds(shadeless_weights, strips, half_core, between)


def find_cover(strips: list[Strip], half_core: float) -> tuple[Signal, float]:
    """A signal that light on the strings does not change, which shows how much of the ground they
    cover, and the separation in sd that it reaches; 0 where there is no colour."""
    return _by_clouds(lightless_weights, strips, half_core, between=True)


def _by_clouds(
    weigh: Callable[[Cloud, Cloud], tuple[np.ndarray, float]],
    strips: list[Strip],
    half_core: float,
    between: bool,
) -> tuple[Signal, float]:
    """The signal of the channels' weights that tell what lies on the axis from what lies beside."""
    inner, outer = np.zeros((0, 3)), np.zeros((0, 3))
    if strips[0].values.ndim == 3:
        inner, outer = _samples(strips, half_core, between)
    if min(len(inner), len(outer)) < FEWEST:
        return LUMA, 0.0
    weights, separation = weigh(central_cloud(inner), central_cloud(outer))
    return summed(weights), separation


def of_bundle(strengths: np.ndarray) -> np.ndarray:
    """Which columns (M,) stand out as the bundle does, and not as ground between legs."""
    return np.asarray(strengths >= BUNDLE * np.percentile(strengths, STRONGEST))


def _samples(strips: list[Strip], half_core: float, between: bool) -> tuple[np.ndarray, np.ndarray]:
    """Colours (K, 3) on the axis of some strips, and (L, 3) on the ground beside it."""
    core, ground = [], []
    for strip in strips:
        axis, beside = _rows(strip, half_core)
        inner = _off_ground(axis, beside) if between else axis
        core.append(_some(inner.reshape(-1, 3)))
        ground.append(_some(beside.reshape(-1, 3)))
    inner, outer = np.concatenate(core), np.concatenate(ground)
    return inner[~np.isnan(inner).any(1)], outer[~np.isnan(outer).any(1)]


def _side_px(half_core: float, parts: float = CALM) -> int:
    """Side of squares much smaller than strands."""
    return max(round(half_core / parts), 1)


def _calmed(strip: Strip, half_core: float, parts: float = CALM) -> Strip:
    """A strip without the pixels' noise, which hides what strands of several kinds have apart."""
    return replace(strip, values=averaged(strip.values, _side_px(half_core, parts)))


def _is_noisy(strips: list[Strip], calm: list[Strip], half_core: float) -> bool:
    """Whether noise counts beside what the strings differ from their ground by: a distance from the
    ground's colour is the longer for it."""
    steps, away = [], []
    for strip, quiet in zip(strips, calm, strict=True):
        axis, beside = (_known(rows) for rows in _rows(quiet, half_core))
        _, ground = _rows(strip, half_core)
        apart = _known(np.diff(ground[::NEIGHBOURS], axis=1))
        if min(len(axis), len(beside), len(apart)) > 0:
            steps.append(np.median(np.linalg.norm(apart, axis=1)))
            away.append(np.median(np.linalg.norm(axis - np.median(beside, axis=0), axis=1)))
    return len(steps) > 0 and bool(np.median(steps) > NOISY * np.median(away))


def _known(values: np.ndarray) -> np.ndarray:
    """Those of the values (K, M) or (K, M, 3) that are known, (n, 1) or (n, 3)."""
    some = values.reshape(values.shape[0] * values.shape[1], -1)
    return np.asarray(some[np.isfinite(some).all(axis=1)])


def _rows(strip: Strip, half_core: float) -> tuple[np.ndarray, np.ndarray]:
    """A strip's values on its axis and on the ground beside it."""
    n = np.abs(np.arange(-strip.half_px, strip.half_px + 1))
    return strip.values[n < max(CORE * half_core, 1.0)], strip.values[n > GROUND * half_core]


def _stretches(axis: np.ndarray, half_core: float) -> Iterator[np.ndarray]:
    """What lies on an axis (K, M) or (K, M, 3), by stretches of WINDOW half cores."""
    window = max(round(WINDOW * half_core), 1)
    for first in range(0, axis.shape[1] - window + 1, window):
        yield axis[:, first : first + window]


def _windows(strips: list[Strip], half_core: float) -> list[np.ndarray]:
    """Colours (K, M, 3) in each stretch of the axis of some strips, from one side to the other."""
    return [
        stretch for strip in strips for stretch in _stretches(_rows(strip, half_core)[0], half_core)
    ]


def _across(values: np.ndarray, which: np.ndarray) -> np.ndarray:
    """By how much values (K, M, ...) differ from one side of the axis, where their rows begin, to
    the other, of those (K, M) asked for; 0 where one side has none."""
    half = len(values) // 2
    sides = values[:half][which[:half]], values[-half:][which[-half:]]
    if min(len(side) for side in sides) == 0:
        return np.zeros(values.shape[2:])
    return np.asarray(sides[0].mean(axis=0) - sides[1].mean(axis=0))


def _lie_beside(across: list[np.ndarray], apart: list[float]) -> bool:
    """Whether what differs so much from one side of the axis to the other, window by window, does
    so all along, by a fair part of what it is apart."""
    return bool(np.linalg.norm(np.mean(across, axis=0)) > BESIDE * np.mean(apart))


def _some(samples: np.ndarray) -> np.ndarray:
    return samples[:: max(1, len(samples) // SAMPLES)]


def _off_ground(axis: np.ndarray, beside: np.ndarray) -> np.ndarray:
    """Those columns of what lies on the axis (K, M, 3) that are unlike what lies beside it there
    (R, M, 3): the separator's plate, which lies across the strip, is not."""
    some = beside[:: max(1, len(beside) // ROWS)]
    ground = np.stack([nan_median(some[..., c]) for c in range(3)], axis=1)
    away = np.linalg.norm(np.median(axis, axis=0) - ground, axis=1)
    known = np.isfinite(away)
    if not known.any():
        return axis
    return axis[:, known][:, of_bundle(away[known])]


def many_coloured(windows: list[np.ndarray], outer: np.ndarray) -> bool:
    """Whether strands of several hues wind about each other: in many of the stretches of the axis
    that show strings their chromaticity, which shading leaves alone, spreads. A connector, a plate
    and the strings before them are each of their own. Strings and their shadow on a ground of
    another hue lie side by side.

    windows: of (K, M, 3) linear BGR on the axis, outer (m, 3) beside it.
    """
    ground = np.median(outer, axis=0)
    spread = _spread(np.abs(outer - ground))
    # On a ground of uneven brightness strings are told by hue alone.
    middle, typical = _ground_hue(outer)
    shown, spreads, across = 0, [], []
    for some in windows:
        hues = _hue_of(some)
        far = np.sqrt((((some - ground) / spread) ** 2).mean(axis=-1)) > FAR
        other = np.linalg.norm(hues - middle, axis=-1) > OTHER_HUE * typical
        strings = (far | other) & (some.sum(axis=-1) > LIT)
        if strings.sum() <= max(OF_WINDOW * np.isfinite(some[..., 0]).sum(), 4):
            continue
        shown += 1
        low, high = np.percentile(hues[strings], [25.0, 75.0], axis=0)
        apart = float(np.linalg.norm(high - low))
        if apart > SEVERAL_HUES:
            spreads.append(apart)
            across.append(_across(hues, strings))
    return shown > 0 and len(spreads) / shown > OFTEN and not _lie_beside(across, spreads)


def black_among(windows: list[np.ndarray], outer: np.ndarray) -> bool:
    """Whether black strands wind about others of another hue than the ground's. Black itself has no
    hue, and lies no further off a dark ground's light than that does from its own. A limb in the
    dark has its string's.

    windows, outer: as for `many_coloured`.
    """
    ground = np.median(outer, axis=0)
    if ground.sum() < 2.0 * LIT:
        return False
    hue, typical = _ground_hue(outer)
    shown, across = 0, []
    for some in windows:
        known = np.isfinite(some).all(axis=-1)
        dark = some.sum(axis=-1) < LIT
        other = ~dark & (np.linalg.norm(_hue_of(some) - hue, axis=-1) > OTHER_HUE * typical)
        if other.sum() > OF_EITHER * known.sum():
            shown += 1
            black = dark.sum() > BLACK * known.sum()
            if black and not _has_hue_of(some[dark], some[other]):
                across.append(_across(dark.astype(float), dark | other))
    return shown > 0 and len(across) / shown > OFTEN and not _lie_beside(across, [1.0])


def _has_hue_of(dark: np.ndarray, strings: np.ndarray) -> bool:
    """Whether what is dark (n, 3) has rather the strings' (m, 3) hue than none."""
    of_dark = _hue_of(np.median(dark, axis=0, keepdims=True))[0]
    of_strings = np.median(_hue_of(strings), axis=0)
    away, from_none = (np.linalg.norm(of_dark - hue) for hue in (of_strings, NO_HUE))
    return bool(away < LIKE_STRINGS * from_none)


def _ground_hue(outer: np.ndarray) -> tuple[np.ndarray, float]:
    """The ground's hue (3,), and how far from it that of its samples lies."""
    hues = _hue_of(outer)
    middle = np.median(hues, axis=0)
    return middle, float(_spread(np.linalg.norm(hues - middle, axis=1)))


def _spread(away: np.ndarray) -> np.ndarray:
    """Robust sd of what lies so far from its median, along the first axis."""
    return np.asarray(1.4826 * np.median(away, axis=0) + FLOOR)


def _hue_of(samples: np.ndarray) -> np.ndarray:
    return samples / np.maximum(np.linalg.norm(samples, axis=-1, keepdims=True), 1e-9)


def distance_for(inner: np.ndarray, outer: np.ndarray) -> Signal:
    """The distance for strings of several colours: across the ground's own where they stand out
    there, so that light and shadow on the ground need not count; in all directions elsewhere."""
    ground = np.median(outer, axis=0)
    light = float(np.linalg.norm(ground))
    unit = ground / max(light, 1e-9)
    away = inner - ground
    # However bright the brightest on the axis is - a connector, strands of the other colour.
    plain = float(np.median(np.linalg.norm(outer - ground, axis=1)))
    out = np.linalg.norm(away, axis=1) > OFF * plain
    away = away[out] if out.any() else away
    if light < SHADOWS * float(np.median(np.linalg.norm(away, axis=1))):
        return DISTANCE
    along = away @ unit
    across = np.linalg.norm(away - along[:, None] * unit, axis=1)
    noise = np.median(np.linalg.norm(outer - (outer @ unit)[:, None] * unit, axis=1))
    least = max(ACROSS * light, OFF * noise)
    of_its_hue = (across < least) & ((along > BRIGHTER * light) | (along < -DARKER * light))
    enough = np.percentile(across, MIXED) > least and of_its_hue.mean() < OF_ITS_HUE
    return Signal(Way.ACROSS, unit.astype(np.float32)) if enough else DISTANCE


def are_both_ways(strips: list[Strip], half_core: float) -> bool:
    """Whether strands brighter than the ground wind about darker ones, black and white on grey.

    Both are then found in many of the windows of the axis that show strings, now on one side of it
    and now on the other; a connector and the strings before it, the gleam of dark strings, or the
    shadow of bright ones, are not.
    """
    shown, across = 0, []
    for strip in strips:
        calm = _calmed(strip, half_core, CALMER)
        axis, outer = (project(rows, LUMA_BGR) for rows in _rows(calm, half_core))
        away, spreads = [], []
        # From the ground beside them: that of a whole picture is less even.
        for some, beside in zip(
            _stretches(axis, half_core), _stretches(outer, half_core), strict=True
        ):
            known = beside[np.isfinite(beside)]
            if known.size:
                ground = float(np.median(known))
                away.append(some - ground)
                spreads.append(float(_spread(np.abs(known - ground))))
        least = CLEARLY * float(np.median(spreads)) if spreads else np.inf
        for some in away:
            brighter, darker = ((way * some > least).mean() > OF_EITHER for way in (1, -1))
            shown += int(brighter or darker)
            if brighter and darker:
                across.append(_across((some > 0.0).astype(float), np.abs(some) > least))
    return shown > 0 and len(across) / shown > OFTEN and not _lie_beside(across, [1.0])
