"""How a window's helix is fitted where one limb is dark."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix import bundle
from tsvision.measures.helix.bundle import SCALE_PX, BundleFit, fit_window
from tsvision.measures.helix.fit import HelixFit, fit_helix
from tsvision.measures.helix.search import coil_at, straight_at
from tsvision.measures.helix.section import pair_core
from tsvision.measures.helix.silhouette import (
    COILED,
    KC,
    PARAMETERS,
    PHI,
    PHIC,
    RC,
    RHO,
    SLOPE,
    Y0,
    K,
    Section,
    model_edges,
)
from tsvision.measures.helix.weigh import PLAINLY, POOR, noise_cost
from tsvision.measures.light.shape import trust_of
from tsvision.measures.zone.fits import _better

DIAMETER_PX = 30.0
NAN = float("nan")


def dark_below(coil_px: float, seed: int) -> tuple[Edges, Edges]:
    """Edges of two strands along a line that coils by so much, and the same with the lower ones up
    to a strand inside, as the light falls there, lobe by lobe."""
    section = pair_core(2)
    p = np.zeros(PARAMETERS)
    p[RHO] = 0.5 * DIAMETER_PX / section.diameter_d
    p[K], p[PHI], p[RC], p[KC], p[PHIC] = 0.1, 0.4, coil_px, 0.07, 1.0
    upper, lower = model_edges(p, section, -120.0, 241)
    rng = np.random.default_rng(seed)
    upper = upper + 0.1 * rng.standard_normal(241)
    inside = gaussian_filter1d(rng.standard_normal(241), 8.0)
    inside = np.abs(4.0 * inside / inside.std())
    sure = np.ones(241)
    lit = Edges(np.arange(241.0), upper, lower, sure, sure)
    return lit, replace(lit, lower_px=lower + inside)


@pytest.mark.parametrize("seed", range(4))
def test_along_a_coil_the_lit_limb_tells(seed: int) -> None:
    lit, edges = dark_below(9.0, seed)
    true = fit_window(lit, pair_core(2), 0.0, 240.0, DIAMETER_PX, NAN)
    even = fit_window(edges, pair_core(2), 0.0, 240.0, DIAMETER_PX, NAN)
    assert true is not None and even is not None and even.fit.cost > POOR / 2
    trust = trust_of([(edges, even)])
    assert trust[0] == 1.0 and trust[1] < 0.3
    found = fit_window(replace(edges, trust=trust), pair_core(2), 0.0, 240.0, DIAMETER_PX, NAN)
    assert found is not None and found.fit.cost < 0.7 * even.fit.cost
    assert found.fit.pitch_px == pytest.approx(true.fit.pitch_px, rel=0.01)
    assert found.fit.diameter_px == pytest.approx(DIAMETER_PX, rel=0.03)


def test_along_a_straight_bundle_both_limbs_count() -> None:
    _, edges = dark_below(0.0, 0)
    both, one = (
        fit_window(replace(edges, trust=t), pair_core(2), 0.0, 240.0, DIAMETER_PX, NAN, coil=False)
        for t in ((1.0, 1.0), (1.0, 0.1))
    )
    assert both is not None and one is not None
    assert both.fit.diameter_px == one.fit.diameter_px


def test_a_short_straight_stretch_does_not_stand_for_the_bundle() -> None:
    """In a third of a turn hardly anything can misfit: a long fit beside the separator stays."""
    lit, _ = dark_below(0.0, 0)
    long = fit_window(lit, pair_core(2), 0.0, 240.0, DIAMETER_PX, NAN)
    assert long is not None and not long.fit.coiled
    rough = replace(long, fit=replace(long.fit, cost=0.4))
    good = replace(long.fit, cost=0.3)
    assert not _better(BundleFit(good, 100.0, 120.0), rough)
    assert _better(BundleFit(good, 100.0, 240.0), rough)
    assert not _better(BundleFit(replace(good, cost=0.39), 100.0, 240.0), rough)


@pytest.mark.parametrize(("from_px", "right"), [(0.0, False), (180.0, True)])
def test_a_poor_fit_is_not_carried_on_into_a_much_longer_view(from_px: float, right: bool) -> None:
    """A quarter of a turn fitted badly; the next frame shows two more, which tell the strands."""
    edges = straight_in_noise(0.1)
    true = fit_window(edges, pair_core(2), 0.0, 240.0, DIAMETER_PX, NAN, coil=False)
    assert true is not None
    p = true.fit.p.copy()
    p[K] *= 2.2
    poor = BundleFit(replace(true.fit, p=p, cost=0.95), from_px, 240.0)
    found = fit_window(edges, pair_core(2), 0.0, 240.0, DIAMETER_PX, NAN, poor, coil=False)
    assert found is not None
    assert (found.fit.pitch_px == pytest.approx(true.fit.pitch_px, rel=0.01)) == right


def straight_in_noise(noise_px: float, coil_px: float = 0.0) -> Edges:
    """Edges of two strands about a straight line, or one that coils a little, with noise."""
    section = pair_core(2)
    p = np.zeros(PARAMETERS)
    p[RHO] = 0.5 * DIAMETER_PX / section.diameter_d
    p[K], p[PHI], p[RC], p[KC], p[PHIC] = 0.1, 0.4, coil_px, 0.07, 1.0
    rng = np.random.default_rng(5)
    upper, lower = np.stack(model_edges(p, section, -120.0, 241)) + noise_px * rng.normal(
        size=(2, 241)
    )
    return Edges(np.arange(241.0), upper, lower, np.ones(241), np.ones(241))


@pytest.mark.parametrize("noise_px", [0.1, 0.3, 0.5])
def test_what_noise_costs_is_told_from_the_edges(noise_px: float) -> None:
    """The cost of exactly the right outline is that of the noise, and of nothing else."""
    t = (noise_px / SCALE_PX * np.random.default_rng(0).normal(size=100_000)) ** 2
    right = float((t / (1.0 + t)).mean())
    assert noise_cost(straight_in_noise(noise_px), SCALE_PX) == pytest.approx(right, abs=0.04)


def test_no_coil_is_sought_in_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    sought = []
    monkeypatch.setattr(bundle, "coils_of", lambda *a: sought.append(a) or [])
    section = pair_core(2)
    straight = fit_window(straight_in_noise(0.5), section, 0.0, 240.0, DIAMETER_PX, NAN)
    assert straight is not None and straight.fit.cost > PLAINLY and not sought
    # a coil by twice as much as the noise is, still too small to swing
    fit_window(straight_in_noise(0.5, 1.0), section, 0.0, 240.0, DIAMETER_PX, NAN)
    assert sought


def test_no_coil_is_sought_where_the_middle_line_is_still(monkeypatch: pytest.MonkeyPatch) -> None:
    """What swells to both sides fits badly, but no coil makes it do so: such a search took up to
    3 s in films of one dim limb (`wild 869`, `871`, `921`)."""
    sought: list[tuple] = []
    monkeypatch.setattr(bundle, "coils_of", lambda *a: sought.append(a) or [])
    even = straight_in_noise(0.1)
    swell = 1.2 * np.sin(0.31 * even.s_px)
    swollen = replace(even, upper_px=even.upper_px + swell, lower_px=even.lower_px - swell)
    found = fit_window(swollen, pair_core(2), 0.0, 240.0, DIAMETER_PX, NAN)
    assert found is not None and found.fit.cost > POOR and not sought


@pytest.mark.parametrize("phase", [0.0, 3.0, 4.5])
def test_an_edge_that_goes_with_the_lobes_is_no_coil(phase: float) -> None:
    """Two strands, straight, lit from one side: the dark limb's edge is seen up to 1.6 px inside,
    lobe by lobe. As a coil of one lobe's length it would add 0.09 to the pitch (measured so)."""
    section, diameter_px, rate = pair_core(2), 15.5, 0.18
    p = np.zeros(PARAMETERS)
    p[RHO], p[K], p[PHI] = 0.5 * diameter_px / section.diameter_d, rate, 0.4
    z = np.arange(-80.0, 81.0)
    upper, lower = model_edges(p, section, z[0], z.size)
    noise = 0.1 * np.random.default_rng(0).standard_normal((2, z.size))
    inside = 0.8 * (1.0 + np.cos(2.0 * rate * z + phase))
    sure = np.ones(z.size)
    edges = Edges(z + 80.0, upper + noise[0], lower + noise[1] + inside, sure, sure, (1.0, 0.3))
    found = fit_window(edges, section, 0.0, 160.0, diameter_px, NAN)
    assert found is not None and not found.fit.coiled
    assert found.fit.pitch_px == pytest.approx(2.0 * np.pi / rate, rel=0.01)


