"""Tables to Parquet and CSV, with units; profiles are appended frame by frame."""

from __future__ import annotations

from array import array
from contextlib import suppress
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from tsvision.jsonable import printable
from tsvision.records import FrameRow, KnotSighting, Profile
from tsvision.results.schema import FRAMES, KNOTS, PROFILES, widened

_ROWS_A_GROUP = 200_000
_COMPRESSION = "zstd"
_SIGHTING = [f.name for f in fields(KnotSighting)]


class RowCollector:
    """Frame rows kept in columns: some 450 bytes a frame, however long the recording."""

    def __init__(self) -> None:
        self._numbers = {f.name: array("d") for f in fields(FrameRow) if f.type == "float"}
        self._counts = {f.name: array("q") for f in fields(FrameRow) if f.type == "int"}
        self._texts: dict[str, list[str]] = {
            f.name: [] for f in fields(FrameRow) if f.type == "str"
        }

    def add(self, row: FrameRow) -> None:
        """Append one row."""
        for name, numbers in self._numbers.items():
            numbers.append(getattr(row, name))
        for name, counts in self._counts.items():
            counts.append(getattr(row, name))
        for name, texts in self._texts.items():
            texts.append(printable(getattr(row, name)))

    def table(self) -> pd.DataFrame:
        """All rows, FrameRow's columns in its order."""
        columns: dict[str, Any] = {}
        for f in fields(FrameRow):
            if f.name in self._numbers:
                columns[f.name] = np.array(self._numbers[f.name], dtype=float)
            elif f.name in self._counts:
                columns[f.name] = np.array(self._counts[f.name], dtype=np.int64)
            else:
                columns[f.name] = pd.Series(self._texts[f.name], dtype=object)
        return pd.DataFrame(columns)


def row_table_to_parquet(path: Path, frames: pd.DataFrame) -> None:
    """Rows as measured, to be read back by `tables_from_parquet` without a change."""
    pq.write_table(_conform(frames, FRAMES), path, compression=_COMPRESSION)


def knot_table_to_parquet(path: Path, knots: pd.DataFrame) -> None:
    """Sightings as measured, without a track."""
    table = pa.Table.from_pandas(knots, preserve_index=False)
    pq.write_table(table, path, compression=_COMPRESSION)


def tables_from_parquet(paths: list[Path]) -> pd.DataFrame:
    """The tables of several files, one below the other."""
    return pa.concat_tables([pq.read_table(path) for path in paths]).to_pandas()


class KnotCollector:
    """Sightings of knots, one row each."""

    def __init__(self) -> None:
        self._rows: list[tuple[float, ...]] = []

    def add(self, row: FrameRow, sightings: tuple[KnotSighting, ...]) -> None:
        """Append the sightings of one frame."""
        for knot in sightings:
            self._rows.append((row.frame, row.turns, *(getattr(knot, n) for n in _SIGHTING)))

    def table(self) -> pd.DataFrame:
        """`frame`, `turns`, then KnotSighting's columns; empty when no knot was seen."""
        table = pd.DataFrame(self._rows, columns=["frame", "turns", *_SIGHTING], dtype=float)
        return table.astype({"frame": np.int64})


class ProfileWriter:
    """Appends profiles to a Parquet file; holds at most one row group in memory."""

    def __init__(self, path: Path) -> None:
        self._writer = pq.ParquetWriter(path, PROFILES, compression=_COMPRESSION)
        self._waiting: list[pa.RecordBatch] = []
        self._rows = 0

    def add(self, frame: int, profile: Profile) -> None:
        """Append the profile of one frame."""
        count = len(profile.s_mm)
        columns = [pa.array(np.full(count, frame, dtype=np.int64))]
        for f in fields(Profile):
            values = getattr(profile, f.name)
            known = values is not None
            columns.append(
                _or_null(np.asarray(values, np.float32)) if known else pa.nulls(count, pa.float32())
            )
        self._waiting.append(pa.record_batch(columns, schema=PROFILES))
        self._rows += count
        if self._rows >= _ROWS_A_GROUP:
            self.end_group()

    def append(self, path: Path) -> None:
        """Append the row groups of another file of profiles as they are."""
        with pq.ParquetFile(path) as other:
            for group in range(other.num_row_groups):
                table = other.read_row_group(group)
                self._writer.write_table(table, row_group_size=max(1, len(table)))

    def close(self) -> None:
        """Write what waits and the footer."""
        self.end_group()
        self._writer.close()

    def abandon(self) -> None:
        """Let go of the file after an error, which must not be hidden by another one."""
        self._waiting, self._rows = [], 0
        with suppress(OSError, pa.ArrowException):
            self._writer.close()

    def end_group(self) -> None:
        """Write what waits as a row group of its own."""
        if self._waiting:
            table = pa.Table.from_batches(self._waiting, PROFILES).combine_chunks()
            self._writer.write_table(table, row_group_size=max(1, self._rows))
        self._waiting, self._rows = [], 0


def write_frames(folder: Path, frames: pd.DataFrame) -> None:
    """frames.parquet and frames.csv."""
    _write_both(folder / "frames", _conform(frames, FRAMES))


def write_knots(folder: Path, knots: pd.DataFrame) -> None:
    """knots.parquet and knots.csv."""
    _write_both(folder / "knots", _conform(knots, KNOTS))


def _conform(table: pd.DataFrame, schema: pa.Schema) -> pa.Table:
    """The table under the schema's columns, types and units; what is missing is empty."""
    kinds = {name: _kind(table[name]) for name in table.columns}
    schema = widened(schema, list(table.columns), kinds)
    arrays = [_column(table, field) for field in schema]
    return pa.Table.from_arrays(arrays, schema=schema)


def _kind(column: pd.Series) -> pa.DataType:
    if pd.api.types.is_bool_dtype(column):
        return pa.bool_()
    if pd.api.types.is_integer_dtype(column):
        return pa.int64()
    return pa.float64() if pd.api.types.is_float_dtype(column) else pa.string()


def _column(table: pd.DataFrame, field: pa.Field) -> pa.Array:
    if field.name not in table.columns:
        return pa.nulls(len(table), field.type)
    values = table[field.name]
    if pa.types.is_string(field.type):
        return pa.array([printable(str(v)) if isinstance(v, str) else "" for v in values])
    if pa.types.is_floating(field.type):
        return _or_null(values.to_numpy(dtype=float))
    return pa.array(values, type=field.type, from_pandas=True)


def _or_null(values: np.ndarray) -> pa.Array:
    """Unknown is null on disk: SQL leaves it out of means, pandas shows it as NaN."""
    return pa.array(values, mask=np.isnan(values))


def _write_both(stem: Path, table: pa.Table) -> None:
    pq.write_table(table, stem.with_suffix(".parquet"), compression=_COMPRESSION)
    table.to_pandas().to_csv(
        stem.with_suffix(".csv"), index=False, lineterminator="\n", encoding="utf-8"
    )
