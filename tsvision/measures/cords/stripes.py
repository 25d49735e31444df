"""Distance between neighbouring strands, and their sense, from the stripes that they show.

Any rope shows its strands as stripes, whether its number of strands is known or not and whether a
helix can be fitted to its outline or not. Unrolled from the cylinder that they lie on (n = R sin
theta), strands of one helix become a plane wave exp(i (k s - m theta)): k the rate along the axis,
m how many such stripes stand around, its sign the handedness. A two-dimensional spectrum over
short stretches, averaged (Welch), finds it. What lies alike on both senses of m (noise, fuzz,
uneven light) is taken off; harmonics stand at whole multiples of k and m alike and are skipped.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter, gaussian_filter1d

from tsvision.measures.helix.section import pair_core

SEEN = 0.87  # of the radius: beyond, the stripes crowd together
ANGLES = 25
MOST_AROUND = 8.0
SLOPES = (0.15, 2.5)  # tan of the angle between stripes and axis at the surface


COARSE = 0.5  # of the diameter: smoothing that leaves the bundle's own strands only
TWO_COLOURED = 2.8  # waves seen around, below which one wave spans two strands


@dataclass(frozen=True)
class Stripes:
    """repeat_px: along the axis from strand to strand, with its standard uncertainty; around: how
    many waves stand around the rope; slope: dn/ds of the stripes on the axis, > 0 for Z;
    confidence: 0..1, how far the wave's sense outweighs its mirror image; strands_a_wave: 2 where
    one wave spans two strands of unlike colour."""

    repeat_px: float
    repeat_px_sd: float
    around: float
    slope: float
    confidence: float
    strands_a_wave: int


def unroll(
    values: np.ndarray, middle_row: np.ndarray, radius_px: float
) -> tuple[np.ndarray, np.ndarray]:
    """values (R, M) seen on a cylinder around `middle_row` (M,): (A, M) at angles theta (A,)."""
    theta = np.linspace(-np.arcsin(SEEN), np.arcsin(SEEN), ANGLES)
    rows = middle_row[None, :] + radius_px * np.sin(theta)[:, None]
    low = np.clip(np.floor(rows).astype(int), 0, values.shape[0] - 2)
    part = rows - low
    column = np.arange(values.shape[1])[None, :]
    return (1.0 - part) * values[low, column] + part * values[low + 1, column], theta


def flatten(unrolled: np.ndarray, radius_px: float) -> np.ndarray:
    """Take off what changes slowly along the rope (light, shading across), (A, M) both; NaN, where
    the ground shows between strands, becomes 0."""
    known = np.isfinite(unrolled)
    if not known.any():
        return np.zeros_like(unrolled)
    part = gaussian_filter1d(known.astype(float), 3.0 * radius_px, axis=1, mode="nearest")
    seen = np.where(known, unrolled, 0.0)
    slow = gaussian_filter1d(seen, 3.0 * radius_px, axis=1, mode="nearest")
    flat = seen - slow / np.maximum(part, 1e-6)
    spread = 1.4826 * np.median(np.abs(flat[known] - np.median(flat[known]))) + 1e-9
    return np.where(known, np.clip(flat / spread, -4.0, 4.0), 0.0)


@dataclass(frozen=True)
class _Wave:
    k: float
    m: float
    share: float  # of the flattened signal's power, its mirror image's taken off
    confidence: float
    k_sd: float


def find_wave(flat: np.ndarray, theta: np.ndarray, radius_px: float) -> _Wave | None:
    """The strongest wave (k, m) of one sense in a flattened, unrolled strip (A, M)."""
    columns = flat.shape[1]
    length = int(min(columns, max(16.0 * radius_px, 32)))
    if columns < 5.0 * radius_px:
        return None
    starts = np.unique(
        np.linspace(0, columns - length, max(2 * columns // length - 1, 1)).astype(int)
    )
    around = np.arange(-MOST_AROUND, MOST_AROUND + 0.01, 0.25)
    window = np.hanning(length + 2)[1:-1]
    taper = np.cos(theta / theta[-1] * np.pi / 2 * 0.9)
    lift = np.exp(1j * np.outer(around, theta)) * taper / taper.sum()
    size = 4 * length
    k = 2.0 * np.pi * np.fft.rfftfreq(size)
    power = np.zeros((len(starts), around.size, k.size))
    total = 0.0
    for i, a in enumerate(starts):
        spectrum = np.fft.rfft(flat[:, a : a + length] * window, size, axis=1)
        power[i] = np.abs(lift @ spectrum / window.sum()) ** 2
        total += float(np.mean(flat[:, a : a + length] ** 2))
    mean = power.mean(axis=0)
    own = mean - mean[::-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = k[None, :] * radius_px / np.abs(around)[:, None]
    allowed = (np.abs(around)[:, None] >= 0.5) & (slope > SLOPES[0]) & (slope < SLOPES[1])
    allowed &= k[None, :] > 2.0 * np.pi / (0.7 * length)
    own = np.where(allowed, own, 0.0)
    j, i = divmod(int(np.argmax(own)), k.size)
    if own[j, i] <= 0.0:
        return None
    j, i = _fundamental(own, j, i, around)
    both = mean[j, i] + mean[around.size - 1 - j, i]
    centres = [_peak(k, p[j], i) for p in power]
    strong = power[:, j, i]
    k_mean = float(np.average(centres, weights=strong))
    scatter = float(np.sqrt(np.average((np.array(centres) - k_mean) ** 2, weights=strong)))
    resolved = 0.3 * 2.0 * np.pi / columns  # a peak is placed to a third of its width
    k_sd = float(np.hypot(scatter / np.sqrt(max(len(starts) / 2.0, 1.0)), resolved))
    return _Wave(
        k=_peak(k, mean[j], i),
        m=_peak(around, mean[:, i], j),
        share=4.0 * float(own[j, i]) / max(total / len(starts), 1e-12),
        confidence=float(own[j, i] / max(both, 1e-12)),
        k_sd=k_sd,
    )


def _fundamental(own: np.ndarray, j: int, i: int, around: np.ndarray) -> tuple[int, int]:
    """The peak itself, or the one at half its k and m when that is nearly as strong."""
    half_i = i // 2
    half_j = int(np.argmin(np.abs(around - 0.5 * around[j])))
    near = own[max(half_j - 2, 0) : half_j + 3, max(half_i - 3, 0) : half_i + 4]
    if near.size == 0 or near.max() < 0.5 * own[j, i]:
        return j, i
    dj, di = np.unravel_index(int(np.argmax(near)), near.shape)
    return max(half_j - 2, 0) + int(dj), max(half_i - 3, 0) + int(di)


def _peak(x: np.ndarray, y: np.ndarray, i: int) -> float:
    """Place of the maximum near index i, by a parabola."""
    low, high = max(i - 3, 0), min(i + 4, y.size)
    i = low + int(np.argmax(y[low:high]))
    if i in (0, y.size - 1):
        return float(x[i])
    a, b, c = y[i - 1 : i + 2]
    bend = a - 2.0 * b + c
    return float(x[i] + (0.5 * (a - c) / bend if bend < 0 else 0.0) * (x[1] - x[0]))


def _strands_a_wave(seen_around: float, count: int) -> int:
    """Which divisor of N the wave spans: N / m strands for the m whose R / a fits best."""
    outer = pair_core(min(count, 8))
    crowding = outer.diameter_d / (2.0 * max(float(outer.radius_d.max()), 0.25))
    options = [m for m in range(1, count + 1) if count % m == 0]
    return count // min(options, key=lambda m: abs(np.log(seen_around / (m * crowding))))


def coarse_slope(channel: np.ndarray, middle_row: np.ndarray, radius_px: float) -> float:
    """Slope, -1..1, of what is left when everything finer than the bundle's own strands is smoothed
    away; > 0 for Z. Strands may be plied themselves, the other way round as a rule: the fine
    stripes are then theirs, and the coarse bands are the bundle's.
    """
    unrolled, theta = unroll(channel, middle_row, radius_px)
    flat = flatten(unrolled, 3.0 * radius_px)
    step = radius_px * float(theta[1] - theta[0])
    sigma = (COARSE * 2.0 * radius_px / step, COARSE * 2.0 * radius_px)
    part = gaussian_filter((flat != 0.0).astype(float), sigma, mode="constant")
    coarse = gaussian_filter(flat, sigma, mode="constant") / np.maximum(part, 1e-3)
    across, along = np.gradient(coarse, step, 1.0)
    use = part > 0.5
    if not use.any():
        return 0.0
    across = across - across[use].mean()
    total = float((along[use] ** 2 + across[use] ** 2).sum())
    return -2.0 * float((along * across)[use].sum()) / total if total > 0.0 else 0.0


def find_stripes(
    channels: list[np.ndarray], middle_row: np.ndarray, radius_px: float, count: int | None = None
) -> Stripes | None:
    """Stripes of the channel that shows them best; None where no channel shows any.

    channels: pictures (R, M) of the straightened rope, any unit, NaN beside it; middle_row (M,)
    its middle; radius_px half its diameter; count: number of strands, when known.

    Strands are round: their ridges lie at the centres' radius a, inside the outer radius R, and a
    wave that stands around m times shows as one of m R / a. So strands alike in colour show at
    least the four of a pair; less than half way to that is one wave a turn, which spans two strands
    of unlike colour, and the repeat is half of it.
    """
    waves = []
    for values in channels:
        unrolled, theta = unroll(values, middle_row, radius_px)
        wave = find_wave(flatten(unrolled, radius_px), theta, radius_px)
        if wave is not None:
            waves.append(wave)
    if not waves:
        return None
    best = max(waves, key=lambda w: w.share * w.confidence)
    strands = 2 if abs(best.m) < TWO_COLOURED else 1
    if count:
        strands = _strands_a_wave(abs(best.m), count)
    repeat = 2.0 * np.pi / best.k / strands
    return Stripes(
        repeat_px=repeat,
        repeat_px_sd=repeat * best.k_sd / best.k,
        around=abs(best.m),
        slope=float(radius_px * best.k / best.m),
        confidence=best.confidence,
        strands_a_wave=strands,
    )
