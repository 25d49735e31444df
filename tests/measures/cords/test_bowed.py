"""Cords that bow: drawn ones of known diameter, repeat and sense, hairy, coloured, with shadows."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.bench.pictures48_draw import cases, draw
from tests.measures.cord import BLUE, RED, TABLE, bow, draw_cord
from tsvision.flags import Flag, flags_from_text
from tsvision.images.signal import LUMA
from tsvision.images.strip import straight_axis
from tsvision.measures.cords import rope
from tsvision.measures.cords.bowed import _agrees, _knots, learn_bowed
from tsvision.measures.cords.rope import Rope, measure_rope
from tsvision.measures.looks import learn_looks
from tsvision.measures.recording import Measurer
from tsvision.records import Camera, Frame, FrameResult, FrameRow, Rig, Scale, Strings, View

CURVE = bow(620, 90.0, 130.0)
LENGTH_PX = float(np.linalg.norm(np.diff(CURVE, axis=0), axis=1).sum()) * 620 / 660
# The rope's D is read where the brightness falls most steeply, inside the darkening limb: on
# these cords of 32 px that was 0.5 to 1.1 px low (as is the helix fit there).
D_TOLERANCE_PX = 1.5


def measured(picture: np.ndarray, **rig: Any) -> FrameResult:
    return Measurer(Rig(**rig)).measure(Frame(0, "a.png", picture))


@cache
def three_ply(hand: str, hairs: int = 0) -> np.ndarray:
    return draw_cord(CURVE, 3, 32.0, 36.0, hand, hairs=hairs)


@cache
def two_colours() -> np.ndarray:
    return draw_cord(CURVE, 2, 32.0, 44.0, "S", (RED, BLUE), TABLE, shadow=True)


def test_a_bowed_cord_is_followed_and_flagged() -> None:
    result = measured(three_ply("Z"))
    flags = flags_from_text(result.row.flags)
    assert Flag.CURVED_AXIS in flags
    assert Flag.ENVELOPE_ONLY in flags  # nobody told N
    assert result.row.diameter_px == pytest.approx(32.0, abs=D_TOLERANCE_PX)
    assert result.row.strand_repeat_px == pytest.approx(36.0, rel=0.01)
    assert result.row.knot_count == 0
    assert result.profile is not None
    assert np.nanmax(result.profile.s_px) == pytest.approx(LENGTH_PX, rel=0.03)


@pytest.mark.slow
def test_the_mirrored_picture_shows_the_other_sense() -> None:
    assert measured(three_ply("Z")).row.handedness == "Z"
    assert measured(three_ply("S")).row.handedness == "S"
    assert measured(np.ascontiguousarray(three_ply("Z")[:, ::-1])).row.handedness == "S"
    assert measured(np.ascontiguousarray(np.rot90(three_ply("Z")))).row.handedness == "Z"


@pytest.mark.parametrize("coloured", [False, True])
def test_a_rope_whose_edges_are_seen_here_and_there_is_none(
    coloured: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every twelfth column shows an edge: enough of them, but in no window a third."""
    pixels = np.full((120, 1500), 60, np.uint8)
    pixels[50:70] = 180
    pixels = np.dstack([pixels] * 3) if coloured else pixels
    axis = straight_axis((0.0, 59.5), (1499.0, 59.5))
    curve: Any = SimpleNamespace(axis=axis, start_px=0.0, end_px=1499.0, width_px=20.0, ground=None)
    sight: Any = SimpleNamespace(gamma=1.0, signal=LUMA)

    def scattered(contrast: np.ndarray, *_: object) -> tuple[np.ndarray, np.ndarray]:
        columns = contrast.shape[1]
        return np.full(columns, 10.0), (np.arange(columns) % 12 == 0).astype(float)

    assert measure_rope(pixels, curve, sight) is not None
    monkeypatch.setattr(rope, "_edge", scattered)
    assert measure_rope(pixels, curve, sight) is None


def test_a_picture_without_the_cord_says_what_else_is_not_known() -> None:
    measurer = Measurer(Rig())
    measurer.prime([three_ply("Z")])
    noise = np.random.default_rng(3).integers(18, 26, three_ply("Z").shape).astype(np.uint8)
    row = measurer.measure(Frame(0, "a.png", noise)).row
    flags = flags_from_text(row.flags)
    assert Flag.NO_BUNDLE in flags and np.isnan(row.diameter_px)
    lacking = Flag.NO_SCALE | Flag.NO_TURNS | Flag.NO_SEPARATOR | Flag.CURVED_AXIS
    assert flags & lacking == lacking and np.isfinite(row.axis_x0_px)


@pytest.mark.slow
def test_hairs_are_not_the_edge() -> None:
    clean, hairy = measured(three_ply("Z")).row, measured(three_ply("Z", 150)).row
    assert Flag.FIBRES in flags_from_text(hairy.flags)
    assert hairy.diameter_px == pytest.approx(clean.diameter_px, rel=0.02)
    assert hairy.strand_repeat_px == pytest.approx(36.0, rel=0.02)


def test_length_along_the_curve_gives_the_scale() -> None:
    one, two = (
        measured(three_ply("Z"), camera=Camera(scale_from="length", length_mm=mm)).row
        for mm in (100.0, 200.0)
    )
    # The picture cuts the cord off obliquely, hence the 2 %.
    assert one.mm_per_px == pytest.approx(100.0 / LENGTH_PX, rel=0.02)
    assert two.diameter_mm == pytest.approx(2.0 * one.diameter_mm)
    relative = np.hypot(one.diameter_px_sd / one.diameter_px, one.mm_per_px_sd / one.mm_per_px)
    assert one.diameter_mm_sd == pytest.approx(one.diameter_mm * relative)
    assert one.mm_per_px_sd > 0.01 * one.mm_per_px
    assert Flag.NO_SCALE not in flags_from_text(one.flags)