@pytest.mark.parametrize("phase", [0.0, 1.0, 2.0])
def test_an_edge_that_goes_as_often_as_the_section_repeats_is_no_coil(phase: float) -> None:
    """Six strands make four lobes a turn, but lie alike twice a turn: so often a dark limb's edge
    goes in and out. Told as coils (in five straight frames of eight) their pitch was up to 61 %
    off."""
    section, rate = pair_core(6), 0.1
    lit = twisted(section, rate, 0.4)
    inside = 1.5 * (1.0 + np.cos(2.0 * rate * np.arange(241.0) + phase))
    edges = replace(lit, lower_px=lit.lower_px + inside)
    found = fit_window(edges, section, 0.0, 240.0, DIAMETER_PX, NAN)
    assert found is not None and not found.fit.coiled
    assert found.fit.pitch_px == pytest.approx(2.0 * np.pi / rate, rel=0.01)


@pytest.mark.parametrize("coils_a_lobe", [0.2, 0.35, 0.7, 1.0])
def test_a_slight_coil_is_found_wherever_it_is_not_in_step(coils_a_lobe: float) -> None:
    """A sixth of D, so many coils a lobe."""
    section = pair_core(2)
    p = np.zeros(PARAMETERS)
    p[RHO] = 0.5 * DIAMETER_PX / section.diameter_d
    p[K], p[PHI], p[RC], p[KC], p[PHIC] = 0.1, 0.4, DIAMETER_PX / 6.0, 0.2 * coils_a_lobe, 1.0
    upper, lower = model_edges(p, section, -120.0, 241)
    edges = Edges(np.arange(241.0), upper, lower, np.ones(241), np.ones(241))
    found = fit_window(edges, section, 0.0, 240.0, DIAMETER_PX, NAN)
    assert found is not None and found.fit.coiled
    assert found.fit.p[KC] == pytest.approx(p[KC], rel=0.05)


