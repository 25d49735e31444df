"""Knots, E0 and places along the axis, of bundles drawn from their centre line."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from tsvision.images.strip import Axis
from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.bundle import BundleFit
from tsvision.measures.looks import Looks
from tsvision.measures.zone.knots import LOBE
from tsvision.measures.zone.outline import Outlined, add_outline
from tsvision.records import FrameRow

D, LENGTH = 28.0, 700
MM_PER_PX = 0.03
BUNDLE, KNOT = (7.0, 96.0), (16.0, 40.0)  # radius and period of the coils, px


def looks(
    connector_px: float = float(LENGTH), connector_seen: bool = True, by_distance: bool = False
) -> Looks:
    axis = Axis(np.array([[0.0, 200.0], [LENGTH, 200.0]]), np.array([0.0, LENGTH]))
    fake: Any = SimpleNamespace(
        diameter_px=D,
        zero_px=0.0,
        zero_known=True,
        zone_px=float(LENGTH),
        ends=SimpleNamespace(connector_px=connector_px, connector_seen=connector_seen),
        scale=SimpleNamespace(mm_per_px=MM_PER_PX),
        sight=SimpleNamespace(axis=axis, signal=SimpleNamespace(by_distance=by_distance)),
        strand_count=6,
    )
    return cast(Looks, fake)


def drawn(knots: list[tuple[float, float]], knot: tuple[float, float] = KNOT) -> Edges:
    """A coiled bundle with knots of that radius and period between the given s."""
    s = np.arange(float(LENGTH))
    knotted = np.zeros(s.size, dtype=bool)
    for low, high in knots:
        knotted |= (s > low) & (s < high)
    radius = np.where(knotted, knot[0], BUNDLE[0])
    phase = np.cumsum(2.0 * np.pi / np.where(knotted, knot[1], BUNDLE[1]))
    middle = radius * np.cos(phase)
    ones = np.ones(s.size)
    return Edges(s, middle + 0.5 * D, middle - 0.5 * D, ones, ones)


def beating() -> Edges:
    """An even coil of which every fifth crest shows all of E, the others a tenth less."""
    s = np.arange(float(LENGTH))
    swing = np.cos(2.0 * np.pi * s / BUNDLE[1])
    lobes = sum(np.exp(-0.5 * ((s - at) / 25.0) ** 2) for at in (0.0, 240.0, 480.0, 672.0))
    half = 0.5 * D + 0.4 * BUNDLE[0] * np.abs(swing) * (0.3 + 0.7 * lobes)
    ones = np.ones(s.size)
    return Edges(s, 0.6 * BUNDLE[0] * swing + half, 0.6 * BUNDLE[0] * swing - half, ones, ones)


def seen(edges: Edges, at: Looks) -> Outlined:
    row = FrameRow(frame=0, file="", turns=30.0, diameter_px=D, diameter_px_sd=0.2)
    return add_outline(row, edges, at, None, None, float("nan"))


def outlined(knots: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """(centre, length) in px of the knots found, where those between the given s were drawn."""
    found = seen(drawn(knots), looks()).knots
    return [(k.centre_mm / MM_PER_PX, k.length_mm / MM_PER_PX) for k in found]


def test_neighbours_are_told_apart() -> None:
    """The gap of 50 px is half a coil of the bundle, and more than a coil of the knots."""
    found = outlined([(180.0, 300.0), (350.0, 480.0)])
    assert [centre for centre, _ in found] == pytest.approx([240.0, 415.0], abs=0.5 * D)
    assert all(length == pytest.approx(125.0, abs=D) for _, length in found)


@pytest.mark.parametrize("length", [60.0, 130.0, 280.0])
def test_one_knot_stays_one(length: float) -> None:
    ((centre, seen),) = outlined([(200.0, 200.0 + length)])
    assert centre == pytest.approx(200.0 + 0.5 * length, abs=0.5 * D)
    assert seen == pytest.approx(length, abs=D)


@pytest.mark.parametrize("period", [30.0, 40.0, 60.0])
def test_the_coils_of_a_knot_are_its_own(period: float) -> None:
    """Of a knot of 200 px; by what E is closed over there were less than half as many."""
    (knot,) = seen(drawn([(200.0, 400.0)], (KNOT[0], period)), looks()).knots
    assert knot.coils == pytest.approx(200.0 / period, abs=0.5)


@pytest.mark.parametrize("every", [3, 8])
def test_a_few_edges_where_strings_are_hardly_seen_are_no_knot(every: int) -> None:
    """Before ground as dark as the strings: what was found there, far from them, made a knot of
    1 to 4 D in seven of eight frames of a path-traced film without any."""
    plain = drawn([])
    gap = (plain.s_px > 200.0) & (plain.s_px < 290.0)
    weight = np.where(gap & (plain.s_px % every != 0.0), 0.0, 1.0)
    upper = np.where(gap, plain.upper_px + 2.0 * D, plain.upper_px)
    jumping = Edges(plain.s_px, upper, plain.lower_px, weight, weight)
    found = seen(jumping, looks())
    assert not found.knots and not found.lobes
    assert found.row.max_envelope_px == pytest.approx(D + 2.0 * BUNDLE[0], abs=0.1 * D)


def test_a_single_lobe_is_no_knot_but_is_told() -> None:
    """One crest of the coil reaches out as far as a knot's, over a third of D."""
    plain = drawn([])
    s = plain.s_px
    crest = 288.0  # a crest on the upper side, in mid-zone
    out = (16.0 - 7.0) * (np.abs(s - crest) < 0.16 * D)
    ones = np.ones(LENGTH)
    found = seen(Edges(s, plain.upper_px + out, plain.lower_px + out, ones, ones), looks())
    assert not found.knots and found.row.knot_count == 0.0
    (lobe,) = found.lobes
    assert lobe.centre_mm == pytest.approx(crest * MM_PER_PX, abs=0.2 * D * MM_PER_PX)
    assert lobe.length_mm < D * MM_PER_PX and lobe.confidence == LOBE


