"""Where the strings end: the plate's face and the connector's, on rendered films with truth.

N = 6 is the case that the spigot spoils: it is as wide as the bundle, and the body behind it,
1.1 mm further, is the first thing that is wider.
"""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from synth.build import make_settings
from synth.recording import write_recording
from synth.settings import Strings
from tests.srgb import encode
from tsvision.images.frames import open_recording
from tsvision.images.linear import to_linear
from tsvision.images.sight import Sight
from tsvision.images.signal import LUMA
from tsvision.images.strip import straight_axis
from tsvision.measures.edges.cut import Cut, cut_frame
from tsvision.measures.ends import legs
from tsvision.measures.ends.ends import Ends, _ends_of_motion, _pair, _still_outline, find_ends
from tsvision.measures.ends.legs import Face, apex_from_legs, face_from_legs
from tsvision.measures.looks import Looks, learn_looks
from tsvision.measures.recording import sample_pictures
from tsvision.measures.scale import resolve_scale
from tsvision.measures.zone.budgets import connector_px
from tsvision.rig import load_rig

NAN = float("nan")
SIZE: dict[str, object] = {"camera.width_px": 960, "camera.height_px": 400}


class Film:
    """A rendered film, what was learnt of it, and where its ends truly are (s in px)."""

    def __init__(self, folder: Path, preset: str, look: str, seed: int) -> None:
        turns = (0.0, 3.0, 5.0, 7.0, 9.0, 14.0)
        strings = Strings(count=6)
        settings = make_settings(turns, preset, seed, look=look, strings=strings, changes=SIZE)
        write_recording(folder, settings)
        rig = load_rig(folder / "rig.toml")
        self.pictures = sample_pictures(open_recording(folder, rig), 8)
        found = learn_looks(self.pictures, rig, resolve_scale(rig))
        assert found is not None
        self.looks: Looks = found
        self.truth = pd.read_parquet(folder / "truth.parquet")
        truth = self.truth.iloc[-1]
        self.mm_per_px = float(truth["mm_per_px"])
        axis = found.sight.axis
        u, origin = axis.tangent(np.array(0.0)), axis.at(np.array(0.0))
        self.separator_px, self.connector_px = (
            float((np.array([truth[f"axis_x{i}_px"], truth[f"axis_y{i}_px"]]) - origin) @ u)
            for i in (0, 1)
        )


@pytest.fixture(scope="module")
def clean(tmp_path_factory: pytest.TempPathFactory) -> Film:
    return Film(tmp_path_factory.mktemp("clean") / "film", "clean", "bright_on_dark", 1)


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Film:
    return Film(tmp_path_factory.mktemp("bench") / "film", "bench", "dark_on_bright", 3)


@pytest.mark.parametrize("name", ["clean", "bench"])
def test_both_ends(name: str, request: pytest.FixtureRequest) -> None:
    """Measured: within 0.03 mm (clean) and 0.08 mm; 1.1 mm when the body was taken for the face."""
    film: Film = request.getfixturevalue(name)
    assert film.looks.zero_known
    separator = (film.looks.zero_px - film.separator_px) * film.mm_per_px
    connector = (film.looks.ends.connector_px - film.connector_px) * film.mm_per_px
    assert abs(separator) < 0.15 and abs(connector) < 0.15


@pytest.mark.parametrize("name", ["clean", "bench"])
def test_ends_without_any_length_told(name: str, request: pytest.FixtureRequest) -> None:
    film: Film = request.getfixturevalue(name)
    ends = find_ends(film.pictures, [], film.looks.sight)
    assert abs(ends.plate_px - film.separator_px) * film.mm_per_px < 0.2
    assert abs(ends.connector_px - film.connector_px) * film.mm_per_px < 0.5


def test_one_picture_and_its_length(bench: Film) -> None:
    """Nothing moves in one picture: the plate is seen, and L tells of the connector."""
    ends = find_ends(bench.pictures[3:4], [], bench.looks.sight, bench.looks.zone_px)
    assert abs(ends.plate_px - bench.separator_px) * bench.mm_per_px < 0.2
    assert abs(ends.connector_px - bench.connector_px) * bench.mm_per_px < 0.4


def test_a_clear_end_outweighs_a_scale_that_is_a_little_off() -> None:
    """Both edges of the plate's block and, dimly, a spot on the way: 3 % short of L by the scale
    lie the front edge and the face, 2 % beyond it the back edge and the spot."""
    faces = {879.0: 13.2, 871.0: 9.8, 847.0: 3.3, 860.0: 4.4}
    assert _pair([83.5, 153.5], faces, 748.8, NAN) == (153.5, 879.0)


