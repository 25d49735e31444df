"""Small recordings and a stand-in for the measuring of frames."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from tsvision.images.frames import iter_frames
from tsvision.records import FrameResult, FrameRow, KnotSighting, Profile, Recording

Measure = Callable[[Recording, int, int], Iterator[FrameResult]]


def picture(number: int, color: bool = False) -> np.ndarray:
    """48 x 64 with a bright bar whose column tells the frame's number."""
    pixels = np.full((48, 64), 40, np.uint8)
    pixels[:, number : number + 3] = 220
    return cv2.cvtColor(pixels, cv2.COLOR_GRAY2BGR) if color else pixels


@pytest.fixture
def film(tmp_path: Path) -> Path:
    """A folder of 12 PNG frames with turns."""
    folder = tmp_path / "film"
    folder.mkdir()
    lines = ["frame,file,turns"]
    for i in range(12):
        assert cv2.imwrite(str(folder / f"f{i}.png"), picture(i))
        lines.append(f"{i},f{i}.png,{i / 2}")
    (folder / "turns.csv").write_text("\n".join(lines) + "\n")
    (folder / "rig.toml").write_text("[strings]\ncount = 2\n[camera]\nmm_per_px = 0.02\n")
    return folder


def measure_bar(recording: Recording, start: int, stop: int) -> Iterator[FrameResult]:
    """The bar's column as a diameter: every number can be told from the picture."""
    for frame in iter_frames(recording, start, stop):
        row = FrameRow(
            frame=frame.index, file=frame.file, turns=float(recording.turns[frame.index])
        )
        if frame.pixels is None:
            yield FrameResult(FrameRow(frame.index, frame.file, row.turns, flags="UNREADABLE"))
            continue
        grey = frame.pixels if frame.pixels.ndim == 2 else frame.pixels[:, :, 0]
        column = float(np.argmax(grey[0]))
        scale = recording.rig.camera.mm_per_px
        row = FrameRow(
            frame=frame.index,
            file=frame.file,
            turns=row.turns,
            diameter_px=column,
            diameter_px_sd=0.1,
            diameter_mm=column * scale,
            diameter_mm_sd=0.1 * scale,
            mm_per_px=scale,
        )
        s_px = np.arange(grey.shape[1], dtype=float)
        edge = grey[0].astype(float)
        profile = Profile(s_px * scale, s_px, edge, -edge, 2 * edge * scale, 2 * edge * scale)
        knots = (KnotSighting(column, 1.0, 2.0, column, 0.0),) if column > 8 else ()
        yield FrameResult(row, profile, knots)


@pytest.fixture
def measure() -> Measure:
    """`measure_bar` as a fixture."""
    return measure_bar
