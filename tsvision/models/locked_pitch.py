"""Locked pitch: past the lock, each turn is laid at the pitch seen beside the separator."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from tsvision.models import straight_then_line
from tsvision.models.shelf import DisplacementModel


def feed_mm_per_turn(*, centre_radius_mm: ArrayLike, pitch_mm: ArrayLike) -> np.ndarray:
    """String that one turn at pitch p takes: √(p² + (2π a)²), mm."""
    around = 2 * np.pi * np.asarray(centre_radius_mm, dtype=float)
    return np.hypot(np.asarray(pitch_mm, dtype=float), around)


def displacement_mm(
    turns: ArrayLike,
    *,
    twisting_zone_mm: ArrayLike,
    hole_distance_mm: ArrayLike,
    centre_radius_mm: ArrayLike,
    pitch_mm: ArrayLike,
) -> np.ndarray:
    """Straight helix at radius a up to L/p turns, then √(p² + (2π a)²) each turn, mm."""
    return straight_then_line.displacement_mm(
        turns, *_lock(twisting_zone_mm, centre_radius_mm, pitch_mm),
        **_helix(twisting_zone_mm, hole_distance_mm, centre_radius_mm),
    )  # fmt: skip


def slope_mm_per_turn(
    turns: ArrayLike,
    *,
    twisting_zone_mm: ArrayLike,
    hole_distance_mm: ArrayLike,
    centre_radius_mm: ArrayLike,
    pitch_mm: ArrayLike,
) -> np.ndarray:
    """dx/dturns; jumps at the lock."""
    return straight_then_line.slope_mm_per_turn(
        turns, *_lock(twisting_zone_mm, centre_radius_mm, pitch_mm),
        **_helix(twisting_zone_mm, hole_distance_mm, centre_radius_mm),
    )  # fmt: skip


def turns_for_displacement(
    displacement_mm: ArrayLike,
    *,
    twisting_zone_mm: ArrayLike,
    hole_distance_mm: ArrayLike,
    centre_radius_mm: ArrayLike,
    pitch_mm: ArrayLike,
) -> np.ndarray:
    """The turns >= 0 that give x; NaN below the displacement at 0 turns."""
    return straight_then_line.turns_for_displacement(
        displacement_mm, *_lock(twisting_zone_mm, centre_radius_mm, pitch_mm),
        **_helix(twisting_zone_mm, hole_distance_mm, centre_radius_mm),
    )  # fmt: skip


def _lock(zone: ArrayLike, centre: ArrayLike, pitch: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    lock_turns = np.asarray(zone, dtype=float) / np.asarray(pitch, dtype=float)
    return lock_turns, feed_mm_per_turn(centre_radius_mm=centre, pitch_mm=pitch)


def _helix(zone: ArrayLike, hole: ArrayLike, centre: ArrayLike) -> dict[str, ArrayLike]:
    return {"twisting_zone_mm": zone, "hole_distance_mm": hole, "radius_mm": centre}


MODEL = DisplacementModel(
    name="locked_pitch",
    title="Locked-pitch feed beside the separator",
    equation="x as a straight helix of radius a up to L/p turns; then + √(p² + (2π a)²) a turn",
    parameters=("twisting_zone_mm", "hole_distance_mm", "centre_radius_mm", "pitch_mm"),
    assumptions=(
        "beside the separator strands are always laid at one pitch p and centre radius a",
        "once the zone is full of turns of that pitch, each new turn draws its own string length",
        "what is laid is pushed on and stored as coils, which take up no turns themselves",
    ),
    source="this project's reading of the near-separator zoom in Tavakoli, Batista & Neto",
    fails="coils do take up turns (writhe): too much string a turn when p is long",
    free=("centre_radius_mm", "pitch_mm"),
    displacement_mm=displacement_mm,
    slope_mm_per_turn=slope_mm_per_turn,
    turns_for_displacement=turns_for_displacement,
)