def test_light_on_the_flanks_of_a_coil_does_not_move_the_diameter() -> None:
    """Edges seen farther out the more their flank is turned towards a lamp down the axis."""
    lit, _ = dark_below(9.0, 0)
    steep = [np.clip(o * np.gradient(e), 0, 1) for o, e in ((1, lit.upper_px), (-1, lit.lower_px))]
    edges = replace(lit, upper_px=lit.upper_px + steep[0], lower_px=lit.lower_px - steep[1])
    found = fit_window(edges, pair_core(2), 0.0, 240.0, DIAMETER_PX, NAN)
    assert found is not None and found.fit.coiled
    least, by_normal, alike = (
        abs(fit_helix(part, found.fit.section, found.fit.p, COILED).diameter_px - DIAMETER_PX)
        for part in (replace(edges, half_slope=m) for m in (bundle.FLANK, 1.0, np.inf))
    )
    assert least < 0.85 * by_normal < 0.85 * alike
    assert abs(found.fit.diameter_px - DIAMETER_PX) < 0.5 * alike


def swaying(edges: Edges, by_d: float) -> Edges:
    """The same whose middle sways by so many D, rms."""
    off = np.sqrt(2.0) * by_d * DIAMETER_PX * np.sin(np.linspace(0.0, 3.0 * np.pi, 241))
    return replace(edges, upper_px=edges.upper_px + off, lower_px=edges.lower_px + off)


def searches(monkeypatch: pytest.MonkeyPatch, holds: bool, sways: list[float]) -> list[tuple]:
    """What each search was given over frames of a straight bundle that sways by so many D; it finds
    no coil."""
    lit, _ = dark_below(0.0, 0)
    straight = fit_window(lit, pair_core(2), 0.0, 240.0, DIAMETER_PX, NAN)
    assert straight is not None and not straight.fit.coiled
    asked: list[tuple] = []

    def none_found(*given: object) -> object:
        asked.append(given)
        return straight.fit

    monkeypatch.setattr(bundle, "_searched", none_found)
    monkeypatch.setattr(bundle, "_holds", lambda warm, before, longer: holds)
    before = straight
    for by_d in sways:
        found = fit_window(swaying(lit, by_d), pair_core(2), 0.0, 240.0, DIAMETER_PX, NAN, before)
        assert found is not None
        before = found
    return asked


