"""Displacement as an encoder would record it, beside what the scene's own geometry draws in."""

from __future__ import annotations

import numpy as np

from synth.laws import law_displacement_mm
from synth.settings import Settings
from synth.state import State


def recorded_displacement(
    settings: Settings, state: State, drawn_mm: float, time_s: float
) -> dict[str, object]:
    """Columns: recorded displacement, the scene's own, their gap and which one was followed.

    The recorded value is the law's (the scene's own for `geometry`), less what the string
    stretches under its tension and what has crept by `time_s`.
    """
    hidden = settings.hidden
    named = law_displacement_mm(settings, state.real, abs(state.wound_turns))
    law = drawn_mm if named is None else named
    loose = settings.actuator.load_N / settings.strings.count
    # The string in the zone stretches with the tension above that of the untwisted string.
    stretch = hidden.stretch_per_N * (state.real.tension_N - loose) * (state.zone_mm + law)
    creep = hidden.creep_mm_per_decade * np.log10(1.0 + time_s)
    return {
        "displacement_mm": float(law - stretch - creep),
        "law_displacement_mm": law,
        "scene_displacement_mm": drawn_mm,
        "law_minus_scene_mm": law - drawn_mm,
        "followed": state.followed,
    }
