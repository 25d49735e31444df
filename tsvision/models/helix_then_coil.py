"""Two touching strands: a straight helix at their centre radius until it locks, then coils."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from tsvision.models import coil_at_pitch, straight_then_line
from tsvision.models.shelf import DisplacementModel

LOCK_PITCH = np.pi  # in units of d: below it the strands' contact leaves the axis, a grows


def lock_turns(*, twisting_zone_mm: ArrayLike, string_diameter_mm: ArrayLike) -> np.ndarray:
    """Turns at which the straight helix locks, L / (π d)."""
    pitch = LOCK_PITCH * np.asarray(string_diameter_mm, dtype=float)
    return np.asarray(twisting_zone_mm, dtype=float) / pitch


def feed_mm_per_turn(*, string_diameter_mm: ArrayLike) -> np.ndarray:
    """String drawn per turn while coiling beside helix of pitch π d: 2.89 d (see coil_at_pitch)."""
    pitch = LOCK_PITCH * np.asarray(string_diameter_mm, dtype=float)
    return coil_at_pitch.feed_mm_per_turn(string_diameter_mm=string_diameter_mm, pitch_mm=pitch)


def displacement_mm(
    turns: ArrayLike,
    *,
    twisting_zone_mm: ArrayLike,
    hole_distance_mm: ArrayLike,
    string_diameter_mm: ArrayLike,
) -> np.ndarray:
    """Straight helix at radius d/2 up to L/(π d) turns, then 2.89 d a turn, mm. Broadcasts."""
    return straight_then_line.displacement_mm(
        turns, *_lock(twisting_zone_mm, string_diameter_mm),
        **_helix(twisting_zone_mm, hole_distance_mm, string_diameter_mm),
    )  # fmt: skip


def slope_mm_per_turn(
    turns: ArrayLike,
    *,
    twisting_zone_mm: ArrayLike,
    hole_distance_mm: ArrayLike,
    string_diameter_mm: ArrayLike,
) -> np.ndarray:
    """dx/dturns; jumps where coiling starts."""
    return straight_then_line.slope_mm_per_turn(
        turns, *_lock(twisting_zone_mm, string_diameter_mm),
        **_helix(twisting_zone_mm, hole_distance_mm, string_diameter_mm),
    )  # fmt: skip


def turns_for_displacement(
    displacement_mm: ArrayLike,
    *,
    twisting_zone_mm: ArrayLike,
    hole_distance_mm: ArrayLike,
    string_diameter_mm: ArrayLike,
) -> np.ndarray:
    """The turns >= 0 that give x; NaN below the displacement at 0 turns."""
    return straight_then_line.turns_for_displacement(
        displacement_mm, *_lock(twisting_zone_mm, string_diameter_mm),
        **_helix(twisting_zone_mm, hole_distance_mm, string_diameter_mm),
    )  # fmt: skip


def _lock(zone: ArrayLike, string: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    return (
        lock_turns(twisting_zone_mm=zone, string_diameter_mm=string),
        feed_mm_per_turn(string_diameter_mm=string),
    )


def _helix(zone: ArrayLike, hole: ArrayLike, string: ArrayLike) -> dict[str, ArrayLike]:
    centre = np.asarray(string, dtype=float) / 2
    return {"twisting_zone_mm": zone, "hole_distance_mm": hole, "radius_mm": centre}


MODEL = DisplacementModel(
    name="helix_then_coil",
    title="Straight helix at the strand centres, then coiling",
    equation="straight helix of radius d/2 up to L/(π d) turns; then + 2.89 d a turn",
    parameters=("twisting_zone_mm", "hole_distance_mm", "string_diameter_mm"),
    assumptions=(
        "two round strings that touch; no stretch, no flattening, no bending stiffness",
        "the helix locks at pitch π d, where contact leaves the axis (no solution under 2 d)",
        "past the lock coils of the ideal tight helix stand beside helix at the locked pitch",
    ),
    source=(
        "strand contact: Olsen & Bohr 2010; tight coil: Maritan, Micheletti, Trovato & Banavar "
        "2000; turns shared by twist and writhe: Călugăreanu-White-Fuller"
    ),
    fails="stiff strings coil earlier and looser: an earlier onset and about 3.26 d a turn",
    free=("string_diameter_mm",),
    displacement_mm=displacement_mm,
    slope_mm_per_turn=slope_mm_per_turn,
    turns_for_displacement=turns_for_displacement,
    only_strings=2,
)
