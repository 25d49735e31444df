"""What a mechanism on the shelf is.

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

from tsvision.mechanisms.state import State

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
    jumps: bool = False  # at its `onset_turns`, from one row to the next


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
    """A base model (one of `diagnosis.simulate.QUESTIONABLE`) with parts added to it."""

    parts: tuple[Part, ...] = ()
    base: str = "constant_radius"

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(part.mechanism for part in self.parts)
