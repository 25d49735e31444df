"""Coils that widen and narrow along the bundle, followed from place to place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.measures.swept import COIL_PX, LENGTH_PX, D, bundle, from_the_axis
from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.bundle import BundleFit, fit_window
from tsvision.measures.helix.followed import Followed, _agreeing, follow
from tsvision.measures.helix.section import pair_core
from tsvision.measures.zone.envelope import Envelope
from tsvision.measures.zone.laid import expected_along


def fit_to(edges: Edges, low_px: float, high_px: float) -> BundleFit:
    found = fit_window(edges, pair_core(2), low_px, high_px, D, np.nan)
    assert found is not None and found.fit.coiled
    return found


def followed_by(
    found: BundleFit, edges: Edges, start_px: float = 0.0, end_px: float = LENGTH_PX - 1.0
) -> Followed | None:
    """Where no knot is expected."""
    seen = Envelope(np.full(LENGTH_PX, D), D)
    expected = expected_along(found, edges, seen, [], start_px, end_px)
    return follow(found, edges, expected, start_px, end_px)


def line_of(s_px: list[float], rate: list[float], stretch: list[float]) -> Followed:
    lines = (s_px, rate, stretch, s_px)
    return Followed(*(np.array(x) for x in lines), 2, 12.0)


def missed_turns(followed: Followed, turns: np.ndarray) -> float:
    """By how much the turns between first and last place are missed, by the angles read there."""
    s = followed.s_px
    laid = 0.5 * (followed.rate[1:] + followed.rate[:-1]) * np.diff(s) / (2.0 * np.pi)
    true = np.interp(s[[0, -1]], np.arange(turns.size), turns)
    return float(followed.counted(laid).sum() - (true[1] - true[0]))


def test_a_coil_that_widens_all_along() -> None:
    """From 3 to 8 px; the fit beside the narrow end, carried over, misses 1.5 turns of 19."""
    edges, turns = bundle(from_the_axis(np.linspace(3.0, 8.0, LENGTH_PX)))
    found = fit_to(edges, 60.0, 180.0)
    followed = followed_by(found, edges)
    assert followed is not None
    span = followed.s_px[-1] - followed.s_px[0]
    assert span > 0.85 * LENGTH_PX
    carried = (found.fit.p[1] + found.fit.p[6]) * span / (2.0 * np.pi)
    first, last = np.interp(followed.s_px[[0, -1]], np.arange(turns.size), turns)
    assert carried < (last - first) - 1.0
    assert missed_turns(followed, turns) == pytest.approx(0.0, abs=0.1)
    true = np.hypot(1.0, np.interp(followed.s_px, [0, LENGTH_PX], [3.0, 8.0]) * 2 * np.pi / COIL_PX)
    inside = (followed.s_px > 50.0) & (followed.s_px < LENGTH_PX - 50.0)
    np.testing.assert_allclose(followed.stretch[inside], true[inside], rtol=0.03)


def test_noise_in_the_edges_does_not_lead_astray() -> None:
    edges, turns = bundle(from_the_axis(np.linspace(4.0, 7.0, LENGTH_PX)))
    random = np.random.default_rng(5)
    upper, lower = (e + random.normal(0.0, 0.4, e.size) for e in (edges.upper_px, edges.lower_px))
    noisy = replace(edges, upper_px=upper, lower_px=lower)
    followed = followed_by(fit_to(noisy, 60.0, 220.0), noisy)
    assert followed is not None
    assert missed_turns(followed, turns) == pytest.approx(0.0, abs=0.2)


@pytest.mark.parametrize("sd_px", [9.0, 14.0])
def test_turns_are_counted_through_a_waist_that_no_helix_describes(sd_px: float) -> None:
    s = np.arange(LENGTH_PX)
    radius = 8.0 * (1.0 - 0.9 * np.exp(-0.5 * ((s - 330.0) / sd_px) ** 2))
    edges, turns = bundle(from_the_axis(radius))
    followed = followed_by(fit_to(edges, 60.0, 220.0), edges)
    assert followed is not None and followed.unbroken(0.0, LENGTH_PX, 40.0)
    assert missed_turns(followed, turns) == pytest.approx(0.0, abs=0.2)
    stretch = np.hypot(1.0, np.interp(followed.s_px, s, radius) * 2.0 * np.pi / COIL_PX)
    inside = (followed.s_px > 60.0) & (followed.s_px < 580.0)
    np.testing.assert_allclose(followed.stretch[inside], stretch[inside], rtol=0.15)


def test_turns_are_counted_through_a_bulge() -> None:
    s = np.arange(LENGTH_PX)
    radius = 5.0 + 6.0 * np.exp(-0.5 * ((s - 330.0) / 30.0) ** 2)
    edges, turns = bundle(from_the_axis(radius))
    followed = followed_by(fit_to(edges, 60.0, 220.0), edges)
    assert followed is not None
    assert missed_turns(followed, turns) == pytest.approx(0.0, abs=0.1)


def test_turns_are_counted_to_the_ends_where_the_coil_begins_on_the_axis() -> None:
    edges, turns = bundle(from_the_axis(np.full(LENGTH_PX, 7.0)))
    followed = followed_by(fit_to(edges, 100.0, 260.0), edges)
    assert followed is not None
    np.testing.assert_allclose(followed.s_px[[0, -1]], [0.0, LENGTH_PX - 1.0], atol=2.0)
    assert missed_turns(followed, turns) == pytest.approx(0.0, abs=0.1)


def test_a_place_that_was_read_wrongly_is_left_out() -> None:
    """One that costs as little as the others, but from and to which the angle does not lead; and
    of two at one place the one to which it does."""
    s = np.array([0.0, 10.0, 20.0, 20.0, 30.0, 40.0, 50.0])
    rate = np.full(s.size, 0.05)  # turns per px
    angle = 0.05 * s + np.array([0.0, 0.5, 0.0, 0.2, 0.0, 0.21, -0.5])
    kept = _agreeing(s, rate, angle, np.full(s.size, 0.4), 0.05 * s, rate, 2)
    assert kept.tolist() == [True, True, True, False, True, False, True]


def test_places_that_agree_on_another_rate_than_is_expected_are_left_out() -> None:
    """A coil taken for a straight stretch turns half as often: three places that say so lead on to
    each other, and to those beside them but for half a turn; two of them cost as well."""
    s = 10.0 * np.arange(8)
    rate, angle, cost = np.full(8, 0.05), 0.05 * s, np.full(8, 0.3)
    rate[3:6], angle[3:] = 0.025, angle[3:] - np.array([0.125, 0.375, 0.5, 0.5, 0.5])
    cost[3:6] = 0.8
    kept = _agreeing(s, rate, angle, cost, 0.05 * s, np.full(8, 0.05), 2)
    assert kept.tolist() == [True, True, True, False, False, False, True, True]
    rate[7] = -0.05
    assert not _agreeing(s, rate, angle, cost, 0.05 * s, np.full(8, 0.05), 2)[7]
    rate[7] = 0.05
    believed = _agreeing(s, rate, angle, cost, np.cumsum(10.0 * rate), rate, 2)
    assert believed.sum() > 5


def test_what_was_laid_says_how_often_the_angle_went_round() -> None:
    line = line_of([0.0, 1.0, 3.0], [0.0] * 3, [1.0] * 3)  # angles as s
    line = replace(line, angle_rad=2.0 * np.pi * np.array([0.0, 0.1, 0.3]))
    np.testing.assert_allclose(line.counted(np.array([0.4, 1.6])), [0.6, 1.7])


def test_what_is_not_seen_is_not_told() -> None:
    edges, _ = bundle(np.full(LENGTH_PX, 6.0))
    found = fit_to(edges, 60.0, 220.0)
    hidden = edges.within(edges.s_px < 350.0)
    followed = followed_by(found, hidden)
    assert followed is not None
    assert followed.s_px[-1] < 370.0


def test_a_fit_that_describes_nothing_is_not_followed() -> None:
    edges, _ = bundle(np.full(LENGTH_PX, 6.0))
    found = fit_to(edges, 60.0, 220.0)
    random = np.random.default_rng(3)
    shaken = replace(edges, upper_px=edges.upper_px + 8.0 * np.sin(random.normal(0, 9, LENGTH_PX)))
    rough = replace(shaken, lower_px=-shaken.upper_px[::-1])
    assert followed_by(found, rough) is None
    assert followed_by(found, edges, 100.0, 120.0) is None


def test_between_places_all_is_told_and_less_beyond() -> None:
    line = line_of([100.0, 120.0], [0.2, 0.4], [1.0, 1.2])
    told = line.told(np.array([60.0, 82.0, 100.0, 110.0, 200.0]))
    np.testing.assert_allclose(told, [0.0, 0.5, 1.0, 1.0, 0.0])
    alone = line_of([100.0], [0.2], [1.0])
    np.testing.assert_allclose(alone.told(np.array([100.0, 300.0])), [1.0, 0.0])


@pytest.mark.parametrize(
    ("s_px", "unbroken"),
    [
        ((30.0, 50.0, 70.0, 90.0), True),
        ((30.0, 70.0, 90.0), False),  # a place is missing
        ((50.0, 70.0, 90.0), False),  # far from where it begins
        ((30.0, 50.0, 70.0), False),
        ((30.0,), False),
    ],
)
def test_whether_all_between_the_ends_is_told(s_px: tuple[float, ...], unbroken: bool) -> None:
    ones = [1.0] * len(s_px)
    line = line_of(list(s_px), ones, ones)
    assert line.unbroken(0.0, 120.0, ends_px=40.0) == unbroken
