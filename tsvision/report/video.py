"""The overlay as a film: H.264 in MP4, one overlay a frame."""

from __future__ import annotations

import os
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import av
import numpy as np

from tsvision.atomic import telling_what_failed
from tsvision.errors import InputError
from tsvision.records import Recording
from tsvision.report.measured import Measured, read_measured
from tsvision.report.overlay import CAPTION_PX, draw_overlay, own_zoom
from tsvision.report.pictures import display_bgr, fit_within

VIDEO_NAME = "overlay.mp4"
_WIDEST_PX, _HIGHEST_PX = 1920, 1080


def write_overlay_video(
    measure_dir: Path, recording: Recording, out: Path | None = None, frames_per_s: float = 0.0
) -> Path:
    """Write each frame of the recording with what was measured drawn in; returns the path.

    `out` defaults to `overlay.mp4` in the measure folder. `frames_per_s` of 0 plays at the
    recording's own rate where the measured times tell it (kept within 1 to 60), else at 8. A frame
    that cannot be decoded is grey with its caption, so the film keeps the recording's length.
    Memory does not grow with the recording. InputError when nothing can be decoded or written.
    """
    measured = read_measured(Path(measure_dir))
    path = Path(out) if out else measured.folder / VIDEO_NAME
    rate = frames_per_s or own_rate(measured.frames["time_s"].to_numpy(float))
    part = path.with_name(f".{path.name}.part.mp4")
    with telling_what_failed(path):
        try:
            _encode(part, overlays(measured, recording), rate)
            os.replace(part, path)
        finally:
            part.unlink(missing_ok=True)
    return path


def own_rate(time_s: np.ndarray) -> float:
    """Frames a second from the median step of times (n,), within 1 to 60; 8 where unknown."""
    steps = np.diff(time_s[np.isfinite(time_s)])
    steps = steps[steps > 0]
    return float(np.clip(1 / np.median(steps), 1.0, 60.0)) if len(steps) else 8.0


def overlays(measured: Measured, recording: Recording) -> Iterator[np.ndarray]:
    """One (H, W, 3) BGR picture a frame, all of the first decodable frame's size."""
    from tsvision.images.frames import iter_frames

    size: tuple[int, int] | None = None
    waiting: list[int] = []  # undecodable frames before the size is known
    row_of = {str(file): i for i, file in enumerate(measured.frames["file"])}
    for frame in iter_frames(recording):
        row = row_of.get(frame.file)
        if row is None:  # not among the frames that were measured
            continue
        if frame.pixels is not None and size is None:
            size = (frame.pixels.shape[0], frame.pixels.shape[1])
            yield from (_overlay(measured, early, None, size) for early in waiting)
        if size is None:
            waiting.append(row)
        else:
            yield _overlay(measured, row, frame.pixels, size)


def _overlay(
    measured: Measured, index: int, pixels: np.ndarray | None, size: tuple[int, int]
) -> np.ndarray:
    """Overlay on a canvas of `size` (H, W): grey where the frame is missing or smaller."""
    canvas = np.full((*size, 3), 90, np.uint8)
    if pixels is not None:
        part = display_bgr(pixels)[: size[0], : size[1]]
        canvas[: part.shape[0], : part.shape[1]] = part
    row = measured.row(index)
    profile = measured.profile(row)
    labels = measured.track_labels(row.frame)
    seen = measured.sightings(row.frame)
    room = min(_WIDEST_PX / size[1], (_HIGHEST_PX - CAPTION_PX) / size[0])
    return draw_overlay(canvas, row, profile, seen, min(own_zoom(size[1]), room), labels=labels)


def _encode(path: Path, pictures: Iterator[np.ndarray], rate: float) -> None:
    first = next(pictures, None)
    if first is None:
        raise InputError(f"{path.parent}: no frame could be decoded, so there is no video to write")
    small = fit_within(first, _WIDEST_PX, _HIGHEST_PX)
    height, width = small.shape[0] // 2 * 2, small.shape[1] // 2 * 2  # H.264 halves the colours
    with av.open(str(path), "w", format="mp4", options={"movflags": "faststart"}) as film:
        stream = film.add_stream("libx264", rate=Fraction(rate).limit_denominator(1000))
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        stream.options = {"crf": "20", "preset": "veryfast"}
        for picture in _chain(first, pictures):
            shown = fit_within(picture, _WIDEST_PX, _HIGHEST_PX)[:height, :width]
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(shown), format="bgr24")
            film.mux(stream.encode(frame))
        film.mux(stream.encode(None))


def _chain(first: np.ndarray, rest: Iterator[np.ndarray]) -> Iterator[np.ndarray]:
    yield first
    yield from rest
