"""Candidates for a wanted stroke, load, length and life: which N, d, L and turns.

Every candidate is worked out with the same laws as the rest of the project: turns by inverting a
displacement model, onset and reversible stroke by geometry, torque by virtual work, life by the
best life model. Life was tested on one string type, N = 2, L = 23.2 mm: other candidates are
referred to it by equal stress (load a string over d²) and equal stroke a zone length, and what
lies outside the tested range is said to be an extrapolation.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from tsvision.actuator.geometry import Geometry, model_keywords, paper_geometry
from tsvision.actuator.onset import predict_onset
from tsvision.actuator.reversible import reversible_limit
from tsvision.actuator.statics import Motor, statics, stroke_time_s
from tsvision.data import table
from tsvision.errors import InputError
from tsvision.life.fit import LifeFit, fit_all, predict_cycles
from tsvision.life.table import LifeTests, paper_tests
from tsvision.models import SECTIONS, DisplacementModel

ZONES = 24  # lengths tried per N and d
TRACE = 41  # turn counts along a stroke


@dataclass(frozen=True)
class Wanted:
    """What the designer asks for. `length_mm` bounds zone plus stroke; `life_cycles` 0: any."""

    stroke_mm: float
    load_N: float
    length_mm: float
    life_cycles: float = 0.0
    hole_distance_mm: float = 5.0
    hole_diameter_mm: float = float("nan")
    friction: float = 0.0
    safety: float = 4.0  # breaking load over largest tension
    overtwist: bool = True  # may the stroke go past the onset


@dataclass(frozen=True)
class Candidate:
    """One design. Lengths in mm, loads in N, torque in N m, turns and cycles as counts.

    `against` lists the limits that it breaks (none: it does all that was asked), `notes` what to
    know besides.
    """

    strings: int
    string_diameter_mm: float
    twisting_zone_mm: float
    bundle_diameter_mm: float
    turns: float
    contraction_percent: float
    onset_turns: float
    onset_low: float
    onset_high: float
    reversible_mm: float
    reversible_low_mm: float
    torque_Nm: float
    stroke_s: float
    tension_N: float
    strength_N: float
    life_cycles: float
    life_low: float
    against: tuple[str, ...] = field(default_factory=tuple)
    notes: tuple[str, ...] = field(default_factory=tuple)


@lru_cache
def reference_strength_N_per_mm2() -> float:
    """Breaking load of the paper's line over its measured diameter squared, N/mm²."""
    stated = table("stated").set_index("key")["value"]
    diameter = paper_geometry(2).string_diameter_mm
    return float(stated["string_strength_N"]) / diameter**2


@lru_cache
def reference_life() -> LifeFit:
    """The life model that the paper's table supports best."""
    return fit_all(paper_tests())[0]


def candidates(
    wanted: Wanted,
    model: DisplacementModel,
    counts: tuple[int, ...],
    string_diameters_mm: tuple[float, ...],
    motor: Motor,
    section: str = "packing_fraction",
) -> list[Candidate]:
    """All designs tried, those that break no limit first, then the shorter, then fewer strings."""
    _check(wanted)
    longest = wanted.length_mm - wanted.stroke_mm
    zones = np.geomspace(max(0.1 * longest, 1.0), longest, ZONES)
    found = [
        candidate
        for count in counts
        for diameter in string_diameters_mm
        for zone in zones
        if (candidate := _candidate(wanted, model, count, diameter, zone, motor, section))
    ]
    return sorted(found, key=lambda c: (len(c.against), c.twisting_zone_mm, c.strings))


def shortest_of_each(found: list[Candidate]) -> list[Candidate]:
    """The best candidate of every N and d, in the order of `candidates`."""
    best: dict[tuple[int, float], Candidate] = {}
    for candidate in found:
        best.setdefault((candidate.strings, candidate.string_diameter_mm), candidate)
    return list(best.values())


def _check(wanted: Wanted) -> None:
    for name in ("stroke_mm", "load_N", "length_mm", "safety"):
        value = getattr(wanted, name)
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{name} is {value:g}; give a number above 0")
    if wanted.length_mm <= wanted.stroke_mm:
        raise InputError(
            f"length {wanted.length_mm:g} mm must exceed the stroke of {wanted.stroke_mm:g} mm: "
            "it holds the twisting zone as well"
        )


