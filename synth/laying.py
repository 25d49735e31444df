"""Lay legs, bundle and centre line so that the turn budget closes.

One unknown: above the locked pitch it lengthens p, below it is the coil's radius. The turns held
grow with it without a jump, so a bracketing root finder closes the linking number.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from synth.centre_line import CentreLine, centre_line
from synth.effects import Effective
from synth.knots import KnotState, coil_shape
from synth.sections import make_section, widening
from synth.settings import Settings
from tsvision.errors import InputError

GRID_MM = 0.01  # along x, while the turn budget is being solved
ARC_STEP_MM = 0.008  # along the line, of the state that is kept
COIL_LIMIT_D = 2.0  # largest base radius of the coil, in units of D


@dataclass(frozen=True)
class Laid:
    """What holds the turns: lengths mm; `sites_mm` (N, 2) at the bundle's start."""

    pitch_mm: float
    apex_mm: float
    coil_mm: float
    sites_mm: np.ndarray
    line: CentreLine
    leg_turns: float

    @property
    def turns(self) -> float:
        return self.leg_turns + self.line.turns


def leg_angle_rad(radius_mm: float, hole_distance_mm: float) -> float:
    """Angle about the axis that a straight leg covers from its hole to touching the bundle."""
    return float(np.arccos(min(1.0, 2.0 * radius_mm / hole_distance_mm))) if radius_mm > 0 else 0.0


def leg_length_mm(radius_mm: float, hole_distance_mm: float, pitch_mm: float) -> float:
    """Axial length of a straight leg that meets the helix tangentially."""
    across = np.sqrt(max(hole_distance_mm**2 / 4.0 - radius_mm**2, 0.0))
    return float(across * pitch_mm / (2.0 * np.pi * radius_mm))


def hole_of_strands(sites: np.ndarray, holes: int) -> np.ndarray:
    """Through which hole (N,) each of the strands at these sites (N, 2) comes: neighbours share."""
    angle = np.arctan2(sites[:, 1], sites[:, 0]) % (2.0 * np.pi)
    # A strand just below +x belongs to the first hole, so count from the lowest of its half.
    angle = np.where(angle > 2.0 * np.pi - np.pi / 2.0 + 1e-9, angle - 2.0 * np.pi, angle)
    hole = np.empty(len(sites), int)
    hole[np.argsort(angle)] = np.arange(len(sites)) * holes // len(sites)
    return hole


def leg_ends_mm(sites: np.ndarray, holes: int) -> tuple[np.ndarray, np.ndarray]:
    """(H,) numbers of the holes in use, and where (H, 2) in the section their legs arrive: a leg
    of several strands is pulled straight as one, towards the middle of their sites."""
    hole = hole_of_strands(sites, holes)
    used = np.unique(hole)
    return used, np.stack([sites[hole == h].mean(axis=0) for h in used])


def leg_radius_mm(sites: np.ndarray, holes: int) -> float:
    """Distance from the bundle's middle that the legs aim at."""
    return float(np.hypot(*leg_ends_mm(sites, holes)[1].T).mean())


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
    radius = leg_radius_mm(sites_mm(settings, real, pitch), settings.actuator.holes)
    legs = leg_angle_rad(radius, real.hole_distance_mm) / (2.0 * np.pi)
    apex = leg_length_mm(radius, real.hole_distance_mm, pitch)
    return legs + (real.zone_mm - apex) / pitch


def lay(
    settings: Settings,
    real: Effective,
    knots: tuple[KnotState, ...],
    amount: float,
    locked_mm: float,
) -> Laid:
    """Close the turn budget for `amount` wound turns at the locked pitch.

    Raises InputError when even the widest coil cannot hold them.
    """

    def build(unknown: float, grid_mm: float = GRID_MM) -> Laid:
        pitch = locked_mm * float(np.exp(max(-unknown, 0.0)))
        sites = sites_mm(settings, real, pitch)
        outer = real.diameter_mm + 2.0 * float(np.hypot(*sites.T).max())
        coil = max(unknown, 0.0) * outer
        radius = leg_radius_mm(sites, settings.actuator.holes)
        apex = min(leg_length_mm(radius, real.hole_distance_mm, pitch), real.zone_mm)
        shape = coil_shape(settings, real, knots, coil, outer, apex, amount)
        line = centre_line(apex, real.zone_mm, shape, pitch, grid_mm)
        legs = leg_angle_rad(radius, real.hole_distance_mm) / (2.0 * np.pi)
        return Laid(pitch, apex, coil, sites, line, legs)

    low, high = -18.0, 0.0
    if build(0.0).turns < amount:
        low, high = 0.0, COIL_LIMIT_D
        most = build(high).turns
        if most < amount:
            raise InputError(
                f"turns = {amount:g} cannot be held: this bundle takes at most "
                f"{most:.0f} turns in {real.zone_mm:g} mm"
            )
    unknown = brentq(lambda u: build(u).turns - amount, low, high, xtol=1e-9)
    rough = build(unknown)
    if rough.apex_mm < 0.05 * real.hole_distance_mm:
        raise InputError(
            f"hole_distance_mm = {real.hole_distance_mm:g} leaves no legs once {amount:g} turns "
            "have opened the bundle; give a larger distance or fewer strings"
        )
    slant = max(float(rough.line.arc_mm[-1]) / max(real.zone_mm - rough.apex_mm, 1e-9), 1.0)
    fine_mm = ARC_STEP_MM / slant
    # The finer grid sums the turns a little differently: one secant step closes the budget on it.
    fine = build(unknown, fine_mm)
    nudge = 1e-4
    slope = (build(unknown + nudge).turns - rough.turns) / nudge
    return build(unknown - (fine.turns - amount) / slope, fine_mm)
