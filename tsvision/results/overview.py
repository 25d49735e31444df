"""A table over recordings: one row each, from their summaries."""

from __future__ import annotations

from typing import Any

import pyarrow as pa

from tsvision.results.schema import unit_of

_ONSETS = ("overtwist", "local_overtwist", "knot", "irreversible")
_ONSET_PARTS = (("turns", "turns"), ("low", "turns_low"), ("high", "turns_high"))


def recordings_table(summaries: dict[str, dict[str, Any]]) -> pa.Table:
    """One row a recording: N, load, D, angle, onsets, counts, flags. Units in the metadata."""
    rows = [overview(name, summary) for name, summary in summaries.items()]
    schema = pa.schema([_field(column, kind) for column, kind in _COLUMNS.items()])
    return pa.Table.from_pylist(rows, schema=schema)


def overview(name: str, summary: dict[str, Any]) -> dict[str, Any]:
    """The row of one recording."""
    rig = summary["rig"]
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
