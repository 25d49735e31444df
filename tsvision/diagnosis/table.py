"""DATA for the diagnosis: a long-form (or wide) table, checked, as arrays.

Defaults for the inputs' tolerances (one standard deviation) where no `<constant>_sd` column says
otherwise are in `DEFAULT_TOLERANCE`.
"""

from __future__ import annotations

import csv
import difflib
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tsvision.errors import InputError
from tsvision.mechanisms.shelf import OBSERVABLES, Conditions
from tsvision.models import SECTIONS
from tsvision.records import Rig
from tsvision.units import kgf_to_newton

NAN = float("nan")
# Share of the value (first) and mm (second): the larger of the two is the standard deviation.
DEFAULT_TOLERANCE: dict[str, tuple[float, float]] = {
    "bundle_diameter_mm": (0.005, 0.003),  # a caliper that shows 0.01 mm
    "packed_diameter_mm": (0.08, 0.0),  # D from a section model, which errs by up to 13 %
    "paired_diameter_mm": (0.02, 0.0),  # 2 d: two strings leave nothing to packing
    "twisting_zone_mm": (0.0, 0.15),
    "hole_distance_nominal_mm": (0.0, 0.10),
    "camera_scale": (0.005, 0.0),
}
CONSTANTS = (
    "strings",
    "string_diameter_mm",
    "twisting_zone_mm",
    "hole_distance_nominal_mm",
    "bundle_diameter_mm",
)
TOLERANCES = (*(f"{name}_sd" for name in CONSTANTS[1:]), "camera_scale_sd")
COLUMNS = ("run", "turns", "load_N", "branch", "time_s", "cycle", "observable", "value", "value_sd")
ALIASES = {"contraction_mm": "displacement_mm"}
GAIN_SD = {"torque_Nmm": 0.03, "pitch_mm": 0.01}  # gauges whose gain is not known exactly
LEAST_ROWS = 4
BRANCHES = {"wind": False, "unwind": True, "": False}


@dataclass(frozen=True)
class Sighting:
    """What the pictures of one run showed of a mechanism: it set in between `low` and `high` turns,
    or was not seen (`observed` False) although it would have been."""

    mechanism: str
    observed: bool
    low: float = NAN
    high: float = NAN


@dataclass(frozen=True)
class Table:
    """Observations and the conditions under which they were made.

    Row arrays have shape (n,): `observable` indexes `observables`, `condition` indexes `at`,
    `run` indexes `runs`, `before` is the row that precedes it in its run (-1: none).
    `radius_sd_mm`, `zone_sd_mm`, `hole_sd_mm` have shape (m,), like `at`'s arrays.
    """

    at: Conditions
    observables: tuple[str, ...]
    observable: np.ndarray
    condition: np.ndarray
    run: np.ndarray
    before: np.ndarray
    value: np.ndarray
    value_sd: np.ndarray
    runs: tuple[str, ...]
    radius_sd_mm: np.ndarray
    zone_sd_mm: np.ndarray
    hole_sd_mm: np.ndarray
    camera_sd: float
    load_recorded: bool
    gain_sd: dict[str, float] = field(default_factory=dict)  # observable -> sd of its gauge's gain
    # observable -> size of slow errors that its instrument is known to make along a recording
    drifts: dict[str, float] = field(default_factory=dict)
    sightings: tuple[Sighting, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def rows(self) -> int:
        return len(self.value)

    def select(self, keep: np.ndarray) -> Table:
        """The rows where `keep` (n,) is true; conditions stay, so that indices hold."""
        picked = np.flatnonzero(keep)
        return Table(
            **{
                **{name: getattr(self, name) for name in self.__dataclass_fields__},
                **{
                    name: getattr(self, name)[picked]
                    for name in ("observable", "condition", "run", "value", "value_sd")
                },
                "before": _renumbered(self.before, picked),
            }
        )


def _renumbered(before: np.ndarray, picked: np.ndarray) -> np.ndarray:
    """`before` among the picked rows; a row whose predecessor is gone starts anew."""
    new = np.full(len(before) + 1, -1)
    new[picked] = np.arange(len(picked))
    return new[before[picked]]


def read_table(path: Path, rig: Rig | None = None) -> Table:
    """Read DATA.csv. Raises InputError with the line and the mend where something is wrong."""
    header, rows = read_rows(path)
    return table_from_rows(header, rows, rig or Rig(), str(path))


def read_rows(path: Path) -> tuple[list[str], list[dict]]:
    """Header and rows of a CSV as text, names stripped; InputError when it cannot be read."""
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file)
            rows = [{k.strip(): v for k, v in row.items() if k is not None} for row in reader]
            header = [name.strip() for name in reader.fieldnames or []]
    except (OSError, UnicodeDecodeError, csv.Error) as problem:
        raise InputError(f"cannot read '{path}' as CSV ({problem}); give a UTF-8 CSV") from problem
    if not rows:
        raise InputError(f"'{path}' holds no rows; give one observation a row")
    return header, rows


