"""Checked rows to the arrays of a `Table`: conditions once each, rows that point to them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from tsvision.diagnosis.observations import Table
from tsvision.diagnosis.rows import CONSTANTS, NAN, TOLERANCES
from tsvision.errors import InputError
from tsvision.mechanisms.shelf import OBSERVABLES
from tsvision.mechanisms.state import Conditions
from tsvision.models import SECTIONS
from tsvision.records import Rig

# Share of the value (first) and mm (second): the larger of the two is the standard deviation.
DEFAULT_TOLERANCE: dict[str, tuple[float, float]] = {
    "bundle_diameter_mm": (0.005, 0.003),  # a caliper that shows 0.01 mm
    "packed_diameter_mm": (0.08, 0.0),  # D from a section model, which errs by up to 13 %
    "paired_diameter_mm": (0.02, 0.0),  # 2 d: two strings leave nothing to packing
    "twisting_zone_mm": (0.0, 0.15),
    "hole_distance_nominal_mm": (0.0, 0.10),
    "camera_scale": (0.005, 0.0),
}
NO_CONDITION = ("value", "value_sd", "observable", "load_stated")
PACE_S = 10.0  # from reading to reading, where no times are known
GAIN_SD = {"torque_Nmm": 0.03, "pitch_mm": 0.01}  # gauges whose gain is not known exactly


def arrange(rows: list[dict], notes: list[str], where: str, rig: Rig) -> Table:
    """Parsed rows to arrays: conditions without repetition, rows that point to them."""
    if any(row["turns"] < 0 for row in rows):
        notes.append("negative turns were read as winding the other way: their magnitude counts")
    loads = [row["load_N"] for row in rows]
    unknown = sum(map(math.isnan, loads))
    if 0 < unknown < len(rows):
        raise InputError(f"{where}: {unknown} rows have no load; fill 'load_N' or drop the column")
    runs = tuple(dict.fromkeys(row["run"] for row in rows))
    observables = tuple(name for name in OBSERVABLES if any(r["observable"] == name for r in rows))
    keys: dict[tuple, int] = {}
    first: list[dict] = []
    condition = np.zeros(len(rows), dtype=int)
    for i, row in enumerate(rows):
        key = tuple(str(v) for k, v in row.items() if k not in NO_CONDITION)
        if key not in keys:
            keys[key] = len(first)
            first.append(row)
        condition[i] = keys[key]
    run = np.array([runs.index(row["run"]) for row in rows])
    observable = np.array([observables.index(row["observable"]) for row in rows])
    at, sds = _conditions(first, runs, notes, where)
    if np.all(np.isnan(at.time_s)):
        at = _timed(at, notes)
    table = Table(
        at=at,
        observables=observables,
        observable=observable,
        condition=condition,
        run=run,
        before=_before(at, condition, observable, run),
        value=np.array([row["value"] for row in rows]),
        value_sd=np.array([row.get("value_sd", NAN) for row in rows]),
        runs=runs,
        radius_sd_mm=sds[0],
        zone_sd_mm=sds[1],
        hole_sd_mm=sds[2],
        camera_sd=_camera_sd(rows, rig),
        # A rig's load alone is a default, and not what hung there while these rows were read.
        load_recorded=not unknown and any(row["load_stated"] for row in rows),
        gain_sd={name: sd for name, sd in GAIN_SD.items() if name in observables},
        notes=tuple(notes),
    )
    return table


def _timed(at: Conditions, notes: list[str]) -> Conditions:
    """Times at an even pace where both branches tell the order of the readings."""
    if not at.unwinding.any() or at.unwinding.all():
        notes.append("no times are known: creep is not considered, though it may look like stretch")
        return at
    notes.append(
        f"no times are known: for creep, a reading every {PACE_S:g} s is assumed, in the order of "
        "the motion"
    )
    time = np.zeros(len(at.turns))
    for run in np.unique(at.run):
        own = np.flatnonzero(at.run == run)
        time[own[_in_order(at.take(own))]] = PACE_S * np.arange(len(own))
    return replace(at, time_s=time)


def _camera_sd(rows: list[dict], rig: Rig) -> float:
    given = [row["camera_scale_sd"] for row in rows if not math.isnan(row["camera_scale_sd"])]
    if given:
        return float(np.mean(given))
    if math.isfinite(rig.camera.mm_per_px_sd) and math.isfinite(rig.camera.mm_per_px):
        return rig.camera.mm_per_px_sd / rig.camera.mm_per_px
    return DEFAULT_TOLERANCE["camera_scale"][0]


def _conditions(
    first: list[dict], runs: tuple[str, ...], notes: list[str], where: str
) -> tuple[Conditions, list[np.ndarray]]:
    column = {
        name: np.array([row.get(name, NAN) for row in first], dtype=float)
        for name in ("turns", "load_N", "time_s", "cycle", *CONSTANTS, *TOLERANCES)
    }
    for name in ("strings", "twisting_zone_mm", "hole_distance_nominal_mm"):
        _need(column[name], name, where)
    if np.any(column["strings"] < 1) or np.any(column["strings"] % 1):
        raise InputError(f"{where}: 'strings' must be a whole number of at least 1")
    if np.any(column["twisting_zone_mm"] <= 0) or np.any(column["hole_distance_nominal_mm"] < 0):
        raise InputError(f"{where}: the twisting zone must be above 0 mm and no distance negative")
    diameter, packed = _nominal_diameter(column, notes, where)
    given = column["bundle_diameter_mm_sd"]
    kind = np.where(packed, np.where(column["strings"] <= 2, 1, 2), 0)
    share, least = np.array([DEFAULT_TOLERANCE[name] for name in _DIAMETERS])[kind].T
    string_share = column["string_diameter_mm_sd"] / column["string_diameter_mm"]
    share = np.where(packed & np.isfinite(string_share), np.hypot(share, string_share), share)
    run = np.array([runs.index(row["run"]) for row in first])
    turns = np.abs(column["turns"])
    at = Conditions(
        turns=turns,
        load_N=column["load_N"],
        strings=column["strings"],
        string_diameter_mm=column["string_diameter_mm"],
        twisting_zone_mm=column["twisting_zone_mm"],
        hole_distance_mm=column["hole_distance_nominal_mm"],
        radius_mm=diameter / 2,
        unwinding=np.array([row["unwinding"] for row in first]),
        peak_turns=turns,
        time_s=column["time_s"],
        cycle=column["cycle"],
        run=run,
    )
    at = replace(at, peak_turns=_peaks(at))
    zone_sd = _tolerance(column, "twisting_zone_mm")
    hole_sd = _tolerance(column, "hole_distance_nominal_mm")
    radius_sd = np.where(np.isnan(given), np.maximum(share * diameter, least), given) / 2
    return at, [radius_sd, zone_sd, hole_sd]


_DIAMETERS = ("bundle_diameter_mm", "paired_diameter_mm", "packed_diameter_mm")


def _need(column: np.ndarray, name: str, where: str) -> None:
    if np.any(np.isnan(column)):
        rig_key = {
            "strings": "strings.count",
            "twisting_zone_mm": "actuator.twisting_zone_mm",
            "hole_distance_nominal_mm": "actuator.hole_distance_mm",
        }[name]
        raise InputError(f"{where}: '{name}' is unknown; add that column, or {rig_key} in --rig")


def _tolerance(column: dict[str, np.ndarray], name: str) -> np.ndarray:
    share, least = DEFAULT_TOLERANCE[name]
    default = np.maximum(share * column[name], least)
    return np.where(np.isnan(column[f"{name}_sd"]), default, column[f"{name}_sd"])


def _nominal_diameter(
    column: dict[str, np.ndarray], notes: list[str], where: str
) -> tuple[np.ndarray, np.ndarray]:
    """D as stated, else from the section model; and where the latter was used."""
    diameter = column["bundle_diameter_mm"].copy()
    packed = np.isnan(diameter)
    if np.any(packed):
        if np.any(np.isnan(column["string_diameter_mm"][packed])):
            raise InputError(
                f"{where}: neither 'bundle_diameter_mm' nor 'string_diameter_mm' is known; "
                "add a column, or strings.diameter_mm in --rig"
            )
        for count in np.unique(column["strings"][packed]):
            rows = packed & (column["strings"] == count)
            section = SECTIONS["pair_core" if count <= 10 else "ring"]
            diameter[rows] = section.bundle_diameter_mm(
                int(count), column["string_diameter_mm"][rows]
            )
        notes.append("the nominal bundle diameter comes from the section model")
    if np.any(diameter <= 0):
        raise InputError(f"{where}: the bundle diameter must be above 0 mm")
    return diameter, packed


def _in_order(at: Conditions, *groups: np.ndarray) -> np.ndarray:
    """The order of motion, by `groups` (the last first), cycle, time and branch."""
    along = np.where(at.unwinding, -at.turns, at.turns)
    time, cycle = np.nan_to_num(at.time_s), np.nan_to_num(at.cycle)
    return np.lexsort((along, at.unwinding, time, cycle, *groups))


def _peaks(at: Conditions) -> np.ndarray:
    """The turns from which the motor last turned back, (m,); winding, the most since then.

    A run may hold several cycles, each to turns of its own.
    """
    peaks = np.empty(len(at.turns))
    for run in np.unique(at.run):
        own = np.flatnonzero(at.run == run)
        for stretch in _windings(at, own[_in_order(at.take(own))]):
            peaks[stretch] = np.maximum.accumulate(at.turns[stretch])
    return peaks


def _windings(at: Conditions, order: np.ndarray) -> list[np.ndarray]:
    """One run's readings in their `order`, cut where a cycle begins or the motor winds anew."""
    cycle = np.nan_to_num(at.cycle[order])
    fresh = cycle[1:] != cycle[:-1]
    if _clock_tells(at, order):
        fresh |= at.unwinding[order][:-1] & ~at.unwinding[order][1:]
    return np.split(order, 1 + np.flatnonzero(fresh))


def _clock_tells(at: Conditions, order: np.ndarray) -> bool:
    """Whether no two turn counts share a time: a clock that starts again tells no order."""
    times = list(zip(at.cycle[order].astype(str), at.time_s[order].astype(str), strict=True))
    places = zip(times, at.turns[order], at.unwinding[order], strict=True)
    return len({*times}) == len({*places})


def _before(
    at: Conditions, condition: np.ndarray, observable: np.ndarray, run: np.ndarray
) -> np.ndarray:
    """For each row the row before it in the same run and observable, in the order of motion."""
    order = _in_order(at.take(condition), run, observable)
    same = (run[order][1:] == run[order][:-1]) & (observable[order][1:] == observable[order][:-1])
    before = np.full(len(run), -1)
    before[order[1:][same]] = order[:-1][same]
    return before
