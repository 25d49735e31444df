"""What the models need of a measured recording: D, the locked pitch, the rig."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pandas as pd

from tsvision.records import Actuator, Rig, Strings


def bundle_diameter_mm(frames: pd.DataFrame) -> float:
    """Median near-separator diameter over the frames that have one, mm; NaN when none has."""
    return (
        float(frames["diameter_mm"].median()) if frames["diameter_mm"].notna().any() else math.nan
    )


def locked_pitch_mm(frames: pd.DataFrame) -> float:
    """Pitch beside the separator once it no longer falls, mm: median past the twist phase.

    In a recording that ends before overtwist nothing is locked: NaN.
    """
    past = frames["phase"].isin(["overtwist", "local overtwist", "local_overtwist", "knotted"])
    past |= frames["phase"] == "irreversible"
    pitch = frames.loc[past, "pitch_mm"]
    return float(np.median(pitch.dropna())) if pitch.notna().any() else math.nan


def rig_of_summary(summary: dict[str, Any], given: Rig) -> Rig:
    """The rig under which a recording was measured, with what `given` knows laid over it."""
    recorded = summary.get("rig", {})
    return replace(
        given,
        strings=_filled(given.strings, recorded, "strings", Strings),
        actuator=_filled(given.actuator, recorded, "actuator", Actuator),
    )


def _filled(given: Any, recorded: dict[str, Any], section: str, noun: type) -> Any:
    """`given` with what it lacks taken from the summary's keys such as `strings.count`."""
    values = {}
    for item in fields(noun):
        value = getattr(given, item.name)
        unknown = value is None or (isinstance(value, float) and math.isnan(value))
        if unknown and recorded.get(f"{section}.{item.name}") is not None:
            value = recorded[f"{section}.{item.name}"]
        values[item.name] = value
    return noun(**values)
