"""Constant radius with the distance between the separator's holes: the paper's model."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from tsvision.models.shelf import DisplacementModel
from tsvision.units import RAD_PER_TURN, rad_to_turns, turns_to_rad


def displacement_mm(
    turns: ArrayLike,
    *,
    twisting_zone_mm: ArrayLike,
    hole_distance_mm: ArrayLike,
    radius_mm: ArrayLike,
) -> np.ndarray:
    """x = √(L² + (S/2 + |α| r)²) - L in mm; α = 2π turns. Broadcasts.

    At 0 turns x is √(L² + S²/4) - L, the string's way to its hole, as in the paper.
    """
    zone = np.asarray(twisting_zone_mm, dtype=float)
    across = _across_mm(turns, hole_distance_mm, radius_mm)
    return np.hypot(zone, across) - zone


def slope_mm_per_turn(
    turns: ArrayLike,
    *,
    twisting_zone_mm: ArrayLike,
    hole_distance_mm: ArrayLike,
    radius_mm: ArrayLike,
) -> np.ndarray:
    """dx/dturns = 2π r (S/2 + |α| r) / √(L² + (S/2 + |α| r)²), signed as the turns are."""
    across = _across_mm(turns, hole_distance_mm, radius_mm)
    along = across / np.hypot(np.asarray(twisting_zone_mm, dtype=float), across)
    sign = np.where(np.asarray(turns, dtype=float) < 0, -1.0, 1.0)
    return sign * RAD_PER_TURN * np.asarray(radius_mm, dtype=float) * along


def turns_for_displacement(
    displacement_mm: ArrayLike,
    *,
    twisting_zone_mm: ArrayLike,
    hole_distance_mm: ArrayLike,
    radius_mm: ArrayLike,
) -> np.ndarray:
    """The turns >= 0 that give x; NaN below the displacement at 0 turns."""
    zone = np.asarray(twisting_zone_mm, dtype=float)
    x = np.asarray(displacement_mm, dtype=float)
    squared = x * (x + 2 * zone)
    across = np.sqrt(np.where(squared >= 0, squared, np.nan))
    angle = (across - np.asarray(hole_distance_mm, dtype=float) / 2) / np.asarray(radius_mm)
    return rad_to_turns(np.where(angle >= -1e-12, np.maximum(angle, 0.0), np.nan))


def _across_mm(turns: ArrayLike, hole_distance_mm: ArrayLike, radius_mm: ArrayLike) -> np.ndarray:
    half = np.asarray(hole_distance_mm, dtype=float) / 2
    return half + np.abs(turns_to_rad(turns)) * np.asarray(radius_mm, dtype=float)


MODEL = DisplacementModel(
    name="constant_radius",
    title="Constant radius with S (the paper's model)",
    equation="x = √(L² + (S/2 + α r)²) − L",
    parameters=("twisting_zone_mm", "hole_distance_mm", "radius_mm"),
    assumptions=(
        "the string feeds freely through the separator and does not stretch",
        "one helix of radius r = D/2 (the OUTER radius) over the whole zone L",
        "the radius stays what it is beside the separator, at any turn count and load",
        "half the hole distance adds to the arc α r as if unrolled on one triangle",
    ),
    source="Tavakoli, Batista & Neto, eq. (2); the offset S after Godler & Sonoda 2010",
    fails=(
        "too much at high load; slope still rises where measured contraction is a straight line; "
        "strand centres lie at a < D/2, so the radius stands in for coiling"
    ),
    free=("radius_mm",),
    displacement_mm=displacement_mm,
    slope_mm_per_turn=slope_mm_per_turn,
    turns_for_displacement=turns_for_displacement,
)
