"""Short films of the own renderer, stored as a camera does, and what is measured of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from synth.build import make_settings
from synth.recording import write_recording
from synth.settings import Settings, Strings
from tsvision.images.frames import open_recording
from tsvision.measures.recording import Measurer, sample_pictures
from tsvision.records import Frame, FrameRow
from tsvision.rig import load_rig

STORED: dict[str, object] = {
    "camera.width_px": 960,
    "camera.height_px": 400,
    "sensor.format": "jpg",
    "sensor.quality": 85,
    "sensor.grey": False,
}


def film_of(count: int, look: str, changes: dict[str, object]) -> Settings:
    """Three frames as a camera stores them, colour at half the resolution."""
    strings = Strings(count=count)
    return make_settings((5.0, 7.0, 9.0), look=look, strings=strings, changes=STORED | changes)


def measured_rows(folder: Path, settings: Settings) -> tuple[Measurer, list[FrameRow], np.ndarray]:
    """What was learnt of a film, its frames' rows, and the true D of each, px."""
    write_recording(folder, settings)
    recording = open_recording(folder, load_rig(folder / "rig.toml"))
    pictures = sample_pictures(recording, len(recording.files))
    measurer = Measurer(recording.rig)
    measurer.prime(pictures)
    rows = [
        measurer.measure(Frame(i, "", picture), float(turns)).row
        for i, (picture, turns) in enumerate(zip(pictures, recording.turns, strict=True))
    ]
    return measurer, rows, pd.read_parquet(folder / "truth.parquet")["diameter_px"].to_numpy()


def measured(folder: Path, settings: Settings) -> tuple[Measurer, np.ndarray, np.ndarray]:
    """What was learnt, D less its true value, and how sure of it each frame is; px."""
    measurer, rows, truth = measured_rows(folder, settings)
    d_px, sd_px = np.array([(row.diameter_px, row.diameter_px_sd) for row in rows]).T
    return measurer, d_px - truth, sd_px
