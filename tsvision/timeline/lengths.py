"""Lengths of sightings in mm and in px: without a scale no number of px may pass for mm."""

from __future__ import annotations

import numpy as np
import pandas as pd

from tsvision.timeline.order import numbers

NAMES = ("centre", "length", "max_diameter")


def in_both_units(frames: pd.DataFrame, knots: pd.DataFrame) -> pd.DataFrame:
    """`knots` with `centre_px`, `length_px`, `max_diameter_px` beside the mm columns.

    In frames without a scale (`mm_per_px` not finite) a sighting's lengths are given in px under
    the names of mm; they are moved where they belong, and the mm are NaN. Frame tables without a
    column `mm_per_px` are taken as they are.
    """
    if "mm_per_px" not in frames:
        return knots
    scale_of = dict(zip(frames["frame"], numbers(frames, "mm_per_px"), strict=True))
    scale = np.array([scale_of.get(name, np.nan) for name in knots["frame"]])
    known = np.isfinite(scale)
    columns: dict[str, np.ndarray] = {}
    for name in NAMES:
        given = numbers(knots, f"{name}_mm")
        columns[f"{name}_mm"] = np.where(known, given, np.nan)
        in_px = np.where(known, given / np.where(known, scale, 1.0), given)
        columns[f"{name}_px"] = np.where(np.isfinite(in_px), in_px, numbers(knots, f"{name}_px"))
    return knots.assign(**columns)


def over(table: pd.DataFrame, name: str, below: pd.DataFrame, base: str) -> np.ndarray:
    """(n,) `name` over `base`, in mm where both are known, else in px; rows side by side."""
    in_mm = numbers(table, f"{name}_mm") / numbers(below, f"{base}_mm")
    in_px = numbers(table, f"{name}_px") / numbers(below, f"{base}_px")
    return np.where(np.isfinite(in_mm), in_mm, in_px)