def test_burnt_out_metal_is_no_clearer_an_end_than_a_glittering_spigot() -> None:
    """Nothing at all moves before the burnt-out body, so it shows a hundred times less motion than
    the spigot before it; L says the spigot."""
    rng = np.random.default_rng(5)
    strips = np.zeros((6, 61, 1200, 1))
    spigot, body = 1000, 1030
    strips[:, 20:41, :spigot] = rng.normal(0.4, 0.1, (6, 21, spigot, 1))
    strips[:, 20:41, spigot:body] = rng.normal(0.8, 0.012, (6, 21, body - spigot, 1))
    strips[:, :, body:] = 1.0
    found = _ends_of_motion(strips, 500.0, 20.0)
    assert any(abs(s - body) < 4 for s in found)
    plate, connector = _pair([20.0], found, 988.0, NAN)
    assert plate == 20.0 and connector == pytest.approx(spigot, abs=4)


def test_a_spigot_that_glitters_as_strings_move_stands_still_in_outline() -> None:
    """Polished metal mirrors the strings: motion went on to the body behind it, and the spigot was
    a knot in every frame (`wild 653`). A coil as wide is elsewhere in the next frame."""
    s_px, spigot = np.arange(900.0), 700
    cuts = []
    for phase in np.linspace(0.0, 2.0, 5):
        half = 9.0 + np.round(3.0 * np.sin(0.2 * s_px + phase))
        swing = np.round(8.0 * np.sin(0.05 * s_px + 2.0 * phase)) * (s_px > 300) * (s_px < 600)
        half[spigot:] = 22.0
        outline = SimpleNamespace(low=swing - half, high=swing + half)
        cuts.append(SimpleNamespace(s_px=s_px, silhouette=outline))
    assert _still_outline(cuts, 20.0, 450.0) == spigot
    assert np.isnan(_still_outline(cuts, 32.0, 450.0))  # no wider than the bundle may be
    assert np.isnan(_still_outline(cuts[:1], 20.0, 450.0))


def test_what_lies_close_behind_the_apex_is_no_connector() -> None:
    """The plate out of view, the legs in view: motion ends where the picture does."""
    assert np.isnan(_pair([], {600.0: 1.0}, 2600.0, 250.0)[1])
    assert _pair([], {2400.0: 1.0}, 2600.0, 250.0)[1] == 2400.0
    assert _pair([], {600.0: 1.0}, 2600.0, NAN)[1] == 600.0


def test_a_plate_seen_aside_lies_between_its_edges() -> None:
    """A block's front and back edge show 3 % of L apart under a yaw of 2 degrees."""
    picture = np.full((400, 1000), 60, np.uint8)
    picture[:, :70] = 150
    picture[:, 70:99] = 100
    picture[190:210, 99:] = 220
    sight = Sight(
        axis=straight_axis((0.0, 199.5), (999.0, 199.5)),
        signal=LUMA,
        sense=1,
        width_px=20.0,
        start_px=99.0,
        end_px=999.0,
        connector_px=NAN,
        legs_seen=True,
        separation=5.0,
        gamma=2.2,
    )
    ends = find_ends([picture], [], sight, 900.0)
    assert ends.plate_px == pytest.approx(84.0, abs=3.0)


def test_nothing_there_gives_no_ends(clean: Film) -> None:
    grey = [np.full((400, 960), 90, np.uint8)] * 5
    ends = find_ends(grey, [], clean.looks.sight)
    assert np.isnan(ends.plate_px) and np.isnan(ends.connector_px)


def pairs_of(film: Film) -> list[tuple[np.ndarray, Cut]]:
    looks = film.looks
    strand_px = looks.diameter_px / looks.section.diameter_d
    cuts = [(p, cut_frame(p, looks.sight, strand_px, looks.half_px)) for p in film.pictures]
    return [(p, c) for p, c in cuts if c is not None]


def from_legs(film: Film, off_px: float, plate_px: float = NAN) -> Face | None:
    looks, pairs = film.looks, pairs_of(film)
    half_gap = 0.5 * looks.hole_distance_mm / film.mm_per_px
    return face_from_legs(
        pairs, looks.sight, film.separator_px + off_px, plate_px, half_gap, film.mm_per_px
    )


@pytest.mark.parametrize("name", ["clean", "bench"])
@pytest.mark.parametrize("off_mm", [-0.5, 0.0, 0.5])
def test_legs_tell_where_they_leave_the_plate(
    name: str, off_mm: float, request: pytest.FixtureRequest
) -> None:
    """Whatever the plate seemed to tell."""
    film: Film = request.getfixturevalue(name)
    face = from_legs(film, off_mm / film.mm_per_px)
    assert face is not None and face.sd_px * film.mm_per_px < 0.2
    assert abs(face.s_px - film.separator_px) * film.mm_per_px < 0.1


