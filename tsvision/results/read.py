"""Read a measured recording back."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from tsvision.errors import InputError
from tsvision.results.files import SUMMARY
from tsvision.results.schema import FORMAT

_COUNTS = ("format", "frames_total", "frames_measured", "frames_flagged")
_QUANTITIES = ("diameter_mm", "diameter_px", "helix_angle_deg")


@dataclass(frozen=True)
class Measurement:
    """The tables and the summary of one measured recording (columns: see schema.py)."""

    folder: Path
    frames: pd.DataFrame
    profiles: pd.DataFrame
    knots: pd.DataFrame
    summary: dict[str, Any]


def read_measurement(folder: Path) -> Measurement:
    """Read what `tsvision measure` wrote; raises InputError when it is not whole."""
    summary = read_summary(folder)
    return Measurement(
        folder,
        read_table(folder / "frames.parquet"),
        read_table(folder / "profiles.parquet"),
        read_table(folder / "knots.parquet"),
        summary,
    )


def read_summary(folder: Path) -> dict[str, Any]:
    """summary.json of a measured recording; raises InputError."""
    path = folder / SUMMARY
    if not path.is_file():
        raise InputError(
            f"{folder}: holds no {SUMMARY}; name a folder that `tsvision measure` wrote"
        )
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(
            f"{path}: cannot be read ({type(error).__name__}); measure again"
        ) from None
    if not isinstance(summary, dict) or not _has_its_parts(summary):
        raise InputError(f"{path}: is no summary of a measurement; measure again")
    if summary["format"] > FORMAT:
        raise InputError(f"{path}: written by a newer tsvision; update, or measure again")
    return summary


def _has_its_parts(summary: dict[str, Any]) -> bool:
    counts = all(isinstance(summary.get(name), int) for name in _COUNTS)
    quantities = (summary.get(name) for name in _QUANTITIES)
    return (
        counts
        and all(isinstance(q, dict) and {"value", "sd"} <= set(q) for q in quantities)
        and all(isinstance(summary.get(name), dict) for name in ("rig", "input", "flags"))
    )


def read_table(path: Path) -> pd.DataFrame:
    """One table of a measured recording; raises InputError when it is not whole."""
    if not path.is_file():
        raise InputError(f"{path}: missing; measure the recording again")
    try:
        return pq.read_table(path).to_pandas()
    except (OSError, pa.ArrowException) as error:
        raise InputError(
            f"{path}: no whole Parquet table ({type(error).__name__}); measure again"
        ) from None
