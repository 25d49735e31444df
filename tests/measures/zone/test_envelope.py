"""Knots by the written criterion, the baseline, and which stretches a helix may be fitted to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.windows import even_stretches
from tsvision.measures.zone.envelope import baseline_px, envelope_px, middle_swing, unevenness_of
from tsvision.measures.zone.knots import Outline, find_knots, knots_along

S = np.arange(0.0, 20.0, 0.01)
PLACE = np.stack([S, 0 * S], axis=1)


def bump(base: float, top: float, centre: float, half_length: float) -> np.ndarray:
    """E(s): `base` with one rectangle of height `top`."""
    return np.where(np.abs(S - centre) <= half_length, top, base)


def knots(envelope: np.ndarray, diameter: float = 0.5, base: float = 0.55):
    return find_knots(S, envelope, diameter, base, PLACE, 0.005, gap_px=0.4)


def test_an_interval_that_meets_the_criterion_is_one_knot() -> None:
    (knot,) = knots(bump(0.55, 0.9, 8.0, 0.6))
    assert knot.centre_px == pytest.approx(8.0, abs=0.02)
    assert knot.length_px == pytest.approx(1.2, abs=0.02)
    assert knot.max_diameter_px == pytest.approx(0.9)
    assert (knot.centre_x_px, knot.centre_y_px) == (pytest.approx(8.0, abs=0.02), 0.0)


@pytest.mark.parametrize(
    ("top", "half_length", "is_knot"),
    [
        (0.9, 0.255, True),  # just longer than 1 D
        (0.9, 0.24, False),  # shorter than 1 D
        (0.705, 0.6, True),  # just above 1.40 D
        (0.695, 0.6, False),  # above 1.15 E0, below 1.40 D
        (0.62, 0.6, False),  # below 1.15 E0
    ],
)
def test_each_limit_of_the_criterion(top: float, half_length: float, is_knot: bool) -> None:
    assert len(knots(bump(0.55, top, 8.0, half_length))) == is_knot


def test_two_knots_apart_stay_two_and_a_dip_within_one_does_not_part_it() -> None:
    apart = np.maximum(bump(0.55, 0.9, 5.0, 0.5), bump(0.55, 0.8, 12.0, 0.5))
    assert len(knots(apart)) == 2
    dip = np.where(np.abs(S - 8.0) < 0.15, 0.55, bump(0.55, 0.9, 8.0, 0.8))
    assert len(knots(dip)) == 1


def outline(upper_reach: float, lower_reach: float, lower_seen: bool = True) -> Outline:
    """A bundle of D = 20 px that coils over three D, as far as told to either side of the axis."""
    s_px, turn = np.arange(600.0), 2.0 * np.pi / 30.0
    inside = np.abs(s_px - 300.0) < 30.0
    swing = np.sin(turn * s_px)
    middle = np.where(inside, np.where(swing > 0.0, upper_reach, lower_reach) * swing, 0.0)
    upper, lower = middle + 10.0, np.where(inside & (not lower_seen), 0.0, middle - 10.0)
    one = np.ones(600)
    edges = Edges(s_px, upper, lower, one, one)
    return Outline(edges, upper, lower, one > 0.0, 20.0, 0.2, 30.0, True)


@pytest.mark.parametrize(
    ("reaches", "lower_seen", "is_knot"),
    [
        ((12.0, 12.0), True, True),
        ((16.0, 8.0), True, True),  # the axis lies a little off the knot's own
        ((30.0, 0.0), True, False),  # an edge that jumps to a shadow
        ((0.0, 30.0), True, False),
        ((30.0, 0.0), False, True),  # the other side may reach as far, unseen
    ],
)
def test_a_knot_reaches_out_on_both_sides(reaches, lower_seen: bool, is_knot: bool) -> None:
    place = np.stack([np.arange(600.0), np.zeros(600)], axis=1)
    knots, lobes = knots_along(outline(*reaches, lower_seen), 20.0, place)
    assert len(knots) == is_knot
    assert bool(lobes) == (not is_knot)
    assert all(lobe.confidence < 0.5 for lobe in lobes)


@pytest.mark.parametrize(
    ("trust", "is_knot"), [((1.0, 0.3), False), ((0.3, 1.0), True), ((1.0, 0.6), True)]
)
def test_a_knot_reaches_out_on_the_side_that_is_lit(trust, is_knot: bool) -> None:
    """A dark limb whose crests show here and not there: up to 17 knots in one recording of two
    strands that coiled evenly, the first of them ten turns before the true one."""
    place = np.stack([np.arange(600.0), np.zeros(600)], axis=1)
    one = outline(2.0, 9.0)
    dark = replace(one, edges=replace(one.edges, trust=trust))
    knots, lobes = knots_along(dark, 20.0, place)
    assert (len(knots), bool(lobes)) == (is_knot, not is_knot)


def test_magnification_does_not_matter() -> None:
    (small,) = knots(bump(0.55, 0.9, 8.0, 0.6))
    (large,) = find_knots(
        40 * S, 40 * bump(0.55, 0.9, 8.0, 0.6), 20.0, 22.0, PLACE, 0.2, gap_px=16.0
    )
    assert large.length_px == pytest.approx(40 * small.length_px)
    assert large.confidence == pytest.approx(small.confidence)


def test_the_baseline_is_the_lower_quartile_and_ignores_a_knot() -> None:
    envelope = bump(22.0, 40.0, 8.0, 2.0)
    assert baseline_px(envelope) == 22.0
    assert np.isnan(baseline_px(np.full(5, np.nan)))
    assert unevenness_of(np.full(10, 3.0)) == 0.0
    assert unevenness_of(np.array([1.0, 3.0] * 5)) == pytest.approx(0.5)


def lobed(count: int, diameter: float, period: float) -> tuple[np.ndarray, np.ndarray]:
    """Upper and lower edge that swing between half and full reach, as two strands do."""
    half = 0.25 * diameter * (1.0 + np.abs(np.cos(np.pi * np.arange(count) / period)))
    return half, -half


def test_the_envelope_bridges_the_lobes_and_keeps_a_knot() -> None:
    upper, lower = lobed(600, 20.0, 30.0)
    known = np.ones(600, bool)
    plain = envelope_px(upper, lower, known, 33.0)
    np.testing.assert_allclose(plain[40:-40], 20.0, atol=0.3)
    upper[280:320] = 18.0
    knotted = envelope_px(upper, lower, known, 33.0)
    assert knotted[300] == pytest.approx(36.0)
    assert (knotted > 30.0).sum() == pytest.approx(40, abs=3)


def coiled(count: int, diameter: float, radius: float, period: float) -> np.ndarray:
    """(2, count) edges of a smooth cylinder whose centre line swings by `radius`."""
    middle = radius * np.cos(2 * np.pi * np.arange(count) / period)
    return np.stack([middle + 0.5 * diameter, middle - 0.5 * diameter])


@pytest.mark.parametrize("width", [2, 5, 8])
def test_a_fibre_is_no_envelope_whether_the_other_edge_is_seen_or_not(width: int) -> None:
    known = np.ones(600, bool)
    upper, lower = coiled(600, 20.0, 5.0, 44.0)
    clean = envelope_px(upper, lower, known, 48.0, 20.0)
    np.testing.assert_allclose(clean[50:-50], 30.0, atol=0.3)
    upper[300 : 300 + width] += 14.0
    np.testing.assert_allclose(envelope_px(upper, lower, known, 48.0, 20.0), clean, atol=0.5)
    lower[300 : 300 + width] = 0.0
    np.testing.assert_allclose(envelope_px(upper, lower, known, 48.0, 20.0), clean, atol=0.5)


@pytest.mark.parametrize("size_px", [1.4, 2.2, 2.8, 4.0])
def test_two_fibres_half_a_coil_apart_are_no_knot(size_px: float) -> None:
    """On opposite sides, closed into one stretch of E: they may add less than a knot's 15 %."""
    known = np.ones(600, bool)
    upper, lower = coiled(600, 20.0, 3.0, 44.0)
    upper[306:310] += size_px
    lower[284:288] -= size_px
    assert envelope_px(upper, lower, known, 48.0, 20.0)[50:-50].max() < 1.15 * 26.0


