"""Scale from a ruler: the rhythm of its ticks along a line through them."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from tsvision.errors import InputError
from tsvision.images.calibration import Calibration
from tsvision.images.frames_picture import to_luma
from tsvision.images.linear import to_linear
from tsvision.images.strip import cut_strip, straight_axis

_HALF_PX = 3  # the line is averaged over 7 px across
_FEWEST_TICKS = 6
_CLEAR = 5.0  # how far the tick's peak must stand out of the spectrum


def from_ruler(
    pixels: np.ndarray,
    first_px: tuple[float, float],
    second_px: tuple[float, float],
    division_mm: float,
    gamma: float = float("nan"),
) -> Calibration:
    """Scale half-way along a line that crosses every tick of a ruler; one division is known.

    The frequency comes from the phase of the ticks, fitted by a parabola along the line, so that
    perspective does not bias the middle; its change along the line is told. Raises InputError
    when no steady rhythm is there.
    """
    profile = _profile(pixels, first_px, second_px, gamma)
    cycles_per_px = _coarse(profile)
    fine, sd, change = _refine(profile, cycles_per_px)
    scale = fine * division_mm
    found = {
        "ticks": fine * len(profile),
        "division_px": 1.0 / fine,
        "change_along_percent": 100.0 * change,
    }
    notes = ()
    if abs(change) > 0.01:
        notes = ("the scale changes along the ruler by more than 1 %: it is tilted to the camera",)
    return Calibration(scale, {"ticks": sd * division_mm}, "ruler", found=found, notes=notes)


def _profile(
    pixels: np.ndarray,
    first_px: tuple[float, float],
    second_px: tuple[float, float],
    gamma: float,
) -> np.ndarray:
    """Light along the line, (n,), without its slow changes."""
    axis = straight_axis(np.array(first_px, dtype=float), np.array(second_px, dtype=float))
    if not axis.length_px >= 20:
        raise InputError("ruler: the two points must lie at least 20 px apart")
    picture = to_linear(to_luma(pixels), gamma)
    strip = cut_strip(picture, axis, (0.0, axis.length_px), _HALF_PX)
    light = strip.values.mean(axis=0, dtype=float)
    if not np.isfinite(light).all():
        raise InputError("ruler: the line leaves the picture; choose points inside it")
    return light - gaussian_filter1d(light, max(4.0, len(light) / 8), mode="nearest")


def _coarse(profile: np.ndarray) -> float:
    """The ticks' frequency to about a tenth of a bin, in cycles per px."""
    count = len(profile)
    window = np.hanning(count)
    padded = 1 << int(np.ceil(np.log2(8 * count)))
    power = np.abs(np.fft.rfft(profile * window, padded)) ** 2
    frequency = np.fft.rfftfreq(padded)
    usable = (frequency > _FEWEST_TICKS / count) & (frequency < 0.45)
    if not usable.any():
        raise InputError("ruler: the line is too short; it must cross at least 6 ticks")
    best = int(np.argmax(np.where(usable, power, 0.0)))
    floor = float(np.mean(power[usable]))
    if not power[best] > _CLEAR * floor:
        raise InputError("ruler: no steady ticks along the line; lay it across all of them")
    return float(frequency[best])


def _refine(profile: np.ndarray, cycles_per_px: float) -> tuple[float, float, float]:
    """Frequency in the middle, its standard uncertainty, and its relative change end to end."""
    s = np.arange(len(profile)) - (len(profile) - 1) / 2
    smooth_px = 1.0 / cycles_per_px
    carrier = profile * np.exp(-2j * np.pi * cycles_per_px * s)
    slow = gaussian_filter1d(carrier.real, smooth_px) + 1j * gaussian_filter1d(
        carrier.imag, smooth_px
    )
    edge = int(np.ceil(2 * smooth_px))
    inner = slice(edge, len(profile) - edge)
    if len(profile) - 2 * edge < 3 * smooth_px:
        raise InputError("ruler: the line is too short; it must cross at least 8 ticks")
    cycles = np.unwrap(np.angle(slow[inner])) / (2 * np.pi)
    fit, residual, *_ = np.polyfit(s[inner], cycles, 2, full=True)
    rms = float(np.sqrt(residual[0] / len(cycles))) if len(residual) else 0.0
    independent = max(2.0, (len(profile) - 2 * edge) / (3.5 * smooth_px))
    span = len(profile) - 2 * edge
    sd = rms * np.sqrt(12.0 / independent) / span
    frequency = cycles_per_px + fit[1]
    change = 2 * fit[0] * len(profile) / frequency
    return float(frequency), float(sd), float(change)
