"""Where sightings lie along the bundle, in units of its D, with or without a scale."""

from __future__ import annotations

import numpy as np
import pandas as pd

from tsvision.timeline.lengths import median, medians
from tsvision.timeline.order import Order, numbers


def places_in_diameters(frames: pd.DataFrame, knots: pd.DataFrame) -> tuple[np.ndarray, np.ndarray]:
    """(rows,) position along the bundle and length of each sighting, in median D."""
    unit_mm, unit_px = medians(frames)
    along_mm = numbers(knots, "centre_mm")
    if np.isfinite(along_mm).all() and np.isfinite(unit_mm):
        return along_mm / unit_mm, np.nan_to_num(numbers(knots, "length_mm") / unit_mm, nan=1.5)
    ux, uy = axis_unit(frames)
    along_px = numbers(knots, "centre_x_px") * ux + numbers(knots, "centre_y_px") * uy
    return along_px / unit_px, np.nan_to_num(numbers(knots, "length_px") / unit_px, nan=1.5)


def axis_unit(frames: pd.DataFrame) -> tuple[float, float]:
    """Direction of the axis in the picture, separator to connector; along x where unknown."""
    x0, y0, x1, y1 = (
        median(numbers(frames, f"axis_{name}_px")) for name in ("x0", "y0", "x1", "y1")
    )
    ux, uy = (x1 - x0, y1 - y0) if np.isfinite([x0, y0, x1, y1]).all() else (1.0, 0.0)
    norm = float(np.hypot(ux, uy)) or 1.0
    return ux / norm, uy / norm


def rows_of_steps(frames: pd.DataFrame, knots: pd.DataFrame, order: Order) -> list[np.ndarray]:
    """Rows of the knot table that belong to each place of the order."""
    names = frames["frame"].to_numpy()[order.rows]
    of = {}
    if len(knots):
        of = {name: np.asarray(rows) for name, rows in knots.groupby("frame").indices.items()}
    return [of.get(name, np.zeros(0, dtype=int)) for name in names]
