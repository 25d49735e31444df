"""The actuator that mechanisms act on: under which conditions it is read, and how it stands."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# What a table says of the actuators in it, as against how they were moved.
NOMINAL = (
    "twisting_zone_mm",
    "hole_distance_mm",
    "radius_mm",
    "string_diameter_mm",
    "strings",
    "load_N",
)


@dataclass(frozen=True)
class Conditions:
    """Under which conditions something was observed: arrays of shape (m,), one entry each.

    `turns` are motor turns (unsigned), `peak_turns` those from which the motor last turned back
    (where it winds, the most since it began to), `tension_N` is F/N. Unknown loads and times are
    NaN; then no shape that `needs` them is used.
    """

    turns: np.ndarray
    load_N: np.ndarray
    strings: np.ndarray
    string_diameter_mm: np.ndarray
    twisting_zone_mm: np.ndarray
    hole_distance_mm: np.ndarray
    radius_mm: np.ndarray
    unwinding: np.ndarray
    peak_turns: np.ndarray
    time_s: np.ndarray
    cycle: np.ndarray
    run: np.ndarray

    @property
    def tension_N(self) -> np.ndarray:
        return self.load_N / self.strings

    def take(self, index: np.ndarray) -> Conditions:
        """The conditions at `index` (any NumPy index of the first axis)."""
        return Conditions(
            **{name: getattr(self, name)[index] for name in self.__dataclass_fields__}
        )


@dataclass(frozen=True)
class Reference:
    """What "typical" and "lowest" mean: scalars of the fitted data, kept when predicting."""

    span_turns: float
    gap_turns: float  # between neighbouring turn levels
    span_s: float
    load_min_N: float
    load_mean_N: float
    load_max_N: float
    tension_min_N: float
    tension_mean_N: float
    radius_mm: float
    zone_mm: float
    hole_mm: float
    one: float = 1.0

    @classmethod
    def of(cls, data: Conditions) -> Reference:
        """The scalars of fitted data; what is unknown there stays NaN."""
        levels = np.unique(np.round(data.turns, 6))
        gaps = np.diff(levels)
        tension = data.tension_N[data.tension_N > 0]
        load = data.load_N[data.load_N > 0]
        time = data.time_s[np.isfinite(data.time_s)]
        nan = float("nan")
        return cls(
            span_turns=float(levels[-1]) or 1.0,
            gap_turns=float(np.median(gaps)) if gaps.size else 1.0,
            span_s=max(float(time.max()), 1e-9) if time.size else nan,
            load_min_N=float(load.min()) if load.size else nan,
            load_mean_N=float(load.mean()) if load.size else nan,
            load_max_N=float(load.max()) if load.size else nan,
            tension_min_N=float(tension.min()) if tension.size else nan,
            tension_mean_N=float(tension.mean()) if tension.size else nan,
            radius_mm=float(data.radius_mm.mean()),
            zone_mm=float(data.twisting_zone_mm.mean()),
            hole_mm=float(data.hole_distance_mm.mean()) or 1.0,
        )


@dataclass(frozen=True)
class State:
    """The actuator while the stages run; arrays broadcast to (B, m), B parameter sets at once.

    `alpha_rad` is the rotation that lays the strands, `coiled_rad` what coils took up instead,
    `reached_rad` what reached the bundle at all, knots and coils included,
    `camera` the factor by which the camera enlarges, `torque_extra_Nmm` torque beyond F dx/dα,
    `legs` a factor on the turns that the way from the holes to the bundle is worth.
    """

    at: Conditions
    reference: Reference
    alpha_rad: np.ndarray
    reached_rad: np.ndarray
    radius_mm: np.ndarray
    zone_mm: np.ndarray
    hole_mm: np.ndarray
    displacement_mm: np.ndarray
    camera: np.ndarray
    torque_extra_Nmm: np.ndarray
    coiled_rad: np.ndarray
    legs: np.ndarray


def bounded(number: np.ndarray, low: float, high: float) -> np.ndarray:
    """`np.clip` without its overhead; the solver may step a little beyond a bound."""
    return np.minimum(np.maximum(number, low), high)


def softplus(number: np.ndarray, width: np.ndarray | float) -> np.ndarray:
    """A hinge max(number, 0) rounded over `width`, without overflow."""
    return width * np.logaddexp(0.0, number / width)


def tension_at(state: State, radius_mm: np.ndarray) -> np.ndarray:
    """A string's tension in N, T = F / (N cos β), for a trial radius.

    Turns that coil the bundle count too: on its way round the coil a string leans no less.
    """
    lay = (state.alpha_rad + state.coiled_rad) * radius_mm / state.zone_mm
    return state.at.tension_N * np.sqrt(1.0 + lay * lay)
