"""The overlay draws each thing where its numbers say, and nowhere else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tsvision.records import FrameRow, KnotSighting, Profile
from tsvision.report import palette
from tsvision.report.overlay import caption_text, draw_overlay, finite_pieces, with_caption
from tsvision.report.trace import trace_frame

ROW = FrameRow(
    frame=3,
    file="f.png",
    turns=12.0,
    diameter_px=20.0,
    diameter_mm=0.5,
    pitch_px=50.0,
    mm_per_px=0.025,
    axis_x0_px=20.0,
    axis_y0_px=60.0,
    axis_x1_px=220.0,
    axis_y1_px=60.0,
    apex_x_px=40.0,
    apex_y_px=60.0,
    separator_x_px=20.0,
    separator_y_px=60.0,
)


def straight_profile(count: int = 201) -> Profile:
    s_px = np.arange(count, dtype=float)
    flat = np.full(count, 8.0)
    return Profile(s_px * 0.025, s_px, flat, -flat, 16 * flat / 8 * 0.025, flat * 2.5 * 0.025)


def drawn_rows(picture: np.ndarray, column: int) -> list[int]:
    """The two rows of a column that come nearest to the edges' colour (lines are anti-aliased)."""
    away = np.abs(picture[:, column].astype(float) - palette.bgr(palette.EDGES)).sum(axis=1)
    return sorted(np.argsort(away, kind="stable")[:2].tolist())


def test_edges_lie_along_n_from_the_axis() -> None:
    trace = trace_frame(ROW, straight_profile())
    np.testing.assert_allclose(trace.upper[0], (20, 68))  # n = (-u_y, u_x): down for u to the right
    np.testing.assert_allclose(trace.lower[-1], (220, 52))
    np.testing.assert_allclose(trace.envelope_upper[10], (30, 70))


def test_everything_turns_with_the_axis() -> None:
    down = replace(
        ROW,
        axis_x0_px=60.0,
        axis_y0_px=20.0,
        axis_x1_px=60.0,
        axis_y1_px=220.0,
        separator_x_px=60.0,
        separator_y_px=20.0,
        apex_x_px=60.0,
        apex_y_px=40.0,
    )
    trace = trace_frame(down, straight_profile())
    np.testing.assert_allclose(trace.upper[0], (52, 20), atol=1e-9)
    assert trace.near_region[:, 1].min() == pytest.approx(40)
    assert trace.near_region[:, 1].max() == pytest.approx(140)  # max(2 p, 4 D) = 100 px


def test_an_axis_in_view_only_from_mid_zone_still_counts_s_from_the_separator() -> None:
    late = replace(ROW, axis_x0_px=120.0)
    np.testing.assert_allclose(trace_frame(late, straight_profile()).upper[0], (20, 68))


def test_lines_follow_a_bowed_axis() -> None:
    radius = 400.0
    s_px = np.arange(301, dtype=float)
    turn = s_px / radius  # an arc about (0, 0), from (radius, 0) on, clockwise as seen (y down)
    arc = radius * np.column_stack([np.cos(turn), np.sin(turn)])
    flat = np.full(301, 8.0)
    mm = 0.025
    profile = Profile(
        s_px * mm, s_px, flat, -flat, 16 * flat / 8 * mm, flat * 2.5 * mm, arc[:, 0], arc[:, 1]
    )
    row = replace(ROW, separator_x_px=np.nan, separator_y_px=np.nan, apex_x_px=arc[40, 0])
    row = replace(row, apex_y_px=arc[40, 1])
    knot = KnotSighting(mm * 150, 0.5, 1.0, centre_x_px=arc[150, 0], centre_y_px=arc[150, 1])
    trace = trace_frame(row, profile, [knot])
    inner, outer = (np.linalg.norm(line, axis=1) for line in (trace.upper, trace.lower))
    np.testing.assert_allclose(inner, radius - 8, atol=1e-3)  # n points to the arc's centre
    np.testing.assert_allclose(outer, radius + 8, atol=1e-3)
    np.testing.assert_allclose(np.linalg.norm(trace.envelope_upper, axis=1), radius - 10, atol=1e-3)
    np.testing.assert_allclose(trace.axis, arc)
    (box,) = trace.knots
    assert np.ptp(np.arctan2(box[:, 1], box[:, 0])) * radius == pytest.approx(20, abs=1e-3)
    near = np.arctan2(trace.near_region[:, 1], trace.near_region[:, 0]) * radius
    assert (near.min(), near.max()) == pytest.approx((40, 140), abs=1e-3)


