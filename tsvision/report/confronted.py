"""What a verdict says of each observation: measured, by the base model, by the extended one."""

from __future__ import annotations

import math
from typing import Any

from tsvision.errors import InputError

_MOST = 3000
_UNITS = {"mm": "mm", "deg": "°", "turns": "turns", "Nmm": "N mm"}
_NUMBERS = ("turns", "value", "base", "extended")


def confronted(verdict: dict[str, Any] | None) -> list[dict[str, Any]]:
    """One entry an observable: `name`, `unit`, `turns` and the residuals `base` and `extended`
    (measured minus model), all lists of one length; empty when the verdict holds no rows.

    InputError when the rows are not those of `tsvision diagnose`.
    """
    rows = (verdict or {}).get("rows") or []
    found: dict[str, dict[str, Any]] = {}
    try:
        for row in rows[:_MOST]:
            name = str(row["observable"])
            turns, value, base, extended = (_number(row.get(key)) for key in _NUMBERS)
            entry = found.setdefault(name, _empty(name))
            entry["turns"].append(turns)
            entry["base"].append(value - base)
            entry["extended"].append(value - extended)
    except (TypeError, KeyError, AttributeError) as problem:
        raise InputError(
            f"the verdict's rows are not those of `tsvision diagnose --json` ({problem!r})"
        ) from None
    return list(found.values())


def _empty(name: str) -> dict[str, Any]:
    words, _, end = name.rpartition("_")
    unit = _UNITS.get(end, "")
    label = (words if unit else name).replace("_", " ")
    return {"name": label, "unit": unit, "turns": [], "base": [], "extended": []}


def _number(value: Any) -> float:
    known = isinstance(value, int | float) and not isinstance(value, bool)
    return float(value) if known else math.nan
