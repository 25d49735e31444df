"""The noise of a sensor tells whether files hold its light or the light as the eye sees it."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from synth.build import make_settings
from synth.recording import write_recording
from tests.srgb import encode
from tsvision.flags import Flag, flags_from_text
from tsvision.images.frames import open_recording
from tsvision.images.tone_curve import gamma_of
from tsvision.measures.recording import measure_frames
from tsvision.records import FrameRow, Recording
from tsvision.rig import load_rig

SIZE = (400, 600)


def scene(rng: np.random.Generator, blur_px: float = 0.8) -> np.ndarray:
    """Light from 0.02 to 0.6 of full, with a grain of a tenth, as a lens shows it."""
    levels = np.geomspace(0.02, 0.6, SIZE[1])[None, :]
    light = np.asarray(levels * (1.0 + 0.1 * rng.standard_normal(SIZE)))
    return cv2.GaussianBlur(light, (0, 0), blur_px)


def counted(light: np.ndarray, rng: np.random.Generator, electrons: float = 2000.0) -> np.ndarray:
    """Photons, each counted or not, and 8 electrons of reading out."""
    read = rng.normal(0.0, 8.0, light.shape)
    return np.clip((rng.poisson(electrons * light) + read) / electrons, 0.0, 1.0)


def stored(light: np.ndarray, gamma: float) -> np.ndarray:
    """As 8 bit; NaN: sRGB."""
    if np.isnan(gamma):
        return encode(light)
    return np.rint(255.0 * light ** (1.0 / gamma)).astype(np.uint8)


def pictures(gamma: float, count: int = 2, electrons: float = 2000.0) -> list[np.ndarray]:
    rng = np.random.default_rng(1)
    light = scene(rng)
    return [stored(counted(light, rng, electrons), gamma) for _ in range(count)]


@pytest.mark.parametrize("count", [1, 2])
def test_linear_light_is_told(count: int) -> None:
    assert gamma_of(pictures(1.0, count)) == 1.0


@pytest.mark.parametrize("bits", [12, 16])
def test_of_16_bit_of_which_a_sensor_may_fill_12(bits: int) -> None:
    rng = np.random.default_rng(2)
    fine = np.rint((2**bits - 1) * counted(scene(rng), rng)).astype(np.uint16)
    assert gamma_of([fine]) == 1.0


def test_of_colour() -> None:
    rng = np.random.default_rng(2)
    colour = np.dstack([stored(counted(scene(rng), rng), 1.0) for _ in range(3)])
    assert gamma_of([colour]) == 1.0


def test_files_for_the_eye_are_as_they_were() -> None:
    assert np.isnan(gamma_of(pictures(np.nan)))


def test_of_another_root() -> None:
    assert gamma_of(pictures(1.6, electrons=6000.0)) == pytest.approx(1.6, abs=0.25)


def test_noise_that_no_light_made_tells_nothing() -> None:
    """As much at every level, as it is added to pictures that were computed; or none at all."""
    rng = np.random.default_rng(3)
    light = scene(rng)
    assert np.isnan(gamma_of([stored(light, 1.0)]))
    code = 255.0 * light ** (1.0 / 2.2) + rng.normal(0.0, 3.0, SIZE)
    assert np.isnan(gamma_of([np.clip(np.rint(code), 0, 255).astype(np.uint8)]))


def test_coding_that_takes_the_noise_away_tells_nothing() -> None:
    through = []
    for picture in pictures(1.0):
        _, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 85])
        through.append(cv2.imdecode(data, cv2.IMREAD_GRAYSCALE))
    assert np.isnan(gamma_of(through))


def test_grain_as_sharp_as_the_pixels_is_not_taken_for_noise() -> None:
    """It grows with the light, as shot noise does, though as its square: a file for the eye."""
    rng = np.random.default_rng(4)
    light = scene(rng, blur_px=0.3)
    assert np.isnan(gamma_of([stored(counted(light, rng), np.nan)]))


@pytest.fixture(scope="module")
def linear_film(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """Bright strings on a dark ground by a camera that stores linear light."""
    folder = tmp_path_factory.mktemp("linear") / "film"
    changes = {
        "camera.width_px": 960, "camera.height_px": 400, "sensor.gamma": 1.0,
        "sensor.full_well_e": 3000.0,
    }  # fmt: skip
    write_recording(folder, make_settings((6.0, 9.0, 12.0), look="bright_on_dark", changes=changes))
    return open_recording(folder, load_rig(folder / "rig.toml"))


def rows(recording: Recording, gamma: float) -> list[FrameRow]:
    camera = replace(recording.rig.camera, gamma=gamma)
    told = replace(recording, rig=replace(recording.rig, camera=camera))
    return [result.row for result in measure_frames(told)]


@pytest.mark.slow
def test_a_film_of_linear_light_is_measured_as_if_told(linear_film: Recording) -> None:
    guessed, given = rows(linear_film, np.nan), rows(linear_film, 1.0)
    assert linear_film.rig.camera.gamma == 1.0  # what the renderer wrote beside it
    for row, told in zip(guessed, given, strict=True):
        assert row.diameter_px == told.diameter_px
        assert row.gamma == told.gamma == 1.0
        assert Flag.GAMMA_GUESSED in flags_from_text(row.flags)
        assert Flag.GAMMA_GUESSED not in flags_from_text(told.flags)
