"""Numbers and results as a person reads them; the only place that rounds for the page."""

from __future__ import annotations

import math
from typing import Any

UNKNOWN = "–"


def with_sd(value: float | None, sd: float | None = None, unit: str = "") -> str:
    """`0.481 ± 0.003 mm`: digits follow the uncertainty's first two significant ones."""
    if value is None or not math.isfinite(value):
        return UNKNOWN
    tail = f"\u202f{unit}" if unit and unit != "°" else unit
    if sd is None or not math.isfinite(sd) or sd <= 0:
        return f"{plain(value)}{tail}"
    digits = min(6, max(0, 1 - math.floor(math.log10(sd))))
    if digits > 3 and sd > 10.0 ** (1 - digits) * 2:
        digits -= 1
    return f"{_minus(f'{value:.{digits}f}')} ± {sd:.{digits}f}{tail}"


def plain(value: float | None) -> str:
    """Four significant digits, no exponent for everyday sizes; `–` when unknown."""
    if value is None or not math.isfinite(value):
        return UNKNOWN
    if value == round(value) and abs(value) < 1e6:
        return _minus(f"{value:.0f}")
    return _minus(f"{value:.4g}")


def _minus(text: str) -> str:
    return text.replace("-", "\u2212", 1) if text.startswith("-") else text


ONSET_NAMES = {
    "overtwist_onset": "overtwist",
    "local_overtwist_onset": "local overtwist",
    "knot_onset": "knots",
    "irreversible_onset": "irreversible knots",
}


def onset_sentence(name: str, onset: dict[str, Any]) -> str:
    """One onset in words; a recording that ends first is said so, never given a number."""
    what = ONSET_NAMES.get(name, name.removesuffix("_onset").replace("_", " "))
    low, high = onset.get("low"), onset.get("high")
    percent = f"{100 * float(onset.get('level') or 0.95):g}\u202f%"
    span = f"{percent} interval {plain(low)} to {plain(high)}" if _both(low, high) else ""
    status = onset.get("status")
    if status == "observed":
        return f"{plain(onset.get('turns'))} turns" + (f" ({span})" if span else "")
    if status == "not_observed":
        return f"no {what} up to {plain(onset.get('last_turns'))} turns"
    return "undetermined" + (f" ({span})" if span else "")


def _both(low: float | None, high: float | None) -> bool:
    return low is not None and high is not None and math.isfinite(low) and math.isfinite(high)