def _candidate(
    wanted: Wanted,
    model: DisplacementModel,
    count: int,
    string_mm: float,
    zone_mm: float,
    motor: Motor,
    section: str,
) -> Candidate | None:
    """One design worked out; None where the model has no turns for the stroke."""
    bundle = float(SECTIONS[section].bundle_diameter_mm(count, string_mm))
    shape = Geometry(count, string_mm, zone_mm, wanted.hole_distance_mm, bundle)
    keywords = {k: float(v) for k, v in model.geometry(model_keywords(shape)).items()}  # type: ignore[arg-type]
    start = float(model.displacement_mm(0.0, **keywords))
    turns = float(model.turns_for_displacement(start + wanted.stroke_mm, **keywords))
    if not np.isfinite(turns):
        return None
    way = np.linspace(0.0, turns, TRACE)
    acting = statics(model, way, keywords, wanted.load_N, count, wanted.friction)
    onset = predict_onset(count, zone_mm, bundle)
    limit = reversible_limit(
        count, zone_mm, bundle, wanted.hole_distance_mm, wanted.hole_diameter_mm
    )
    life, life_low, stretched = _life(wanted, count, string_mm, zone_mm, turns)
    made = Candidate(
        strings=count,
        string_diameter_mm=string_mm,
        twisting_zone_mm=float(zone_mm),
        bundle_diameter_mm=bundle,
        turns=turns,
        contraction_percent=100 * wanted.stroke_mm / (zone_mm + wanted.stroke_mm),
        onset_turns=onset.turns,
        onset_low=onset.low,
        onset_high=onset.high,
        reversible_mm=limit.displacement_mm,
        reversible_low_mm=limit.low_mm,
        torque_Nm=float(np.max(acting.torque_winding_Nm)),
        stroke_s=stroke_time_s(acting, motor),
        tension_N=float(np.max(acting.string_tension_N)),
        strength_N=reference_strength_N_per_mm2() * string_mm**2,
        life_cycles=life,
        life_low=life_low,
    )
    return _judged(made, wanted, motor, stretched)


def _life(
    wanted: Wanted, count: int, string_mm: float, zone_mm: float, turns: float
) -> tuple[float, float, bool]:
    """Median life, its lower 95 % bound, and whether it lies outside the tested range."""
    pair, tested = paper_geometry(2), paper_tests()
    stress = (2 / count) * (pair.string_diameter_mm / string_mm) ** 2
    one = np.ones(1)
    load = wanted.load_N * stress * one
    stroke = wanted.stroke_mm * pair.twisting_zone_mm / zone_mm * one
    asked = LifeTests("asked", load, turns * one, stroke, one, one > 0)
    middle, low, _ = predict_cycles(reference_life(), asked)
    inside = (
        tested.load_N.min() <= load[0] <= tested.load_N.max()
        and tested.contraction_mm.min() <= stroke[0] <= tested.contraction_mm.max()
    )
    return float(middle[0]), float(low[0]), not inside


def _judged(made: Candidate, wanted: Wanted, motor: Motor, stretched: bool) -> Candidate:
    """The candidate with the limits that it breaks and what else to know."""
    limits = (
        (wanted.stroke_mm > made.reversible_mm, "irreversible"),
        (made.tension_N * wanted.safety > made.strength_N, "strength"),
        (not made.torque_Nm < motor.stall_torque_Nm, "motor stalls"),
        (made.life_cycles < wanted.life_cycles, "life"),
        (not wanted.overtwist and made.turns > made.onset_turns, "overtwist"),
    )
    notes = (
        (made.turns > made.onset_turns, "overtwisted"),
        (made.reversible_low_mm < wanted.stroke_mm <= made.reversible_mm, "may not unwind"),
        (made.life_low < wanted.life_cycles <= made.life_cycles, "life unsure"),
        (stretched, "life extrapolated"),
    )
    return replace(
        made,
        against=tuple(text for broken, text in limits if broken),
        notes=tuple(text for holds, text in notes if holds),
    )
