"""Volume conserving radius: a twisted string of fixed length thickens as it shortens."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from tsvision.models.shelf import DisplacementModel
from tsvision.units import RAD_PER_TURN, rad_to_turns, turns_to_rad

LARGEST_TWIST = 2 / (3 * np.sqrt(3.0))  # of (r₀ α / L)²; reached at a height of L/√3


def displacement_mm(
    turns: ArrayLike, *, twisting_zone_mm: ArrayLike, radius_mm: ArrayLike
) -> np.ndarray:
    """x = L (1 - h), h the larger root of h³ - h + (r₀ α/L)² = 0; NaN past the largest twist."""
    length = np.asarray(twisting_zone_mm, dtype=float)
    return length * (1 - _height(turns, length, radius_mm))


def slope_mm_per_turn(
    turns: ArrayLike, *, twisting_zone_mm: ArrayLike, radius_mm: ArrayLike
) -> np.ndarray:
    """dx/dturns from the cubic: dh/dk = -1 / (3 h² - 1), k = (r₀ α/L)²."""
    length = np.asarray(twisting_zone_mm, dtype=float)
    radius = np.asarray(radius_mm, dtype=float)
    height = _height(turns, length, radius)
    dk_dturn = 2 * turns_to_rad(turns) * RAD_PER_TURN * (radius / length) ** 2
    return length * dk_dturn / (3 * height**2 - 1)


def turns_for_displacement(
    displacement_mm: ArrayLike, *, twisting_zone_mm: ArrayLike, radius_mm: ArrayLike
) -> np.ndarray:
    """The turns >= 0 that give x; NaN outside 0 <= x <= L (1 - 1/√3)."""
    length = np.asarray(twisting_zone_mm, dtype=float)
    height = 1 - np.asarray(displacement_mm, dtype=float) / length
    # x = 0 comes back from the cosine a few units in the last place off.
    sound = (height <= 1 + 1e-12) & (height >= 1 / np.sqrt(3.0))
    twist = np.sqrt(np.where(sound, np.maximum(height - height**3, 0.0), np.nan))
    return rad_to_turns(twist * length / np.asarray(radius_mm, dtype=float))


def _height(turns: ArrayLike, length: np.ndarray, radius_mm: ArrayLike) -> np.ndarray:
    """Trigonometric solution of the depressed cubic: its largest root, 1 at zero turns."""
    k = (turns_to_rad(turns) * np.asarray(radius_mm, dtype=float) / length) ** 2
    cosine = np.where(k <= LARGEST_TWIST, -k / LARGEST_TWIST, np.nan)
    return 2 / np.sqrt(3.0) * np.cos(np.arccos(cosine) / 3)


MODEL = DisplacementModel(
    name="volume_conserving",
    title="Volume conserving radius (Hanlan, Davis & Durian)",
    equation="H² = L² − (α r)² with r² H = r₀² L; x = L − H",
    parameters=("twisting_zone_mm", "radius_mm"),
    assumptions=(
        "no separator: `twisting_zone_mm` is the string's own length at rest",
        "the bundle stays a solid cylinder of constant volume, so it thickens as it shortens",
    ),
    source="Hanlan, Davis & Durian, Soft Matter 2023, 'Twist and measure'",
    fails="ends at x = 0.42 L; with a separator, conserved volume is variable_radius instead",
    free=("radius_mm",),
    displacement_mm=displacement_mm,
    slope_mm_per_turn=slope_mm_per_turn,
    turns_for_displacement=turns_for_displacement,
    separator=False,
)