def test_coils_that_were_not_found_are_sought_again_where_the_middle_swings_more(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A straight bundle whose middle sways by 0.04 D: one search, none for as much again."""
    asked = searches(monkeypatch, True, [0.04, 0.04, 0.042, 0.06])
    swings = [bundle.swing_px(part) for part, *_ in asked]
    assert len(swings) == 2 and swings[1] > 1.4 * swings[0]


def test_a_poor_fit_to_what_hardly_swings_is_searched_for_coils_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Every frame whose straight fit was worse than the one before cost a search of 140 ms."""
    asked = searches(monkeypatch, False, [0.02, 0.02, 0.021, 0.027])
    assert [given[7] for given in asked] == [True, False, False, True]


def twisted(section: Section, rate: float, phase: float, noise_px: float = 0.1) -> Edges:
    p = np.zeros(PARAMETERS)
    p[RHO] = 0.5 * DIAMETER_PX / section.diameter_d
    p[K], p[PHI], p[Y0], p[SLOPE] = rate, phase, 0.4, 0.002
    edges = model_edges(p, section, -120.0, 241)
    noise = noise_px * np.random.default_rng(3).standard_normal((2, 241))
    return Edges(np.arange(241.0), *(edges + noise), *np.ones((2, 241)))


def like(section: Section) -> HelixFit:
    """The frame before: the same strands, their rate and phase another."""
    p = np.zeros(PARAMETERS)
    p[RHO] = 0.5 * DIAMETER_PX / section.diameter_d
    nothing = np.zeros((PARAMETERS, PARAMETERS))
    return HelixFit(p, nothing, 0.1, 0.04, 400, section, (0.0, 240.0))


@pytest.mark.parametrize("phase", [0.1, 0.9, 1.7, 2.5, 3.1])
def test_strands_whose_rate_is_nearly_known_are_found_at_any_phase(phase: float) -> None:
    edges = twisted(pair_core(2), 0.1, phase)
    fit = straight_at(edges, like(pair_core(2)), 0.102, SCALE_PX)
    assert fit is not None
    assert fit.p[K] == pytest.approx(0.1, abs=2e-4)
    assert fit.diameter_px == pytest.approx(DIAMETER_PX, abs=0.1)


def test_strands_that_may_stand_a_quarter_turn_on_are_not_led_on() -> None:
    """Eight lie nearly four-fold: in noise a search has to tell which of two phases it is."""
    plain, noisy = (twisted(pair_core(8), 0.1, 0.4, px) for px in (0.1, 2.0))
    fit = straight_at(plain, like(pair_core(8)), 0.1, SCALE_PX)
    assert fit is not None and fit.p[PHI] == pytest.approx(0.4, abs=0.02)
    assert straight_at(noisy, like(pair_core(8)), 0.1, SCALE_PX) is None


def test_a_straight_bundle_is_led_on_from_frame_to_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    """By as much as the motor has turned: no search while that fits as well as before."""
    section = pair_core(2)
    first = fit_window(twisted(section, 0.1, 0.4), section, 0.0, 240.0, DIAMETER_PX, 0.1)
    assert first is not None

    def searched(*given: object) -> None:
        raise AssertionError("searched")

    monkeypatch.setattr(bundle, "search_straight", searched)
    further = twisted(section, 0.11, 2.0)
    found = fit_window(further, section, 0.0, 240.0, DIAMETER_PX, 0.11, first)
    assert found is not None
    assert found.fit.p[K] == pytest.approx(0.11, abs=2e-4)


def test_a_coil_is_sought_where_no_column_shows_both_edges() -> None:
    """Of black and red strands on brown either edge was found on the red one alone: a singular
    matrix, and the learning of all frames was lost with it."""
    s = np.arange(120.0)
    upper = (s % 20 < 10).astype(float)
    edges = Edges(s, np.full(120, 10.0), np.full(120, -10.0), upper, 1.0 - upper)
    assert coil_at(edges, 0.1)[RC] == 0.0


@pytest.mark.parametrize(("slope", "aslant"), [(0.25, True), (-0.25, True), (0.05, False)])
def test_what_crosses_the_axis_is_a_leg(slope: float, aslant: bool) -> None:
    """A leg of four strands was measured for a bundle of eight in a frame of three turns, 20 px of
    99 off and surer than 1 (`wild 643`). Fitted bundles lie within 0.08 of their axis."""
    level = straight_in_noise(0.1)
    rise = slope * (level.s_px - 120.0)
    leg = replace(level, upper_px=level.upper_px + rise, lower_px=level.lower_px + rise)
    found = fit_window(leg, pair_core(2), 0.0, 240.0, DIAMETER_PX, NAN, coil=False)
    assert found is not None and found.fit.diameter_px == pytest.approx(DIAMETER_PX, abs=0.2)
    assert bundle.is_aslant(found.fit) == aslant


def test_coils_aslant_or_of_hardly_a_strand_are_none() -> None:
    lit, _ = dark_below(9.0, 0)
    found = fit_window(lit, pair_core(2), 0.0, 240.0, DIAMETER_PX, NAN)
    assert found is not None and found.fit.coiled
    coil = found.fit
    assert bundle._upright(coil) is coil and bundle._upright(None) is None
    p = coil.p.copy()
    p[SLOPE] = 0.2
    assert bundle._upright(replace(coil, p=p)) is None
    assert bundle._upright(replace(coil, z_px=(0.0, 0.5 * coil.pitch_px))) is None
    p[RC] = 0.0  # a straight one is left for the frame to judge
    assert bundle._upright(replace(coil, p=p)) is not None
