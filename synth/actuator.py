"""One state of the actuator for every turn count, so that both budgets close.

Strategy. Legs run straight from the holes to the apex and meet the bundle's helix at its lay
angle; the bundle is laid at one pitch p about its own centre line. Turning shortens p until it
reaches the locked pitch; from there on every further turn goes into the coiling of the centre
line. So there is one unknown a frame (p above the lock, the coil's radius below it), and the
linking number (legs + strand turns + the centre line's own turns) fixes it. The strand length in
the zone then follows from the geometry, and with it the displacement.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from synth.centre_line import CentreLine, centre_line
from synth.effects import Effective, effective, wound_turns
from synth.knots import KnotState, coil_shape, knot_states
from synth.sections import make_section, widening
from synth.settings import Settings
from tsvision.errors import InputError

GRID_MM = 0.01  # along x, while the turn budget is being solved
ARC_STEP_MM = 0.008  # along the line, of the state that is kept


@dataclass(frozen=True)
class State:
    """The actuator at one motor turn count; lengths mm, angles rad, `sign` +1 winds Z.

    `sites_mm` (N, 2) strand centres at the bundle's start; `has_bundle` is False while the
    strands do not touch yet (up to about a quarter turn).
    """

    motor_turns: float
    wound_turns: float
    lost_turns: float
    sign: float
    has_bundle: bool
    apex_mm: float
    zone_mm: float
    pitch_mm: float
    coil_radius_mm: float
    leg_turns: float
    sites_mm: np.ndarray
    diameter_mm: float
    line: CentreLine
    knots: tuple[KnotState, ...]
    real: Effective


def leg_angle_rad(radius_mm: float, hole_distance_mm: float) -> float:
    """Angle about the axis that a straight leg covers from its hole to touching the bundle."""
    return float(np.arccos(min(1.0, 2.0 * radius_mm / hole_distance_mm))) if radius_mm > 0 else 0.0


def leg_length_mm(radius_mm: float, hole_distance_mm: float, pitch_mm: float) -> float:
    """Axial length of a straight leg that meets the helix tangentially."""
    across = np.sqrt(max(hole_distance_mm**2 / 4.0 - radius_mm**2, 0.0))
    return float(across * pitch_mm / (2.0 * np.pi * radius_mm))


def strand_radius_mm(sites: np.ndarray) -> float:
    """Mean radius of the strand centres: the radius that the legs aim at."""
    return float(np.hypot(*sites.T).mean())


def sites_mm(settings: Settings, real: Effective, pitch_mm: float) -> np.ndarray:
    """Strand centres (N, 2) in mm at this pitch, contact relaxation and planted effects in."""
    strings = settings.strings
    d = real.diameter_mm
    section = make_section(strings.section, strings.count)
    flat = 1.0 - settings.hidden.flattening
    opened = widening(strings.section, strings.count, pitch_mm, d)
    return section.sites * d * flat * opened * real.widen


def locked_pitch_mm(settings: Settings, real: Effective) -> float:
    """The pitch reached at the overtwist onset; the bundle is never laid tighter."""
    onset = real.law.overtwist_turns
    assert onset is not None
    return _pitch_for_turns(settings, real, onset)


def _pitch_for_turns(settings: Settings, real: Effective, turns: float) -> float:
    def excess(log_pitch: float) -> float:
        return _straight_turns(settings, real, float(np.exp(log_pitch))) - turns

    low, high = np.log(0.5 * real.diameter_mm), np.log(1e4 * real.zone_mm)
    if excess(low) < 0:
        raise InputError(
            f"overtwist_turns = {turns:g} cannot be laid in a zone of {real.zone_mm:g} mm; "
            f"at most {excess(low) + turns:.1f} turns"
        )
    return float(np.exp(brentq(excess, low, high, xtol=1e-12)))


def _straight_turns(settings: Settings, real: Effective, pitch: float) -> float:
    radius = strand_radius_mm(sites_mm(settings, real, pitch))
    legs = leg_angle_rad(radius, real.hole_distance_mm) / (2.0 * np.pi)
    apex = leg_length_mm(radius, real.hole_distance_mm, pitch)
    return legs + (real.zone_mm - apex) / pitch


def state_at(settings: Settings, index: int) -> State:
    """State of frame `index` of `settings.turns` (the past matters: backlash, knots that stay).

    Raises InputError when no geometry can hold the turn count.
    """
    turns = settings.turns[index]
    peak = max((abs(t) for t in settings.turns[: index + 1]), default=abs(turns))
    wound = wound_turns(settings, index)
    return solve_state(settings, turns, wound, max(peak, abs(turns)), _time_s(settings, index))


def _time_s(settings: Settings, index: int) -> float:
    steps = np.abs(np.diff(settings.turns[: index + 1], prepend=settings.turns[0]))
    return float(steps.sum() * settings.seconds_per_turn)


def solve_state(
    settings: Settings, turns: float, wound: float, peak: float, time_s: float = 0.0
) -> State:
    """Close the turn budget for `wound` turns (signed); `peak` is the largest |turns| so far."""
    real = effective(settings, turns, time_s)
    amount = abs(wound)
    sign = (1.0 if settings.strings.handedness == "Z" else -1.0) * (-1.0 if wound < 0 else 1.0)
    if settings.strings.count == 1:
        raise InputError("strings.count = 1 has nothing to twist about; give at least 2 strings")
    loose = sites_mm(settings, real, 1e3 * real.zone_mm)
    leg_turns = leg_angle_rad(strand_radius_mm(loose), real.hole_distance_mm) / (2 * np.pi)
    if amount <= leg_turns:
        return _untouched(settings, real, turns, wound, sign, loose)
    locked = locked_pitch_mm(settings, real)
    knots = knot_states(settings, real, amount, peak)

    def build(
        unknown: float, grid_mm: float = GRID_MM
    ) -> tuple[float, float, float, np.ndarray, CentreLine]:
        pitch = locked * float(np.exp(max(-unknown, 0.0)))
        coil = max(unknown, 0.0) * real.diameter_mm
        sites = sites_mm(settings, real, pitch)
        radius = strand_radius_mm(sites)
        apex = min(leg_length_mm(radius, real.hole_distance_mm, pitch), real.zone_mm)
        outer = real.diameter_mm + 2.0 * float(np.hypot(*sites.T).max())
        shape = coil_shape(settings, real, knots, coil, outer, apex, amount)
        line = centre_line(apex, real.zone_mm, shape, pitch, grid_mm)
        return pitch, apex, coil, sites, line

    def excess(unknown: float) -> float:
        _, _, _, sites, line = build(unknown)
        radius = strand_radius_mm(sites)
        legs = leg_angle_rad(radius, real.hole_distance_mm) / (2.0 * np.pi)
        return legs + line.turns - amount

    low, high = -18.0, 0.0
    if excess(0.0) < 0.0:
        low, high = 0.0, 12.0
        if excess(high) < 0.0:
            raise InputError(
                f"turns = {turns:g} cannot be held: this bundle takes at most "
                f"{excess(high) + amount:.0f} turns in {real.zone_mm:g} mm"
            )
    unknown = brentq(excess, low, high, xtol=1e-9)
    _, apex, _, _, rough = build(unknown)
    slant = max(float(rough.arc_mm[-1]) / max(real.zone_mm - apex, 1e-9), 1.0)
    pitch, apex, coil, sites, line = build(unknown, ARC_STEP_MM / slant)
    radius = strand_radius_mm(sites)
    return State(
        motor_turns=turns,
        wound_turns=wound,
        lost_turns=abs(turns) - amount,
        sign=sign,
        has_bundle=True,
        apex_mm=apex,
        zone_mm=real.zone_mm,
        pitch_mm=pitch,
        coil_radius_mm=coil,
        leg_turns=leg_angle_rad(radius, real.hole_distance_mm) / (2.0 * np.pi),
        sites_mm=sites,
        diameter_mm=real.diameter_mm * (1.0 - settings.hidden.flattening)
        + 2.0 * float(np.hypot(*sites.T).max()),
        line=line,
        knots=knots,
        real=real,
    )


def _untouched(
    settings: Settings, real: Effective, turns: float, wound: float, sign: float, sites: np.ndarray
) -> State:
    """Less than about a quarter turn: straight strands from the holes to the connector."""
    return State(
        motor_turns=turns,
        wound_turns=wound,
        lost_turns=abs(turns) - abs(wound),
        sign=sign,
        has_bundle=False,
        apex_mm=real.zone_mm,
        zone_mm=real.zone_mm,
        pitch_mm=np.nan,
        coil_radius_mm=0.0,
        leg_turns=abs(wound),
        sites_mm=sites,
        diameter_mm=np.nan,
        line=centre_line(real.zone_mm, real.zone_mm, None, 1.0, GRID_MM),
        knots=(),
        real=real,
    )
