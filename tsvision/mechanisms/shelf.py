"""What a mechanism on the shelf is, and the state of the actuator that it changes.

A mechanism is a claim with one or more shapes; a shape has parameters and acts on the state at
one or more stages. The stages run in a fixed order, so that mechanisms compose whichever is
added first: motor (turns on their way to the bundle) -> knots (turns that lay nothing) -> coils
(turns that lay no strands) -> geometry -> tension -> [base model] -> draw (what changes the
displacement) -> view (camera).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

STAGES = ("motor", "knots", "coils", "geometry", "tension", "draw", "view")
OBSERVABLES: dict[str, str] = {
    "displacement_mm": "mm",
    "diameter_mm": "mm",
    "helix_angle_deg": "deg",
    "hole_distance_mm": "mm",
    "twist_turns": "turns",
    "pitch_mm": "mm",
    "turns_seen": "turns",
    "torque_Nmm": "N mm",
}
# What shows how far the bundle was turned.
SHOW_ROTATION = (
    "displacement_mm",
    "helix_angle_deg",
    "twist_turns",
    "torque_Nmm",
    "pitch_mm",
    "turns_seen",
)


@dataclass(frozen=True)
class Conditions:
    """Under which conditions something was observed: arrays of shape (m,), one entry each.

    `turns` are motor turns (unsigned), `peak_turns` the largest of the run so far, `tension_N` is
    F/N. Unknown loads and times are NaN; then no shape that `needs` them is used.
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

    def cos_helix(self) -> np.ndarray:
        """cos β of the zone's mean helix, tan β = α r / L."""
        return self.zone_mm / np.hypot(self.zone_mm, self.alpha_rad * self.radius_mm)


Values = Mapping[str, np.ndarray]  # parameter name -> array (B, 1)
Effect = Callable[[State, Values], dict[str, np.ndarray]]  # the fields of the state it replaces


@dataclass(frozen=True)
class Parameter:
    """One free number of a shape, with its unit, bounds and prior.

    `prior`: "normal" (about 0 with standard deviation `typical`, cut at the bounds), "uniform"
    between the bounds, or "log_uniform". `of` scales low, high and typical by something of the
    data, a field of `Reference`: radius_mm, span_turns, tension_mean_N …, or one.
    `starts` are the values tried first, in units of `typical` (normal) or as a share of the range.
    `null` is where the mechanism vanishes, None where the parameter only shapes it.
    """

    name: str
    unit: str
    meaning: str
    low: float
    high: float
    typical: float = 1.0
    prior: str = "normal"
    of: str = "one"
    starts: tuple[float, ...] = (0.5,)
    null: float | None = 0.0


@dataclass(frozen=True)
class Shape:
    """One formula for a mechanism: parameters and what it does at which stage."""

    name: str
    equation: str
    parameters: tuple[Parameter, ...]
    effects: Mapping[str, Effect]
    needs: frozenset[str] = frozenset()  # of: load, loads, time, unwinding, bundles
    log_odds: float = 0.0  # how likely before any data, against the other shapes


def varying(shape: Shape) -> Shape:
    """`shape` with its size (its first parameter) drifting a little with turns and load.

    Nature does not share our formulas: a cause that is 20 % stronger at one end of the data than
    at the other is still that cause, and must not call for a second one.
    """
    size = shape.parameters[0].name

    def wrapped(effect: Effect) -> Effect:
        def inner(state: State, p: Values) -> dict[str, np.ndarray]:
            turns = 2.0 * state.at.turns / state.reference.span_turns - 1.0
            load = state.at.load_N / state.reference.load_mean_N - 1.0
            drift = p["drift_with_turns"] * turns + p["drift_with_load"] * load
            drift = drift + p["drift_with_both"] * turns * load
            return effect(state, {**p, size: p[size] * (1.0 + drift)})

        return inner

    return Shape(
        f"{shape.name}_varying",
        f"{shape.equation}, its size drifting with turns and load",
        (*shape.parameters, _drift("turns"), _drift("load"), _drift("both")),
        {stage: wrapped(effect) for stage, effect in shape.effects.items()},
        shape.needs | {"loads"},
        shape.log_odds - 1.0,
    )


def easing(shape: Shape) -> Shape:
    """`shape` with its size (its first parameter) settling over the first turns, from less or from
    more: a bundle has to be laid before anything about it is what it will be."""
    size = shape.parameters[0].name

    def wrapped(effect: Effect) -> Effect:
        def inner(state: State, p: Values) -> dict[str, np.ndarray]:
            missing = p["missing_at_first"] * np.exp(-state.at.turns / p["easing_turns"])
            return effect(state, {**p, size: p[size] * (1.0 - missing)})

        return inner

    return Shape(
        f"{shape.name}_easing",
        f"{shape.equation}, its size settling over the first turns",
        (*shape.parameters, *_EASING),
        {stage: wrapped(effect) for stage, effect in shape.effects.items()},
        shape.needs,
        shape.log_odds - 1.0,
    )


_EASING = (
    Parameter(
        "missing_at_first",
        "1",
        "share of the size that is not there at 0 turns (below 0: that is there besides)",
        low=-1.0,
        high=1.0,
        typical=0.4,
        starts=(0.7, -0.7),
        null=None,
    ),
    Parameter(
        "easing_turns",
        "turns",
        "turns over which it settles",
        low=0.02,
        high=0.4,
        of="span_turns",
        prior="uniform",
        starts=(0.25,),
        null=None,
    ),
)


def _drift(what: str) -> Parameter:
    return Parameter(
        f"drift_with_{what}",
        "1",
        f"relative change of the size over the range of {what}"
        + (", turns times load" if what == "both" else ""),
        low=-0.7,
        high=0.7,
        typical=0.2,
        starts=(0.0,),
        null=None,
    )


@dataclass(frozen=True)
class Mechanism:
    """A candidate cause: its claim in words, where it shows, and its shapes."""

    name: str
    title: str
    claim: str
    touches: tuple[str, ...]
    source: str
    shapes: tuple[Shape, ...]
    checks: str = ""  # what a person would look at

    def extend(self, simulation: Simulation, shape: str | None = None) -> Simulation:
        """The simulation with this mechanism added; never changes the one given."""
        found = self.shapes[0] if shape is None else self.shape(shape)
        return Simulation((*simulation.parts, Part(self.name, found)), simulation.base)

    def shape(self, name: str) -> Shape:
        """The shape called `name`; KeyError lists those that exist."""
        for shape in self.shapes:
            if shape.name == name:
                return shape
        known = ", ".join(shape.name for shape in self.shapes)
        raise KeyError(f"mechanism '{self.name}' has no shape '{name}'; there are: {known}")


@dataclass(frozen=True)
class Part:
    """A mechanism in one shape, as it stands in a simulation."""

    mechanism: str
    shape: Shape

    def key(self, parameter: str) -> str:
        return f"{self.mechanism}.{parameter}"


@dataclass(frozen=True)
class Simulation:
    """A base model (a name of `tsvision.models.MODELS`) with parts added to it."""

    parts: tuple[Part, ...] = ()
    base: str = "constant_radius"

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(part.mechanism for part in self.parts)


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
