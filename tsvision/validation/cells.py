"""One published number beside what can be computed for it."""

from __future__ import annotations

import math
from dataclasses import dataclass

# status -> what it says; the last two are failures.
STATUS: dict[str, str] = {
    "agrees": "recomputed, equal within the published rounding",
    "input": "measured or chosen by the authors; nothing to recompute it from",
    "model": "measured by the authors; a model's value stands beside it",
    "within_bounds": "cannot be recomputed; lies inside the bounds that other numbers allow",
    "erratum": "the paper's own numbers contradict it; see the reason",
    "outside_bounds": "lies outside the bounds that other numbers allow",
    "differs": "should agree within the published rounding and does not",
}
FAILURES = ("outside_bounds", "differs")


@dataclass(frozen=True)
class Cell:
    """Published and computed value of one table cell; NaN where there is none.

    `tolerance` is the rounding allowed for the difference computed - published; `low` and
    `high` bound the value where it can only be bounded. All in the column's unit.
    """

    table: str
    row: str
    column: str
    published: float
    computed: float = math.nan
    tolerance: float = math.nan
    low: float = math.nan
    high: float = math.nan
    status: str = "input"
    reason: str = ""

    @property
    def difference(self) -> float:
        """computed - published."""
        return self.computed - self.published


def recomputed(
    table: str,
    row: str,
    column: str,
    published: float,
    computed: float,
    tolerance: float,
    erratum: str = "",
) -> Cell:
    """A cell that must agree within `tolerance`, unless a known erratum says why it cannot.

    An erratum that is none any more (the numbers agree) is ignored, so it cannot hide anything.
    """
    agrees = abs(computed - published) <= tolerance * (1 + 1e-9)
    status = "agrees" if agrees else ("erratum" if erratum else "differs")
    reason = "" if agrees else erratum
    return Cell(table, row, column, published, computed, tolerance, status=status, reason=reason)


def bounded(
    table: str,
    row: str,
    column: str,
    published: float,
    computed: float,
    bounds: tuple[float, float],
    reason: str,
) -> Cell:
    """A cell that can only be bounded: `computed` is the best estimate, `reason` says how."""
    low, high = bounds
    status = "within_bounds" if low <= published <= high else "outside_bounds"
    return Cell(table, row, column, published, computed, math.nan, low, high, status, reason)
