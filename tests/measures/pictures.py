"""Pictures of a straight helix drawn by the benchmark's renderer, for tests of laws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.bench.pictures48_draw import Case, draw
from tsvision.measures.recording import Measurer
from tsvision.records import Camera, Frame, FrameRow, Rig, Strings, View

CASE = Case(
    strings=2,
    diameter_px=40.0,
    beta_deg=25.0,
    tilt_deg=4.0,
    phase_rad=0.7,
    handedness="Z",
    dark_on_bright=True,
    noise=0.01,
    light_deg=10.0,
    seed=5,
)


def picture(**changes: object) -> np.ndarray:
    """CASE with changes, (540, 960) uint8."""
    return draw(replace(CASE, **changes))  # type: ignore[arg-type]


def measure(pixels: np.ndarray, strings: int = 2, mm_per_px: float = float("nan")) -> FrameRow:
    """One picture cold, as a recording of one frame."""
    rig = Rig(
        strings=Strings(count=strings),
        camera=Camera(mm_per_px=mm_per_px),
        view=View(separator_side="none"),
    )
    measurer = Measurer(rig)
    measurer.prime([pixels])
    return measurer.measure(Frame(0, "picture.png", pixels)).row
