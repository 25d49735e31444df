"""Two touching strands that lock at a pitch of their own (as seen), then coil."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from tsvision.models import straight_then_line
from tsvision.models.rope_geometry import tightest_coil
from tsvision.models.shelf import DisplacementModel


def feed_mm_per_turn(*, string_diameter_mm: ArrayLike, pitch_mm: ArrayLike) -> np.ndarray:
    """String drawn per turn while coils form beside helix of pitch p: √(p² + (π d)²)/(1 + p/l).

    A further turn lengthens the bundle's own centre line by what it takes to hold one turn,
    1 / (1/p + 1/l): 1/p turns a mm as strand twist, and one turn every l mm as writhe, with
    l = √(P² + (2π R)²) of the tightest coil of a tube of diameter 2 d. Each mm of centre line
    holds √(1 + (π d/p)²) mm of string. The expression is smallest near p = π d.
    """
    string = np.asarray(string_diameter_mm, dtype=float)
    pitch = np.asarray(pitch_mm, dtype=float)
    radius, coil = tightest_coil()
    loop = 2 * np.hypot(coil, 2 * np.pi * radius) * string  # the bundle is 2 d thick
    return np.hypot(pitch, np.pi * string) / (1 + pitch / loop)


def displacement_mm(
    turns: ArrayLike,
    *,
    twisting_zone_mm: ArrayLike,
    hole_distance_mm: ArrayLike,
    string_diameter_mm: ArrayLike,
    pitch_mm: ArrayLike,
) -> np.ndarray:
    """Straight helix at radius d/2 up to L/p turns, then coiling, mm. Broadcasts."""
    return straight_then_line.displacement_mm(
        turns, *_lock(twisting_zone_mm, string_diameter_mm, pitch_mm),
        **_helix(twisting_zone_mm, hole_distance_mm, string_diameter_mm),
    )  # fmt: skip


def slope_mm_per_turn(
    turns: ArrayLike,
    *,
    twisting_zone_mm: ArrayLike,
    hole_distance_mm: ArrayLike,
    string_diameter_mm: ArrayLike,
    pitch_mm: ArrayLike,
) -> np.ndarray:
    """dx/dturns; jumps where coiling starts."""
    return straight_then_line.slope_mm_per_turn(
        turns, *_lock(twisting_zone_mm, string_diameter_mm, pitch_mm),
        **_helix(twisting_zone_mm, hole_distance_mm, string_diameter_mm),
    )  # fmt: skip


def turns_for_displacement(
    displacement_mm: ArrayLike,
    *,
    twisting_zone_mm: ArrayLike,
    hole_distance_mm: ArrayLike,
    string_diameter_mm: ArrayLike,
    pitch_mm: ArrayLike,
) -> np.ndarray:
    """The turns >= 0 that give x; NaN below the displacement at 0 turns."""
    return straight_then_line.turns_for_displacement(
        displacement_mm, *_lock(twisting_zone_mm, string_diameter_mm, pitch_mm),
        **_helix(twisting_zone_mm, hole_distance_mm, string_diameter_mm),
    )  # fmt: skip


def _lock(zone: ArrayLike, string: ArrayLike, pitch: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    return (
        np.asarray(zone, dtype=float) / np.asarray(pitch, dtype=float),
        feed_mm_per_turn(string_diameter_mm=string, pitch_mm=pitch),
    )


def _helix(zone: ArrayLike, hole: ArrayLike, string: ArrayLike) -> dict[str, ArrayLike]:
    centre = np.asarray(string, dtype=float) / 2
    return {"twisting_zone_mm": zone, "hole_distance_mm": hole, "radius_mm": centre}


MODEL = DisplacementModel(
    name="coil_at_pitch",
    title="Straight helix up to a seen pitch, then coiling",
    equation="straight helix of radius d/2 up to L/p turns; then + √(p² + (π d)²)/(1 + p/l) a turn",
    parameters=("twisting_zone_mm", "hole_distance_mm", "string_diameter_mm", "pitch_mm"),
    assumptions=(
        "two round strings that touch; no stretch, no flattening",
        "bending stiffness or load lock the helix at a pitch p longer than π d: p is measured",
        "a turn is shared by strand twist at pitch p and the writhe of tight coils, l long each",
    ),
    source="as helix_then_coil, with the pitch left to the picture",
    fails="the first coil pops in at once (a jump); p drifts while the zone fills",
    free=("string_diameter_mm", "pitch_mm"),
    displacement_mm=displacement_mm,
    slope_mm_per_turn=slope_mm_per_turn,
    turns_for_displacement=turns_for_displacement,
    only_strings=2,
)
