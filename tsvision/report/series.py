"""The tables' columns against turns, as the page plots them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from tsvision.report.palette import phase_key

BASE_MODEL = "constant_radius"  # the paper's; it comes first


@dataclass(frozen=True)
class Abscissa:
    """What the plots run over: `x` (K,) one a frame, its label, and whether it only rises."""

    x: np.ndarray
    label: str
    rises: bool

    def falling(self) -> np.ndarray:
        """(K,) True where the motor turns back: x is less than at the known frame before."""
        known = np.flatnonzero(np.isfinite(self.x))
        falls = np.zeros(len(self.x), bool)
        falls[known[1:]] = np.diff(self.x[known]) < 0
        return falls


def abscissa(frames: pd.DataFrame) -> Abscissa:
    """Motor turns where any are known, else the frame's number."""
    turns = frames["turns"].to_numpy(float)
    known = turns[np.isfinite(turns)]
    if len(known) < 2 or known.min() == known.max():
        return Abscissa(frames["frame"].to_numpy(float), "frame", True)
    return Abscissa(turns, "motor turns", bool((np.diff(known) >= 0).all()))


def series(
    frames: pd.DataFrame, in_px: bool, zone_mm: float = float("nan")
) -> dict[str, np.ndarray]:
    """Columns (K,) in the units of the page: D and sd, angle in degrees, coil as a share of D,
    and how far the two budgets are from closing (turns; string, which needs L = `zone_mm`)."""
    unit = "px" if in_px else "mm"
    column = {
        name: frames[name].to_numpy(float) for name in frames.columns if _numeric(frames, name)
    }
    diameter = column[f"diameter_{unit}"]
    with np.errstate(divide="ignore", invalid="ignore"):
        coil = column["coil_amplitude_mm"] / column["diameter_mm"]
    return {
        "diameter": diameter,
        "diameter_sd": column[f"diameter_{unit}_sd"],
        "angle": np.degrees(column["helix_angle_rad"]),
        "angle_sd": np.degrees(column["helix_angle_rad_sd"]),
        "knots": column["knot_count"],
        "coil": coil,
        "unevenness": column["unevenness"],
        "displacement": column["displacement_mm"],
        "turn_budget": column["turn_budget_error"],
        "turn_budget_sd": column["turns_seen_sd"],
        "string_budget": column["string_length_mm"] - zone_mm - column["displacement_mm"],
        "string_budget_sd": column["string_length_mm_sd"],
    }


def _numeric(frames: pd.DataFrame, name: str) -> bool:
    return bool(pd.api.types.is_numeric_dtype(frames[name]))


def first_winding_bands(axis: Abscissa, phases: list[str]) -> list[tuple[float, float, str]]:
    """Phases along the first winding: unwinding passes the same turns in other phases."""
    falls = np.flatnonzero(axis.falling())
    end = int(falls[0]) if len(falls) else len(phases)
    return phase_bands(axis.x[:end], phases[:end])


def phase_bands(x: np.ndarray, phases: list[str]) -> list[tuple[float, float, str]]:
    """Stretches of equal phase as (from, to, phase) along a rising x; borders lie midway between
    frames, frames without a phase or place are passed over."""
    places = [(float(at), phase_key(p)) for at, p in zip(x, phases, strict=True)]
    places = [(at, p) for at, p in places if np.isfinite(at) and p and p != "nan"]
    bands: list[tuple[float, float, str]] = []
    for (at, phase), (after, _) in zip(
        places, [*places[1:], places[-1]] if places else [], strict=True
    ):
        start = bands[-1][1] if bands else at
        end = (at + after) / 2
        if bands and bands[-1][2] == phase:
            bands[-1] = (bands[-1][0], end, phase)
        else:
            bands.append((start, end, phase))
    return bands


def predictions(
    turns: np.ndarray, diameter_mm: float, rig: dict[str, Any]
) -> dict[str, np.ndarray]:
    """Displacement in mm (K,) by every model on the shelf whose geometry is known from the rig
    and the measured D; title -> values. Models that lack a number are left out."""
    from tsvision.models import MODELS

    given = {
        "twisting_zone_mm": rig.get("actuator.twisting_zone_mm"),
        "hole_distance_mm": rig.get("actuator.hole_distance_mm"),
        "string_diameter_mm": rig.get("strings.diameter_mm"),
        "radius_mm": diameter_mm / 2,
    }
    known = {k: float(v) for k, v in given.items() if v is not None and np.isfinite(float(v))}
    return {
        model.title: model.displacement_mm(turns, **model.geometry(known))
        for model in sorted(MODELS.values(), key=lambda m: m.name != BASE_MODEL)
        if set(model.parameters) <= set(known)
    }
