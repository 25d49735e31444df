"""An account in words for people and in plain values for programs."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

from tsvision.records import Onset
from tsvision.timeline.account import Account

NAMES = {
    "knot_onset": "knot onset",
    "overtwist_onset": "overtwist onset",
    "local_overtwist_onset": "local overtwist onset",
    "irreversible_onset": "irreversible onset",
}


def summary(account: Account) -> dict[str, object]:
    """The account's part of summary.json: the onsets by name, their reasons, and the rest."""
    onsets: dict[str, object] = {name: onset_values(o) for name, o in account.onsets.items()}
    return onsets | {
        "onset_reasons": account.reasons,
        "notes": list(account.notes),
        **account.extras,
    }


def onset_values(onset: Onset) -> dict[str, object]:
    """One onset as the interface note has it; strict JSON holds no NaN."""
    return {key: _plain(value) for key, value in asdict(onset).items()}


def _plain(value: object) -> object:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def onset_line(name: str, values: dict[str, object], reason: str = "") -> str:
    """`knot onset: 47.5 turns (95 % 46.3–48.1)`, or why there is none."""
    label = NAMES.get(name, name)
    if values["status"] == "observed":
        return f"{label}: {_turns(values['turns'])} turns ({_interval(values)})"
    if values["status"] == "not_observed":
        what = "no knot" if name == "knot_onset" else "not reached"
        return f"{label}: not observed, {what} up to {_turns(values['last_turns'])} turns"
    bounds = f" ({_interval(values)})" if values["low"] is not None else ""
    return f"{label}: undetermined, {reason or 'the pictures do not tell'}{bounds}"


def line(name: str, told: dict[str, Any]) -> str:
    """The one line for people, from `summary()` or a summary.json."""
    reasons = told.get("onset_reasons", {})
    parts = [onset_line(name, told[name], reasons.get(name, ""))]
    if name == "knot_onset" and told[name]["status"] == "observed":
        way_back = "irreversible_onset"
        parts += _irreversible(told.get(way_back, {}), reasons.get(way_back, ""))
    if name == "knot_onset":
        parts += _safe(told.get("safe", {}))
    return "; ".join(parts)


def _irreversible(values: dict[str, Any], reason: str) -> list[str]:
    status = values.get("status")
    if status == "observed":
        return [f"irreversible from {_turns(values['turns'])}"]
    if status == "not_observed":
        return [f"reversible up to {_turns(values['last_turns'])}"]
    return [f"whether it is reversible is open: {reason}"] if reason else []


def _safe(safe: dict[str, Any]) -> list[str]:
    if safe.get("turns") is None:
        return []
    least = "at least " if safe["basis"] == "end_of_recording" else ""
    if safe.get("contraction_percent") is not None:
        return [f"largest safe contraction {least}{safe['contraction_percent']:.0f} %"]
    why = f" (contraction unknown: {safe['reason']})" if safe.get("reason") else ""
    return [f"largest safe turn count {least}{_turns(safe['turns'])}{why}"]


def _interval(values: dict[str, object]) -> str:
    level = 100 * float(values["level"])  # type: ignore[arg-type]
    return f"{level:g} % {_turns(values['low'])}–{_turns(values['high'])}"


def _turns(value: object) -> str:
    return "?" if value is None else f"{float(value):.1f}"  # type: ignore[arg-type]
