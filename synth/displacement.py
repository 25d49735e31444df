"""Displacement as an encoder would record it, beside what the scene's own geometry draws in.

The scene always closes its string budget by its own geometry. A law other than `geometry` is
what gets written to turns.csv; the truth then says by how much it contradicts the scene.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from synth.actuator import State
from synth.sections import section_diameter_mm
from synth.settings import Settings
from tsvision.errors import InputError

LAWS = ("geometry", "constant_radius", "variable_radius", "linear")


def law_displacement_mm(settings: Settings, state: State, drawn_mm: float) -> float:
    """x by the named law with what is really there (turns that arrived, true L, S, D)."""
    name = settings.law.displacement
    if name == "geometry":
        return drawn_mm
    real, strings = state.real, settings.strings
    angle = 2.0 * np.pi * _drawing_turns(settings, state)
    zone, shift = real.zone_mm, 0.5 * real.hole_distance_mm
    outer = section_diameter_mm(strings.section, strings.count, real.diameter_mm) * real.widen
    radius = 0.5 * outer
    if name == "constant_radius":
        return float(np.hypot(zone, shift + angle * radius) - zone)
    if name == "variable_radius":
        return float(
            brentq(
                lambda x: (
                    np.hypot(zone, shift + angle * radius * np.sqrt((zone + x) / zone)) - zone - x
                ),
                -1.0,
                1e6,
            )
        )
    onset = real.law.overtwist_turns or 0.0
    straight = float(np.hypot(zone, shift + 2 * np.pi * min(angle / (2 * np.pi), onset) * radius))
    return straight - zone + 3.26 * real.diameter_mm * max(angle / (2 * np.pi) - onset, 0.0)


def _drawing_turns(settings: Settings, state: State) -> float:
    """Turns that draw string: knots absorb a share of those past the first knot."""
    turns = abs(state.wound_turns)
    first = state.real.law.knot_turns
    share = settings.hidden.knot_absorption
    if share and first is not None and settings.law.knots:
        turns -= share * max(turns - first, 0.0)
    return turns


def recorded_displacement(
    settings: Settings, state: State, drawn_mm: float, index: int
) -> dict[str, object]:
    """Columns: recorded displacement, the scene's own, their gap and which one was followed."""
    if settings.law.displacement not in LAWS:
        raise InputError(
            f"displacement law '{settings.law.displacement}' is unknown; choose {', '.join(LAWS)}"
        )
    hidden = settings.hidden
    law = law_displacement_mm(settings, state, drawn_mm)
    loose = settings.actuator.load_N / settings.strings.count
    # The string in the zone stretches with the tension above that of the untwisted string.
    stretch = hidden.stretch_per_N * (state.real.tension_N - loose) * (state.zone_mm + law)
    time_s = index * settings.seconds_per_turn
    creep = hidden.creep_mm_per_decade * np.log10(1.0 + time_s)
    zero = 0.0
    return {
        "displacement_mm": float(law - stretch - creep - zero),
        "law_displacement_mm": law,
        "scene_displacement_mm": drawn_mm,
        "law_minus_scene_mm": law - drawn_mm,
        "followed": "geometry",
    }