def table_from_rows(
    header: Sequence[str], rows: Iterable[Mapping[str, object]], rig: Rig, where: str = "the table"
) -> Table:
    """Rows of text or numbers (keys as in the interface note) to a `Table`."""
    names = [name.strip() for name in header]
    notes: list[str] = []
    records = [{k.strip(): v for k, v in row.items() if k is not None} for row in rows]
    if "observable" not in names or "value" not in names:
        names, records = _long_from_wide(names, records, notes, where)
    _check_names(names, notes, where)
    if "turns" not in names:
        raise InputError(f"{where} has no column 'turns'; add the motor turns of each observation")
    parsed = _parse(names, records, rig, notes, where)
    return _arrange(parsed, notes, where, rig)


def _long_from_wide(
    names: list[str], records: list[dict], notes: list[str], where: str
) -> tuple[list[str], list[dict]]:
    """One row an observation from one row a condition."""
    named = {ALIASES.get(name, name): name for name in names}
    found = [name for name in OBSERVABLES if name in named]
    if not found:
        raise InputError(
            f"{where} has neither 'observable' and 'value' nor a column of "
            f"{', '.join(OBSERVABLES)}; add one"
        )
    keep = [name for name in names if name not in {named[f] for f in found}]
    notes.append(f"read as a wide table: {', '.join(found)}")
    long = [
        {**{k: row.get(k) for k in keep}, "observable": name, "value": row.get(named[name])}
        | {"value_sd": row.get(f"{named[name]}_sd") or row.get(f"{named[name][:-3]}_sd_mm")}
        for row in records
        for name in found
    ]
    return [*keep, "observable", "value", "value_sd"], long


def _check_names(names: list[str], notes: list[str], where: str) -> None:
    known = (*COLUMNS, *CONSTANTS, *TOLERANCES, "load_kgf")
    odd = [name for name in names if name not in known]
    for name in odd:
        near = difflib.get_close_matches(name, known, n=1, cutoff=0.8)
        if near and near[0] not in names and name not in ("cycles", *OBSERVABLES):
            raise InputError(f"{where} has a column '{name}'; did you mean '{near[0]}'?")
    if odd:
        notes.append(f"columns not used: {', '.join(odd)}")


def number(text: object, column: str, line: int, where: str) -> float:
    """A float, NaN for an empty cell; InputError names line and column otherwise."""
    if text is None or (
        isinstance(text, str) and text.strip().lower() in ("", "nan", "na", "none")
    ):
        return NAN
    try:
        found = float(text)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise InputError(
            f"{where}, line {line}: '{text}' in column '{column}' is no number; mend or empty it"
        ) from None
    if math.isinf(found):
        raise InputError(f"{where}, line {line}: infinite '{column}'; mend or empty it")
    return found


