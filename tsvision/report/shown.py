"""The frames that a page shows as pictures, each with its lines and profile."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import cv2
import numpy as np
import pandas as pd

from tsvision.records import Frame, FrameRow, KnotSighting, Profile, Recording
from tsvision.report.overlay import finite_pieces
from tsvision.report.pictures import data_uri, display_bgr, fit_within, jpeg_within
from tsvision.report.trace import Trace, trace_frame

_LINES = ("axis", "upper", "lower", "envelope_upper", "envelope_lower", "separator", "near_region")
_WIDEST_PX, _HIGHEST_PX = 1280, 900
_PROFILE_SAMPLES = 320


def choose(count: int, most: int, wanted: Iterable[int] = ()) -> list[int]:
    """At most `most` of `count` positions: evenly spread, first and last, and those wanted."""
    if count <= most:
        return list(range(count))
    must = {i for i in wanted if 0 <= i < count}
    spread = np.linspace(0, count - 1, max(2, most - len(must))).round().astype(int)
    return sorted(must | set(spread.tolist()))


def frames_at(recording: Recording, table: pd.DataFrame, chosen: Sequence[int]) -> dict[int, Frame]:
    """Positions in the table of frames -> decoded frames, matched by their file's name, so that
    a stretch measured out of a longer recording finds its own pictures. A folder is read at those
    places alone, a video from the first to the last."""
    from tsvision.images.frames import iter_frames

    index_of = {file: i for i, file in enumerate(recording.files)}
    names = table["file"].astype(str)
    wanted = {index_of[names.iloc[p]]: p for p in chosen if names.iloc[p] in index_of}
    if not wanted:
        return {}
    if recording.kind == "folder":
        return {p: f for i, p in wanted.items() for f in iter_frames(recording, i, i + 1)}
    found = iter_frames(recording, min(wanted), max(wanted) + 1)
    return {wanted[f.index]: f for f in found if f.index in wanted}


def window_px(traces: list[Trace], width: int, height: int) -> tuple[int, int, int, int]:
    """x0, y0, x1, y1 that holds all lines of all frames with room around; the whole picture
    when there is none. One window for all frames, so that the picture stands still."""
    parts = [getattr(t, name) for t in traces for name in _LINES]
    points = np.vstack([np.empty((0, 2)), *parts])
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return 0, 0, width, height
    low, high = points.min(axis=0), points.max(axis=0)
    room = 0.08 * max(high - low) + 20
    x0, y0 = np.floor(low - room).astype(int)
    x1, y1 = np.ceil(high + room).astype(int)
    x0, y0, x1, y1 = max(0, x0), max(0, y0), min(width, x1), min(height, y1)
    if x1 - x0 < 16 or y1 - y0 < 16:
        return 0, 0, width, height
    return int(x0), int(y0), int(x1), int(y1)


def picture_of(
    frame: Frame, window: tuple[int, int, int, int], budget_bytes: int
) -> dict[str, Any] | None:
    """The window of a frame as a JPEG address with its place; None when it cannot be shown."""
    if frame.pixels is None:
        return None
    x0, y0, x1, y1 = window
    part = frame.pixels[y0:y1, x0:x1]
    if not part.size:
        return None
    small = fit_within(display_bgr(part), _WIDEST_PX, _HIGHEST_PX)
    # SVG counts from the corner of the first pixel, the tables from its centre.
    return {
        "href": data_uri(jpeg_within(small, budget_bytes), "jpeg"),
        "x": x0 - 0.5,
        "y": y0 - 0.5,
        "width": part.shape[1],
        "height": part.shape[0],
    }


def paths_of(trace: Trace, step_px: float) -> dict[str, str]:
    """SVG path data of each line; vertices closer to the line than a quarter `step_px` go."""
    paths = {name: _path(getattr(trace, name), step_px, name == "near_region") for name in _LINES}
    paths["knots"] = "".join(_path(box, step_px, True) for box in trace.knots)
    return {name: path for name, path in paths.items() if path}


def _path(line: np.ndarray, step_px: float, closed: bool) -> str:
    out = []
    for piece in finite_pieces(line):
        thin = cv2.approxPolyDP(piece.astype(np.float32)[:, None], 0.25 * step_px, closed)[:, 0]
        text = " ".join(f"{x:.1f} {y:.1f}" for x, y in thin)
        out.append(f"M{text}" + ("Z" if closed else ""))
    return "".join(out)


def profile_of(
    row: FrameRow, profile: Profile | None, knots: list[KnotSighting], in_px: bool
) -> dict[str, Any]:
    """Width w(s), envelope e(s) and the intervals that stand out, thinned for the page."""
    shown: dict[str, Any] = {"s": [], "w": [], "e": [], "knots": []}
    if profile is not None:
        stride = max(1, len(profile.s_px) // _PROFILE_SAMPLES)
        per_px = row.mm_per_px
        s = profile.s_px if in_px else profile.s_mm
        w = profile.upper_px - profile.lower_px if in_px else profile.width_mm
        e = profile.envelope_mm / per_px if in_px else profile.envelope_mm
        digits = 1 if in_px else 3
        for name, values in (("s", s), ("w", np.abs(w)), ("e", e)):
            shown[name] = [round(float(v), digits) for v in values[::stride]]
    shown["knots"] = [[k.centre_mm, k.length_mm, k.max_diameter_mm] for k in knots]
    start = row.apex_mm / row.mm_per_px if in_px else row.apex_mm
    pitch, diameter = (row.pitch_px, row.diameter_px) if in_px else (row.pitch_mm, row.diameter_mm)
    reach = max(2 * pitch if np.isfinite(pitch) else 0.0, 4 * diameter)
    shown["near"] = [start, start + reach]
    shown["diameter"] = diameter
    shown["baseline"] = np.nan if in_px else row.baseline_envelope_mm
    return shown


def trace_all(
    rows: list[FrameRow], profiles: list[Profile | None], knots: list[list[KnotSighting]]
) -> list[Trace]:
    """One trace a frame, in order."""
    return [trace_frame(r, p, k) for r, p, k in zip(rows, profiles, knots, strict=True)]
