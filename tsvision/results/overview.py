"""A table over recordings: one row each, from their summaries."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pyarrow as pa

from tsvision.errors import InputError
from tsvision.results.read import read_summary
from tsvision.results.schema import unit_of

VERDICT = "verdict.json"

_ONSETS = ("overtwist", "local_overtwist", "knot", "irreversible")
_ONSET_PARTS = (("turns", "turns"), ("low", "turns_low"), ("high", "turns_high"))


def recordings_table(places: Mapping[str, Path]) -> pa.Table:
    """One row a recording: N, load, D, angle, onsets, counts, flags, verdict. Units in the
    metadata. `places` maps names to folders that `tsvision measure` wrote."""
    rows = [
        overview(name, read_summary(place), read_verdict(place)) for name, place in places.items()
    ]
    schema = pa.schema([_field(column, kind) for column, kind in _COLUMNS.items()])
    return pa.Table.from_pylist(rows, schema=schema)


def read_verdict(folder: Path) -> dict[str, Any]:
    """verdict.json beside a measurement (`tsvision diagnose DIR --out DIR/verdict.json`); empty
    when there is none. Raises InputError when it is no such file."""
    path = folder / VERDICT
    if not path.is_file():
        return {}
    try:
        verdict = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: no verdict ({type(error).__name__}); diagnose again") from None
    if not isinstance(verdict, dict) or "status" not in verdict:
        raise InputError(f"{path}: no verdict; write it with `tsvision diagnose DIR --out`")
    return verdict


def overview(
    name: str, summary: Mapping[str, Any], verdict: Mapping[str, Any] = {}
) -> dict[str, Any]:
    """The row of one recording."""
    rig = summary["rig"]
    base, extended = verdict.get("base") or {}, verdict.get("extended") or {}
    causes = verdict.get("causes") or []
    row: dict[str, Any] = {
        "recording": name,
        "key": summary.get("key"),
        "strings": rig.get("strings.count"),
        "string_diameter_mm": rig.get("strings.diameter_mm"),
        "load_N": rig.get("actuator.load_N"),
        "mm_per_px": rig.get("camera.mm_per_px"),
        "frames_total": summary["frames_total"],
        "frames_measured": summary["frames_measured"],
        "frames_flagged": summary["frames_flagged"],
        "diameter_mm": summary["diameter_mm"]["value"],
        "diameter_mm_sd": summary["diameter_mm"]["sd"],
        "diameter_px": summary["diameter_px"]["value"],
        "helix_angle_deg": summary["helix_angle_deg"]["value"],
        "helix_angle_deg_sd": summary["helix_angle_deg"]["sd"],
        "handedness": summary.get("handedness"),
        "verdict": verdict.get("status"),
        "causes": "|".join(str(cause["name"]) for cause in causes) if verdict else None,
        "rmse_base_mm": base.get("rmse_mm"),
        "rmse_extended_mm": extended.get("rmse_mm"),
        "flags": "|".join(f"{flag}:{count}" for flag, count in summary.get("flags", {}).items()),
    }
    for onset in _ONSETS:
        told = summary.get(f"{onset}_onset") or {}
        row[f"{onset}_status"] = told.get("status")
        for part, column in _ONSET_PARTS:
            row[f"{onset}_{column}"] = told.get(part)
        row[f"{onset}_last_turns"] = told.get("last_turns")
    return row


_COLUMNS: dict[str, pa.DataType] = {
    "recording": pa.string(),
    "key": pa.string(),
    "strings": pa.int64(),
    "string_diameter_mm": pa.float64(),
    "load_N": pa.float64(),
    "mm_per_px": pa.float64(),
    "frames_total": pa.int64(),
    "frames_measured": pa.int64(),
    "frames_flagged": pa.int64(),
    "diameter_mm": pa.float64(),
    "diameter_mm_sd": pa.float64(),
    "diameter_px": pa.float64(),
    "helix_angle_deg": pa.float64(),
    "helix_angle_deg_sd": pa.float64(),
    "handedness": pa.string(),
    "verdict": pa.string(),
    "causes": pa.string(),
    "rmse_base_mm": pa.float64(),
    "rmse_extended_mm": pa.float64(),
    "flags": pa.string(),
    **{
        f"{onset}_{part}": pa.string() if part == "status" else pa.float64()
        for onset in _ONSETS
        for part in ("status", "turns", "turns_low", "turns_high", "last_turns")
    },
}


def _field(name: str, kind: pa.DataType) -> pa.Field:
    bare = name.removesuffix("_sd")
    if pa.types.is_string(kind):
        unit = ""
    elif bare.endswith("_deg"):
        unit = "deg"
    elif "_turns" in bare:
        unit = "turn"
    else:
        unit = unit_of(name)
    return pa.field(name, kind, metadata={"unit": unit})