def _parse(
    names: list[str], records: list[dict], rig: Rig, notes: list[str], where: str
) -> list[dict]:
    """Each usable row as a dict of floats and words, constants filled from the rig."""
    defaults = {
        "strings": NAN if rig.strings.count is None else float(rig.strings.count),
        "string_diameter_mm": rig.strings.diameter_mm,
        "twisting_zone_mm": rig.actuator.twisting_zone_mm,
        "hole_distance_nominal_mm": rig.actuator.hole_distance_mm,
        "bundle_diameter_mm": NAN,
    }
    numeric = [n for n in ("turns", "time_s", "cycle", "value", "value_sd") if n in names]
    parsed, seen = [], set()
    empty = twice = 0
    for line, record in enumerate(records, start=2):
        row: dict = {n: number(record.get(n), n, line, where) for n in numeric}
        word = str(record.get("observable") or "").strip()
        if word not in OBSERVABLES:
            near = difflib.get_close_matches(word, OBSERVABLES, n=1)
            hint = f"did you mean '{near[0]}'?" if near else f"use one of {', '.join(OBSERVABLES)}"
            raise InputError(f"{where}, line {line}: observable '{word}' is unknown; {hint}")
        row["observable"] = word
        if math.isnan(row["value"]) or math.isnan(row["turns"]):
            empty += 1
            continue
        if not math.isnan(row.get("value_sd", NAN)) and row["value_sd"] <= 0:
            raise InputError(f"{where}, line {line}: value_sd must be above 0; mend or empty it")
        row["run"] = str(record.get("run") or "run").strip()
        branch = str(record.get("branch") or "").strip().lower()
        if branch not in BRANCHES:
            raise InputError(f"{where}, line {line}: branch '{branch}'; write 'wind' or 'unwind'")
        row["unwinding"] = BRANCHES[branch]
        row["load_N"] = _load(record, names, rig, line, where)
        for name in CONSTANTS:
            given = number(record.get(name), name, line, where) if name in names else NAN
            row[name] = defaults[name] if math.isnan(given) else given
        for name in TOLERANCES:
            row[name] = number(record.get(name), name, line, where) if name in names else NAN
            if row[name] < 0:
                raise InputError(f"{where}, line {line}: '{name}' is negative; give it as positive")
        key = tuple(str(row[k]) for k in sorted(row))
        if key in seen and ("time_s" in names or "value" in names):
            twice += 1
            continue
        seen.add(key)
        parsed.append(row)
    if empty:
        notes.append(f"{empty} rows without a value or turns were left out")
    if twice:
        notes.append(f"{twice} rows that repeat another one exactly were left out")
    if len(parsed) < LEAST_ROWS:
        raise InputError(
            f"{where} has {len(parsed)} usable observations; at least {LEAST_ROWS} are needed to "
            "decide anything"
        )
    return parsed


def _load(record: dict, names: list[str], rig: Rig, line: int, where: str) -> float:
    load = number(record.get("load_N"), "load_N", line, where) if "load_N" in names else NAN
    if math.isnan(load) and "load_kgf" in names:
        load = float(kgf_to_newton(number(record.get("load_kgf"), "load_kgf", line, where)))
    if load < 0:
        raise InputError(f"{where}, line {line}: load {load:g} N is negative; give its magnitude")
    return rig.actuator.load_N if math.isnan(load) else load


def _arrange(rows: list[dict], notes: list[str], where: str, rig: Rig) -> Table:
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
        key = tuple(str(v) for k, v in row.items() if k not in ("value", "value_sd", "observable"))
        if key not in keys:
            keys[key] = len(first)
            first.append(row)
        condition[i] = keys[key]
    run = np.array([runs.index(row["run"]) for row in rows])
    observable = np.array([observables.index(row["observable"]) for row in rows])
    at, sds = _conditions(first, runs, notes, where)
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
        load_recorded=not unknown
        and not (math.isfinite(rig.actuator.load_N) and set(loads) == {rig.actuator.load_N}),
        gain_sd={name: sd for name, sd in GAIN_SD.items() if name in observables},
        notes=tuple(notes),
    )
    return table


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
        peak_turns=np.array([turns[run == k].max() for k in run]),
        time_s=column["time_s"],
        cycle=column["cycle"],
        run=run,
    )
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


def _before(
    at: Conditions, condition: np.ndarray, observable: np.ndarray, run: np.ndarray
) -> np.ndarray:
    """For each row the row before it in the same run and observable, in the order of motion."""
    turns, back = at.turns[condition], at.unwinding[condition]
    along = np.where(back, -turns, turns)
    time = np.nan_to_num(at.time_s[condition])
    cycle = np.nan_to_num(at.cycle[condition])
    order = np.lexsort((along, back, time, cycle, run, observable))
    same = (run[order][1:] == run[order][:-1]) & (observable[order][1:] == observable[order][:-1])
    before = np.full(len(run), -1)
    before[order[1:][same]] = order[:-1][same]
    return before
