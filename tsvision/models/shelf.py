"""What a model on the shelf is: functions plus the words that belong to them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tsvision.errors import InputError

# keyword -> (unit, meaning). Every model takes a subset of these, by these names.
GEOMETRY: dict[str, tuple[str, str]] = {
    "twisting_zone_mm": ("mm", "L, separator's exit face to motor connector"),
    "hole_distance_mm": ("mm", "S, between the separator's holes"),
    "radius_mm": ("mm", "r, radius of the bundle, D/2 with D its outer diameter"),
    "string_diameter_mm": ("mm", "d, one string under load"),
    "centre_radius_mm": ("mm", "a, radius of the outermost strands' centre lines, (D - d)/2"),
    "pitch_mm": ("mm", "p, length of one full revolution of the strands beside the separator"),
}


@dataclass(frozen=True)
class DisplacementModel:
    """A displacement model: x(turns) with its slope and inverse, and what it assumes.

    All three functions are vectorised and broadcast `turns` against every geometry keyword.
    Displacement in mm, slope in mm per turn; NaN where the model has no solution.
    `parameters` names the geometry keywords that it takes (all are needed); `free` names those
    that a refit to data may change. `only_strings`: the one N that it holds for, None for any.
    `separator`: whether string comes through one's holes, else the string has a length of its own.
    """

    name: str
    title: str
    equation: str
    parameters: tuple[str, ...]
    assumptions: tuple[str, ...]
    source: str
    fails: str
    free: tuple[str, ...]
    displacement_mm: Callable[..., np.ndarray]
    slope_mm_per_turn: Callable[..., np.ndarray]
    turns_for_displacement: Callable[..., np.ndarray]
    only_strings: int | None = None
    separator: bool = True

    def geometry(self, known: Mapping[str, ArrayLike]) -> dict[str, ArrayLike]:
        """Pick this model's keywords out of all that is known; InputError if one is missing."""
        lacking = [name for name in self.parameters if name not in known]
        if lacking:
            raise InputError(f"model '{self.name}' needs {', '.join(lacking)}; give them too")
        return {name: known[name] for name in self.parameters}


@dataclass(frozen=True)
class BundleSection:
    """A model of the bundle's cross-section: outer diameter D for N strings of diameter d."""

    name: str
    title: str
    equation: str
    assumptions: tuple[str, ...]
    source: str
    fails: str
    bundle_diameter_mm: Callable[..., np.ndarray]
    centres: Callable[[int], np.ndarray] | None  # strand centres in units of d, shape (N, 2)
