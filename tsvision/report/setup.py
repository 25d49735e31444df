"""`tsvision setup`: look at the first frame, put right what was found, write rig.toml."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

from tsvision.records import FrameResult, Recording
from tsvision.report.page import render
from tsvision.report.setup_server import SetupServer
from tsvision.report.setup_state import (
    Measure,
    first_readable,
    frame_in,
    given_rig,
    save_rig,
    show_frame,
    try_rig,
)
from tsvision.rig import rig_values
from tsvision.rig_keys import SECTIONS

# What a person fills in by hand; region, side and scale have controls of their own.
_TYPED = (
    "strings.count",
    "strings.diameter_mm",
    "actuator.twisting_zone_mm",
    "actuator.hole_distance_mm",
    "actuator.hole_diameter_mm",
    "actuator.load_N",
)


def make_server(
    recording: Recording,
    rig_path: Path,
    port: int = 0,
    measure: Measure | None = None,
    start: int = 0,
) -> SetupServer:
    """A server, not yet serving, for this recording; saving writes `rig_path` and stops it.

    `start` is the frame shown first (or the next that is readable); the page can ask for others.
    `measure` replaces the measuring of frames (for tests). InputError when no frame is readable.
    """
    frame = first_readable(recording, start)
    measuring, one = measure or measure_one, threading.Lock()

    def show(fields: dict[str, Any]) -> dict[str, Any]:
        return show_frame(first_readable(recording, frame_in(fields)))

    def look(fields: dict[str, Any]) -> dict[str, Any]:
        index = frame_in(fields)
        with one:  # measuring twice at once would only be slower
            return try_rig(recording, index, given_rig(fields), measuring)

    def save(fields: dict[str, Any]) -> dict[str, Any]:
        frame_in(fields)
        old = save_rig(rig_path, fields)
        server.stop()
        return {"saved": str(rig_path), "old": str(old) if old else None}

    data = {
        "picture": show_frame(frame),
        "frames": len(recording.files),
        "fields": {k: v for k, v in rig_values(recording.rig).items() if v is not None},
    }
    page = render(
        "setup.html",
        data=data,
        title=recording.source.resolve().name,
        rig_path=str(rig_path),
        exists=rig_path.exists(),
        typed=[(key, *_words(key)) for key in _TYPED],
    )
    server = SetupServer(page, {"frame": show, "try": look, "save": save}, port)
    return server


def measure_one(recording: Recording, index: int) -> FrameResult:
    """One frame of a recording, as `tsvision measure` measures it."""
    from tsvision.measures.recording import measure_frames

    return next(measure_frames(recording, start=index, stop=index + 1))


def _words(key: str) -> tuple[str, str]:
    """Label and help of a rig key, from the one list of keys."""
    section, name = key.split(".")
    info = SECTIONS[section].model_fields[name]
    words, unit = name.rsplit("_", 1) if name.endswith(("_mm", "_N")) else (name, "")
    label = f"{words.replace('_', ' ')} ({unit})" if unit else f"{section} {words}"
    return label, info.description or ""
