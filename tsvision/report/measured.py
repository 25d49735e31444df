"""A measure folder as the report needs it: tables, summary, and each frame's own nouns."""

from __future__ import annotations

import json
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from tsvision.errors import InputError
from tsvision.records import FrameRow, KnotSighting, Profile

_ROW_FIELDS = {f.name: f.type for f in fields(FrameRow)}
_KNOT_FIELDS = [f.name for f in fields(KnotSighting)]


@dataclass(frozen=True)
class Measured:
    """Tables of one measured recording; `frames` has every column of FrameRow, one row a frame."""

    folder: Path
    frames: pd.DataFrame
    profiles: pd.DataFrame
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

    def profile(self, frame: int, mm_per_px: float) -> Profile | None:
        """The silhouette of a frame, None where none was found."""
        part = self.profiles[self.profiles["frame"] == frame]
        if part.empty:
            return None
        columns = {name: part[name].to_numpy(float) for name in part.columns if name != "frame"}
        s_px = columns["s_px"] if "s_px" in columns else columns["s_mm"] / mm_per_px
        return Profile(
            s_mm=columns["s_mm"],
            s_px=s_px,
            upper_px=columns["upper_px"],
            lower_px=columns["lower_px"],
            width_mm=columns["width_mm"],
            envelope_mm=columns["envelope_mm"],
        )

    def sightings(self, frame: int) -> list[KnotSighting]:
        """The knots seen in a frame."""
        part = self.knots[self.knots["frame"] == frame]
        known = [name for name in _KNOT_FIELDS if name in part.columns]
        return [
            KnotSighting(**dict(zip(known, map(float, values), strict=True)))
            for values in part[known].itertuples(index=False)
        ]


def read_measured(folder: Path) -> Measured:
    """Read what `tsvision measure` wrote; InputError when the folder is no such output."""
    frames = _table(folder, "frames")
    for name, kind in _ROW_FIELDS.items():
        if name not in frames.columns:
            frames[name] = "" if kind == "str" else np.nan
    summary_path = folder / "summary.json"
    try:
        summary = json.loads(summary_path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as problem:
        raise InputError(
            f"{summary_path}: cannot be read ({problem.__class__.__name__}); "
            "measure the recording again with `tsvision measure`"
        ) from None
    return Measured(folder, frames, _table(folder, "profiles"), _table(folder, "knots"), summary)


def _table(folder: Path, name: str) -> pd.DataFrame:
    path = folder / f"{name}.parquet"
    if not path.is_file():
        raise InputError(
            f"{folder} holds no {path.name}; give a folder that `tsvision measure --out` wrote"
        )
    try:
        return pd.read_parquet(path)
    except (OSError, ValueError) as problem:
        raise InputError(
            f"{path}: not a Parquet table ({problem.__class__.__name__}); measure again"
        ) from None


def source_of(folder: Path) -> Path | None:
    """Where the summary says the frames were read from, if they are still there."""
    named = (read_measured(folder).summary.get("input") or {}).get("source")
    path = Path(str(named)) if named else None
    if path and not path.is_absolute() and not path.exists():
        path = folder / path
    return path if path and path.exists() else None
