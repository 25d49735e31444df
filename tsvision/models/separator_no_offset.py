"""Separator, but the distance between its holes is left out."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from tsvision.models.shelf import DisplacementModel
from tsvision.units import RAD_PER_TURN, rad_to_turns, turns_to_rad


def displacement_mm(
    turns: ArrayLike, *, twisting_zone_mm: ArrayLike, radius_mm: ArrayLike
) -> np.ndarray:
    """x = √(L² + (α r)²) - L in mm. Broadcasts."""
    zone = np.asarray(twisting_zone_mm, dtype=float)
    return np.hypot(zone, turns_to_rad(turns) * np.asarray(radius_mm, dtype=float)) - zone


def slope_mm_per_turn(
    turns: ArrayLike, *, twisting_zone_mm: ArrayLike, radius_mm: ArrayLike
) -> np.ndarray:
    """dx/dturns = 2π r (α r) / √(L² + (α r)²)."""
    radius = np.asarray(radius_mm, dtype=float)
    across = turns_to_rad(turns) * radius
    return RAD_PER_TURN * radius * across / np.hypot(np.asarray(twisting_zone_mm), across)


def turns_for_displacement(
    displacement_mm: ArrayLike, *, twisting_zone_mm: ArrayLike, radius_mm: ArrayLike
) -> np.ndarray:
    """The turns >= 0 that give x; NaN for x < 0."""
    x = np.asarray(displacement_mm, dtype=float)
    squared = x * (x + 2 * np.asarray(twisting_zone_mm, dtype=float))
    across = np.sqrt(np.where(x >= 0, squared, np.nan))
    return rad_to_turns(across / np.asarray(radius_mm, dtype=float))


MODEL = DisplacementModel(
    name="separator_no_offset",
    title="Constant radius, separator without S",
    equation="x = √(L² + (α r)²) − L",
    parameters=("twisting_zone_mm", "radius_mm"),
    assumptions=(
        "the string feeds freely through one point on the axis",
        "one helix of radius r over the whole zone L; no stretch",
    ),
    source="Popov, Gaponov & Ryu 2013, as quoted by Tavakoli, Batista & Neto",
    fails="too little at few turns when the holes stand apart; else as constant_radius",
    free=("radius_mm",),
    displacement_mm=displacement_mm,
    slope_mm_per_turn=slope_mm_per_turn,
    turns_for_displacement=turns_for_displacement,
)
