"""Phases, knots and onsets by the written criterion, on exact geometry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

COIL_SHARE = 0.05
UNEVEN = 0.08
KNOT_OVER_BASELINE = 1.15
KNOT_OVER_D = 1.40
KNOT_LENGTH_D = 1.0


@dataclass(frozen=True)
class TrueKnot:
    """An interval of E(s) that meets the criterion, mm along the axis."""

    start_mm: float
    stop_mm: float
    centre_mm: float
    max_diameter_mm: float


@dataclass(frozen=True)
class Envelope:
    """E(s) on a grid with the numbers that the phases are decided by."""

    s_mm: np.ndarray
    envelope_mm: np.ndarray
    baseline_mm: float
    unevenness: float
    knots: tuple[TrueKnot, ...]


def find_knots(s_mm: np.ndarray, envelope_mm: np.ndarray, diameter_mm: float) -> Envelope:
    """Apply the knot criterion to E(s); arrays (M,) over the twisted part."""
    baseline = float(np.percentile(envelope_mm, 25))
    uneven = float(envelope_mm.std() / envelope_mm.mean())
    above = envelope_mm >= KNOT_OVER_BASELINE * baseline
    edges = np.flatnonzero(np.diff(np.concatenate([[0], above.astype(int), [0]])))
    step = s_mm[1] - s_mm[0]
    found = []
    for first, after in zip(edges[::2], edges[1::2], strict=True):
        length = (after - first) * step
        part = envelope_mm[first:after]
        if length >= KNOT_LENGTH_D * diameter_mm and part.max() >= KNOT_OVER_D * diameter_mm:
            weight = part - baseline
            centre = float((s_mm[first:after] * weight).sum() / weight.sum())
            found.append(
                TrueKnot(float(s_mm[first]), float(s_mm[after - 1]), centre, float(part.max()))
            )
    return Envelope(s_mm, envelope_mm, baseline, uneven, tuple(found))


def phase_of(envelope: Envelope, coil_amplitude_mm: float, diameter_mm: float) -> str:
    """twist | overtwist | local overtwist | knotted; the hole decides on irreversible."""
    if envelope.knots:
        return "knotted"
    if coil_amplitude_mm < COIL_SHARE * diameter_mm:
        return "twist"
    return "overtwist" if envelope.unevenness < UNEVEN else "local overtwist"


def onset(turns: np.ndarray, present: np.ndarray) -> dict[str, object]:
    """First |turns| of the last unbroken stretch of `present` before the winding's end.

    `turns` must be of the winding part, in order; not observed when the last frame lacks it.
    """
    last = float(np.abs(turns).max()) if len(turns) else float("nan")
    absent: dict[str, object] = {"status": "not_observed", "turns": None, "last_turns": last}
    if not len(present) or not present[-1]:
        return absent
    missing = np.flatnonzero(~present)
    first = 0 if not len(missing) else int(missing[-1]) + 1
    before = None if first == 0 else float(abs(turns[first - 1]))
    return {
        "status": "observed",
        "turns": float(abs(turns[first])),
        "after_turns": before,
        "last_turns": last,
    }
