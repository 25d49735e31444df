"""What `tsvision setup` knows: the frame shown, the rig as filled in, and what is found with it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from tsvision.atomic import write_text
from tsvision.errors import InputError
from tsvision.images.frames import iter_frames
from tsvision.records import Frame, FrameResult, Recording, Rig
from tsvision.report.digest import frame_card
from tsvision.report.pictures import data_uri, display_bgr, fit_within, jpeg_within
from tsvision.report.shown import paths_of
from tsvision.report.trace import trace_frame
from tsvision.rig import load_rig
from tsvision.rig_keys import SECTIONS, commented_file

_PICTURE_BYTES = 600_000
Measure = Callable[[Recording, int], FrameResult]


def first_readable(recording: Recording, start: int = 0) -> Frame:
    """The first frame from `start` on that can be decoded; InputError when there is none."""
    if not 0 <= start < len(recording.files):
        raise InputError(
            f"frame {start}: the recording holds frames 0 to {len(recording.files) - 1}"
        )
    for frame in iter_frames(recording, start, ahead=0):
        if frame.pixels is not None:
            return frame
    raise InputError(f"{recording.source}: no frame can be decoded, so there is nothing to show")


def frame_in(fields: dict[str, Any]) -> int:
    """Take the frame's number out of what the page sent; the rest are the rig's fields."""
    number = fields.pop("frame", None)
    if type(number) is not int:
        raise InputError(f"frame {number!r}: must be a whole number from 0 on")
    return number


def show_frame(frame: Frame) -> dict[str, Any]:
    """A frame for the page, shrunk: its JPEG's address, its name, and its own size in px, in
    which points on the page are given."""
    assert frame.pixels is not None
    small = fit_within(display_bgr(frame.pixels), 1920, 1440)
    height, width = frame.pixels.shape[:2]
    href = data_uri(jpeg_within(small, _PICTURE_BYTES), "jpeg")
    return {
        "href": href,
        "width": width,
        "height": height,
        "frame": frame.index,
        "file": frame.file,
    }


def given_rig(fields: dict[str, Any]) -> Rig:
    """The rig from the page's fields ("section.key" -> value; None or "" is unknown).

    Raises InputError, naming the key, when a value is not usable.
    """
    known = {k: _plain(v) for k, v in fields.items() if v is not None and v != ""}
    return load_rig(None, known)


def _plain(value: Any) -> Any:
    """Text as a person types it: a number where it is one, a decimal comma allowed."""
    if not isinstance(value, str):
        return value
    text = value.strip()
    try:
        number = float(text.replace(",", ".") if text.count(",") == 1 else text)
    except ValueError:
        return text
    return int(number) if number.is_integer() and "." not in text else number


def try_rig(recording: Recording, index: int, rig: Rig, measure: Measure) -> dict[str, Any]:
    """Measure the frame shown with this rig: its lines as SVG paths, its numbers and flags.

    What stands still is learnt from the whole recording, as when it is measured in earnest.
    """
    result = measure(replace(recording, rig=rig), index)
    row = result.row
    return {
        "paths": paths_of(trace_frame(row, result.profile, result.knots), 1.0),
        "card": frame_card(row),
        "flags": [f for f in row.flags.split("|") if f],
        "found": math.isfinite(row.axis_x0_px),
        "separator": _point(row.separator_x_px, row.separator_y_px),
        "axis": [
            _point(row.axis_x0_px, row.axis_y0_px),
            _point(row.axis_x1_px, row.axis_y1_px),
        ],
    }


def _point(x: float, y: float) -> list[float] | None:
    return [round(x, 2), round(y, 2)] if math.isfinite(x) and math.isfinite(y) else None


def rig_text(fields: dict[str, Any]) -> str:
    """rig.toml with these values in force and every other key as a comment that explains it."""
    given_rig(fields)
    section, lines = "", []
    for line in commented_file().splitlines():
        if line.startswith("["):
            section = line.strip("[]")
        name = line[2:].split(" = ")[0] if line.startswith("# ") and " = " in line else ""
        known = name in (SECTIONS[section].model_fields if section else ())
        value = fields.get(f"{section}.{name}") if known else None
        kept = line if value is None or value == "" else f"{name} = {_toml(_plain(value))}"
        lines.append(kept)
    return "\n".join(lines) + "\n"


def _toml(value: Any) -> str:
    if isinstance(value, str):
        escaped = value.replace("\\", "\\\\").replace('"', '\\"')
        return '"' + "".join(c if c.isprintable() else f"\\u{ord(c):04X}" for c in escaped) + '"'
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_toml(v) for v in value) + "]"
    return repr(value)


def save_rig(path: Path, fields: dict[str, Any]) -> Path | None:
    """Write rig.toml; an older one stays beside it as rig.toml.old, whose path is returned."""
    text = rig_text(fields)
    old = None
    if path.exists():
        old = path.with_name(path.name + ".old")
        write_text(old, path.read_text(encoding="utf-8"))
    write_text(path, text)
    return old
