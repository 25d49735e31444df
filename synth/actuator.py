"""One state of the actuator for every turn count, so that both budgets close.

Strategy. Legs run straight from the holes to the apex and meet the bundle's helix at its lay
angle; the bundle is laid at one pitch p about its own centre line. Turning shortens p until it
reaches the locked pitch; from there on every further turn goes into the coiling of the centre
line. So there is one unknown a frame (p above the lock, the coil's radius below it), and the
linking number (legs + strand turns + the centre line's own turns) fixes it. The strand length in
the zone then follows from the geometry, and with it the displacement. Told to follow a law, the
lock is loosened until the string length obeys the law as well.
"""

from __future__ import annotations

import numpy as np

from synth.centre_line import centre_line
from synth.effects import Effective, effective, wound_turns
from synth.knots import KnotState, knot_states
from synth.laws import law_displacement_mm, lay_by_law
from synth.laying import (
    GRID_MM,
    Laid,
    lay,
    leg_angle_rad,
    leg_radius_mm,
    locked_pitch_mm,
    sites_mm,
)
from synth.settings import Settings
from synth.state import State
from synth.strands import arc_length_mm, strand_paths

LAW_TOLERANCE_MM = 0.003


def state_at(settings: Settings, index: int) -> State:
    """State of frame `index` of `settings.turns` (the past matters: backlash, knots that stay).

    Raises InputError when no geometry can hold the turn count.
    """
    turns = settings.turns[index]
    peak = max((abs(t) for t in settings.turns[: index + 1]), default=abs(turns))
    wound = wound_turns(settings, index)
    return solve_state(settings, turns, wound, max(peak, abs(turns)))


def elapsed_s(settings: Settings, index: int) -> float:
    """Time of frame `index` at a steady motor speed."""
    steps = np.abs(np.diff(settings.turns[: index + 1], prepend=settings.turns[0]))
    return float(steps.sum() * settings.seconds_per_turn)


def solve_state(settings: Settings, turns: float, wound: float, peak: float) -> State:
    """Close the turn budget for `wound` turns (signed); `peak` is the largest |turns| so far."""
    real = effective(settings, turns)
    amount = abs(wound)
    sign = (1.0 if settings.strings.handedness == "Z" else -1.0) * (-1.0 if wound < 0 else 1.0)
    loose = sites_mm(settings, real, 1e3 * real.zone_mm)
    radius = leg_radius_mm(loose, settings.actuator.holes)
    leg_turns = leg_angle_rad(radius, real.hole_distance_mm) / (2 * np.pi)
    if amount <= leg_turns:
        line = centre_line(real.zone_mm, real.zone_mm, None, 1.0, GRID_MM)
        laid = Laid(np.nan, real.zone_mm, 0.0, loose, line, amount)
        return _state(settings, real, turns, wound, peak, sign, laid, (), "geometry")
    locked = locked_pitch_mm(settings, real)
    knots = knot_states(settings, real, amount, peak)
    laid = lay(settings, real, knots, amount, locked)
    state = _state(settings, real, turns, wound, peak, sign, laid, knots, "geometry")
    if settings.law.follow == "law":
        return _obeying(settings, state, laid) or state
    return state


def _obeying(settings: Settings, state: State, free: Laid) -> State | None:
    """The state whose real strand length, contact included, is L + x(law); None if none is."""
    amount = abs(state.wound_turns)
    wanted = law_displacement_mm(settings, state.real, amount)
    if wanted is None:
        return None
    aim = wanted
    for _ in range(6):
        laid = lay_by_law(settings, state.real, state.knots, amount, free, aim)
        if laid is None:
            return None
        found = _state(
            settings, state.real, state.motor_turns, state.wound_turns, state.peak_turns,
            state.sign, laid, state.knots, "law",
        )  # fmt: skip
        lengths = [arc_length_mm(path) for path in strand_paths(settings, found)]
        lack = wanted + found.zone_mm - float(np.mean(lengths))
        if abs(lack) < LAW_TOLERANCE_MM:
            return found
        aim += lack
    return None


def _state(
    settings: Settings,
    real: Effective,
    turns: float,
    wound: float,
    peak: float,
    sign: float,
    laid: Laid,
    knots: tuple[KnotState, ...],
    followed: str,
) -> State:
    has_bundle = bool(np.isfinite(laid.pitch_mm))
    outer = real.diameter_mm * (1.0 - settings.hidden.flattening)
    outer += 2.0 * float(np.hypot(*laid.sites_mm.T).max())
    return State(
        motor_turns=turns,
        wound_turns=wound,
        peak_turns=peak,
        lost_turns=abs(turns) - abs(wound),
        sign=sign,
        has_bundle=has_bundle,
        apex_mm=laid.apex_mm,
        zone_mm=real.zone_mm,
        pitch_mm=laid.pitch_mm,
        coil_radius_mm=laid.coil_mm,
        leg_turns=laid.leg_turns,
        sites_mm=laid.sites_mm,
        diameter_mm=outer if has_bundle else np.nan,
        line=laid.line,
        knots=knots,
        real=real,
        followed=followed,
    )
