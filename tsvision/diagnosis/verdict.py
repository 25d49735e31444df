"""The answer: what a diagnosis says, as a frozen record, as JSON and in plain words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from tsvision.jsonable import jsonable

DIGITS = 7  # enough for any reader, short enough to read


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
                    "parameters": {key: jsonable(e, DIGITS) for key, e in c.parameters.items()},
                    "shape": c.shape,
                    "equation": c.equation,
                    "claim": c.claim,
                    "title": c.title,
                }
                for c in self.causes
            ],
            "equivalent": [list(names) for names in self.equivalent],
            **{
                name: jsonable(getattr(self, name), DIGITS)
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