def test_a_drawn_edge_is_where_it_was_measured() -> None:
    frame = np.zeros((120, 240), np.uint8)
    picture = draw_overlay(frame, ROW, straight_profile(), zoom=1, caption=False)
    assert drawn_rows(picture, 180) == [52, 68]
    assert not frame.any()


def test_zoom_keeps_pixel_centres_together() -> None:
    frame = np.zeros((120, 240), np.uint8)
    picture = draw_overlay(frame, ROW, straight_profile(), zoom=3, caption=False)
    assert drawn_rows(picture, 540) == [3 * 52 + 1, 3 * 68 + 1]


def test_a_picture_made_small_keeps_its_lines_a_pixel_wide() -> None:
    frame = np.zeros((120, 240), np.uint8)
    picture = draw_overlay(frame, ROW, straight_profile(), zoom=0.2, caption=False)
    assert picture.shape == (24, 48, 3)
    full = draw_overlay(frame, ROW, straight_profile(), zoom=1, caption=False)
    assert picture[:, 36].max() > 0.6 * full[:, 180].max()


def test_knot_box_spans_its_interval() -> None:
    knot = KnotSighting(2.5, 0.5, 1.0, centre_x_px=120.0, centre_y_px=62.0)
    (box,) = trace_frame(ROW, None, [knot]).knots
    assert box[:, 0].min() == pytest.approx(110)
    assert box[:, 0].max() == pytest.approx(130)


def test_without_a_scale_a_knot_is_still_marked_where_it_was_seen() -> None:
    knot = KnotSighting(np.nan, np.nan, np.nan, centre_x_px=120.0, centre_y_px=62.0)
    (box,) = trace_frame(replace(ROW, mm_per_px=np.nan), None, [knot]).knots
    assert box[:, 0].min() == pytest.approx(100)
    assert box[:, 1].max() == pytest.approx(80)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_a_frame_where_nothing_was_found_is_shown_bare(dtype: type) -> None:
    frame = np.full((40, 60, 3), 200, dtype)
    frame[:20] = 100
    picture = draw_overlay(frame, FrameRow(0, "x.png"), zoom=1, caption=False)
    assert picture.shape == (40, 60, 3)
    assert picture.dtype == np.uint8
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) == 2


@pytest.mark.parametrize("width", [300, 400, 588, 700])
def test_a_caption_is_never_cut_off(width: int) -> None:
    row = FrameRow(1, "x.png", turns=8.531, phase="overtwist", knot_count=0.0)
    row = replace(
        row, diameter_mm=0.899, diameter_mm_sd=0.035, helix_angle_rad=0.88, handedness="Z"
    )
    canvas = np.zeros((10, width, 3), np.uint8)
    drawn = np.flatnonzero(with_caption(canvas, row)[:-13].max(axis=(0, 2)))
    assert 0.5 * width < drawn[-1] < width - 8


def test_missing_samples_break_the_line() -> None:
    line = np.array([[0, 0], [1, 0], [np.nan, 0], [3, 0], [np.nan, np.nan], [5, 0], [6, 0.0]])
    assert [len(p) for p in finite_pieces(line)] == [2, 2]


def test_caption_leaves_unknown_numbers_out() -> None:
    assert caption_text(FrameRow(0, "x.png")) == "frame 0"
    full = replace(ROW, phase="local overtwist", diameter_mm_sd=0.004, knot_count=1.0)
    assert caption_text(full) == "frame 3  12 turns  local overtwist  D 0.500 +- 0.004 mm  1 knot"
