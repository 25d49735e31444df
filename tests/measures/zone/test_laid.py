"""Turns and bundle along a zone whose coil widens into a knot, against the curve itself.

The truth is counted on a sampled centre line: its length, and the material's twist along it plus
what the line's own coiling adds (Calugareanu: link = twist + writhe, here of a slowly varying
helix, whose writhe a turn is one less the cosine of its lead).
"""

from __future__ import annotations

import numpy as np
import pytest

from tests.measures.swept import bundle
from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.bundle import BundleFit
from tsvision.measures.helix.fit import HelixFit
from tsvision.measures.helix.followed import Followed
from tsvision.measures.helix.section import pair_core
from tsvision.measures.helix.silhouette import KC, PARAMETERS, PHI, PHIC, RC, RHO, K, model_edges
from tsvision.measures.zone.envelope import Envelope, envelope_px
from tsvision.measures.zone.laid import (
    Laid,
    _as_counted,
    _as_followed,
    coil_rate,
    expected_along,
    laid_between,
)

TWIST = 2.0 * np.pi / 40.0  # rad per px of bundle
D = 20.0
COIL, KNOT = (4.0, 2.0 * np.pi / 60.0), (12.0, 2.0 * np.pi / 28.0)  # radius, rate


def fit_of(radius: float, rate: float) -> HelixFit:
    section = pair_core(2)
    q = float(np.hypot(1.0, radius * rate))
    p = np.zeros(PARAMETERS)
    p[RHO], p[RC], p[KC] = 0.5 * D / section.diameter_d, radius, rate
    p[K], p[PHI], p[PHIC] = TWIST * q - rate / q, 0.3, 0.1
    return HelixFit(p, np.eye(9), 0.1, 0.1, 300, section, (0.0, 300.0))


def laid(radius: np.ndarray, rate: np.ndarray) -> tuple[float, float]:
    """(turns, bundle px) of unit columns, counted on the curve; from one radius to the next there
    is no bundle."""
    step = 0.01
    s = np.arange(0.0, radius.size - 1.0, step)
    column = np.round(s).astype(int)
    r, angle = radius[column], np.cumsum(rate[column]) * step
    line = np.stack([s, r * np.cos(angle), r * np.sin(angle)], axis=1)
    along = np.linalg.norm(np.diff(line, axis=0), axis=1)
    along[np.diff(r) != 0.0] = step
    length = float(along.sum())
    writhe = float(((1.0 - step / along) * np.diff(angle)).sum()) / (2.0 * np.pi)
    return TWIST * length / (2.0 * np.pi) + writhe, length


def shown(radius: np.ndarray, rate: np.ndarray) -> tuple[Edges, Envelope]:
    """Edges and envelope of coils, piece by piece of the same radius and rate."""
    s, ones = np.arange(radius.size, dtype=float), np.ones(radius.size)
    up, low = np.empty(s.size), np.empty(s.size)
    for r, q in set(zip(radius, rate, strict=True)):
        fit = fit_of(float(r), float(q))
        piece = (radius == r) & (rate == q)
        for edge, drawn in zip(
            (up, low), model_edges(fit.p, fit.section, 0.0, s.size), strict=True
        ):
            edge[piece] = drawn[piece]
    return Edges(s, up, low, ones, ones), envelope_of(up, low)


def envelope_of(up: np.ndarray, low: np.ndarray) -> Envelope:
    return Envelope(envelope_px(up, low, np.ones(up.size) > 0, 1.2 * D, D), 1.2 * D)


def laid_along(
    found: BundleFit,
    edges: Edges,
    envelope: Envelope,
    knots_px: list[tuple[float, float]],
    start_px: float,
    end_px: float,
) -> Laid:
    """By what is expected alone."""
    expected = expected_along(found, edges, envelope, knots_px, start_px, end_px)
    return laid_between(expected, knots_px, start_px, end_px)


@pytest.mark.parametrize("coil", [(0.0, 0.0), COIL])
def test_what_a_knot_holds(coil: tuple[float, float]) -> None:
    s = np.arange(600.0)
    knot = (220.0, 330.0)
    inside = (s >= knot[0]) & (s <= knot[1])
    radius = np.where(inside, KNOT[0], coil[0])
    rate = np.where(inside, KNOT[1], coil[1])
    edges, envelope = shown(radius, rate)
    fit = BundleFit(fit_of(*coil), 20.0, 180.0)
    # The envelope says where the knot ends; its coils are laid a little beyond that.
    seen = laid_along(fit, edges, envelope, [knot], 0.0, 599.0)
    turns, length = laid(radius, rate)
    assert seen.turns == pytest.approx(turns, rel=0.03)
    assert seen.bundle_px == pytest.approx(length, rel=0.03)
    assert 0.3 < seen.knot_turns / seen.turns < 0.7
    assert coil_rate(edges, *knot, D) == pytest.approx(KNOT[1], rel=0.05)