def test_where_no_edge_is_seen_no_knot_is_ruled_out() -> None:
    nothing = np.zeros(LENGTH)
    row = seen(Edges(drawn([]).s_px, nothing, nothing, nothing, nothing), looks()).row
    assert np.isnan(row.baseline_envelope_px) and np.isnan(row.knot_count)
    assert seen(drawn([]), looks()).row.knot_count == 0.0


@pytest.mark.parametrize("end", ["separator", "connector"])
def test_legs_that_part_and_what_the_connector_grips_are_no_knots(end: str) -> None:
    """Edges that spread over the last D of what is seen; a knot that begins there is one."""
    first = end == "separator"
    plain, spread = drawn([]), drawn([])
    s = spread.s_px if first else spread.s_px[::-1]
    wide = 0.6 * D * (s < 0.9 * D)
    spread = Edges(plain.s_px, plain.upper_px + wide, plain.lower_px - wide, *[np.ones(LENGTH)] * 2)
    assert not seen(plain, looks()).knots and not seen(spread, looks()).knots
    there = (0.0, 4.0 * D) if first else (LENGTH - 4.0 * D, float(LENGTH))
    assert len(outlined([there])) == 1


def test_many_knots_leave_the_baseline_alone() -> None:
    """Two knots over more than half of the zone: E0 is that of the coils between them."""
    none = seen(drawn([]), looks()).row.baseline_envelope_px
    many = [(80.0, 290.0), (420.0, 610.0)]
    found = seen(drawn(many, (24.0, 60.0)), looks())
    assert none == pytest.approx(D + 2.0 * BUNDLE[0], rel=0.02)
    assert found.row.baseline_envelope_px == pytest.approx(none, rel=0.1)
    assert len(found.knots) == 2


def test_lobes_that_meet_the_coil_now_and_then_do_not_lower_the_baseline() -> None:
    """At every fifth crest of the coil a strand's lobe reaches out to E, elsewhere a tenth less.
    Closed over the period alone, E0 would be that of the crests which show no lobe."""
    base = seen(beating(), looks()).row.baseline_envelope_px
    # The line through seven coils' middles tilts by 0.8 px, 4 % of E; one coil alone reads 8 % low.
    assert base == pytest.approx(D + 2.0 * BUNDLE[0], rel=0.045)


