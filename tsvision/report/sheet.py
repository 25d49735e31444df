"""A contact sheet: the recording at a glance, overlays side by side in one picture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from tsvision.atomic import write_bytes
from tsvision.errors import InputError
from tsvision.records import FrameRow, Recording
from tsvision.report import shown
from tsvision.report.measured import Measured, read_measured
from tsvision.report.overlay import draw_overlay, with_caption
from tsvision.report.pictures import fit_within

SHEET_NAME = "sheet.jpg"
_GAP_PX = 8


def write_sheet(
    measure_dir: Path,
    recording: Recording,
    out: Path | None = None,
    most: int = 24,
    width_px: int = 2400,
) -> Path:
    """Write evenly chosen frames, cut to the bundle's surroundings, as one picture of `width_px`.

    `out` defaults to `sheet.jpg` in the measure folder; .png is written as PNG. InputError when
    no frame is readable.
    """
    measured = read_measured(Path(measure_dir))
    path = Path(out) if out else measured.folder / SHEET_NAME
    chosen = shown.choose(len(measured.frames), most)
    tiles = _tiles(measured, recording, chosen, width_px)
    if not tiles:
        raise InputError(
            f"{recording.source}: no frame could be decoded; nothing to put on a sheet"
        )
    sheet = lay_out([t for t, _ in tiles], [r for _, r in tiles], width_px)
    kind, quality = (
        (".png", []) if path.suffix == ".png" else (".jpg", [cv2.IMWRITE_JPEG_QUALITY, 88])
    )
    _, data = cv2.imencode(kind, sheet, quality)
    write_bytes(path, data.tobytes())
    return path


def lay_out(tiles: Sequence[np.ndarray], rows_of: Sequence[FrameRow], width_px: int) -> np.ndarray:
    """Tiles (any sizes, BGR), each under its caption, in as many columns as make the sheet
    about 4 : 3, on white."""
    tallest, widest = (max(t.shape[i] for t in tiles) for i in (0, 1))
    columns, room = _columns(len(tiles), widest / tallest, width_px)
    small = [
        with_caption(fit_within(t, room, 10**6), r) for t, r in zip(tiles, rows_of, strict=True)
    ]
    height = max(t.shape[0] for t in small)
    rows = math.ceil(len(small) / columns)
    sheet = np.full((rows * (height + _GAP_PX) + _GAP_PX, width_px, 3), 255, np.uint8)
    for i, tile in enumerate(small):
        y = _GAP_PX + (i // columns) * (height + _GAP_PX)
        x = _GAP_PX + (i % columns) * (room + _GAP_PX)
        sheet[y : y + tile.shape[0], x : x + tile.shape[1]] = tile
    return sheet


def _columns(tiles: int, aspect: float, width_px: int) -> tuple[int, int]:
    """How many columns make a sheet about 4 : 3, and the width of one in px."""
    columns = max(1, min(tiles, round(math.sqrt(tiles * 4 / 3 / aspect))))
    return columns, (width_px - _GAP_PX * (columns + 1)) // columns


def _tiles(
    measured: Measured, recording: Recording, chosen: list[int], width_px: int
) -> list[tuple[np.ndarray, FrameRow]]:
    frames = shown.frames_at(recording, measured.frames, chosen)
    rows = [measured.row(i) for i in chosen]
    profiles = [measured.profile(r) for r in rows]
    knots = [measured.sightings(r.frame) for r in rows]
    traces = shown.trace_all(rows, profiles, knots)
    tiles = []
    for i, row, profile, seen in zip(chosen, rows, profiles, knots, strict=True):
        frame = frames.get(i)
        if frame is None or frame.pixels is None:
            continue
        x0, y0, x1, y1 = shown.window_px(traces, frame.pixels.shape[1], frame.pixels.shape[0])
        labels = measured.track_labels(row.frame)
        # Drawn no larger than shown: lines drawn before a picture is made small are lost.
        _, room = _columns(len(chosen), (x1 - x0) / (y1 - y0), width_px)
        zoom = min(2.0, room / (x1 - x0))
        drawn = draw_overlay(frame.pixels, row, profile, seen, zoom, caption=False, labels=labels)
        top, bottom, left, right = (round(zoom * at) for at in (y0, y1, x0, x1))
        tiles.append((drawn[top:bottom, left:right], row))
    return tiles
