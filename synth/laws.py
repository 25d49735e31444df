"""Displacement laws, and laying a scene so that its string length obeys one.

The turn budget alone leaves one freedom once the bundle coils: a longer strand pitch and a wider
coil hold the same turns with more string. A law uses it up.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from synth.effects import Effective
from synth.knots import KnotState
from synth.laying import Laid, lay
from synth.sections import section_diameter_mm
from synth.settings import Settings
from tsvision.errors import InputError

LAWS = ("geometry", "constant_radius", "variable_radius", "linear")
COILED_DRAW_D = 3.26  # string drawn by each turn past the onset, in units of d (`linear`)


def drawing_turns(settings: Settings, real: Effective, amount: float) -> float:
    """Turns that draw string: knots absorb a share of those past the first knot."""
    first, share = real.law.knot_turns, settings.hidden.knot_absorption
    if share and first is not None and settings.law.knots:
        return amount - share * max(amount - first, 0.0)
    return amount


def law_displacement_mm(settings: Settings, real: Effective, amount: float) -> float | None:
    """x by the named law at `amount` wound turns, with what is really there (true L, S, D).

    None for the law `geometry`, which is whatever the scene draws in. constant_radius and
    variable_radius as in the paper; linear: constant radius up to the onset, then a constant
    length a turn.
    """
    name = settings.law.displacement
    if name == "geometry":
        return None
    if name not in LAWS:
        raise InputError(f"law.displacement '{name}' is unknown; choose {', '.join(LAWS)}")
    strings = settings.strings
    outer = section_diameter_mm(strings.section, strings.count, real.diameter_mm) * real.widen
    zone, shift, radius = real.zone_mm, 0.5 * real.hole_distance_mm, 0.5 * outer
    turns = drawing_turns(settings, real, amount)

    def constant(at_turns: float, factor: float = 1.0) -> float:
        return float(np.hypot(zone, shift + 2.0 * np.pi * at_turns * radius * factor) - zone)

    if name == "constant_radius":
        return constant(turns)
    if name == "variable_radius":
        return float(
            brentq(lambda x: constant(turns, float(np.sqrt((zone + x) / zone))) - x, 0.0, 1e6)
        )
    onset = real.law.overtwist_turns or 0.0
    beyond = max(turns - onset, 0.0)
    return constant(min(turns, onset)) + COILED_DRAW_D * real.diameter_mm * beyond


def strand_length_mm(laid: Laid) -> float:
    """Mean strand length, legs as straight tangents, before contact: for solving only."""
    radius = np.hypot(*laid.sites_mm.T)
    lay_slope = 2.0 * np.pi * radius / laid.pitch_mm
    bundle = float(np.hypot(1.0, lay_slope).mean()) * float(laid.line.arc_mm[-1])
    return bundle + float(np.hypot(1.0, lay_slope).mean()) * laid.apex_mm


def lay_by_law(
    settings: Settings,
    real: Effective,
    knots: tuple[KnotState, ...],
    amount: float,
    laid: Laid,
    wanted_mm: float,
) -> Laid | None:
    """The scene at these turns whose strand length is about L + `wanted_mm`; None if none is.

    There is none when that is less than the freely laid scene `laid` draws, or more than the
    widest coil holds.
    """

    def excess(stretch: float) -> float:
        return strand_length_mm(at(stretch)) - real.zone_mm - wanted_mm

    def at(stretch: float) -> Laid:
        return lay(settings, real, knots, amount, laid.pitch_mm * float(np.exp(stretch)))

    try:
        if excess(0.0) >= 0.0:
            return None
        high = 0.05
        while excess(high) < 0.0:
            high *= 1.6
            if high > 2.0:
                return None
        return at(float(brentq(excess, 0.0, high, xtol=1e-7)))
    except InputError:
        return None
