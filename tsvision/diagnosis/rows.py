"""Rows of DATA as they come, checked and made into numbers; InputError with line and mend."""

from __future__ import annotations

import difflib
import math

from tsvision.errors import InputError
from tsvision.mechanisms.shelf import OBSERVABLES
from tsvision.records import Rig
from tsvision.separators import has_decimal_comma
from tsvision.units import kgf_to_newton

NAN = float("nan")
CONSTANTS = (
    "strings",
    "string_diameter_mm",
    "twisting_zone_mm",
    "hole_distance_nominal_mm",
    "bundle_diameter_mm",
)
TOLERANCES = (*(f"{name}_sd" for name in CONSTANTS[1:]), "camera_scale_sd")
COLUMNS = ("run", "turns", "load_N", "branch", "time_s", "cycle", "observable", "value", "value_sd")
NUMERIC = ("turns", "time_s", "cycle", "value", "value_sd")
ALIASES = {"contraction_mm": "displacement_mm"}
LEAST_ROWS = 4
BRANCHES = {"wind": False, "unwind": True, "": False}


def long_from_wide(
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
    stated = {name: _sd_column(named[name], names) for name in found}
    taken = {named[name] for name in found} | set(stated.values())
    keep = [name for name in names if name not in taken]
    notes.append(f"read as a wide table: {', '.join(found)}")
    long = [
        {**{k: row.get(k) for k in keep}, "observable": name, "value": row.get(named[name])}
        | {"value_sd": row.get(stated[name])}
        for row in records
        for name in found
    ]
    return [*keep, "observable", "value", "value_sd"], long


def _sd_column(name: str, names: list[str]) -> str:
    """The column with the standard deviations of column `name`, "" where there is none."""
    spellings = (f"{name}_sd", f"{name.removesuffix('_mm')}_sd_mm")
    return next((found for found in spellings if found in names), "")


def check_names(names: list[str], notes: list[str], where: str) -> None:
    """InputError where a column's name nearly is a known one; a note of those not used."""
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
        mend = "write a decimal point" if has_decimal_comma(text) else "mend it"
        raise InputError(
            f"{where}, line {line}: '{text}' in column '{column}' is no number; {mend} or empty it"
        ) from None
    if math.isinf(found):
        raise InputError(f"{where}, line {line}: infinite '{column}'; mend or empty it")
    return found


def parse(
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
    parsed, seen = [], set()
    empty = twice = 0
    for line, record in enumerate(records, start=2):
        row = _row(record, names, rig, defaults, line, where)
        if math.isnan(row["value"]) or math.isnan(row["turns"]):
            empty += 1
            continue
        key = tuple(str(row[k]) for k in sorted(row))
        if key in seen:
            twice += 1
            continue
        seen.add(key)
        parsed.append(row)
    if "branch" not in names:
        _unwind_by_time(parsed, notes)
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


def _row(
    record: dict, names: list[str], rig: Rig, defaults: dict[str, float], line: int, where: str
) -> dict:
    """One row checked; without a value or turns, nothing else of it is."""

    def column(name: str) -> float:
        return number(record.get(name), name, line, where) if name in names else NAN

    row: dict = {n: column(n) for n in NUMERIC if n in names}
    row["observable"] = _observable(record, line, where)
    if math.isnan(row["value"]) or math.isnan(row["turns"]):
        return row
    if row.get("value_sd", NAN) <= 0:
        raise InputError(f"{where}, line {line}: value_sd must be above 0; mend or empty it")
    row["run"] = str(record.get("run") or "run").strip()
    branch = str(record.get("branch") or "").strip().lower()
    if branch not in BRANCHES:
        raise InputError(f"{where}, line {line}: branch '{branch}'; write 'wind' or 'unwind'")
    row["unwinding"] = BRANCHES[branch]
    load = _load(record, names, line, where)
    row["load_stated"] = not math.isnan(load)
    row["load_N"] = load if row["load_stated"] else rig.actuator.load_N
    for name in CONSTANTS:
        given = column(name)
        row[name] = defaults[name] if math.isnan(given) else given
    for name in TOLERANCES:
        row[name] = column(name)
        if row[name] < 0:
            raise InputError(f"{where}, line {line}: '{name}' is negative; give it as positive")
    return row


def _observable(record: dict, line: int, where: str) -> str:
    word = str(record.get("observable") or "").strip()
    if word not in OBSERVABLES:
        near = difflib.get_close_matches(word, OBSERVABLES, n=1)
        hint = f"did you mean '{near[0]}'?" if near else f"use one of {', '.join(OBSERVABLES)}"
        raise InputError(f"{where}, line {line}: observable '{word}' is unknown; {hint}")
    return word


def _unwind_by_time(rows: list[dict], notes: list[str]) -> None:
    """Mark as unwinding what was read after the turns had last fallen, where times tell: without
    them, or where turns only rise, all is winding."""
    falling = 0
    runs: dict[tuple[str, str], list[dict]] = {}
    for row in rows:
        runs.setdefault((row["run"], str(row.get("cycle"))), []).append(row)
    for own in runs.values():
        levels = {row.get("time_s", NAN): abs(row["turns"]) for row in own}
        if len(levels) < 2 or any(map(math.isnan, levels)):
            continue
        if any(levels[row["time_s"]] != abs(row["turns"]) for row in own):
            continue  # two turn counts at one time: the clock does not tell this run's order
        back, before, unwound = False, -1.0, {}
        for time in sorted(levels):
            back = levels[time] < before or (back and levels[time] == before)
            before, unwound[time] = levels[time], back
        for row in own:
            row["unwinding"] = unwound[row["time_s"]]
            falling += row["unwinding"]
    if falling:
        notes.append(f"no column 'branch': {falling} rows were read while the turns fell in time")


def _load(record: dict, names: list[str], line: int, where: str) -> float:
    """The load that the row itself states, NaN where it does not."""
    load = number(record.get("load_N"), "load_N", line, where) if "load_N" in names else NAN
    if math.isnan(load) and "load_kgf" in names:
        load = float(kgf_to_newton(number(record.get("load_kgf"), "load_kgf", line, where)))
    if load < 0:
        raise InputError(f"{where}, line {line}: load {load:g} N is negative; give its magnitude")
    return load
