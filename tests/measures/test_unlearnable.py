"""Pictures from which nothing can be learnt: no exception, no number."""

from __future__ import annotations

import numpy as np
import pytest

from synth.build import make_settings
from synth.recording import write_recording
from tests.measures import pictures
from tsvision.errors import InputError
from tsvision.flags import Flag, flags_from_text
from tsvision.images.frames import iter_frames, open_recording
from tsvision.measures.recording import Measurer
from tsvision.records import Camera, Frame, FrameRow, Recording, Rig, Strings, View
from tsvision.rig import load_rig

TOLD = Rig(strings=Strings(count=2, diameter_mm=0.24), camera=Camera(mm_per_px=0.03))


def noise_like(pixels: np.ndarray) -> np.ndarray:
    return np.random.default_rng(0).integers(80, 120, pixels.shape).astype(np.uint8)


@pytest.mark.parametrize("rig", [Rig(), TOLD])
@pytest.mark.parametrize("shape", [(1, 640), (640, 1), (1, 1), (7, 7), (16, 16), (60, 40)])
@pytest.mark.parametrize("count", [1, 5])
def test_tiny_and_empty_pictures(shape: tuple[int, int], count: int, rig: Rig) -> None:
    random = np.random.default_rng(2)
    line = np.full(shape, 20, np.uint8)
    line[:, shape[1] // 2] = 255
    noise = random.integers(0, 256, shape, dtype=np.uint8)
    for picture in (np.zeros(shape, np.uint8), np.full(shape, 255, np.uint8), line, noise):
        for pixels in (picture, np.dstack([picture] * 3)):
            measurer = Measurer(rig)
            measurer.prime([pixels] * count)
            measurer.measure(Frame(0, "picture.png", pixels), 3.0)
            if min(shape) < 24:
                assert measurer.looks is None and measurer.bowed is None


@pytest.mark.parametrize("first", ["blank", "noise"])
def test_first_frames_without_a_bundle_do_not_blind_a_live_measurer(first: str) -> None:
    """A lamp that is not lit yet, a hand before the lens: the frames after them are measured."""
    pixels = pictures.picture()
    before = noise_like(pixels) if first == "noise" else np.full_like(pixels, 90)
    measurer = Measurer(Rig(strings=Strings(count=2), view=View(separator_side="none")))
    nothing = flags_from_text(measurer.measure(Frame(0, "a.png", before)).row.flags)
    assert nothing & (Flag.BLANK | Flag.NO_BUNDLE)
    row = measurer.measure(Frame(1, "b.png", pixels)).row
    assert row.diameter_px == pytest.approx(pictures.CASE.diameter_px, abs=0.4)


def test_what_a_film_does_not_teach_is_not_sought_frame_by_frame() -> None:
    """Chunks of a recording are measured by what all of it shows."""
    pixels = pictures.picture()
    measurer = Measurer(Rig(strings=Strings(count=2), view=View(separator_side="none")))
    measurer.prime([noise_like(pixels)])
    measurer.measure(Frame(0, "a.png", pixels))
    assert measurer.looks is None


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    size: dict[str, object] = {"camera.width_px": 960, "camera.height_px": 400}
    folder = tmp_path_factory.mktemp("film") / "film"
    write_recording(folder, make_settings((0.0, 0.1, 6.0, 12.0, 18.0), changes=size))
    return open_recording(folder, load_rig(folder / "rig.toml"))


def test_untwisted_legs_have_no_diameter(film: Recording) -> None:
    """Two straight legs are no bundle, whether the looks come from the film or from them alone."""
    frames = list(iter_frames(film))
    pictures = [f.pixels for f in frames if f.pixels is not None]
    for primed in (pictures, pictures[:1]):
        measurer = Measurer(film.rig)
        measurer.prime(primed)
        for frame in frames[:2]:
            row = measurer.measure(frame, float(film.turns[frame.index])).row
            assert flags_from_text(row.flags) & (Flag.TOO_FEW_TURNS | Flag.NO_BUNDLE)
            assert np.isnan(row.diameter_px) and np.isnan(row.pitch_px)


def test_one_leg_is_no_bundle_where_the_string_is_known(film: Recording) -> None:
    """Nobody tells of the turns: the leg is half as wide as two strands side by side."""
    first = next(iter_frames(film))
    assert first.pixels is not None
    measurer = Measurer(film.rig)
    measurer.prime([first.pixels])
    assert measurer.looks is None
    assert np.isnan(measurer.measure(first).row.pitch_px)


def row_in_region(roi_px: tuple[int, int, int, int]) -> FrameRow:
    view = View(separator_side="none", roi_px=roi_px)
    measurer = Measurer(Rig(strings=Strings(count=2), view=view))
    pixels = pictures.picture()[170:370, 280:680]
    measurer.prime([pixels])
    return measurer.measure(Frame(0, "a.png", pixels)).row


@pytest.mark.parametrize("roi_px", [(0, 0, 800, 400), (0, 0, 99999, 99999)])
def test_a_region_larger_than_the_picture_is_the_picture(roi_px: tuple[int, int, int, int]) -> None:
    """Uncut, the first gave another diameter and the second ran for minutes."""
    assert str(row_in_region(roi_px)) == str(row_in_region((0, 0, 400, 200)))


@pytest.mark.parametrize("roi_px", [(5000, 5000, 10, 10), (393, 0, 400, 400)])
def test_a_region_outside_the_picture_is_refused(roi_px: tuple[int, int, int, int]) -> None:
    with pytest.raises(InputError, match=r"view\.roi_px lies outside the 400 x 200 px picture"):
        row_in_region(roi_px)


def test_a_frame_without_a_bundle_says_what_else_is_not_known() -> None:
    pixels = pictures.picture()
    measurer = Measurer(Rig(strings=Strings(count=2), view=View(separator_side="none")))
    measurer.prime([pixels])
    assert measurer.looks is not None
    few = flags_from_text(measurer.measure(Frame(0, "a.png", pixels), 0.1).row.flags)
    whole = flags_from_text(measurer.measure(Frame(1, "b.png", pixels), 20.0).row.flags)
    of_recording = Flag.NO_SEPARATOR | Flag.NO_CONNECTOR | Flag.NO_SCALE
    assert Flag.TOO_FEW_TURNS in few
    assert few & of_recording == whole & of_recording == of_recording


@pytest.mark.parametrize(("strand_px", "is_bundle"), [(6.0, False), (20.0, True), (40.0, False)])
def test_what_the_stated_strands_cannot_make_is_no_bundle(
    strand_px: float, is_bundle: bool
) -> None:
    """Two strands of 20 px make the 40 px in view; a plate or a leg is no bundle of theirs."""
    measurer = Measurer(
        Rig(
            strings=Strings(count=2, diameter_mm=0.01 * strand_px),
            camera=Camera(mm_per_px=0.01),
            view=View(separator_side="none"),
        )
    )
    pixels = pictures.picture()
    measurer.prime([pixels])
    row = measurer.measure(Frame(0, "a.png", pixels)).row
    assert (Flag.NO_BUNDLE in flags_from_text(row.flags)) != is_bundle
    assert np.isfinite(row.diameter_mm) == is_bundle
    assert not is_bundle or row.diameter_mm == pytest.approx(0.4, rel=0.02)
