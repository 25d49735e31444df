"""Columns, types and units of the tables, from the nouns themselves.

The order of FrameRow's fields is the order of columns; a unit follows from the end of a name and
is written into each Parquet column's metadata under `unit`.
"""

from __future__ import annotations

from dataclasses import fields

import pyarrow as pa

from tsvision.records import FrameRow, KnotSighting, Profile

_TYPES = {"int": pa.int64(), "float": pa.float64(), "str": pa.string()}
_UNIT_BY_END = {  # longest first where one ends in another
    "mm_per_px": "mm/px",
    "_mm": "mm",
    "_px": "px",
    "_rad": "rad",
    "_N": "N",
    "_s": "s",
}
_UNIT_BY_NAME = {"turns": "turn", "turns_seen": "turn", "turn_budget_error": "turn"}
FORMAT = 1  # of the folder; raised when a column changes its meaning


def unit_of(column: str) -> str:
    """The unit of a column; "1" for counts and ratios, "" for text."""
    bare = column.removesuffix("_sd")
    if bare in _UNIT_BY_NAME:
        return _UNIT_BY_NAME[bare]
    for end, unit in _UNIT_BY_END.items():
        if bare.endswith(end):
            return unit
    return "1"


def _field(name: str, kind: pa.DataType) -> pa.Field:
    unit = "" if pa.types.is_string(kind) else unit_of(name)
    return pa.field(name, kind, metadata={"unit": unit})


FRAMES = pa.schema([_field(f.name, _TYPES[str(f.type)]) for f in fields(FrameRow)])
KNOTS = pa.schema(
    [
        _field("frame", pa.int64()),
        _field("turns", pa.float64()),
        _field("track", pa.int64()),
        *(_field(f.name, pa.float64()) for f in fields(KnotSighting)),
    ]
)
PROFILES = pa.schema(  # single precision: 1e-4 px on the widest picture
    [_field("frame", pa.int64()), *(_field(f.name, pa.float32()) for f in fields(Profile))]
)


def widened(schema: pa.Schema, columns: list[str], kinds: dict[str, pa.DataType]) -> pa.Schema:
    """The schema with the further columns of a table behind its own."""
    more = [_field(name, kinds[name]) for name in columns if name not in schema.names]
    return pa.schema([*schema, *more])