def test_a_knot_that_grows_and_shrinks() -> None:
    """Most of it is flanks: narrower coils, and bundle that leads from one to the next."""
    s = np.arange(600.0)
    wide = np.cos(np.clip((s - 300.0) / 60.0, -1.0, 1.0) * 0.5 * np.pi) ** 2
    radius = COIL[0] + 10.0 * wide
    edges, turns = bundle(radius, 2.0 * np.pi / 32.0)
    envelope = envelope_of(edges.upper_px, edges.lower_px)
    found = BundleFit(fit_of(COIL[0], 2.0 * np.pi / 32.0), 20.0, 200.0)
    seen = laid_along(found, edges, envelope, [(250.0, 350.0)], 0.0, 599.0)
    assert seen.turns == pytest.approx(turns[-1], rel=0.02)


def test_an_uneven_coil() -> None:
    """The fit's window shows a coil of 4 px; it is 8 px wide further on."""
    s = np.arange(600.0)
    radius = np.where(s < 300, COIL[0], 2.0 * COIL[0])
    rate = np.full(s.size, COIL[1])
    edges, envelope = shown(radius, rate)
    seen = laid_along(BundleFit(fit_of(*COIL), 20.0, 180.0), edges, envelope, [], 0.0, 599.0)
    turns, length = laid(radius, rate)
    assert seen.turns == pytest.approx(turns, rel=0.01)
    assert seen.bundle_px == pytest.approx(length, rel=0.01)


@pytest.mark.parametrize("pitch_px", [34.0, 38.0, 39.7])
def test_an_even_coil_whose_crests_meet_the_strands_lobes_now_and_then(pitch_px: float) -> None:
    """Seen from one side its envelope beats; in the window of the fit only a part of the beat."""
    fit = fit_of(5.0, 2.0 * np.pi / pitch_px)
    up, low = model_edges(fit.p, fit.section, -100.0, 600)
    s, ones = np.arange(600.0), np.ones(600)
    edges = Edges(s, up, low, ones, ones)
    envelope = envelope_of(up, low)
    assert np.ptp(envelope.px) > 0.1 * D
    turns, length = laid(np.full(600, 5.0), np.full(600, 2.0 * np.pi / pitch_px))
    for low_px in (0.0, 100.0, 300.0):
        seen = laid_along(BundleFit(fit, low_px, low_px + 80.0), edges, envelope, [], 0.0, 599.0)
        assert seen.turns == pytest.approx(turns, rel=0.01)
        assert seen.bundle_px == pytest.approx(length, rel=0.01)


def test_waists_narrower_than_a_coil() -> None:
    """Where it overtwists locally: between waists the coil is the fit's, in them nearly none."""
    s = np.arange(600.0)
    rate = np.full(s.size, 2.0 * np.pi / 40.0)
    waists = sum(np.exp(-0.5 * ((s - at) / 12.0) ** 2) for at in (210.0, 400.0))
    radius = np.round(8.0 * (1.0 - 0.8 * waists), 1)  # in steps, for `shown` draws pieces
    edges, envelope = shown(radius, rate)
    found = BundleFit(fit_of(8.0, float(rate[0])), 60.0, 180.0)
    even = laid(np.full(s.size, 8.0), rate)[0]
    turns = float((TWIST * np.hypot(1.0, radius * rate)).sum() / (2.0 * np.pi))
    turns += float((rate * (1.0 - 1.0 / np.hypot(1.0, radius * rate))).sum() / (2.0 * np.pi))
    seen = laid_along(found, edges, envelope, [], 0.0, 599.0)
    assert even > 1.04 * turns
    assert seen.turns == pytest.approx(turns, rel=0.02)


def test_what_was_read_beside_waists_goes_for_them() -> None:
    """All laid 4 % short, by a fit that reads the twist so; read right from place to place where
    the coil could be followed. Nothing of the coil beside it is carried into a waist."""
    s = np.arange(600.0)
    waists = sum(np.exp(-0.5 * ((s - at) / 12.0) ** 2) for at in (210.0, 400.0))
    true = 0.05 * (1.0 - 0.6 * waists)
    bounds = ((20, 185), (235, 376), (425, 590))
    places = np.concatenate([np.arange(a, b, 20.0) for a, b in bounds])
    read = np.interp(places, s, true)
    turning = 2.0 * np.pi * read
    followed = Followed(places, turning, turning, turning, fold=2, reach_px=12.0)
    found = _as_followed(0.96 * true, s, followed, read)
    np.testing.assert_allclose(found, true, rtol=0.02)
    assert found.sum() == pytest.approx(true.sum(), rel=0.003)


