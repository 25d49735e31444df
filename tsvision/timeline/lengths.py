"""Lengths over one another, with or without a scale.

Without a scale a recording has its lengths in px alone, and all that is asked of it but what
depends on the rig's own mm has to come out the same. Lengths are therefore compared as ratios, each
in mm where both are known in mm, else in px.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from tsvision.records import FrameRow, KnotSighting
from tsvision.timeline.order import numbers

USUAL_DIAMETER_PX = 20.0  # where it was measured in no frame
UNITS = ("mm", "px")


def over(table: pd.DataFrame, name: str, below: pd.DataFrame, base: str) -> np.ndarray:
    """(n,) `name` over `base`; rows side by side."""
    in_mm = numbers(table, f"{name}_mm") / numbers(below, f"{base}_mm")
    in_px = numbers(table, f"{name}_px") / numbers(below, f"{base}_px")
    return np.where(np.isfinite(in_mm), in_mm, in_px)


def in_diameters(table: pd.DataFrame, name: str, frames: pd.DataFrame) -> np.ndarray:
    """(n,) `name` over the D of the recording, whose table is `frames`: one number for all, so that
    what the frames read D apart by enters no comparison of lengths."""
    unit_mm, unit_px = medians(frames)
    in_mm = numbers(table, f"{name}_mm") / unit_mm
    return np.where(np.isfinite(in_mm), in_mm, numbers(table, f"{name}_px") / unit_px)


def either(one: FrameRow | KnotSighting, name: str) -> float:
    """A length of one frame in mm, in px without a scale: for ratios alone."""
    in_mm: float = getattr(one, f"{name}_mm")
    in_px: float = getattr(one, f"{name}_px")
    return in_mm if np.isfinite(in_mm) else in_px


def medians(frames: pd.DataFrame) -> tuple[float, float]:
    """Median D in mm (NaN where unknown) and in px."""
    in_px = median(numbers(frames, "diameter_px"))
    in_px = in_px if np.isfinite(in_px) else USUAL_DIAMETER_PX
    return median(numbers(frames, "diameter_mm")), in_px


def median(values: np.ndarray) -> float:
    """Of the finite ones; NaN if there are none."""
    values = values[np.isfinite(values)]
    return float(np.median(values)) if len(values) else float("nan")
