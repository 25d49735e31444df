"""Where the rendered frames go: PNG, JPEG, TIFF files or one H.264 video."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from synth.exposure import take
from synth.render import Scene, shoot
from synth.settings import Settings
from synth.state import State
from synth.strands import StrandPath

FRAMES_PER_SECOND = 25


@dataclass(frozen=True)
class FrameWriter:
    """Writes frames in order; `video` is a PyAV (container, stream) or None."""

    folder: Path
    settings: Settings
    scene: Scene
    with_ids: bool
    video: tuple[Any, Any] | None

    def write(self, state: State, paths: list[StrandPath], index: int) -> str:
        """Draw, expose and store one frame; returns its file name."""
        drawing = take(self.settings, self.scene, state, paths)
        picture = shoot(self.settings, drawing, index)
        if self.with_ids:
            _save(self.folder / id_map_name(index), drawing.ids, [])
        if self.video is not None:
            _encode(self.video, picture)
            return "recording.mp4"
        sensor = self.settings.sensor
        name = f"frame_{index:05d}.{sensor.format}"
        options = []
        if sensor.format == "png":
            options = [cv2.IMWRITE_PNG_COMPRESSION, 2]
        elif sensor.format == "jpg":
            options = [cv2.IMWRITE_JPEG_QUALITY, sensor.quality]
        _save(self.folder / name, picture, options)
        return name


def id_map_name(index: int) -> str:
    """Where a frame's strand id map lies in the recording's folder."""
    return f"truth_ids/frame_{index:05d}.png"


def _save(path: Path, picture: np.ndarray, options: list[int]) -> None:
    path.parent.mkdir(exist_ok=True)
    ok, data = cv2.imencode(path.suffix, picture, options)
    if not ok:
        raise OSError(f"could not encode {path.name}")
    path.write_bytes(data.tobytes())


def _encode(video: tuple[Any, Any], picture: np.ndarray) -> None:
    import av

    container, stream = video
    layout = "gray" if picture.ndim == 2 else "bgr24"
    frame = av.VideoFrame.from_ndarray(picture, format=layout)
    for packet in stream.encode(frame):
        container.mux(packet)


@contextlib.contextmanager
def open_frames(
    folder: Path, settings: Settings, scene: Scene, with_ids: bool
) -> Iterator[FrameWriter]:
    """A writer for the sensor's format; a video is closed when the block ends."""
    if settings.sensor.format != "mp4":
        yield FrameWriter(folder, settings, scene, with_ids, None)
        return
    import av

    with av.open(str(folder / "recording.mp4"), "w") as container:
        stream = container.add_stream("libx264", rate=Fraction(FRAMES_PER_SECOND))
        stream.width, stream.height = scene.view.width, scene.view.height
        stream.pix_fmt = "yuv420p"
        # one thread: the same input gives the same bytes
        stream.options = {"crf": str(settings.sensor.quality), "threads": "1", "preset": "medium"}
        yield FrameWriter(folder, settings, scene, with_ids, (container, stream))
        for packet in stream.encode():
            container.mux(packet)
