"""Frames of a video, exact to the frame.

The packets' time stamps are read first, without decoding: they say how many frames there are and
when each was taken. Decoded pictures are then matched to them by time stamp, so a damaged stretch
leaves its rows empty and shifts nothing. Grey use takes the Y plane as it lies in the file.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np

from tsvision.errors import InputError
from tsvision.images.frames_picture import Unreadable, check_size
from tsvision.records import Frame

_QUARTER_TURNS = {
    90: cv2.ROTATE_90_COUNTERCLOCKWISE,
    -90: cv2.ROTATE_90_CLOCKWISE,
    180: cv2.ROTATE_180,
    -180: cv2.ROTATE_180,
}
_GONE = "the video holds no decodable picture at this time"


@dataclass(frozen=True)
class VideoIndex:
    """When each frame was taken, in order: `pts` (n,) in ticks (empty when the file has none),
    `time_s` (n,) from the first frame on."""

    count: int
    pts: np.ndarray
    time_s: np.ndarray


def index_video(path: Path) -> VideoIndex:
    """Count the frames of a video and time them; raises InputError."""
    try:
        stat = path.stat()
        return _index(path, stat.st_mtime_ns, stat.st_size)
    except (av.FFmpegError, OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(
            f"{path}: no readable video ({reason}); convert or copy it again"
        ) from None


@lru_cache(maxsize=8)
def _index(path: Path, _mtime_ns: int, _size_bytes: int) -> VideoIndex:
    with av.open(str(path)) as container:
        stream = _picture_stream(path, container)
        ticks: list[int | None] = []
        with contextlib.suppress(av.FFmpegError):  # a cut-off end: what came before stands
            for packet in container.demux(stream):
                if packet.size and not packet.is_discard:
                    ticks.append(packet.pts)
        base = float(stream.time_base or 0)
        rate = float(stream.average_rate or 0)
    if not ticks:
        raise InputError(f"{path}: the video holds no frames; copy it again")
    known = np.array(sorted(t for t in ticks if t is not None), dtype=np.int64)
    if base > 0 and len(known) == len(ticks) == len(np.unique(known)):
        return VideoIndex(len(ticks), known, (known - known[0]) * base)
    time_s = np.arange(len(ticks)) / rate if rate > 0 else np.full(len(ticks), np.nan)
    return VideoIndex(len(ticks), np.empty(0, np.int64), time_s)


def _picture_stream(path: Path, container: Any) -> Any:
    if not container.streams.video:
        raise InputError(f"{path}: holds no video stream; name another file")
    stream = container.streams.video[0]
    if stream.codec_context is None:
        raise InputError(f"{path}: its codec is not known; convert the video to H.264")
    try:
        check_size(stream.codec_context.width, stream.codec_context.height)
    except Unreadable as problem:
        raise InputError(f"{path}: {problem}") from None
    return stream


def iter_video(
    path: Path, names: tuple[str, ...], start: int, stop: int, color: bool, threads: int = 0
) -> Iterator[Frame]:
    """Frames start..stop-1 of `names`; `pixels=None` where nothing could be decoded.

    `names` may be a stretch of the video's frames: each ends in its number, `film.mp4#12`.
    """
    if start >= stop:
        return
    first = int(names[0].rsplit("#", 1)[1])
    expected = start
    for number, picture in _numbered(path, index_video(path), first + start, first + stop, threads):
        here = number - first
        if here < expected:
            continue
        if here >= stop:
            break
        for gap in range(expected, here):
            yield Frame(gap, names[gap], None, _GONE)
        yield _to_frame(here, names[here], picture, color)
        expected = here + 1
    for gap in range(expected, stop):
        yield Frame(gap, names[gap], None, _GONE)


def _numbered(
    path: Path, index: VideoIndex, start: int, stop: int, threads: int
) -> Iterator[tuple[int, Any]]:
    """Decoded pictures with their frame number, from at or before `start` on."""
    with av.open(str(path)) as container:
        stream = _picture_stream(path, container)
        stream.thread_type = "AUTO"
        stream.codec_context.thread_count = threads
        if len(index.pts) == 0:
            yield from enumerate(_decoded(container, stream))
            return
        if start > 0:
            container.seek(int(index.pts[start]), stream=stream, backward=True)
        for picture in _decoded(container, stream):
            if picture.pts is None:
                continue
            number = int(np.searchsorted(index.pts, picture.pts))
            if number < index.count and index.pts[number] == picture.pts:
                yield number, picture
                if number >= stop - 1:
                    return


def _decoded(container: Any, stream: Any) -> Iterator[Any]:
    """Pictures in order of display; packets that cannot be decoded are passed over."""
    packets = container.demux(stream)
    while True:
        try:
            packet = next(packets)
        except (StopIteration, av.FFmpegError):
            return
        with contextlib.suppress(av.FFmpegError):
            yield from packet.decode()


def _to_frame(number: int, name: str, picture: Any, color: bool) -> Frame:
    if picture.is_corrupt:
        return Frame(number, name, None, "the picture is damaged in the video")
    try:
        check_size(picture.width, picture.height)
        pixels = _pixels(picture, color)
    except (Unreadable, av.FFmpegError, ValueError) as problem:
        return Frame(number, name, None, f"the picture cannot be converted ({problem})")
    turn = _QUARTER_TURNS.get(int(getattr(picture, "rotation", 0) or 0))
    return Frame(number, name, pixels if turn is None else cv2.rotate(pixels, turn))


def _pixels(picture: Any, color: bool) -> np.ndarray:
    form = picture.format.name
    deep = picture.format.components[0].bits > 8
    if form.startswith(("yuv", "nv12", "gray")) and not (color and not form.startswith("gray")):
        if not deep:
            return _luma(picture, full_range=form.startswith(("yuvj", "gray")))
        return picture.to_ndarray(format="gray16le")
    if color and not form.startswith("gray"):
        return picture.to_ndarray(format="bgr48le" if deep else "bgr24")
    return picture.to_ndarray(format="gray16le" if deep else "gray")


def _luma(picture: Any, full_range: bool) -> np.ndarray:
    """The Y plane itself, spread from 16..235 to 0..255 where the video is of limited range."""
    plane = picture.planes[0]
    rows = np.frombuffer(plane, np.uint8)[: plane.line_size * picture.height]
    luma = rows.reshape(picture.height, plane.line_size)[:, : picture.width]
    if full_range or int(picture.color_range or 0) == 2:
        return np.ascontiguousarray(luma)
    return cv2.LUT(np.ascontiguousarray(luma), _SPREAD)


_SPREAD = np.clip(np.rint((np.arange(256) - 16) * 255 / 219), 0, 255).astype(np.uint8)
