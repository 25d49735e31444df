"""Two strings' legs tell how far off their bundle's edges lie, where light does not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from synth.build import make_settings
from synth.recording import write_recording
from synth.settings import Strings
from tsvision.images.frames import open_recording
from tsvision.measures import looks as looks_module
from tsvision.measures.edges.cut import Cut, cut_frame
from tsvision.measures.edges.shading import Shading
from tsvision.measures.ends.leg_gauge import gauge_from_legs
from tsvision.measures.helix.uncertainty import light_sd_px
from tsvision.measures.light import learnt as learnt_module
from tsvision.measures.light.rounds import EdgeLook
from tsvision.measures.light.settle import settle
from tsvision.measures.light.witness import Witness, heard
from tsvision.measures.looks import Looks, learn_looks
from tsvision.measures.recording import sample_pictures
from tsvision.measures.scale import resolve_scale
from tsvision.records import Rig
from tsvision.rig import load_rig

STRAND_MM = 0.24
NEARLY_PX = 0.35  # seen: 0.01; 0.27 on front-lit strands


def film(folder: Path, count: int) -> tuple[list[np.ndarray], Rig]:
    settings = make_settings(
        (5.0, 9.0, 13.0) if count == 2 else (4.0, 6.0, 8.0),
        look="dark_on_bright",
        strings=Strings(count=count),
        changes={"camera.width_px": 1280, "camera.height_px": 480},
    )
    path = write_recording(folder / "film", settings)
    rig = load_rig(path / "rig.toml", {})
    return sample_pictures(open_recording(path, rig), 8), rig


def learnt(pictures: list[np.ndarray], rig: Rig) -> Looks:
    looks = learn_looks(pictures, rig, resolve_scale(rig))
    assert looks is not None
    return looks


def off_by(shading: tuple[Shading, Shading], px: float) -> tuple[Shading, Shading]:
    """Edges that make a width so much larger, and light that is not sure of it."""
    upper, lower = (replace(s, beyond_px=s.beyond_px + 0.5 * px, place_sd_px=3.0) for s in shading)
    return upper, lower


def asked(
    pictures: list[np.ndarray], looks: Looks, shading: tuple[Shading, Shading]
) -> Witness | None:
    strand_px = STRAND_MM / looks.scale.mm_per_px
    pairs: list[tuple[np.ndarray, Cut]] = []
    for picture in pictures:
        cut = cut_frame(picture, looks.sight, strand_px, looks.half_px)
        assert cut is not None
        pairs.append((picture, cut))
    assert looks.face is not None
    place = looks.zero_px, looks.ends.plate_px, looks.face.half_gap_px
    return gauge_from_legs(pairs, looks.sight, shading, *place, strand_px)


@pytest.fixture(scope="module")
def dark(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[np.ndarray], Looks]:
    pictures, rig = film(tmp_path_factory.mktemp("dark"), 2)
    return pictures, learnt(pictures, rig)


@pytest.mark.parametrize("px", [-2.5, 0.0, 1.5])
def test_a_leg_is_as_much_too_wide_as_the_edges_make_it(
    dark: tuple[list[np.ndarray], Looks], px: float
) -> None:
    pictures, looks = dark
    gauge = asked(pictures, looks, off_by(looks.shading, px))
    assert gauge is not None
    assert abs(gauge.wide_px - px) < NEARLY_PX
    assert NEARLY_PX < 2.0 * gauge.sd_px < 1.5


def test_of_dark_legs_that_gleam_less_than_half_is_seen(
    dark: tuple[list[np.ndarray], Looks],
) -> None:
    pictures, looks = dark
    px = -0.55 * STRAND_MM / looks.scale.mm_per_px
    gauge = asked(pictures, looks, off_by(looks.shading, px))
    assert gauge is not None
    assert abs(gauge.wide_px - px) < 2.0 * gauge.sd_px < 0.5 * abs(px)


def test_legs_as_thin_as_their_blur_tell_nothing(dark: tuple[list[np.ndarray], Looks]) -> None:
    pictures, looks = dark
    upper, lower = (replace(s, blur_px=3.0) for s in looks.shading)
    assert asked(pictures, looks, (upper, lower)) is None


def test_where_no_legs_are_nothing_is_told(dark: tuple[list[np.ndarray], Looks]) -> None:
    pictures, looks = dark
    assert asked([pictures[0][:, ::-1]], looks, looks.shading) is None


def test_either_counts_as_it_is_sure(dark: tuple[list[np.ndarray], Looks]) -> None:
    _, looks = dark
    unsure = off_by(looks.shading, -2.5)
    told, wider = heard(unsure, Witness(-2.5, 0.5))
    assert 2.3 < wider < 2.5
    assert sum(s.beyond_px for s in told) - sum(s.beyond_px for s in unsure) == pytest.approx(wider)
    assert 0.4 < light_sd_px(told) < 0.5
    _, hardly = heard(looks.shading, Witness(-2.5, 5.0))
    assert 0.0 < hardly < 0.05


@pytest.mark.parametrize(
    ("count", "corrected"), [(2, True), pytest.param(4, False, marks=pytest.mark.slow)]
)
def test_a_width_that_light_leaves_open_is_told_by_the_legs_of_two_strings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, count: int, corrected: bool
) -> None:
    """Learning that takes the lit part of the strands for all of them, 3 px too narrow, and is not
    sure of it."""

    def too_narrow(*given: object) -> EdgeLook:
        found = settle(*given)  # type: ignore[arg-type]
        narrow = found.diameter_px - 3.0
        return replace(found, shading=off_by(found.shading, -3.0), diameter_px=narrow)

    pictures, rig = film(tmp_path, count)
    right = learnt(pictures, rig).diameter_px
    monkeypatch.setattr(learnt_module, "settle", too_narrow)
    seen = learnt(pictures, rig)
    assert abs(seen.diameter_px - right + (0.0 if corrected else 3.0)) < 0.6
    assert (light_sd_px(seen.shading) < 1.0) == corrected


def test_what_light_tells_is_left_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def never(*given: object) -> None:
        raise AssertionError("the legs were asked")

    monkeypatch.setattr(looks_module, "gauge_from_legs", never)
    learnt(*film(tmp_path, 2))
