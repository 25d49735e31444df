"""What was measured in one frame, as lines in the picture's own pixel coordinates.

The page draws them as SVG, the overlay with OpenCV: one geometry, so that both show the same.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from tsvision.records import FrameRow, KnotSighting, Profile

NO_LINE = np.empty((0, 2))
_BOX_POINTS = 9  # along each side of a box that follows a bow


@dataclass(frozen=True)
class Trace:
    """Polylines and quadrilaterals, each (K, 2) in px (x, y); empty where nothing is known.

    A row of NaN breaks a polyline. `near_region` and each of `knots` are closed outlines, of four
    corners where the axis is straight.
    """

    axis: np.ndarray
    upper: np.ndarray
    lower: np.ndarray
    envelope_upper: np.ndarray
    envelope_lower: np.ndarray
    separator: np.ndarray
    near_region: np.ndarray
    knots: tuple[np.ndarray, ...]


class _Axis(Protocol):
    """Places along (s) and across (n) the axis, in px, to points of the picture, and back."""

    @property
    def mm_per_px(self) -> float:
        """The scale, NaN where unknown."""

    def point(self, s_px: np.ndarray, n_px: np.ndarray) -> np.ndarray:
        """(K,), (K,) to (K, 2) picture coordinates."""

    def place(self, point: np.ndarray) -> float:
        """s of the point of the axis beside (x, y); NaN where that is unknown."""

    def box(self, s0_px: float, s1_px: float, half_px: float) -> np.ndarray:
        """Outline of an interval of the axis, `half_px` to either side."""


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

    def place(self, point: np.ndarray) -> float:
        """s of the point of the axis beside (x, y); NaN where that is unknown."""
        return float((point - self.origin) @ self.along)

    def box(self, s0_px: float, s1_px: float, half_px: float) -> np.ndarray:
        """Four corners of an interval of the axis, `half_px` to either side."""
        s = np.array([s0_px, s1_px, s1_px, s0_px])
        return self.point(s, half_px * np.array([-1.0, -1.0, 1.0, 1.0]))


@dataclass(frozen=True)
class _Bow:
    """A bowed axis: its points (M, 2) and unit normals (M, 2) at s_px (M,), rising."""

    s_px: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    mm_per_px: float

    def point(self, s_px: np.ndarray, n_px: np.ndarray) -> np.ndarray:
        """(K,), (K,) to (K, 2) picture coordinates; s beyond the ends stays at them."""
        at, across = (
            np.column_stack([np.interp(s_px, self.s_px, v) for v in table.T])
            for table in (self.points, self.normals)
        )
        return at + np.asarray(n_px)[:, None] * across

    def place(self, point: np.ndarray) -> float:
        """s of the point of the axis nearest to (x, y); NaN where that is unknown."""
        if not np.isfinite(point).all():
            return math.nan
        return float(self.s_px[np.argmin(((self.points - point) ** 2).sum(1))])

    def box(self, s0_px: float, s1_px: float, half_px: float) -> np.ndarray:
        """Outline of an interval of the axis, `half_px` to either side."""
        s = np.linspace(s0_px, s1_px, _BOX_POINTS)
        n = np.full(_BOX_POINTS, half_px)
        return np.vstack([self.point(s, -n), self.point(s[::-1], n)])


def trace_frame(
    row: FrameRow, profile: Profile | None = None, knots: Sequence[KnotSighting] = ()
) -> Trace:
    """Lay one frame's numbers back into its picture; what is unknown is left out."""
    line = _axis(row, profile)
    if line is None:
        return Trace(NO_LINE, NO_LINE, NO_LINE, NO_LINE, NO_LINE, NO_LINE, NO_LINE, ())
    upper, lower, over, under = _edges(line, profile)
    return Trace(
        axis=line.points if isinstance(line, _Bow) else _ends(row),
        upper=upper,
        lower=lower,
        envelope_upper=over,
        envelope_lower=under,
        separator=_separator(line, row),
        near_region=_near_region(line, row),
        knots=tuple(box for k in knots if len(box := _knot_box(line, k, row.diameter_px))),
    )


def _axis(row: FrameRow, profile: Profile | None) -> _Axis | None:
    if profile is None or profile.axis_x_px is None or profile.axis_y_px is None:
        return _line(row)
    s_px, first = np.unique(profile.s_px, return_index=True)
    points = np.column_stack([profile.axis_x_px, profile.axis_y_px])[first]
    if len(s_px) < 3 or not np.isfinite(points).all():
        return _line(row)
    along = np.gradient(points, s_px, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return _Bow(s_px, points, np.column_stack([-along[:, 1], along[:, 0]]), row.mm_per_px)


def _ends(row: FrameRow) -> np.ndarray:
    return np.array([[row.axis_x0_px, row.axis_y0_px], [row.axis_x1_px, row.axis_y1_px]])


def _line(row: FrameRow) -> _Line | None:
    start, end = _ends(row)
    span = end - start
    length = math.hypot(*span)
    if not math.isfinite(length) or length == 0:
        return None
    along = span / length
    separator = np.array([row.separator_x_px, row.separator_y_px])
    if np.isfinite(separator).all():
        start = start + along * float((separator - start) @ along)
    return _Line(start, along, np.array([-along[1], along[0]]), row.mm_per_px)


def _edges(line: _Axis, profile: Profile | None) -> tuple[np.ndarray, ...]:
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


def _separator(line: _Axis, row: FrameRow) -> np.ndarray:
    if not math.isfinite(row.separator_x_px):
        return NO_LINE
    half = 1.5 * row.diameter_px if math.isfinite(row.diameter_px) else 20.0
    return line.point(np.zeros(2), half * np.array([-1.0, 1.0]))


def _near_region(line: _Axis, row: FrameRow) -> np.ndarray:
    """From the apex over max(2 p, 4 D): where D, p and the angles of the frame are read."""
    start = line.place(np.array([row.apex_x_px, row.apex_y_px]))
    if not math.isfinite(start):
        start = row.apex_mm / line.mm_per_px
    pitch = 2 * row.pitch_px if math.isfinite(row.pitch_px) else 0.0
    end = start + max(pitch, 4 * row.diameter_px)
    if not math.isfinite(end):
        return NO_LINE
    return line.box(start, end, 0.75 * row.diameter_px)


def _knot_box(line: _Axis, knot: KnotSighting, diameter_px: float) -> np.ndarray:
    """The knot's interval and breadth; without a scale, whose mm are unknown, 2 D about it."""
    centre = line.place(np.array([knot.centre_x_px, knot.centre_y_px]))
    half_length = knot.length_mm / line.mm_per_px / 2
    half_width = 0.6 * knot.max_diameter_mm / line.mm_per_px
    if not math.isfinite(half_length + half_width):
        half_length = half_width = diameter_px
    if not math.isfinite(centre + half_length + half_width):
        return NO_LINE
    return line.box(centre - half_length, centre + half_length, half_width)
