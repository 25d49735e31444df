"""Read measured bundles: folders that `tsvision measure` wrote, or CSV tables."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from tsvision.errors import InputError
from tsvision.separators import has_decimal_comma, read_frame
from tsvision.validation.measured import Bundles, check

# What a CSV may call each value; the first is the usual name.
NAMES: dict[str, tuple[str, ...]] = {
    "strings": ("strings", "N", "n", "count"),
    "string_diameter_mm": ("string_diameter_mm", "d", "d_mm"),
    "string_sd_mm": ("string_diameter_sd_mm", "string_diameter_mm_sd", "d_sd"),
    "diameter_mm": ("diameter_mm", "diameter", "D", "bundle_diameter_mm"),
    "sd_mm": ("diameter_sd_mm", "diameter_mm_sd", "sd", "sd_mm"),
    "load_N": ("load_N", "load"),
}
DEFAULT_SD_SHARE = 0.02  # of D, where a source states no uncertainty


def read_bundles(
    sources: Sequence[Path], strings: int | None = None, string_diameter_mm: float | None = None
) -> tuple[Bundles, list[str]]:
    """All bundles of the sources, and notes on what was assumed. Raises InputError.

    `strings` and `string_diameter_mm` fill what a source does not know.
    """
    notes: list[str] = []
    parts = [
        _folder(source) if source.is_dir() else _table(source, string_diameter_mm, notes)
        for source in sources
    ]
    rows = pd.concat(parts, ignore_index=True)
    if strings is not None:
        rows["strings"] = rows["strings"].fillna(float(strings))
    if string_diameter_mm is not None:
        rows["string_diameter_mm"] = rows["string_diameter_mm"].fillna(string_diameter_mm)
    unknown = rows["sd_mm"].isna()
    if unknown.any():
        rows.loc[unknown, "sd_mm"] = DEFAULT_SD_SHARE * rows.loc[unknown, "diameter_mm"]
        notes.append(f"{int(unknown.sum())} bundles state no uncertainty: 2 % of D was taken")
    columns = {name: rows[name].to_numpy(dtype=float) for name in NAMES}
    columns["string_sd_mm"] = np.nan_to_num(columns["string_sd_mm"])
    return check(Bundles(source=tuple(rows["source"]), **columns)), notes


def _folder(folder: Path) -> pd.DataFrame:
    """One bundle: the recording's typical diameter, with N, d and load of its rig."""
    from tsvision.results.read import read_summary

    summary = read_summary(folder)
    rig = summary.get("rig", {})
    diameter = summary.get("diameter_mm") or {}
    if diameter.get("value") is None:
        raise InputError(f"'{folder}' holds no diameter in mm; measure it with a scale")
    return pd.DataFrame(
        [
            {
                "source": folder.name,
                "strings": _number(rig.get("strings.count")),
                "string_diameter_mm": _number(rig.get("strings.diameter_mm")),
                "string_sd_mm": math.nan,
                "diameter_mm": _number(diameter.get("value")),
                "sd_mm": _number(diameter.get("sd")),
                "load_N": _number(rig.get("actuator.load_N")),
            }
        ]
    )


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else math.nan


def _table(path: Path, string_diameter_mm: float | None, notes: list[str]) -> pd.DataFrame:
    data = read_frame(path)
    rows = pd.DataFrame(index=data.index)
    rows["source"] = [f"{path.name} row {k}" for k in range(1, len(data) + 1)]
    for name, aliases in NAMES.items():
        found = [alias for alias in aliases if alias in data]
        if not found and name in ("strings", "diameter_mm"):
            raise InputError(f"'{path}' has no column '{name}'; name it {' or '.join(aliases)}")
        rows[name] = _numbers(data, found[0], path) if found else np.nan
    single = rows.loc[rows["strings"] == 1, "diameter_mm"]
    if rows["string_diameter_mm"].isna().all() and string_diameter_mm is None and len(single):
        rows["string_diameter_mm"] = float(single.mean())
        rows = rows[rows["strings"] > 1]
        notes.append(f"d = {single.mean():.3g} mm from the single string in {path.name}")
    return rows


def _numbers(data: pd.DataFrame, column: str, path: Path) -> pd.Series:
    """A column's numbers, NaN where it holds none; a decimal comma is refused, not lost."""
    for row, text in enumerate(data[column], start=1):
        if has_decimal_comma(text):
            raise InputError(
                f"{path.name} row {row}: '{text}' in column '{column}'; write a decimal point"
            )
    return pd.to_numeric(data[column], errors="coerce")
