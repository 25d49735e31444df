"""How far may one turn? The largest turn count and contraction from which there is a way back.

A knot larger than the separator's hole gets stuck there when unwinding. Safe is what lies surely
before the first such knot; without a known hole, what lies before the first knot at all.
Contraction is x / (L + largest x of the recording), as in the paper.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.stats import spearmanr

from tsvision.records import Onset, Rig
from tsvision.timeline.order import Order, numbers

LEAST_RANK = 0.9  # of the string seen in the zone with the turns, for it to be believed
SMOOTH_FRAMES = 5


@dataclass(frozen=True)
class Safe:
    """`turns`: largest safe turn count, None if it cannot be told; `basis`: what bounds it,
    irreversible_knot | knot | end_of_recording | nothing; `displacement_mm` and
    `contraction_percent` there, None where unknown, and then `reason` says why."""

    turns: float | None
    basis: str
    displacement_mm: float | None
    contraction_percent: float | None
    reason: str = ""


def largest_safe(frames: pd.DataFrame, order: Order, onsets: dict[str, Onset], rig: Rig) -> Safe:
    """The largest safe turn count of the recording, with displacement and contraction there."""
    turns, basis = _safe_turns(onsets)
    if turns is None or not len(order.rows):
        return Safe(None, basis, None, None)
    wind, along, reason = displacement_by_turns(frames, order, rig)
    if reason:
        return Safe(turns, basis, None, None, reason)
    at = float(np.interp(abs(turns), wind, along))
    total = rig.actuator.twisting_zone_mm + float(along.max())
    if not np.isfinite(total):
        return Safe(turns, basis, at, None, "actuator.twisting_zone_mm is not given")
    return Safe(turns, basis, at, 100.0 * at / total)


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


def displacement_by_turns(
    frames: pd.DataFrame, order: Order, rig: Rig
) -> tuple[np.ndarray, np.ndarray, str]:
    """(turns, x in mm, why not) while winding, by rising turns: x as given, else the string seen
    in the zone minus L, smoothed, where it rises with the turns as it must."""
    given = numbers(frames, "displacement_mm")
    seen = numbers(frames, "string_length_mm") - rig.actuator.twisting_zone_mm
    recorded = np.isfinite(given).sum() >= 2
    x = (given if recorded else seen)[order.rows]
    good = np.isfinite(x) & (order.direction > 0)
    nothing = np.zeros(0)
    if good.sum() < 2:
        return nothing, nothing, "no displacement_mm in turns.csv and no string length seen"
    rising = np.argsort(order.wind[good], kind="stable")
    wind, along = order.wind[good][rising], x[good][rising]
    if recorded:
        return wind, along, ""
    if good.sum() < SMOOTH_FRAMES or not spearmanr(wind, along).statistic >= LEAST_RANK:
        return nothing, nothing, "no displacement_mm in turns.csv, and the string was not followed"
    smooth = pd.Series(along).rolling(SMOOTH_FRAMES, center=True, min_periods=2).median()
    return wind, smooth.to_numpy(), ""


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
