"""What cannot be told because a quantity was not given or not measured, and says so."""

from __future__ import annotations

import numpy as np
import pandas as pd

from tsvision.records import Onset, Rig
from tsvision.timeline import evidence as speak
from tsvision.timeline.order import numbers

PLAIN_RISE = 1.6  # times E₀, to which a knot soon grows
CLOSE = 2.0 * speak.DIAMETER_NOISE  # of the hole: how near a knot's size comes to it
LEAST_READ = 0.3  # share of the measured frames in which a quantity must have been read

Onsets = dict[str, Onset]
Reasons = dict[str, str]


def without_what_is_unknown(
    onsets: Onsets, reasons: Reasons, frames: pd.DataFrame, rig: Rig
) -> tuple[Onsets, Reasons]:
    """Onsets that rest on nothing become `undetermined`, with the reason: irreversible without
    the hole's diameter or a scale, overtwist where the coiling was not read."""
    onsets, reasons = dict(onsets), dict(reasons)
    sizes = _size_problem(frames, rig)
    if sizes and onsets["knot_onset"].status == "not_observed":
        onsets["irreversible_onset"] = onsets["knot_onset"]
        reasons["irreversible_onset"] = "no knot, hence none larger than the hole"
    elif sizes:
        onsets["irreversible_onset"] = _untold(onsets["knot_onset"])
        reasons["irreversible_onset"] = sizes
    if onsets["overtwist_onset"].status != "undetermined" and not _coiling_was_read(frames):
        onsets["overtwist_onset"] = _untold(onsets["overtwist_onset"])
        reasons["overtwist_onset"] = "the swing of the bundle's centre line was not measured"
    return onsets, reasons


def without_what_noise_hides(
    onsets: Onsets, reasons: Reasons, least_believed: float
) -> tuple[Onsets, Reasons]:
    """`not_observed` becomes `undetermined` where a knot would not stand out: `least_believed` is
    the E / E₀ from which a sighting is rather a knot than not."""
    if least_believed <= PLAIN_RISE:
        return onsets, reasons
    onsets, reasons = dict(onsets), dict(reasons)
    for name in ("knot_onset", "irreversible_onset"):
        if onsets[name].status == "not_observed":
            onsets[name] = _untold(onsets[name])
            reasons[name] = (
                f"the envelope is read so unevenly that a knot below {least_believed:.1f} times "
                "its baseline would not stand out"
            )
    return onsets, reasons


def without_near_misses(
    onsets: Onsets, reasons: Reasons, near_misses: list[dict[str, float | int | bool]]
) -> tuple[Onsets, Reasons]:
    """No knot larger than the hole is `undetermined` where one is as large within the error with
    which one view shows its size."""
    largest = max((float(n["of_hole"]) for n in near_misses), default=0.0)
    if onsets["irreversible_onset"].status != "not_observed" or largest < 1.0 - CLOSE:
        return onsets, reasons
    why = f"the largest knot is {100 * largest:.0f} % of the hole: too near for one view to tell"
    told = _untold(onsets["irreversible_onset"])
    return {**onsets, "irreversible_onset": told}, {**reasons, "irreversible_onset": why}


def _size_problem(frames: pd.DataFrame, rig: Rig) -> str:
    if not np.isfinite(rig.actuator.hole_diameter_mm):
        return "the hole's diameter is not given (actuator.hole_diameter_mm)"
    if "mm_per_px" in frames and not np.isfinite(numbers(frames, "mm_per_px")).any():
        return "without a scale (camera.mm_per_px) no knot can be compared with the hole"
    return ""


def _coiling_was_read(frames: pd.DataFrame) -> bool:
    good = speak.measured(frames)
    return not good.any() or (
        np.isfinite(speak.ratio_of(frames, "coil_amplitude")[good]).mean() >= LEAST_READ
    )


def _untold(like: Onset) -> Onset:
    return Onset("undetermined", None, None, None, like.last_turns, like.level)


def camera_moves(frames: pd.DataFrame) -> tuple[str, ...]:
    """A note for every frame from which on the camera stood elsewhere."""
    moved = speak.flagged(frames, "CAMERA_MOVED")
    if not moved.any():
        return ()
    return tuple(
        f"the camera or the rig moved before frame {frame} (at {turns:.4g} turns): what lies "
        "before and after was measured on its own"
        for frame, turns in zip(
            frames["frame"][moved], numbers(frames, "turns")[moved], strict=True
        )
    )
