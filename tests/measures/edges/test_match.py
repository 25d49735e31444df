"""Columns of a shaded, blurred tube drawn from the formula: where the match must end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.measures.tube import tube
from tsvision.measures.edges import match
from tsvision.measures.edges.find import _quality
from tsvision.measures.edges.match import match_edges
from tsvision.measures.edges.mean_edge import edge_samples, mean_profile
from tsvision.measures.edges.shading import LAMPS_RAD, TEMPLATE_GRID_PX, Shading, inside_at


@pytest.mark.parametrize("edge", [20.0, 20.3, 20.5, 20.8])
@pytest.mark.parametrize("outward", [1, -1])
def test_every_column_is_matched_wherever_its_edge_lies(edge: float, outward: int) -> None:
    """Noise-free columns of the template's own shape, started up to 1 px off. Measured: 0.013 px,
    a quarter of the step on which the template is sampled."""
    lamps = 0.7 * np.isclose(LAMPS_RAD, 0.0)
    shade = Shading(8.0, 1.0, 0.3, lamps)
    rows = np.arange(41.0)
    column = 0.17 + tube(outward * (edge - rows), 8.0, 1.0, 0.3, 0.7, 0.0)
    values = np.repeat(column[:, None], 5, axis=1).astype(np.float32)
    start = edge + np.array([-1.0, -0.5, 0.0, 0.5, np.nan])
    found, depth, residual = match_edges(values, start, outward, shade, np.zeros(5))
    np.testing.assert_allclose(found[:4], edge, atol=0.02)
    np.testing.assert_allclose(depth[:4], 1.0, rtol=0.02)
    assert residual[:4].max() < 0.003
    assert np.isnan(found[4])


def test_nothing_is_looked_up_beyond_the_template(monkeypatch: pytest.MonkeyPatch) -> None:
    """A limb that hardly any light reaches, of a strand thicker than the template is long: behind
    its end lies memory of something else, or none (photos of yarn: a crash one time in two)."""
    monkeypatch.setattr(match, "_match", match._match.py_func)  # compiled, no index is checked
    shade = Shading(60.0, 1.0, 0.0, 1.0 * np.isclose(LAMPS_RAD, np.deg2rad(-45.0)))
    assert inside_at(shade, match.LIT) > 27.0
    values = tube(70.0 - np.arange(90.0), 60.0, 1.0, 0.0, 0.7, -0.7)[:, None].astype(np.float32)
    match_edges(values, np.array([72.0]), 1, shade, np.zeros(1), 2.5)


@pytest.mark.parametrize("off_px", [-1.0, 0.0, 1.0])
def test_an_edge_blurred_farther_than_the_template_reaches(off_px: float) -> None:
    """Blur 6 px: what the template was taken to be beyond its end put the edge 0.5 to 2 px off."""
    lamps = 0.7 * np.isclose(LAMPS_RAD, 0.0)
    shade = Shading(15.0, 6.0, 0.3, lamps)
    values = tube(40.3 - np.arange(80.0), 15.0, 6.0, 0.3, 0.7, 0.0)[:, None].astype(np.float32)
    found, _, residual = match_edges(values, np.array([40.3 + off_px]), 1, shade, np.zeros(1), 2.5)
    assert found[0] == pytest.approx(40.3, abs=0.05)
    assert residual[0] < 0.003


@pytest.mark.parametrize("height", [0.15, 0.3, 1.0])
def test_a_fibre_is_told_by_how_little_it_stands_out(height: float) -> None:
    """The step's depth is held near the template's; what is told of a column is not: less than
    twice the height."""
    shade = Shading(5.0, 0.9, 0.25, 0.9 * np.isclose(LAMPS_RAD, np.deg2rad(-22.5)))
    rows = np.arange(41.0)
    b, c = 0.9 * np.cos(np.deg2rad(-22.5)), 0.9 * np.sin(np.deg2rad(-22.5))
    values = height * tube(20.3 - rows, 5.0, 0.9, 0.25, b, c)[:, None].astype(np.float32)
    _, depth, _ = match_edges(values, np.array([20.6]), 1, shade, np.zeros(1))
    assert height - 0.02 < depth[0] < height + 0.16 * (height < 1.0) + 0.02


def test_columns_that_the_lamp_hardly_reaches_count_and_fibres_do_not() -> None:
    """Rejected below 0.45 of the typical depth, side-lit coils had false knots by the dozen."""
    weight = _quality(np.array([1.0, 0.4, 0.2]), np.zeros(3), 1.0)
    np.testing.assert_array_equal(weight, [1.0, 1.0, 0.0])


@pytest.mark.parametrize("ramp", [0.0, 0.4, 0.8, 1.25])
@pytest.mark.parametrize("height", [0.8, 1.0, 1.25])
def test_a_dark_limb_is_found_however_much_of_the_lamp_reaches_it(
    ramp: float, height: float
) -> None:
    """Columns with the same limb whose ramp, from the lamp behind it, is weaker or stronger than
    the template's. Measured: up to 0.16 px; scaled as a whole the template lies up to 0.62 px too
    far out where the ramp is weak."""
    lamp = np.isclose(LAMPS_RAD, np.deg2rad(-22.5))
    shade = Shading(5.0, 0.9, 0.25, 0.9 * lamp)
    edge, rows = 20.3, np.arange(41.0)
    side = tube(edge - rows, 5.0, 0.9, 0.25, 0.0, 0.0)
    b, c = 0.9 * np.cos(np.deg2rad(-22.5)), 0.9 * np.sin(np.deg2rad(-22.5))
    lit = tube(edge - rows, 5.0, 0.9, 0.25, b, c) - side
    values = (height * side + ramp * lit)[:, None].astype(np.float32)
    found, _, _ = match_edges(values, np.array([edge + 0.3]), 1, shade, np.zeros(1))
    assert abs(found[0] - edge) < 0.18
    if ramp == 0.0:
        as_one, _, _ = match_edges(
            values, np.array([edge + 0.3]), 1, replace(shade, undivided=True), np.zeros(1)
        )
        assert not abs(as_one[0] - edge) < 0.3


@pytest.mark.parametrize("front", [0.25, 0.5, 2.0, 3.0])
@pytest.mark.parametrize("off_px", [-0.7, 0.0, 0.7, 1.4])
def test_a_limb_lit_from_behind_is_found_however_much_of_the_lamp_before_it_reaches_it(
    front: float, off_px: float
) -> None:
    """What shines from behind begins at the limb and fades within a px or two. Measured: up to
    0.06 px; where what fades counted with the lamp's ramp up to 0.35 px, and on pictures, whose
    ramps differ more, further, along one strand's lobes and not along the next's."""
    behind = np.isclose(LAMPS_RAD, np.deg2rad(135.0)) + 1.3 * np.isclose(LAMPS_RAD, 2.75, atol=0.01)
    before = np.isclose(LAMPS_RAD, np.deg2rad(-45.0)) + np.isclose(LAMPS_RAD, np.deg2rad(-22.5))
    shade = Shading(13.0, 0.7, 0.09, 0.3 * before + 0.2 * behind)
    column = Shading(13.0, 0.7, 0.09, front * 0.3 * before + 0.2 * behind)
    t_px = 40.3 - np.arange(81.0)
    values = np.interp(t_px, TEMPLATE_GRID_PX, column.template)[:, None].astype(np.float32)
    found, _, _ = match_edges(values, np.array([40.3 + off_px]), 1, shade, np.zeros(1), 2.5)
    assert found[0] == pytest.approx(40.3, abs=0.08)


def test_samples_near_an_edge_are_distances_inside_it_and_scaled_values() -> None:
    """A step from 2 to 12 at row 20, rows above it inside (upper edge) and below (lower)."""
    rows = np.where(np.arange(41.0)[:, None] < 20.0, 12.0, 2.0) * np.ones((1, 4))
    edge, level = np.full(4, 19.5), np.zeros(4)
    t, value = edge_samples(rows, edge, level, 1, 6.0)
    assert t.min() == pytest.approx(-4.5) and t.max() == pytest.approx(5.5)
    np.testing.assert_allclose(value, np.where(t > 0.0, 10.0, 0.0))
    t, value = edge_samples(rows[::-1], 40.0 - edge, level, -1, 6.0)
    np.testing.assert_allclose(value, np.where(t > 0.0, 10.0, 0.0))


def test_a_mean_profile_leaves_out_what_lies_far_off() -> None:
    random = np.random.default_rng(1)
    t = random.uniform(-5.0, 5.0, 8000)
    value = np.where(t > 0.0, 1.0, 0.0) + random.normal(0.0, 0.05, t.size)
    value[random.random(t.size) < 0.03] = 9.0
    profile = mean_profile(t, value)
    assert profile is not None
    over_a_px = np.clip(profile.t_px + 0.5, 0.0, 1.0)
    np.testing.assert_allclose(profile.value, over_a_px, atol=0.03)
    assert mean_profile(t[:20], value[:20]) is None
    assert mean_profile(t[:0], value[:0]) is None


@pytest.mark.parametrize("phases", [(0.1, 0.35, 0.6, 0.85), (0.1, 0.6)])
def test_a_mean_profile_does_not_tell_which_columns_lie_where(phases: tuple[float, ...]) -> None:
    """An edge that runs with the rows: all columns of one sub-pixel phase are of one strand, up to
    a fifth brighter than those of another. The mean is smooth all the same."""
    t = np.concatenate([np.repeat(np.arange(-5.0, 6.0) + phase, 12) for phase in phases])
    brightness = 1.0 + 0.2 * np.cos(2.0 * np.pi * t)
    ramp = np.clip(0.2 * t, 0.0, 1.0)
    profile = mean_profile(t, brightness * ramp)
    assert profile is not None and profile.t_px.size >= 8
    inside = (profile.t_px > 0.7) & (profile.t_px < 4.3)
    slope = np.diff(profile.value[inside]) / np.diff(profile.t_px[inside])
    assert slope.min() > 0.15 and slope.max() < 0.25  # a bin a step: 0.2 by its brightness
