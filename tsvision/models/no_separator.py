"""No separator and no offset: a string of fixed length shortens as it is twisted."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from tsvision.models.shelf import DisplacementModel
from tsvision.units import RAD_PER_TURN, rad_to_turns, turns_to_rad


def displacement_mm(
    turns: ArrayLike, *, twisting_zone_mm: ArrayLike, radius_mm: ArrayLike
) -> np.ndarray:
    """x = L - √(L² - (α r)²) in mm; NaN once α r exceeds the string's length L. Broadcasts."""
    length = np.asarray(twisting_zone_mm, dtype=float)
    return length - _height_mm(turns, length, radius_mm)


def slope_mm_per_turn(
    turns: ArrayLike, *, twisting_zone_mm: ArrayLike, radius_mm: ArrayLike
) -> np.ndarray:
    """dx/dturns = 2π r (α r) / √(L² - (α r)²)."""
    radius = np.asarray(radius_mm, dtype=float)
    return (
        RAD_PER_TURN
        * radius
        * turns_to_rad(turns)
        * radius
        / _height_mm(turns, np.asarray(twisting_zone_mm, dtype=float), radius)
    )


def turns_for_displacement(
    displacement_mm: ArrayLike, *, twisting_zone_mm: ArrayLike, radius_mm: ArrayLike
) -> np.ndarray:
    """The turns >= 0 that give x; NaN outside 0 <= x <= L."""
    length = np.asarray(twisting_zone_mm, dtype=float)
    x = np.asarray(displacement_mm, dtype=float)
    squared = np.where((x >= 0) & (x <= length), x * (2 * length - x), np.nan)
    return rad_to_turns(np.sqrt(squared) / np.asarray(radius_mm, dtype=float))


def _height_mm(turns: ArrayLike, length: np.ndarray, radius_mm: ArrayLike) -> np.ndarray:
    squared = length**2 - (turns_to_rad(turns) * np.asarray(radius_mm, dtype=float)) ** 2
    return np.sqrt(np.where(squared >= 0, squared, np.nan))


MODEL = DisplacementModel(
    name="no_separator",
    title="Plain twisted string, no separator, no offset",
    equation="x = L − √(L² − (α r)²), L = the string's own length",
    parameters=("twisting_zone_mm", "radius_mm"),
    assumptions=(
        "no separator: the whole string twists, `twisting_zone_mm` is its length at rest",
        "both ends attached on the axis; one helix of constant radius; no stretch",
    ),
    source="Würtz, May, Holz, Natale, Palli & Melchiorri 2010; Palli et al. 2013",
    fails="with a separator it runs out of string: no solution past α r = L",
    free=("radius_mm",),
    displacement_mm=displacement_mm,
    slope_mm_per_turn=slope_mm_per_turn,
    turns_for_displacement=turns_for_displacement,
    separator=False,
)
