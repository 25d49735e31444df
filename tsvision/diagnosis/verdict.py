"""The answer: what a diagnosis says, as a frozen record, as JSON and in plain words."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Estimate:
    """A parameter's value with its 95 % interval."""

    value: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class Cause:
    """A named cause: the mechanism, the shape of it that fits best, its parameters."""

    name: str
    title: str
    shape: str
    equation: str
    claim: str
    parameters: dict[str, Estimate]


@dataclass(frozen=True)
class Verdict:
    """What the simulation gets wrong. Dicts hold plain numbers and words, as in the JSON."""

    status: str
    causes: tuple[Cause, ...]
    equivalent: tuple[tuple[str, ...], ...]
    base: dict[str, Any]
    extended: dict[str, Any]
    gain: dict[str, Any] | None
    evidence: tuple[dict[str, Any], ...]
    next_experiment: dict[str, Any] | None
    residual: dict[str, Any]
    exact_equivalences: tuple[dict[str, Any], ...]
    data: dict[str, Any]
    model: dict[str, Any]
    rows: tuple[dict[str, Any], ...]
    notes: tuple[str, ...]
    paragraph: str
    rivals: tuple[dict[str, Any], ...] = ()

    def to_json(self) -> dict[str, Any]:
        """A dict of JSON types; what is unknown (NaN) becomes None."""
        return {
            "status": self.status,
            "causes": [
                {
                    "name": c.name,
                    "parameters": {
                        key: clean({"value": e.value, "low": e.low, "high": e.high, "unit": e.unit})
                        for key, e in c.parameters.items()
                    },
                    "shape": c.shape,
                    "equation": c.equation,
                    "claim": c.claim,
                    "title": c.title,
                }
                for c in self.causes
            ],
            "equivalent": [list(names) for names in self.equivalent],
            **{
                name: clean(getattr(self, name))
                for name in (
                    "base",
                    "extended",
                    "gain",
                    "evidence",
                    "rivals",
                    "next_experiment",
                    "residual",
                    "exact_equivalences",
                    "data",
                    "model",
                    "rows",
                    "notes",
                    "paragraph",
                )
            },
        }


def clean(thing: Any) -> Any:
    """NumPy scalars to Python's, tuples to lists, NaN and infinities to None."""
    if isinstance(thing, dict):
        return {str(key): clean(value) for key, value in thing.items()}
    if isinstance(thing, list | tuple):
        return [clean(value) for value in thing]
    if hasattr(thing, "item"):
        thing = thing.item()
    if isinstance(thing, float):
        return round_digits(thing) if math.isfinite(thing) else None
    return thing


def round_digits(number: float, digits: int = 7) -> float:
    """So many significant digits: enough for any reader, short enough to read."""
    return float(f"{number:.{digits}g}")
