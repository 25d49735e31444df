"""One frame with what was measured drawn on it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np

from tsvision.records import FrameRow, KnotSighting, Profile
from tsvision.report import palette
from tsvision.report.pictures import display_bgr, resized
from tsvision.report.trace import Trace, trace_frame

_SHIFT = 4  # OpenCV draws at 1/16 px
_FONT = cv2.FONT_HERSHEY_SIMPLEX
_SCALE, _SMALLEST = 0.6, 0.1
_PADDING_PX = 18
_TALL_PX = cv2.getTextSize("A", _FONT, _SCALE, 1)[0][1]
CAPTION_PX = _TALL_PX + _PADDING_PX
"""Height of the strip above a picture that holds its numbers."""


def draw_overlay(
    frame: np.ndarray,
    row: FrameRow,
    profile: Profile | None = None,
    knots: Sequence[KnotSighting] = (),
    zoom: float | None = None,
    caption: bool = True,
    labels: Sequence[str] = (),
) -> np.ndarray:
    """Axis, both edges, envelope, near-separator region, separator and knots on the picture.

    `frame` is (H, W) or (H, W, 3) BGR, uint8 or uint16, and is not changed. Returns a new
    (zoom H + caption, zoom W, 3) uint8 BGR picture. `zoom` (default: 1 from 1200 px width on, else
    2) enlarges first, so that a line of 1 px hides less of a thin bundle; below 1 it makes a large
    picture small first, for lines drawn before would be lost. The caption stands in a strip above
    the picture and hides nothing. `labels` names the knots, in their order.
    """
    zoom = zoom or own_zoom(frame.shape[1])
    canvas = resized(display_bgr(frame), zoom)
    trace = trace_frame(row, profile, knots)
    _draw_trace(canvas, trace, zoom)
    if len(labels) == len(trace.knots):
        _draw_labels(canvas, trace.knots, labels, zoom)
    return with_caption(canvas, row) if caption else canvas


def own_zoom(width_px: int) -> float:
    """How much a picture is enlarged to be drawn on where nothing else asks."""
    return 1.0 if width_px >= 1200 else 2.0


def caption_text(row: FrameRow) -> str:
    """The frame's numbers in one line of ASCII, unknown ones left out."""
    parts = [f"frame {row.frame}"]
    if math.isfinite(row.turns):
        parts.append(f"{row.turns:.4g} turns")
    if row.phase:
        parts.append(palette.phase_key(row.phase).replace("_", " "))
    for value, sd, unit in (
        (row.diameter_mm, row.diameter_mm_sd, "mm"),
        (row.diameter_px, row.diameter_px_sd, "px"),
    ):
        if math.isfinite(value):
            digits = 3 if unit == "mm" else 2
            spread = f" +- {sd:.{digits}f}" if math.isfinite(sd) else ""
            parts.append(f"D {value:.{digits}f}{spread} {unit}")
            break
    if math.isfinite(row.helix_angle_rad):
        parts.append(f"beta {math.degrees(row.helix_angle_rad):.1f} deg {row.handedness}".strip())
    if math.isfinite(row.knot_count):
        parts.append(f"{row.knot_count:.0f} knot{'' if row.knot_count == 1 else 's'}")
    return "  ".join(parts)


def _draw_trace(canvas: np.ndarray, trace: Trace, zoom: float) -> None:
    for line, colour in (
        (trace.axis, palette.AXIS),
        (trace.envelope_upper, palette.ENVELOPE),
        (trace.envelope_lower, palette.ENVELOPE),
        (trace.upper, palette.EDGES),
        (trace.lower, palette.EDGES),
    ):
        _polyline(canvas, line, zoom, colour)
    _polyline(canvas, trace.near_region, zoom, palette.NEAR_REGION, closed=True)
    _polyline(canvas, trace.separator, zoom, palette.SEPARATOR, thickness=2)
    for box in trace.knots:
        _polyline(canvas, box, zoom, palette.KNOTS, closed=True, thickness=2)


def _draw_labels(
    canvas: np.ndarray, boxes: Sequence[np.ndarray], labels: Sequence[str], zoom: float
) -> None:
    """Each label above the top of its box, in the knots' colour on a dark rim."""
    for box, label in zip(boxes, labels, strict=True):
        x, y = box[:, 0].mean() * zoom, box[:, 1].min() * zoom - 6
        size, stroke = 0.8 * max(zoom, 1.0), max(round(zoom), 1)
        at = (round(x - 9 * size * len(label)), max(round(y), round(24 * size)))
        cv2.putText(canvas, label, at, _FONT, size, (0, 0, 0), 3 * stroke, cv2.LINE_AA)
        cv2.putText(canvas, label, at, _FONT, size, palette.bgr(palette.KNOTS), stroke, cv2.LINE_AA)


def _polyline(
    canvas: np.ndarray,
    line: np.ndarray,
    zoom: float,
    colour: str,
    closed: bool = False,
    thickness: int = 1,
) -> None:
    # Pixel centres are whole numbers: x at zoom 1 is zoom x + (zoom - 1) / 2 on the canvas.
    for piece in finite_pieces(line):
        points = np.rint((piece * zoom + (zoom - 1) / 2) * 2**_SHIFT).astype(np.int32)
        cv2.polylines(canvas, [points], closed, palette.bgr(colour), thickness, cv2.LINE_AA, _SHIFT)


def finite_pieces(line: np.ndarray) -> list[np.ndarray]:
    """Cut a (K, 2) polyline at its NaN rows; pieces of fewer than two points are dropped."""
    if not len(line):
        return []
    good = np.isfinite(line).all(axis=1)
    cuts = np.flatnonzero(np.diff(good.astype(int))) + 1
    pieces = np.split(line, cuts)
    return [piece for piece in pieces if len(piece) > 1 and np.isfinite(piece[0]).all()]


def with_caption(canvas: np.ndarray, row: FrameRow) -> np.ndarray:
    """The picture under a strip with the row's numbers and a line in the phase's colour."""
    text, width = caption_text(row), canvas.shape[1]
    scale = _SCALE
    # Letters keep to whole pixels: their length does not shrink in step.
    while cv2.getTextSize(text, _FONT, scale, 1)[0][0] > width - 16 and scale > _SMALLEST:
        scale *= 0.95
    strip = np.zeros((CAPTION_PX, width, 3), np.uint8)
    strip[-3:] = palette.bgr(palette.PHASES.get(palette.phase_key(row.phase), palette.GREY))
    cv2.putText(strip, text, (8, _TALL_PX + 6), _FONT, scale, (255, 255, 255), 1, cv2.LINE_AA)
    return np.vstack([strip, canvas])
