"""The coil's radius and wave number along the zone: uniform, uneven, knotted.

Strategy: a base radius (solved for by the turn budget) times a window that vanishes at both ends;
from the local onset on, dips withdraw the coil from stretches; knots are bumps of larger radius
and tighter coils that nucleate one after another, grow, drift and merge when they meet.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from synth.centre_line import CoilShape
from synth.effects import Effective
from synth.sections import section_diameter_mm
from synth.settings import Settings

SNAP_TURNS = 0.6


@dataclass(frozen=True)
class KnotState:
    """One knot as laid: `growth` in 0..1; `radius_D` above the base coil; born at `born_turns`.
    A `stuck` one sits where the legs meet, held back by the separator's hole, and never loosens."""

    number: int
    centre_mm: float
    half_length_mm: float
    growth: float
    born_turns: float
    stuck: bool = False


@lru_cache(maxsize=256)
def _places(seed: int, knots: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Seeded: knot places (share of the bundle), drift directions, dip places."""
    random = np.random.default_rng([seed, 7])
    slots = (np.arange(knots) + 0.5) / max(knots, 1)
    places = 0.26 + 0.64 * (slots + random.uniform(-0.25, 0.25, knots) / max(knots, 1))
    random.shuffle(places)
    drift = random.uniform(-1.0, 1.0, knots)
    dips = np.array([0.31, 0.66]) + random.uniform(-0.09, 0.09, 2)
    return places, drift, dips


def knot_states(
    settings: Settings, real: Effective, amount: float, peak: float
) -> tuple[KnotState, ...]:
    """Knots present at `amount` wound turns when `peak` turns were reached before.

    A knot stays on unwinding: it shrinks only below half the turn count of its birth.
    """
    law = real.law
    if not law.knots or peak < (law.knot_turns or np.inf):
        return ()
    assert law.knot_turns is not None and law.knot_interval_turns is not None
    assert law.knot_growth_turns is not None
    places, drift, _ = _places(settings.seed, law.knot_count)
    strings = settings.strings
    outer = section_diameter_mm(strings.section, strings.count, real.diameter_mm)
    found = []
    for number in range(law.knot_count):
        born = law.knot_turns + number * law.knot_interval_turns
        if peak < born:
            break
        age = peak - born
        # a loop snaps out within SNAP_TURNS, then tightens as turns feed it
        growth = 0.35 * _smooth(age / SNAP_TURNS) + 0.65 * (
            1.0 - np.exp(-age / law.knot_growth_turns)
        )
        stuck = law.stuck_knot and number == 0
        if amount < 0.5 * born and not stuck:
            growth *= max(amount / (0.5 * born), 0.0)
        moved = drift[number] * law.drift_mm_per_turn * age
        centre = places[number] * real.zone_mm + moved
        half = 0.5 * law.knot_length_D * outer * (0.7 + 0.3 * growth)
        found.append(
            KnotState(number, float(centre), float(half), float(growth), float(born), stuck)
        )
    return tuple(found)


def _bump(x: np.ndarray, centre: float, half: float) -> np.ndarray:
    """Flat-topped, smooth, 1 at the centre and 0 beyond 1.4 half lengths."""
    t = np.clip((np.abs(x - centre) / half - 0.6) / 0.8, 0.0, 1.0)
    return 1.0 - t * t * (3.0 - 2.0 * t)


def _window(x: np.ndarray, start: float, stop: float, taper: float) -> np.ndarray:
    t = np.clip(np.minimum(x - start, stop - x) / taper, 0.0, 1.0)
    return t * t * t * (t * (6.0 * t - 15.0) + 10.0)


def coil_shape(
    settings: Settings,
    real: Effective,
    knots: tuple[KnotState, ...],
    coil_mm: float,
    outer_mm: float,
    apex_mm: float,
    amount: float,
) -> CoilShape | None:
    """R(x), k(x) of the coil for a base radius `coil_mm`; None when nothing coils."""
    if coil_mm <= 0.0 and not knots:
        return None
    law = real.law
    assert law.local_turns is not None and law.overtwist_turns is not None
    _, _, dips = _places(settings.seed, law.knot_count)
    uneven = law.local_depth * _smooth((amount - law.local_turns) / (0.25 * law.overtwist_turns))
    start, stop = apex_mm, real.zone_mm
    length = max(stop - start, 1e-6)
    spread = 0.012 + 0.3 * outer_mm / length  # of a dip, in shares of the bundle

    def shape(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        share = (x - start) / length
        dip = np.zeros_like(x)
        for place in dips:
            dip = np.maximum(dip, np.exp(-0.5 * ((share - place) / spread) ** 2))
        base = coil_mm * (1.0 - uneven * dip)
        extra = np.zeros_like(x)
        tight = np.zeros_like(x)
        for knot in knots:
            centre = start + 1.5 * knot.half_length_mm if knot.stuck else knot.centre_mm
            bump = knot.growth * _bump(x, centre, knot.half_length_mm)
            extra = np.hypot(extra, bump)
            tight = np.maximum(tight, bump)
        window = _window(x, start, stop, min(1.2 * outer_mm + 0.5 * coil_mm, 0.25 * length))
        grown = 0.75 * coil_mm + law.knot_radius_D * outer_mm
        radius = window * (base + np.clip(extra, 0.0, 1.15) * np.maximum(grown - base, 0.0) * 0.62)
        loose = law.coil_pitch_D * outer_mm
        firm = law.knot_pitch_D * outer_mm
        # A tight coil of small radius would bend the bundle sharper than its own radius.
        ease = np.clip(radius / outer_mm - 0.2, 0.0, 0.6) / 0.6
        pitch = loose + (firm - loose) * np.clip(tight, 0.0, 1.0) * ease
        return radius, 2.0 * np.pi / pitch

    return shape


def _smooth(t: float) -> float:
    t = min(max(t, 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)
