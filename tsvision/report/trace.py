"""What was measured in one frame, as lines in the picture's own pixel coordinates.

The page draws them as SVG, the overlay with OpenCV: one geometry, so that both show the same.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tsvision.records import FrameRow, KnotSighting, Profile

NO_LINE = np.empty((0, 2))


@dataclass(frozen=True)
class Trace:
    """Polylines and quadrilaterals, each (K, 2) in px (x, y); empty where nothing is known.

    A row of NaN breaks a polyline. `near_region` and each of `knots` are four corners.
    """

    axis: np.ndarray
    upper: np.ndarray
    lower: np.ndarray
    envelope_upper: np.ndarray
    envelope_lower: np.ndarray
    separator: np.ndarray
    near_region: np.ndarray
    knots: tuple[np.ndarray, ...]


@dataclass(frozen=True)
class _Line:
    """The axis as origin (s = 0) and unit vectors along (u) and across (n = (-u_y, u_x))."""

    origin: np.ndarray
    along: np.ndarray
    across: np.ndarray
    mm_per_px: float

    def point(self, s_px: np.ndarray, n_px: np.ndarray) -> np.ndarray:
        """(K,), (K,) to (K, 2) picture coordinates."""
        return self.origin + np.outer(s_px, self.along) + np.outer(n_px, self.across)

    def box(self, s0_px: float, s1_px: float, half_px: float) -> np.ndarray:
        """Four corners of an interval of the axis, `half_px` to either side."""
        s = np.array([s0_px, s1_px, s1_px, s0_px])
        return self.point(s, half_px * np.array([-1.0, -1.0, 1.0, 1.0]))


def trace_frame(
    row: FrameRow, profile: Profile | None = None, knots: Sequence[KnotSighting] = ()
) -> Trace:
    """Lay one frame's numbers back into its picture; what is unknown is left out."""
    line = _line(row)
    if line is None:
        return Trace(NO_LINE, NO_LINE, NO_LINE, NO_LINE, NO_LINE, NO_LINE, NO_LINE, ())
    upper, lower, over, under = _edges(line, profile)
    return Trace(
        axis=np.array([[row.axis_x0_px, row.axis_y0_px], [row.axis_x1_px, row.axis_y1_px]]),
        upper=upper,
        lower=lower,
        envelope_upper=over,
        envelope_lower=under,
        separator=_separator(line, row),
        near_region=_near_region(line, row),
        knots=tuple(box for k in knots if len(box := _knot_box(line, k, row.diameter_px))),
    )


def _line(row: FrameRow) -> _Line | None:
    start = np.array([row.axis_x0_px, row.axis_y0_px])
    span = np.array([row.axis_x1_px, row.axis_y1_px]) - start
    length = math.hypot(*span)
    if not math.isfinite(length) or length == 0:
        return None
    along = span / length
    separator = np.array([row.separator_x_px, row.separator_y_px])
    if np.isfinite(separator).all():
        start = start + along * float((separator - start) @ along)
    return _Line(start, along, np.array([-along[1], along[0]]), row.mm_per_px)


def _edges(line: _Line, profile: Profile | None) -> tuple[np.ndarray, ...]:
    if profile is None or not len(profile.s_px):
        return NO_LINE, NO_LINE, NO_LINE, NO_LINE
    s = profile.s_px
    half = profile.envelope_mm / line.mm_per_px / 2
    if not np.isfinite(half).any():
        return line.point(s, profile.upper_px), line.point(s, profile.lower_px), NO_LINE, NO_LINE
    return (
        line.point(s, profile.upper_px),
        line.point(s, profile.lower_px),
        line.point(s, half),
        line.point(s, -half),
    )


def _separator(line: _Line, row: FrameRow) -> np.ndarray:
    if not math.isfinite(row.separator_x_px):
        return NO_LINE
    half = 1.5 * row.diameter_px if math.isfinite(row.diameter_px) else 20.0
    return line.point(np.zeros(2), half * np.array([-1.0, 1.0]))


def _near_region(line: _Line, row: FrameRow) -> np.ndarray:
    """From the apex over max(2 p, 4 D): where D, p and the angles of the frame are read."""
    apex = np.array([row.apex_x_px, row.apex_y_px])
    start = float((apex - line.origin) @ line.along)
    if not math.isfinite(start):
        start = row.apex_mm / line.mm_per_px
    pitch = 2 * row.pitch_px if math.isfinite(row.pitch_px) else 0.0
    end = start + max(pitch, 4 * row.diameter_px)
    if not math.isfinite(end):
        return NO_LINE
    return line.box(start, end, 0.75 * row.diameter_px)


def _knot_box(line: _Line, knot: KnotSighting, diameter_px: float) -> np.ndarray:
    """The knot's interval and breadth; without a scale, whose mm are unknown, 2 D about it."""
    centre = float((np.array([knot.centre_x_px, knot.centre_y_px]) - line.origin) @ line.along)
    half_length = knot.length_mm / line.mm_per_px / 2
    half_width = 0.6 * knot.max_diameter_mm / line.mm_per_px
    if not math.isfinite(half_length + half_width):
        half_length = half_width = diameter_px
    if not math.isfinite(centre + half_length + half_width):
        return NO_LINE
    return line.box(centre - half_length, centre + half_length, half_width)