def test_what_is_laid_is_made_to_end_in_the_angles_that_were_read() -> None:
    """Of four places the turns between, by their angles; before and behind them what was laid."""
    s = np.arange(100.0)
    places = np.array([19.5, 39.5, 69.5, 79.5])
    true = np.array([1.2, 1.45, 0.6])
    angle = 2.0 * np.pi * (np.append(0.0, np.cumsum(true)) % 0.5)
    ones = np.ones(4)
    followed = Followed(places, ones, ones, angle, fold=2, reach_px=12.0)
    found = _as_counted(np.full(s.size, 0.055), s, followed)
    between = np.diff(np.interp(places, np.arange(101.0) - 0.5, np.append(0.0, found.cumsum())))
    np.testing.assert_allclose(between, true)
    np.testing.assert_allclose(found[[5, 95]], 0.055)


@pytest.mark.parametrize("strands", [0.0, 0.05, 0.5])
def test_strands_that_keep_step_with_the_coils(strands: float) -> None:
    """Their lobes add to the middle's swing for a long way, and take from it for another."""
    rate, radius = 2.0 * np.pi / 40.0, 2.0
    fit = fit_of(radius, rate)
    fit.p[K] = strands * rate + 2e-3
    up, low = model_edges(fit.p, fit.section, 0.0, 600)
    s, ones = np.arange(600.0), np.ones(600)
    edges, envelope = Edges(s, up, low, ones, ones), envelope_of(up, low)
    turns = (fit.p[K] + rate) * 600.0 / (2.0 * np.pi)
    for low_px in (0.0, 150.0, 300.0, 450.0):
        seen = laid_along(BundleFit(fit, low_px, low_px + 120.0), edges, envelope, [], 0.0, 599.0)
        assert seen.turns == pytest.approx(turns, rel=0.01)


def test_what_is_not_seen_of_a_coil_begins_on_the_axis() -> None:
    """Legs and connector hold it: the first and last 60 px are not seen."""
    s = np.arange(600.0)
    radius = 5.0 * np.clip(np.minimum(s, 599.0 - s) / 60.0, 0.0, 1.0)
    rate = np.full(600, 2.0 * np.pi / 38.0)
    fit = fit_of(5.0, float(rate[0]))
    up, low = model_edges(fit.p, fit.section, -100.0, 600)
    ones = np.ones(600)
    envelope = envelope_of(up, low)
    envelope.px[:60] = envelope.px[540:] = np.nan
    found = BundleFit(fit, 100.0, 300.0)
    seen = laid_along(found, Edges(s, up, low, ones, ones), envelope, [], 0.0, 599.0)
    length = float(np.hypot(1.0, radius * rate).sum())
    assert seen.bundle_px == pytest.approx(length, rel=0.01)
    assert seen.bundle_px < 0.97 * float(np.hypot(1.0, 5.0 * rate).sum())


def test_a_coil_against_the_strands_sense_takes_turns_away() -> None:
    """A fit to noise may find one: it is counted, not stumbled over."""
    fit = fit_of(5.0, -2.0 * np.pi / 38.0)
    up, low = model_edges(fit.p, fit.section, -100.0, 600)
    ones = np.ones(600)
    edges = Edges(np.arange(600.0), up, low, ones, ones)
    seen = laid_along(BundleFit(fit, 50.0, 250.0), edges, envelope_of(up, low), [], 0.0, 599.0)
    turns, _ = laid(np.full(600, 5.0), np.full(600, -2.0 * np.pi / 38.0))
    assert seen.turns == pytest.approx(turns, rel=0.01)


def test_a_straight_bundle_has_its_own_rate_only() -> None:
    s = np.arange(400.0)
    fit = fit_of(0.0, 0.0)
    up, low = model_edges(fit.p, fit.section, -200.0, 400)
    ones = np.ones(s.size)
    edges = Edges(s, up, low, ones, ones)
    seen = laid_along(
        BundleFit(fit, 0.0, 399.0), edges, Envelope(np.full(400, 22.0), D), [], 0.5, 399.5
    )
    assert seen.turns == pytest.approx(TWIST * 399.0 / (2.0 * np.pi))
    assert seen.bundle_px == pytest.approx(399.0)
    assert seen.knot_turns == 0.0 and seen.knot_bundle_px == 0.0
