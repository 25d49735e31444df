"""How far may one turn? The largest turn count and contraction from which there is a way back.

A knot larger than the separator's hole gets stuck there when unwinding. Safe is what lies surely
before the first such knot; without a known hole, what lies before the first knot at all.
Contraction is x / (L + largest x of the recording), as in the paper.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from tsvision.records import Onset, Rig
from tsvision.timeline.order import Order, numbers


@dataclass(frozen=True)
class Safe:
    """`turns`: largest safe turn count, None if it cannot be told; `basis`: what bounds it,
    irreversible_knot | knot | end_of_recording | nothing; `displacement_mm` and
    `contraction_percent` there, None where unknown."""

    turns: float | None
    basis: str
    displacement_mm: float | None
    contraction_percent: float | None


def largest_safe(frames: pd.DataFrame, order: Order, onsets: dict[str, Onset], rig: Rig) -> Safe:
    """The largest safe turn count of the recording, with displacement and contraction there."""
    turns, basis = _safe_turns(onsets)
    if turns is None or not len(order.rows):
        return Safe(None, basis, None, None)
    displacement = displacement_mm(frames, rig)[order.rows]
    good = np.isfinite(displacement) & (order.direction > 0)
    if good.sum() < 2:
        return Safe(turns, basis, None, None)
    wind, along = order.wind[good], displacement[good]
    at = float(np.interp(abs(turns), wind[np.argsort(wind)], along[np.argsort(wind)]))
    total = rig.actuator.twisting_zone_mm + float(along.max())
    percent = 100.0 * at / total if np.isfinite(total) and total > 0 else None
    return Safe(turns, basis, at, percent)


def _safe_turns(onsets: dict[str, Onset]) -> tuple[float | None, str]:
    for name, basis in (("irreversible_onset", "irreversible_knot"), ("knot_onset", "knot")):
        onset = onsets[name]
        near = _nearer_bound(onset)
        if onset.status == "observed" and near is not None:
            return near, basis
        if onset.status == "not_observed":
            return onset.last_turns, "end_of_recording"
        if near is not None:  # undetermined, but surely not before this
            return near, basis
    return None, "nothing"


def _nearer_bound(onset: Onset) -> float | None:
    """The bound nearer to zero turns, whichever way the motor counts."""
    bounds = [b for b in (onset.low, onset.high) if b is not None]
    return min(bounds, key=abs) if len(bounds) == 2 else None


def displacement_mm(frames: pd.DataFrame, rig: Rig) -> np.ndarray:
    """(n,) x as given, else from the string seen in the zone, x = X − L; NaN where unknown."""
    given = numbers(frames, "displacement_mm")
    if np.isfinite(given).sum() >= 2:
        return given
    return numbers(frames, "string_length_mm") - rig.actuator.twisting_zone_mm


def near_misses(tracks: pd.DataFrame, rig: Rig) -> list[dict[str, float | int | bool]]:
    """How near each knot came to being too large: its largest diameter over the hole's."""
    hole = rig.actuator.hole_diameter_mm
    real = tracks[tracks["confirmed"] & ~tracks["artefact"]] if len(tracks) else tracks
    if not np.isfinite(hole):
        return []
    tracks_of, sizes = numbers(real, "track"), numbers(real, "max_diameter_mm")
    return [
        {
            "track": int(track),
            "max_diameter_mm": float(size),
            "of_hole": float(size / hole),
            "passes": bool(size <= hole),
        }
        for track, size in zip(tracks_of, sizes, strict=True)
        if np.isfinite(size)
    ]
