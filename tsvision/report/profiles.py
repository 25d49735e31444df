"""Profiles of a recording from their Parquet file, a row group at a time: memory stays flat."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from tsvision.errors import InputError
from tsvision.records import Profile

_COLUMNS = tuple(f.name for f in fields(Profile))


class Profiles:
    """`of(frame)` looks one frame up, `chunks()` goes through all. Keeps the last group read, so
    that looking frames up in order reads each group once."""

    def __init__(self, path: Path) -> None:
        try:
            self._file = pq.ParquetFile(path)
        except (OSError, pa.ArrowException) as problem:
            raise InputError(
                f"{path}: no whole Parquet table ({type(problem).__name__}); measure again"
            ) from None
        groups = range(self._file.metadata.num_row_groups)
        self._spans = [self._span(g) for g in groups]
        self._held: tuple[int, pd.DataFrame] | None = None

    def of(self, frame: int, mm_per_px: float) -> Profile | None:
        """The silhouette of a frame, None where none was found. `s_px` follows from `s_mm` and
        the scale where the table lacks it."""
        parts = [
            table[table["frame"] == frame]
            for group, (low, high) in enumerate(self._spans)
            if low <= frame <= high and not (table := self._group(group)).empty
        ]
        part = pd.concat(parts) if len(parts) > 1 else parts[0] if parts else pd.DataFrame()
        if part.empty:
            return None
        columns = {n: part[n].to_numpy(float) for n in _COLUMNS if n in part.columns}
        columns.setdefault("s_px", columns["s_mm"] / mm_per_px)
        bowed = np.isfinite(columns.get("axis_x_px", [np.nan])).all()
        kept = {n: v for n, v in columns.items() if bowed or not n.startswith("axis_")}
        return Profile(**kept)

    def chunks(self) -> Iterator[pd.DataFrame]:
        """All profiles in order, one table a row group."""
        for group in range(len(self._spans)):
            yield self._group(group)

    def _group(self, group: int) -> pd.DataFrame:
        if self._held is None or self._held[0] != group:
            self._held = (group, self._file.read_row_group(group).to_pandas())
        return self._held[1]

    def _span(self, group: int) -> tuple[int, int]:
        """First and last frame of a row group, from its statistics where there are any."""
        column = self._file.schema_arrow.get_field_index("frame")
        told = self._file.metadata.row_group(group).column(column).statistics
        if told is not None and told.has_min_max:
            return int(told.min), int(told.max)
        frames = self._file.read_row_group(group, columns=["frame"])["frame"].to_numpy()
        return (int(np.min(frames)), int(np.max(frames))) if len(frames) else (0, -1)
