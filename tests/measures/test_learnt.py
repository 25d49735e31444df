"""Edges of coloured strings: by their hue where nothing else tells them, by brightness where it
tells more."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from synth.build import make_settings
from synth.recording import write_recording
from synth.settings import Settings, Strings
from tsvision.images.frames import open_recording
from tsvision.images.signal import Way
from tsvision.measures.learnt import _tells_more
from tsvision.measures.recording import Measurer, sample_pictures
from tsvision.measures.settle import EdgeLook
from tsvision.measures.shading import plain_shading
from tsvision.records import Frame
from tsvision.rig import load_rig

RED, PALE_GREEN = (0.4, 0.04, 0.05), (0.36, 0.47, 0.39)


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


def measured(folder: Path, settings: Settings) -> tuple[Measurer, np.ndarray, np.ndarray]:
    """What was learnt, D less its true value, and how sure of it each frame is; px."""
    write_recording(folder, settings)
    recording = open_recording(folder, load_rig(folder / "rig.toml"))
    pictures = sample_pictures(recording, 3)
    measurer = Measurer(recording.rig)
    measurer.prime(pictures)
    rows = [
        measurer.measure(Frame(i, "", picture), float(turns)).row
        for i, (picture, turns) in enumerate(zip(pictures, recording.turns, strict=True))
    ]
    truth = pd.read_parquet(folder / "truth.parquet")["diameter_px"].to_numpy()
    d_px, sd_px = np.array([(row.diameter_px, row.diameter_px_sd) for row in rows]).T
    return measurer, d_px - truth, sd_px


@pytest.mark.parametrize("count", [2, 4])
def test_dark_red_strings_on_an_uneven_pale_ground(tmp_path: Path, count: int) -> None:
    """They are found by their hue, for the ground is too uneven, and measured by their brightness:
    within 0.06 px of 15 and 21, by their hue up to 1.8 px thick."""
    changes: dict[str, object] = {
        "look.strand_rgb": (RED,),
        "look.ground_rgb": PALE_GREEN,
        "look.ground_texture": 0.15,
    }
    settings = film_of(count, "front_lit", changes)
    measurer, error_px, sd_px = measured(tmp_path / "film", settings)
    assert measurer.looks is not None
    assert measurer.looks.sight.signal.way is Way.LUMA
    assert np.abs(error_px).max() < 0.15
    assert sd_px.max() < 0.3


def test_strings_as_bright_as_their_ground_keep_their_hue(tmp_path: Path) -> None:
    measurer, error_px, sd_px = measured(tmp_path / "film", film_of(4, "equal_luma", {}))
    assert measurer.looks is not None
    assert measurer.looks.sight.signal.in_colour
    assert (np.abs(error_px) < 1.96 * sd_px).all()


def look_of(place_sd_px: float, **told: float) -> EdgeLook:
    shade = replace(plain_shading(5.0, 1.0), place_sd_px=place_sd_px)
    fitted = {"frames": 6, "rms_px": 0.3, "matched": 0.98} | told
    return EdgeLook((shade, shade), 20.0, **fitted)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("bright", "more"),
    [
        (look_of(0.05), True),
        (look_of(0.25), False),  # hardly surer
        (look_of(0.05, rms_px=0.31), False),
        (look_of(0.05, frames=5), False),
        (look_of(0.05, matched=0.96), True),
        (look_of(0.05, matched=0.94), False),
        (look_of(0.05, rms_px=float("nan")), False),  # nothing was fitted
    ],
)
def test_brightness_has_to_tell_more_in_every_respect(bright: EdgeLook, more: bool) -> None:
    assert _tells_more(bright, look_of(0.35)) is more