@pytest.mark.parametrize("scale", [MM_PER_PX, float("nan")])
def test_a_knot_is_told_in_px_from_the_separator_and_in_mm_only_with_a_scale(scale: float) -> None:
    at = looks()
    at.scale.mm_per_px = scale  # type: ignore[misc]
    at.zero_px = 50.0  # type: ignore[misc]
    found = seen(drawn([(200.0, 330.0)]), at)
    (knot,), ((low, high),) = found.knots, found.knot_ends_px
    in_px = (knot.centre_px, knot.length_px, knot.max_diameter_px)
    assert in_px[:2] == pytest.approx((0.5 * (low + high) - 50.0, high - low))
    assert in_px[2] == pytest.approx(D + 2.0 * KNOT[0], rel=0.05)
    in_mm = (knot.centre_mm, knot.length_mm, knot.max_diameter_mm)
    assert in_mm == pytest.approx(tuple(scale * px for px in in_px), nan_ok=True)


@pytest.mark.parametrize("connector_seen", [True, False])
def test_the_zone_is_as_long_as_the_rig_says(connector_seen: bool) -> None:
    """Foreshortened by 2 %: a knot three quarters down the picture's zone lies there in mm too,
    unless the connector was not seen but put where the scale leads."""
    connector = 0.98 * LENGTH
    found = seen(drawn([(460.0, 570.0)]), looks(connector, connector_seen))
    ((low, high),) = found.knot_ends_px
    scale = MM_PER_PX * (LENGTH / connector if connector_seen else 1.0)
    assert found.knots[0].centre_mm == pytest.approx(0.5 * (low + high) * scale)
    assert found.profile.s_mm[-1] == pytest.approx(found.profile.s_px[-1] * scale)


def test_a_dip_of_the_coil_is_uneven_and_a_beat_of_the_lobes_is_not() -> None:
    """The coil is withdrawn twice over about one coil, as beyond the local onset."""
    s = np.arange(float(LENGTH))
    dip = sum(np.exp(-0.5 * ((s - at) / 20.0) ** 2) for at in (200.0, 480.0))
    radius = 2.0 * BUNDLE[0] * (1.0 - 0.8 * dip)
    middle = radius * np.cos(2.0 * np.pi * s / (0.5 * BUNDLE[1]))
    ones = np.ones(s.size)
    edges = Edges(s, middle + 0.5 * D, middle - 0.5 * D, ones, ones)
    true = float(np.std(D + 2.0 * radius) / np.mean(D + 2.0 * radius))
    assert seen(edges, looks()).row.unevenness == pytest.approx(true, rel=0.2)
    assert seen(beating(), looks()).row.unevenness < 0.02


@pytest.mark.parametrize(("period", "coiled"), [(80.0, False), (96.0, True)])
def test_a_strand_that_is_seen_less_well_is_no_coil(period: float, coiled: bool) -> None:
    """Blue and yellow: the middle swings once a revolution of the strands, 80 px, with no coil."""
    s = np.arange(float(LENGTH))
    middle = 0.07 * D * np.cos(2.0 * np.pi * s / period)
    ones = np.ones(s.size)
    edges = Edges(s, middle + 0.5 * D, middle - 0.5 * D, ones, ones)
    straight = SimpleNamespace(coiled=False, pitch_px=80.0, p=np.zeros(16))
    row = FrameRow(frame=0, file="", turns=9.0, diameter_px=D, pitch_px=80.0)
    near = cast(BundleFit, SimpleNamespace(fit=straight))
    for by_distance in (True, False):
        at = looks(by_distance=by_distance)
        swing = add_outline(row, edges, at, near, None, float("nan")).row.coil_amplitude_px
        assert (swing > 0.05 * D) == (coiled or not by_distance)


def test_an_edge_that_is_not_seen_is_no_edge_on_the_axis() -> None:
    """Its place is unknown, and so is the width there; the envelope goes on."""
    plain = drawn([])
    hidden = np.where((plain.s_px > 250.0) & (plain.s_px < 280.0), 0.0, 1.0)
    blind = replace(plain, upper_px=plain.upper_px * hidden, upper_weight=hidden)
    profile = seen(blind, looks()).profile
    assert profile is not None
    gone = (profile.s_px > 250.0) & (profile.s_px < 280.0)
    assert gone.sum() == 29
    for values in (profile.upper_px, profile.width_mm):
        np.testing.assert_array_equal(np.isnan(values), gone)
    assert np.isfinite(profile.lower_px).all() and np.isfinite(profile.envelope_mm).all()
