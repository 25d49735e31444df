"""What is really there, as against what the rig file says: the planted effects applied."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from synth.sections import section_diameter_mm
from synth.settings import PAPER_ONSET_TURNS, PAPER_ZONE_MM, Law, Settings


@dataclass(frozen=True)
class Effective:
    """True values at one frame; `widen` multiplies the section, `tension_N` is one string's."""

    diameter_mm: float
    zone_mm: float
    hole_distance_mm: float
    widen: float
    tension_N: float
    law: Law


def stated_zone_mm(settings: Settings) -> float:
    """L as the rig file says it: given, or the paper's for this N."""
    given = settings.actuator.twisting_zone_mm
    return given if given is not None else PAPER_ZONE_MM.get(settings.strings.count, 23.2)


def filled_law(settings: Settings) -> Law:
    """The law with every turn count filled in: twist, then 1 : 2 : 3 as in the paper (N = 2)."""
    law = settings.law
    onset = law.overtwist_turns
    if onset is None:
        onset = PAPER_ONSET_TURNS.get(settings.strings.count, 20.0 - 1.5 * settings.strings.count)
    return replace(
        law,
        overtwist_turns=onset,
        local_turns=2.0 * onset if law.local_turns is None else law.local_turns,
        knot_turns=3.0 * onset if law.knot_turns is None else law.knot_turns,
        knot_interval_turns=0.3 * onset
        if law.knot_interval_turns is None
        else law.knot_interval_turns,
        knot_growth_turns=0.25 * onset if law.knot_growth_turns is None else law.knot_growth_turns,
    )


def wound_turns(settings: Settings, index: int) -> float:
    """Turns that reach the strands at frame `index` (signed): slip, lost turns, backlash."""
    hidden = settings.hidden
    play = hidden.backlash_turns
    reached = 0.0
    # Backlash is a play: the strands stand still until the motor has crossed the gap.
    for turns in settings.turns[: index + 1]:
        reached = min(max(reached, turns), turns + play)
    amount = max(abs(reached) * (1.0 - hidden.slip) - hidden.lost_turns, 0.0)
    return float(np.copysign(amount, reached))


def string_tension_N(settings: Settings, turns: float) -> float:
    """T = F / (N cos beta), the zone's mean tan beta = alpha r / L at the stated geometry."""
    strings = settings.strings
    diameter = section_diameter_mm(strings.section, strings.count, strings.diameter_mm)
    slope = np.pi * abs(turns) * diameter / stated_zone_mm(settings)
    return settings.actuator.load_N / strings.count * float(np.hypot(1.0, slope))


def effective(settings: Settings, turns: float) -> Effective:
    """The true geometry at `turns`, planted effects included."""
    hidden, strings = settings.hidden, settings.strings
    law = filled_law(settings)
    tension = string_tension_N(settings, turns)
    widen = 1.0
    if hidden.radius_step and abs(turns) >= hidden.radius_step_turns:
        widen *= 1.0 + hidden.radius_step
    onset = law.overtwist_turns or 1.0
    widen *= 1.0 + hidden.diameter_drift * min(abs(turns) / onset, 1.0)
    squeeze = (tension / 10.0) ** (-hidden.compression_exponent)
    return Effective(
        diameter_mm=(strings.diameter_mm + hidden.diameter_error_mm) * squeeze,
        zone_mm=stated_zone_mm(settings) + hidden.zone_length_error_mm,
        hole_distance_mm=settings.actuator.hole_distance_mm + hidden.hole_distance_error_mm,
        widen=widen,
        tension_N=tension,
        law=law,
    )