def fainter_on_one_side(film: Film, share: float) -> list[np.ndarray]:
    """The film's pictures with so much of their light left on one side of the axis."""
    axis = film.looks.sight.axis
    u, origin = axis.tangent(np.array(0.0)), axis.at(np.array(0.0))
    rows, columns = np.mgrid[0 : film.pictures[0].shape[0], 0 : film.pictures[0].shape[1]]
    upper = (rows - origin[1]) * u[0] - (columns - origin[0]) * u[1] > 0.0
    pictures = []
    for picture in film.pictures:
        light = to_linear(picture, NAN)
        ground = np.median(light)
        pictures.append(encode(np.where(upper, ground + share * (light - ground), light)))
    return pictures


def test_a_leg_of_a_fainter_colour_is_seen(clean: Film) -> None:
    """White beside green strands, each leg of one: the green ones were not seen, and the apex was
    where the outline closes, 2.8 mm off (`wild 530`)."""
    looks, half_gap = clean.looks, 0.5 * clean.looks.hole_distance_mm / clean.mm_per_px
    cuts = [cut for _, cut in pairs_of(clean)]
    pairs = list(zip(fainter_on_one_side(clean, 0.3)[-len(cuts) :], cuts, strict=True))
    face = face_from_legs(pairs, looks.sight, clean.separator_px, NAN, half_gap, clean.mm_per_px)
    assert face is not None
    assert abs(face.s_px - clean.separator_px) * clean.mm_per_px < 0.1
    found = apex_from_legs(*pairs[-1], looks.sight, face, looks.ends.plate_px)
    seen = (found - looks.zero_px) * clean.mm_per_px
    assert seen == pytest.approx(float(clean.truth["apex_mm"].iloc[-1]), abs=0.15)


def test_legs_behind_the_plate_tell_nothing(clean: Film) -> None:
    assert from_legs(clean, 0.0, plate_px=clean.looks.sight.end_px) is None


def test_one_picture_tells_the_exits_as_well_as_its_strings_lie_in_their_holes(clean: Film) -> None:
    """Its two lines are S apart at the exits, whatever else they tell: strings 0.08 mm off in S
    move these along the lines. Straight legs made that a tenth of it."""
    mm_per_px = clean.mm_per_px
    half_gap = 0.5 * clean.looks.hole_distance_mm / mm_per_px
    last = pairs_of(clean)[-1:]
    face = face_from_legs(last, clean.looks.sight, clean.separator_px, NAN, half_gap, mm_per_px)
    assert face is not None
    apex = apex_from_legs(*last[0], clean.looks.sight, face, NAN)
    slope = half_gap / (apex - face.s_px)
    assert face.sd_px == pytest.approx(legs.HOLE_SD_MM / mm_per_px / slope, rel=0.1)


def test_legs_that_hardly_tell_are_not_asked(clean: Film, monkeypatch: pytest.MonkeyPatch) -> None:
    """The limit is above what good pictures leave open, and holds for what is worse."""
    face = from_legs(clean, 0.0)
    assert face is not None
    monkeypatch.setattr(legs, "MOST_SD_MM", 0.9 * face.sd_px * clean.mm_per_px)
    assert from_legs(clean, 0.0) is None


def test_legs_cross_at_the_apex(clean: Film) -> None:
    """N = 6 at 14 turns: the outline closes before the middles of the legs cross."""
    looks = clean.looks
    assert looks.face is not None
    picture, cut = pairs_of(clean)[-1]
    found = apex_from_legs(picture, cut, looks.sight, looks.face, looks.ends.plate_px)
    seen = (found - looks.zero_px) * clean.mm_per_px
    assert seen == pytest.approx(float(clean.truth["apex_mm"].iloc[-1]), abs=0.15)


@pytest.mark.parametrize(
    ("seen_px", "legs_tell", "face_px"),
    [(1032.0, True, 1000.0), (1005.0, True, 1000.0), (940.0, True, 940.0), (1032.0, False, 1032.0)],
)
def test_turns_are_counted_to_where_the_legs_put_the_face(
    seen_px: float, legs_tell: bool, face_px: float
) -> None:
    """A spigot that glitters as it turns: motion goes on to the body, 4 % of L beyond the face."""
    looks = SimpleNamespace(
        ends=Ends(seen_px, 258.0),
        zero_px=253.0,
        zone_px=747.0,
        face=Face(253.0, 1.0, 80.0, 0.0) if legs_tell else None,
    )
    assert connector_px(looks) == face_px
