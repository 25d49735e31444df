"""Scale from a ruler: the rhythm of its ticks along a line through them."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from tsvision.errors import InputError
from tsvision.images.calibration import Calibration
from tsvision.images.depth import bits_of, filled
from tsvision.images.frames_picture import to_luma
from tsvision.images.linear import to_linear
from tsvision.images.strip import cut_strip, straight_axis

_HALF_PX = 3  # the line is averaged over 7 px across
_FEWEST_TICKS = 6
_HARMONICS = 5
_NO_TICKS = "ruler: no steady ticks along the line; lay it across all of them"
_EXPLAINED = 0.5  # the least share of the line's variance that steady ticks must explain


def from_ruler(
    pixels: np.ndarray,
    first_px: tuple[float, float],
    second_px: tuple[float, float],
    division_mm: float,
    gamma: float = float("nan"),
) -> Calibration:
    """Scale half-way along a line that crosses every tick of a ruler; one division is known.

    The ticks' frequency may change along the line, so that perspective does not bias the middle;
    the change is told. Raises InputError when no steady rhythm is there.
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
    notes: tuple[str, ...] = ()
    if abs(change) > 0.01:
        notes = ("the scale changes along the ruler by more than 1 %: it is tilted to the camera",)
    return Calibration(scale, {"ticks": sd * division_mm}, "ruler", found=found, notes=notes)


def _profile(
    pixels: np.ndarray,
    first_px: tuple[float, float],
    second_px: tuple[float, float],
    gamma: float,
) -> np.ndarray:
    """Light along the line, (n,), from its mean."""
    axis = straight_axis(np.array(first_px, dtype=float), np.array(second_px, dtype=float))
    if not axis.length_px >= 20:
        raise InputError("ruler: the two points must lie at least 20 px apart")
    picture = to_linear(to_luma(filled(pixels, bits_of([pixels]))), gamma)
    strip = cut_strip(picture, axis, (0.0, axis.length_px), _HALF_PX)
    light = strip.values.mean(axis=0, dtype=float)
    if not np.isfinite(light).all():
        raise InputError("ruler: the line leaves the picture; choose points inside it")
    return light - light.mean()


def _coarse(profile: np.ndarray) -> float:
    """The ticks' frequency from the spectrum's highest peak, in cycles per px."""
    count = len(profile)
    window = np.hanning(count)
    padded = 1 << int(np.ceil(np.log2(8 * count)))
    level = np.polyval(np.polyfit(np.arange(count), profile, 3), np.arange(count))
    power = np.abs(np.fft.rfft((profile - level) * window, padded)) ** 2
    frequency = np.fft.rfftfreq(padded)
    usable = (frequency > _FEWEST_TICKS / count) & (frequency < 0.45)
    if not usable.any():
        raise InputError("ruler: the line is too short; it must cross at least 6 ticks")
    best = int(np.argmax(np.where(usable, power, 0.0)))
    if not usable[best]:  # nothing but one grey along the line
        raise InputError(_NO_TICKS)
    return float(frequency[best])


def _refine(profile: np.ndarray, cycles_per_px: float) -> tuple[float, float, float]:
    """Frequency in the middle, its standard uncertainty, and its relative change end to end.

    Least squares of a tick's shape (its first harmonics) repeated along the line with a phase of
    2π (f s + q s²); shape and background follow linearly.
    """
    s = np.arange(len(profile)) - (len(profile) - 1) / 2
    reach = s[-1]
    ground = np.polynomial.legendre.legvander(s / reach, 3)
    count = max(1, min(_HARMONICS, int(0.45 / cycles_per_px)))

    def shapes(parameters: np.ndarray) -> np.ndarray:
        cycles = parameters[0] * s + parameters[1] * s * s / reach
        phase = 2j * np.pi * np.outer(cycles, np.arange(1, count + 1))
        waves = np.exp(phase)
        return np.column_stack([ground, waves.real, waves.imag])

    def residual(parameters: np.ndarray) -> np.ndarray:
        matrix = shapes(parameters)
        return matrix @ np.linalg.lstsq(matrix, profile, rcond=None)[0] - profile

    found = least_squares(
        residual, [cycles_per_px, 0.0], x_scale=[0.1 / len(s), 0.1 / len(s)], diff_step=1e-6
    )
    spread = float(np.var(profile))
    if not np.mean(found.fun**2) < (1 - _EXPLAINED) * spread:
        raise InputError(_NO_TICKS)
    freedom = max(1, len(s) - ground.shape[1] - 2 * count - 2)
    # neighbouring samples err together: blur and the width of ticks tie some 3 px
    variance = 3.0 * float(found.fun @ found.fun) / freedom
    sd = float(np.sqrt(variance * np.linalg.inv(found.jac.T @ found.jac)[0, 0]))
    frequency = float(found.x[0])
    return frequency, sd, 4.0 * float(found.x[1]) / frequency
