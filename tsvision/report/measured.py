"""A measure folder as the report needs it: tables, summary, and each frame's own nouns."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from tsvision.records import FrameRow, KnotSighting, Profile
from tsvision.report.profiles import Profiles
from tsvision.results.read import read_summary, read_table

_ROW_FIELDS = {f.name: f.type for f in fields(FrameRow)}
_KNOT_FIELDS = [f.name for f in fields(KnotSighting)]


@dataclass(frozen=True)
class Measured:
    """Tables of one measured recording; `frames` has every column of FrameRow, one row a frame."""

    folder: Path
    frames: pd.DataFrame
    profiles: Profiles
    knots: pd.DataFrame
    summary: dict[str, Any]

    def row(self, position: int) -> FrameRow:
        """The frame at this position of the table as a FrameRow; missing text becomes ''."""
        record = self.frames.iloc[position]
        values: dict[str, Any] = {}
        for name, kind in _ROW_FIELDS.items():
            value = record[name]
            if kind == "str":
                value = value if isinstance(value, str) else ""
            elif kind == "int":
                value = int(value)
            else:
                value = float(value) if pd.notna(value) else float("nan")
            values[name] = value
        return FrameRow(**values)

    def profile(self, row: FrameRow) -> Profile | None:
        """The silhouette of a frame, None where none was found."""
        return self.profiles.of(row.frame, row.mm_per_px)

    def sightings(self, frame: int) -> list[KnotSighting]:
        """The knots seen in a frame."""
        part = self.knots[self.knots["frame"] == frame]
        known = [name for name in _KNOT_FIELDS if name in part.columns]
        return [
            KnotSighting(**dict(zip(known, map(float, values), strict=True)))
            for values in part[known].itertuples(index=False)
        ]

    def track_labels(self, frame: int) -> list[str]:
        """The track of each knot of a frame, in the order of `sightings`; in brackets where the
        knot was hidden from view and stands where its track says."""
        part = self.knots[self.knots["frame"] == frame]
        if "track" not in part.columns:
            return []
        seen = part["seen"] if "seen" in part.columns else pd.Series(True, part.index)
        return [
            f"{int(t)}" if s else f"({int(t)})" for t, s in zip(part["track"], seen, strict=True)
        ]


def read_measured(folder: Path) -> Measured:
    """Read what `tsvision measure` wrote; InputError when the folder is no such output."""
    folder = Path(folder)
    summary = read_summary(folder)
    frames = read_table(folder / "frames.parquet")
    for name, kind in _ROW_FIELDS.items():
        if name not in frames.columns:
            frames[name] = "" if kind == "str" else np.nan
    profiles = Profiles(folder / "profiles.parquet")
    return Measured(folder, frames, profiles, read_table(folder / "knots.parquet"), summary)


def rig_of(summary: dict[str, Any]) -> dict[str, Any]:
    """What is known of the rig as {"section.key": value}, whether the summary nests it or not."""
    flat: dict[str, Any] = {}
    for key, value in (summary.get("rig") or {}).items():
        inner = value.items() if isinstance(value, dict) else [("", value)]
        flat |= {f"{key}.{name}" if name else key: v for name, v in inner}
    return {k: v for k, v in flat.items() if v is not None and v != [] and v == v}


def find_source(measured: Measured, folder: Path | None = None) -> Path | None:
    """The frames that were measured, under their own name and with the same files, in `folder`,
    or where one would look: beside the measure folder, one above it, or here. The summary keeps
    no path, since it has to read the same on every machine."""
    told = measured.summary.get("input") or {}
    name, files = str(told.get("name") or ""), told.get("files") or []
    if not name or Path(name).name != name:
        return None
    here = measured.folder.resolve()
    usual = (here.parent, here.parent.parent, Path.cwd())
    for place in (shelf / name for shelf in ([folder] if folder else usual)):
        if place.is_file() or (place.is_dir() and _holds(place, files)):
            return place
    return None


def _holds(folder: Path, files: list[dict[str, str]]) -> bool:
    """Whether the first and the last file measured are in the folder."""
    ends = [str(f.get("name")) for f in (files[:1] + files[-1:])]
    return bool(ends) and all((folder / name).is_file() for name in ends)
