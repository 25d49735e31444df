"""Flags of a frame whose numbers fitted and yet are to be doubted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.measures.pictures import measure, picture
from tsvision.flags import Flag, flags_from_text
from tsvision.images.strip import straight_axis
from tsvision.measures import frame
from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.bundle import BundleFit
from tsvision.measures.helix.fit import HelixFit
from tsvision.measures.helix.section import pair_core
from tsvision.measures.helix.silhouette import KC, PARAMETERS, RC, RHO, K
from tsvision.measures.zone.doubts import (
    clipped,
    knots_unsure,
    less_sure_of_pitch,
)
from tsvision.records import FrameRow, KnotSighting

D = 30.0
SHAPE = (400, 600, 3)


def cord(length: float = 600.0) -> Edges:
    s = np.arange(length)
    wave = 0.5 * D - 3.0 * np.sin(0.1 * s) ** 2
    return Edges(s, wave, -wave, np.ones(s.size), np.ones(s.size))


def cut_at(edges: Edges, limit: float) -> Edges:
    """What is seen where the picture ends at n = limit."""
    return replace(edges, upper_px=np.minimum(edges.upper_px, limit))


@pytest.mark.parametrize(
    ("start", "end"),
    [
        ((0.0, 200.0), (599.0, 200.0)),  # out of the picture at both ends
        ((0.0, 40.0), (599.0, 385.0)),  # 30 degrees, out beside a corner
        ((300.0, 0.0), (300.0, 399.0)),
    ],
)
def test_a_bundle_may_go_on_beyond_the_view(
    start: tuple[float, float], end: tuple[float, float]
) -> None:
    axis = straight_axis(np.array(start), np.array(end))
    assert not clipped(cord(axis.length_px), axis, SHAPE, D)


def test_a_bundle_half_out_of_the_picture_is_clipped() -> None:
    axis = straight_axis(np.array([0.0, 394.0]), np.array([599.0, 394.0]))
    assert clipped(cut_at(cord(), 5.0), axis, SHAPE, D)


def test_one_limb_at_the_border_is_not_yet_clipped() -> None:
    axis = straight_axis(np.array([0.0, 385.0]), np.array([599.0, 385.0]))
    short = cord()
    short.upper_weight[:300] = short.upper_weight[320:] = 0.0
    assert not clipped(cut_at(short, 14.0), axis, SHAPE, D)


def test_a_leg_that_crosses_the_axis_is_no_bundle(monkeypatch: pytest.MonkeyPatch) -> None:
    pixels = picture()
    monkeypatch.setattr(frame, "is_aslant", lambda fit: True)
    row = measure(pixels)
    assert Flag.NO_BUNDLE in flags_from_text(row.flags)
    assert np.isnan([row.diameter_px, row.pitch_px]).all()


def test_a_knot_just_above_the_limits_is_unsure() -> None:
    knot = KnotSighting(
        centre_mm=5.0,
        length_mm=1.0,
        max_diameter_mm=0.7,
        centre_x_px=0.0,
        centre_y_px=0.0,
        confidence=0.7,
        coils=2.0,
    )
    assert knots_unsure((replace(knot, confidence=1.0), knot))
    assert not knots_unsure((replace(knot, confidence=0.99),))
    assert not knots_unsure(())


def test_a_coil_whose_turns_disagree_is_less_sure_of_its_pitch() -> None:
    """By as much as they do; of a straight bundle that fits the motor's count is wrong."""
    row = FrameRow(
        frame=0,
        file="f.png",
        turns=20.0,
        turn_budget_error=6.0,
        pitch_px=50.0,
        pitch_px_sd=1.0,
        helix_angle_rad=0.8,
        helix_angle_rad_sd=0.01,
    )
    p = np.zeros(PARAMETERS)
    p[[RHO, K, RC, KC]] = 7.0, 0.1, 5.0, 0.07
    coil = BundleFit(
        HelixFit(p, np.zeros((PARAMETERS, PARAMETERS)), 0.1, 0.1, 100, pair_core(2), (0.0, 100.0)),
        0.0,
        100.0,
    )
    less = less_sure_of_pitch(row, coil)
    assert less.pitch_px_sd == pytest.approx(np.hypot(1.0, 0.3 * 50.0))
    assert less.helix_angle_rad_sd == pytest.approx(0.3 * np.sin(0.8) * np.cos(0.8), rel=0.01)
    # Of a close-up the turns cannot be counted; there the rates tell.
    alone = replace(row, turn_budget_error=np.nan)
    twice = replace(coil, expected_rate=0.5 * (0.1 + 0.07))
    assert less_sure_of_pitch(alone, twice).pitch_px_sd == pytest.approx(50.0, rel=0.01)
    assert less_sure_of_pitch(alone, coil) == alone
    p = p.copy()
    p[RC] = 0.0
    straight = replace(coil, fit=replace(coil.fit, p=p))
    assert less_sure_of_pitch(row, straight) == row
    # Half a pitch in view: one 7 times too long was stated to half of itself (`wild 687`).
    brief = replace(straight, s_high_px=0.5 * straight.fit.pitch_px)
    assert less_sure_of_pitch(row, brief).pitch_px_sd > 10.0
    assert less_sure_of_pitch(row, None) == row


def test_less_than_a_lobe_tells_no_diameter(monkeypatch: pytest.MonkeyPatch) -> None:
    """0.2 of a pitch in a close-up at two turns was told 73 +- 2 px wide where 61 were true."""
    pixels = picture()
    whole = measure(pixels)
    assert whole.diameter_px > 0.0
    monkeypatch.setattr(BundleFit, "lobes_seen", 0.9)
    part = measure(pixels)
    assert np.isnan([part.diameter_px, part.diameter_px_sd, part.pitch_px]).all()
    assert {"FEW_LOBES", "NO_PITCH"} <= set(part.flags.split("|"))


@pytest.mark.slow
def test_a_pitch_that_may_as_well_be_none_is_not_given(monkeypatch: pytest.MonkeyPatch) -> None:
    """A region without ground gave 2500 px with an sd of 1900, in a picture of 768."""
    pixels = picture()
    sure = measure(pixels)
    assert 0.0 < sure.pitch_px_sd < 0.1 * sure.pitch_px and "NO_PITCH" not in sure.flags
    monkeypatch.setattr(frame, "pitch_sd_px", lambda fit, blur_px: 0.6 * fit.pitch_px)
    unsure = measure(pixels)
    assert unsure.diameter_px == sure.diameter_px and unsure.fit_rms_px == sure.fit_rms_px
    given = (unsure.pitch_px, unsure.strand_repeat_px, unsure.helix_angle_rad, unsure.pitch_px_sd)
    assert np.isnan(given).all() and "NO_PITCH" in unsure.flags.split("|")


@pytest.mark.slow
def test_a_pitch_that_the_motor_doubts_by_half_is_not_given(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A seventh of a turn in view was told as 113 px +- 285 where 358 were true (`wild 1180`)."""
    pixels = picture()
    sure = measure(pixels)
    monkeypatch.setattr(frame, "turns_disagree", lambda row, near: True)
    assert measure(pixels).pitch_px == sure.pitch_px
    unsure = replace(sure, pitch_px_sd=0.6 * sure.pitch_px)
    monkeypatch.setattr(frame, "less_sure_of_pitch", lambda row, near: unsure)
    given = measure(pixels)
    assert given.diameter_px == sure.diameter_px
    assert np.isnan([given.pitch_px, given.pitch_mm, given.helix_angle_rad]).all()
    assert {"TURNS_DISAGREE", "NO_PITCH"} <= set(given.flags.split("|"))