@pytest.mark.slow
def test_two_coloured_plies_beside_their_shadow() -> None:
    row = measured(two_colours()).row
    assert row.handedness == "S"
    assert row.strand_repeat_px == pytest.approx(44.0, rel=0.02)
    # Edges in colour come out low (2 px here), which their uncertainty says.
    assert row.diameter_px == pytest.approx(32.0, abs=2.0 * row.diameter_px_sd)
    assert row.diameter_px_sd < 2.0


def test_with_n_known_the_helix_is_fitted_along_the_curve() -> None:
    picture = draw_cord(CURVE, 2, 32.0, 50.0, "Z")
    row = measured(picture, strings=Strings(count=2)).row
    assert Flag.ENVELOPE_ONLY not in flags_from_text(row.flags)
    assert Flag.CURVED_AXIS in flags_from_text(row.flags)
    assert row.diameter_px == pytest.approx(32.0, abs=D_TOLERANCE_PX)
    assert row.pitch_px == pytest.approx(100.0, rel=0.01)
    assert np.degrees(row.helix_angle_rad) == pytest.approx(
        np.degrees(np.arctan(np.pi * 32.0 / 100.0)), abs=1.5
    )


@pytest.mark.parametrize(
    ("sd_px", "count_known", "agrees"),
    [
        (0.8, False, True),
        (25.5, False, False),
        (25.5, True, True),
    ],
)
def test_a_helix_of_a_guessed_n_has_to_know_d_as_well_as_the_rope(
    sd_px: float, count_known: bool, agrees: bool
) -> None:
    """Four colours plied: one picture of twelve that differed by a mirror or a scale was measured
    as four strands of a guessed section, 105 +- 25 px, and no sense told, the others by their
    outline, 96.5 +- 5.5."""
    s, nothing = np.arange(9.0), np.full(9, np.nan)
    shown = Rope(s, nothing, nothing, nothing, nothing, 96.5, 5.5, None, np.nan, 0.0)
    row = FrameRow(
        frame=0,
        file="a.png",
        diameter_px=104.0,
        diameter_px_sd=sd_px,
        fit_rms_px=1.0,
        strand_repeat_px=50.0,
    )
    assert _agrees(row, shown, count_known) is agrees


def test_the_profile_holds_the_curve_in_the_picture() -> None:
    """Points of the axis lie on the cord that was drawn, not on its chord."""
    profile = measured(three_ply("Z")).profile
    assert profile is not None and profile.axis_x_px is not None
    found = np.stack([profile.axis_x_px, profile.axis_y_px], 1)
    drawn = CURVE
    off = [np.hypot(*(drawn - point).T).min() for point in found[::20]]
    assert np.max(off) < 3.0
    chord = found[-1] - found[0]
    across = np.array([-chord[1], chord[0]]) / np.hypot(*chord)
    assert np.ptp((found - found[0]) @ across) > 20.0


def test_a_straight_bundle_keeps_its_looks_untouched() -> None:
    straight = np.stack([np.full(50, 180.0), np.linspace(-20, 640, 50)], axis=1)
    picture = draw_cord(straight, 2, 32.0, 50.0)
    rig = Rig(strings=Strings(count=2))
    looks = learn_looks([picture], rig, Scale())
    assert looks is not None
    bowed, same = learn_bowed([picture], looks, rig, Scale())
    assert bowed is None
    assert same is looks


@pytest.mark.parametrize("count", [2, pytest.param(None, marks=pytest.mark.slow)])
def test_a_strand_of_a_straight_bundle_is_no_cord_that_winds(count: int | None) -> None:
    """Two thick strands lit from 40 degrees: the brighter one was followed along its winds, and
    16.6 px told of a bundle of 55."""
    case = replace(cases(2)[19], light_deg=40.0)
    measurer = Measurer(Rig(strings=Strings(count=count), view=View(separator_side="none")))
    picture = draw(case)
    measurer.prime([picture])
    row = measurer.measure(Frame(0, "picture.png", picture)).row
    assert Flag.CURVED_AXIS not in flags_from_text(row.flags)
    assert row.diameter_px == pytest.approx(case.diameter_px, abs=0.4)


@pytest.mark.parametrize("scale", [0.02, float("nan")])
def test_a_knot_of_a_cord_is_told_in_px_and_in_mm_only_with_a_scale(scale: float) -> None:
    s_px = np.arange(100.0, 900.0)
    envelope = np.where(np.abs(s_px - 500.0) <= 40.0, 36.0, 20.0)
    rope = SimpleNamespace(s_px=s_px, envelope_px=envelope, diameter_px=20.0, diameter_px_sd=0.2)
    axis = straight_axis(np.array([0.0, 60.0]), np.array([999.0, 60.0]))
    bowed = SimpleNamespace(
        curve=SimpleNamespace(axis=axis, start_px=100.0, end_px=900.0),
        scale=Scale(scale, 0.01 * scale),
    )
    (knot,) = _knots(bowed, rope)
    in_px = (knot.centre_px, knot.length_px, knot.max_diameter_px)
    assert in_px == pytest.approx((400.0, 80.0, 36.0), abs=1e-6)
    in_mm = (knot.centre_mm, knot.length_mm, knot.max_diameter_mm)
    assert in_mm == pytest.approx(tuple(scale * px for px in in_px), nan_ok=True)
