"""The same recording in Rerun: frames with lines, scalars and the strands in 3-D over turns."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tsvision.errors import InputError
from tsvision.records import FrameRow, Profile, Recording
from tsvision.report import palette
from tsvision.report.measured import Measured, read_measured, rig_of
from tsvision.report.overlay import finite_pieces
from tsvision.report.pictures import display_bgr, fit_within, jpeg_within
from tsvision.report.trace import trace_frame

VIEWER_NAME = "measured.rrd"
_SCALARS = {
    "diameter": ("diameter_mm", 1.0),
    "helix_angle_deg": ("helix_angle_rad", math.degrees(1)),
    "pitch": ("pitch_mm", 1.0),
    "coil_amplitude": ("coil_amplitude_mm", 1.0),
    "unevenness": ("unevenness", 1.0),
    "knots": ("knot_count", 1.0),
    "turn_budget_error": ("turn_budget_error", 1.0),
    "displacement": ("displacement_mm", 1.0),
}
_POINTS_A_TURN = 16
_MOST_POINTS = 4000


def write_viewer_file(measure_dir: Path, recording: Recording, out: Path | None = None) -> Path:
    """Write a Rerun recording (.rrd) of a measured recording; returns its path.

    Frames stand on two timelines, `frame` and `turns`. InputError when Rerun is not installed.
    """
    rr = _rerun()
    measured = read_measured(Path(measure_dir))
    path = Path(out) if out else measured.folder / VIEWER_NAME
    stream = rr.RecordingStream("tsvision")
    try:
        stream.save(str(path))
    except (OSError, RuntimeError) as problem:
        raise InputError(f"{path}: cannot be written ({problem}); choose another place") from None
    _log_all(rr, stream, measured, recording)
    stream.flush()
    return path


def open_viewer(measure_dir: Path, recording: Recording) -> None:
    """Open Rerun's window and send the recording to it. InputError when it is not installed."""
    rr = _rerun()
    stream = rr.RecordingStream("tsvision")
    stream.spawn()
    _log_all(rr, stream, read_measured(Path(measure_dir)), recording)
    stream.flush()


def _rerun() -> Any:
    try:
        import rerun
    except ImportError:
        raise InputError(
            "the viewer needs Rerun; install it with: pip install 'tsvision[viewer]'"
        ) from None
    return rerun


def _log_all(rr: Any, stream: Any, measured: Measured, recording: Recording) -> None:
    from tsvision.images.frames import iter_frames

    count, diameter_mm = _strings(measured)
    row_of = {str(file): i for i, file in enumerate(measured.frames["file"])}
    for frame in iter_frames(recording):
        position = row_of.get(frame.file)
        if position is None:
            continue
        row = measured.row(position)
        stream.set_time("frame", sequence=row.frame)
        if math.isfinite(row.turns):
            stream.set_time("turns", duration=row.turns)
        if frame.pixels is not None:
            _log_picture(rr, stream, frame.pixels)
        _log_lines(rr, stream, row, measured)
        _log_scalars(rr, stream, row)
        strands = strand_lines(row, count, diameter_mm)
        lines = rr.LineStrips3D(list(strands.lines_mm), radii=strands.radius_mm)
        stream.log("strands", lines if len(strands.lines_mm) else rr.Clear(recursive=False))


def _strings(measured: Measured) -> tuple[int, float]:
    rig = rig_of(measured.summary)
    counted = measured.frames["strand_count"].dropna()
    count = rig.get("strings.count") or (counted.median() if len(counted) else 2)
    return int(count), float(rig.get("strings.diameter_mm") or math.nan)


def _log_picture(rr: Any, stream: Any, pixels: np.ndarray) -> None:
    data = jpeg_within(fit_within(display_bgr(pixels), *pixels.shape[1::-1]), 400_000)
    stream.log("picture", rr.EncodedImage(contents=data, media_type="image/jpeg"))


def _log_lines(rr: Any, stream: Any, row: FrameRow, measured: Measured) -> None:
    profile: Profile | None = measured.profile(row)
    trace = trace_frame(row, profile, measured.sightings(row.frame))
    box = lambda corners: np.vstack([corners, corners[:1]]) if len(corners) else corners  # noqa: E731
    for name, lines, colour in (
        ("axis", [trace.axis], palette.AXIS),
        ("edges", [trace.upper, trace.lower], palette.EDGES),
        ("envelope", [trace.envelope_upper, trace.envelope_lower], palette.ENVELOPE),
        ("near_region", [box(trace.near_region)], palette.NEAR_REGION),
        ("knots", [box(k) for k in trace.knots], palette.KNOTS),
    ):
        # Rerun counts from the first pixel's corner, the tables from its centre.
        strips = [piece + 0.5 for line in lines for piece in finite_pieces(line)]
        rgb = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
        drawn = rr.LineStrips2D(strips, colors=[rgb]) if strips else rr.Clear(recursive=False)
        stream.log(f"picture/{name}", drawn)


def _log_scalars(rr: Any, stream: Any, row: FrameRow) -> None:
    for name, (column, factor) in _SCALARS.items():
        value = getattr(row, column) * factor
        if math.isfinite(value):
            stream.log(f"measured/{name}", rr.Scalars(value))


@dataclass(frozen=True)
class Strands:
    """Centre lines (K, 3) in mm, x along the axis from the separator, and the strands' radius."""

    lines_mm: tuple[np.ndarray, ...]
    radius_mm: float


def strand_lines(row: FrameRow, count: int, string_diameter_mm: float = math.nan) -> Strands:
    """The twisted part as its numbers describe it: `count` strands on one ring of radius
    (D − d)/2 at the measured pitch and handedness, about a centre line that coils with the
    measured amplitude (rms A, so radius √2 A) and pitch.

    A picture of the fit, not of each knot. Empty when D, the pitch or the scale is unknown.
    """
    start, length = row.apex_mm, _zone_mm(row)
    needed = (row.diameter_mm, row.pitch_mm, length)
    if not all(map(math.isfinite, needed)) or row.pitch_mm <= 0:
        return Strands((), math.nan)
    start = start if math.isfinite(start) else 0.0
    d = string_diameter_mm if math.isfinite(string_diameter_mm) else row.diameter_mm / 2
    radius, sign = (row.diameter_mm - d) / 2, -1.0 if row.handedness == "S" else 1.0
    samples = min(_MOST_POINTS, max(2, int(_POINTS_A_TURN * (length - start) / row.pitch_mm)))
    x = np.linspace(start, length, samples)
    coil = math.sqrt(2) * row.coil_amplitude_mm if row.coil_pitch_mm > 0 else 0.0
    coil = coil if math.isfinite(coil) else 0.0
    turn = sign * 2 * np.pi * x / row.coil_pitch_mm if coil else np.zeros_like(x)
    lines = []
    for k in range(count):
        angle = sign * 2 * np.pi * x / row.pitch_mm + 2 * np.pi * k / count
        y = radius * np.cos(angle) + coil * np.cos(turn)
        z = radius * np.sin(angle) + coil * np.sin(turn)
        lines.append(np.column_stack([x, y, z]))
    return Strands(tuple(lines), d / 2)


def _zone_mm(row: FrameRow) -> float:
    span = math.hypot(row.axis_x1_px - row.axis_x0_px, row.axis_y1_px - row.axis_y0_px)
    return span * row.mm_per_px