def test_a_tighter_coil_of_a_knot_is_not_taken_for_fibres() -> None:
    """Lobes of 6 px that reach out on both sides over 2 D: short each, but not one alone."""
    known = np.ones(600, bool)
    upper, lower = coiled(600, 20.0, 3.0, 44.0)
    upper[280:320] = 16.0 + 4.0 * np.cos(2 * np.pi * np.arange(40) / 12.0)
    lower[280:320] = -upper[280:320]
    knotted = envelope_px(upper, lower, known, 24.0, 20.0)
    assert knotted[285:315].min() > 38.0


def test_columns_not_known_stay_empty() -> None:
    upper, lower = lobed(100, 20.0, 30.0)
    known = np.zeros(100, bool)
    known[20:80] = True
    envelope = envelope_px(upper, lower, known, 33.0)
    assert np.isnan(envelope[:20]).all() and np.isnan(envelope[80:]).all()
    assert np.isfinite(envelope[20:80]).all()


@pytest.mark.parametrize("radius", [2.0, 4.0])
def test_the_middle_shows_the_coil_and_not_the_lobes(radius: float) -> None:
    """A coil of `radius` and period 60 px on a bundle 20 px wide: within 10 % after the slow part
    is taken out."""
    upper, lower = lobed(900, 20.0, 23.0)
    swing = radius * np.cos(2 * np.pi * np.arange(900) / 60.0)
    amplitude, period = middle_swing(upper + swing, lower + swing, 20.0)
    assert amplitude == pytest.approx(radius, rel=0.1)
    assert period == pytest.approx(60.0, rel=0.03)
    still, none = middle_swing(upper, lower, 20.0)
    assert still < 0.05 and np.isnan(none)


def edges_of(upper: np.ndarray, lower: np.ndarray) -> Edges:
    ones = np.ones(upper.size)
    return Edges(np.arange(upper.size, dtype=float), upper, lower, ones, ones)


def test_an_even_bundle_is_one_stretch() -> None:
    upper, lower = lobed(600, 20.0, 23.0)
    assert even_stretches(edges_of(upper, lower), 50.0, 550.0, 20.0) == [(50.0, 550.0)]


def test_a_knot_parts_the_stretches() -> None:
    upper, lower = lobed(600, 20.0, 23.0)
    upper[280:330] = 18.0
    first, second = even_stretches(edges_of(upper, lower), 50.0, 550.0, 20.0)
    assert first[0] == 50.0 and second[1] == 550.0
    assert 230 < first[1] < 280 and 330 < second[0] < 380
