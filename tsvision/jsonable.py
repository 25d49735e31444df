"""Strict JSON of whatever the program holds: every command and file writes it by this."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from typing import Any

import numpy as np


def to_json(value: Any) -> str:
    """Strict JSON, as `jsonable`, in lines that a person can read."""
    return json.dumps(jsonable(value), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def jsonable(value: Any, digits: int | None = None) -> Any:
    """`value` as JSON knows it: NaN and infinity become null, arrays and tuples lists, nouns
    objects. `digits` rounds to so many significant ones: what more a reader has no use for."""
    if isinstance(value, float):
        if not math.isfinite(value):
            return None
        return float(value) if digits is None else round_digits(value, digits)
    if isinstance(value, str):
        return printable(value)
    if is_dataclass(value) and not isinstance(value, type):
        value = asdict(value)
    if isinstance(value, Mapping):
        return {str(key): jsonable(inner, digits) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [jsonable(inner, digits) for inner in value]
    if isinstance(value, np.ndarray):
        return jsonable(value.tolist(), digits)
    if isinstance(value, np.generic):
        return jsonable(value.item(), digits)
    return value


def round_digits(number: float, digits: int) -> float:
    """So many significant digits."""
    return float(f"{number:.{digits}g}")


def printable(text: str) -> str:
    """Names that are not valid Unicode become so, with the odd bytes written as \\xNN."""
    return os.fsencode(text).decode("utf-8", "backslashreplace")
