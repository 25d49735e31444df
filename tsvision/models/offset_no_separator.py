"""Attachment offset S, but no separator: a fixed string between two points apart."""

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
    """x = L - √(L² + S²/4 - (S/2 + |α| r)²) in mm; NaN past the end of the string. Broadcasts."""
    length = np.asarray(twisting_zone_mm, dtype=float)
    return length - _height_mm(turns, length, hole_distance_mm, radius_mm)


def slope_mm_per_turn(
    turns: ArrayLike,
    *,
    twisting_zone_mm: ArrayLike,
    hole_distance_mm: ArrayLike,
    radius_mm: ArrayLike,
) -> np.ndarray:
    """dx/dturns = 2π r (S/2 + |α| r) / (L - x), signed as the turns are."""
    radius = np.asarray(radius_mm, dtype=float)
    half = np.asarray(hole_distance_mm, dtype=float) / 2
    across = half + np.abs(turns_to_rad(turns)) * radius
    height = _height_mm(turns, np.asarray(twisting_zone_mm, dtype=float), hole_distance_mm, radius)
    sign = np.where(np.asarray(turns, dtype=float) < 0, -1.0, 1.0)
    return sign * RAD_PER_TURN * radius * across / height


def turns_for_displacement(
    displacement_mm: ArrayLike,
    *,
    twisting_zone_mm: ArrayLike,
    hole_distance_mm: ArrayLike,
    radius_mm: ArrayLike,
) -> np.ndarray:
    """The turns >= 0 that give x; NaN outside 0 <= x <= L."""
    length = np.asarray(twisting_zone_mm, dtype=float)
    half = np.asarray(hole_distance_mm, dtype=float) / 2
    x = np.asarray(displacement_mm, dtype=float)
    squared = np.where((x >= 0) & (x <= length), half**2 + x * (2 * length - x), np.nan)
    return rad_to_turns((np.sqrt(squared) - half) / np.asarray(radius_mm, dtype=float))


def _height_mm(
    turns: ArrayLike, length: np.ndarray, hole_distance_mm: ArrayLike, radius_mm: ArrayLike
) -> np.ndarray:
    half = np.asarray(hole_distance_mm, dtype=float) / 2
    across = half + np.abs(turns_to_rad(turns)) * np.asarray(radius_mm, dtype=float)
    squared = length**2 + half**2 - across**2
    return np.sqrt(np.where(squared >= 0, squared, np.nan))


MODEL = DisplacementModel(
    name="offset_no_separator",
    title="Attachment offset, no separator",
    equation="x = L − √(L² + S²/4 − (S/2 + α r)²)",
    parameters=("twisting_zone_mm", "hole_distance_mm", "radius_mm"),
    assumptions=(
        "no separator: `twisting_zone_mm` is the distance of the attachments at rest",
        "the strings are attached S apart; the offset adds to the arc α r; no stretch",
    ),
    source="after Godler & Sonoda 2010 (TwistDrive), as described by Tavakoli, Batista & Neto",
    fails="with a separator it runs out of string, a little sooner than no_separator",
    free=("radius_mm",),
    displacement_mm=displacement_mm,
    slope_mm_per_turn=slope_mm_per_turn,
    turns_for_displacement=turns_for_displacement,
    separator=False,
)
