"""Variable radius: string volume drawn into a zone of fixed length thickens the bundle."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from tsvision.models.shelf import DisplacementModel
from tsvision.units import RAD_PER_TURN, rad_to_turns, turns_to_rad

NEWTON_STEPS = 60


def displacement_mm(
    turns: ArrayLike,
    *,
    twisting_zone_mm: ArrayLike,
    hole_distance_mm: ArrayLike,
    radius_mm: ArrayLike,
) -> np.ndarray:
    """Solve (L + x)² = L² + (S/2 + |α| r₀ u)², u = √((L + x)/L), for x in mm. Broadcasts.

    Every α has exactly one solution (the quartic in u has one sign change).
    """
    arc, half, zone = _terms(turns, hole_distance_mm, radius_mm, twisting_zone_mm)
    return zone * (_growth(arc, half, zone) ** 2 - 1)


def slope_mm_per_turn(
    turns: ArrayLike,
    *,
    twisting_zone_mm: ArrayLike,
    hole_distance_mm: ArrayLike,
    radius_mm: ArrayLike,
) -> np.ndarray:
    """dx/dturns by implicit differentiation of the quartic in u, signed as the turns are."""
    arc, half, zone = _terms(turns, hole_distance_mm, radius_mm, twisting_zone_mm)
    u = _growth(arc, half, zone)
    across = half + arc * u
    du_darc = across * u / (2 * zone**2 * u**3 - across * arc)
    sign = np.where(np.asarray(turns, dtype=float) < 0, -1.0, 1.0)
    darc_dturn = RAD_PER_TURN * np.asarray(radius_mm, dtype=float)
    return sign * 2 * zone * u * du_darc * darc_dturn


def turns_for_displacement(
    displacement_mm: ArrayLike,
    *,
    twisting_zone_mm: ArrayLike,
    hole_distance_mm: ArrayLike,
    radius_mm: ArrayLike,
) -> np.ndarray:
    """The turns >= 0 that give x, in closed form; NaN below the displacement at 0 turns."""
    zone = np.asarray(twisting_zone_mm, dtype=float)
    x = np.asarray(displacement_mm, dtype=float)
    squared = x * (x + 2 * zone)
    across = np.sqrt(np.where(squared >= 0, squared, np.nan))
    radius = np.asarray(radius_mm, dtype=float) * np.sqrt((zone + x) / zone)
    angle = (across - np.asarray(hole_distance_mm, dtype=float) / 2) / radius
    return rad_to_turns(np.where(angle >= -1e-12, np.maximum(angle, 0.0), np.nan))


def _terms(
    turns: ArrayLike,
    hole_distance_mm: ArrayLike,
    radius_mm: ArrayLike,
    twisting_zone_mm: ArrayLike,
) -> tuple[np.ndarray, ...]:
    arc = np.abs(turns_to_rad(turns)) * np.asarray(radius_mm, dtype=float)
    half = np.asarray(hole_distance_mm, dtype=float) / 2
    return np.broadcast_arrays(arc, half, np.asarray(twisting_zone_mm, dtype=float))


def _growth(arc: np.ndarray, half: np.ndarray, zone: np.ndarray) -> np.ndarray:
    """u >= 1 with L² u⁴ = L² + (S/2 + arc u)².

    Newton from above converges monotonically: right of its root the quartic is convex.
    """
    u = np.maximum(1.0, 2 * (arc / zone + np.sqrt(half / zone) + 1))
    for _ in range(NEWTON_STEPS):
        across = half + arc * u
        value = zone**2 * (u**4 - 1) - across**2
        slope = 4 * zone**2 * u**3 - 2 * across * arc
        step = value / slope
        u = u - step
        if np.all(np.abs(step) <= 1e-14 * u):
            break
    return u


MODEL = DisplacementModel(
    name="variable_radius",
    title="Variable radius (self-consistent)",
    equation="x = √(L² + (S/2 + α r)²) − L with r = r₀ √((L + x)/L)",
    parameters=("twisting_zone_mm", "hole_distance_mm", "radius_mm"),
    assumptions=(
        "as constant radius, but the zone stays evenly filled: its volume grows as L + x",
        "strings keep their packing while the bundle thickens",
        "r and x are solved together (self-consistent), not one after the other",
    ),
    source="Tavakoli, Batista & Neto, eq. (3), after Popov, Gaponov & Ryu 2012-2013",
    fails="in overtwist the string coils instead of thickening: several times too much",
    free=("radius_mm",),
    displacement_mm=displacement_mm,
    slope_mm_per_turn=slope_mm_per_turn,
    turns_for_displacement=turns_for_displacement,
)
