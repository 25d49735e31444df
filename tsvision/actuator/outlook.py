"""Onset and reversible limit of a geometry, as far as it is known, and in words."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tsvision.actuator.geometry import Geometry
from tsvision.actuator.onset import PredictedOnset, predict_onset
from tsvision.actuator.reversible import ReversibleLimit, reversible_limit


@dataclass(frozen=True)
class Outlook:
    """None where N, L or D is unknown; `lines` say the same for people."""

    onset: PredictedOnset | None
    limit: ReversibleLimit | None
    lines: tuple[str, ...]


def outlook(geometry: Geometry) -> Outlook:
    """Where overtwist starts and how far the actuator unwinds again."""
    zone, diameter = geometry.twisting_zone_mm, geometry.bundle_diameter_mm
    if geometry.strings is None or geometry.strings < 2 or math.isnan(zone + diameter):
        return Outlook(None, None, ())
    onset = predict_onset(geometry.strings, zone, diameter)
    hole_distance = geometry.hole_distance_mm
    limit = reversible_limit(
        geometry.strings,
        zone,
        diameter,
        0.0 if math.isnan(hole_distance) else hole_distance,
        geometry.hole_diameter_mm,
    )
    return Outlook(
        onset,
        limit,
        (
            f"overtwist from about {onset.turns:.1f} turns [{onset.low:.1f}, {onset.high:.1f}] "
            f"(helix angle {math.degrees(onset.helix_angle_rad):.1f}°, from geometry)",
            f"unwinds again up to about {limit.displacement_mm:.0f} mm "
            f"[{limit.low_mm:.0f}, {limit.high_mm:.0f}], set by the {limit.limited_by}",
        ),
    )
