"""What the outline's shape alone tells of the width, and what that is good for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.measures.pictures import picture
from tests.measures.tube import offsets_for, seen, tube
from tsvision.measures.edges.cut import cut_frame
from tsvision.measures.edges.edges import Edges
from tsvision.measures.edges.find import find_edges
from tsvision.measures.edges.shading import TEMPLATE_GRID_PX
from tsvision.measures.helix.bundle import BundleFit
from tsvision.measures.helix.fit import fit_helix
from tsvision.measures.helix.section import pair_core
from tsvision.measures.helix.silhouette import (
    EDGE,
    PARAMETERS,
    PHI,
    RHO,
    STRAIGHT,
    TILT,
    K,
    model_edges,
)
from tsvision.measures.light.shading_fit import fit_shading
from tsvision.measures.light.shape import UNKNOWN, Shape, hidden_px, shape_of
from tsvision.measures.recording import Measurer
from tsvision.records import Rig, Strings, View

DIAMETER_PX = 30.0


def fitted(strings: int, outside_px: float, phase_rad: float) -> tuple[Edges, BundleFit]:
    """Edges of touching round strands, both found `outside_px` too far out, and the helix that
    fits them best where they are taken for the true ones."""
    section = pair_core(strings)
    p = np.zeros(PARAMETERS)
    p[RHO] = 0.5 * DIAMETER_PX / section.diameter_d
    p[K], p[PHI] = np.tan(np.deg2rad(25.0)) / (0.5 * DIAMETER_PX), phase_rad
    upper, lower = model_edges(p, section, -150.0, 301)
    noise = 0.1 * np.random.default_rng(3).standard_normal((2, 301))
    s, sure = np.arange(301.0), np.ones(301)
    held = tuple(i for i in STRAIGHT if i != EDGE)
    edges = Edges(s, upper + outside_px + noise[0], lower - outside_px + noise[1], sure, sure)
    return edges, BundleFit(fit_helix(edges, section, p, held), 0.0, 300.0, float("nan"))


@pytest.mark.parametrize("strings", [2, 4, 6])
@pytest.mark.parametrize("outside_px", [-2.0, 0.0, 1.0])
def test_the_shape_tells_how_far_the_edges_are_off(strings: int, outside_px: float) -> None:
    bundles = [fitted(strings, outside_px, phase) for phase in (0.2, 0.9, 1.6)]
    told = shape_of(bundles, 0.0)
    taken_px = float(np.median([found.fit.diameter_px for _, found in bundles]))
    assert taken_px - DIAMETER_PX == pytest.approx(2.0 * outside_px, abs=1.0)
    assert taken_px - told.width_px == pytest.approx(DIAMETER_PX, abs=0.3)
    assert told.sd_px > 0.035 * 0.85 * DIAMETER_PX  # real strands are not rigid circles


@pytest.mark.parametrize("tilt", [-0.08, 0.08])
def test_a_view_aslant_is_no_other_radius(tilt: float) -> None:
    """Steep strands seen at 5 degrees, and one side's edges rough, so that the other has to tell:
    its crests are stretched or squeezed, as of a bundle 20 % thinner or thicker, and edges told by
    their light to 0.2 px were moved by pixels (`wild 643`)."""
    section, bundles = pair_core(8), []
    for phase in (0.2, 0.9, 1.6):
        p = np.zeros(PARAMETERS)
        p[RHO] = 0.5 * DIAMETER_PX / section.diameter_d
        p[K], p[PHI], p[TILT] = np.tan(np.deg2rad(54.0)) / (0.5 * DIAMETER_PX), phase, tilt
        upper, lower = model_edges(p, section, -150.0, 301)
        rough = 0.5 * np.random.default_rng(3).standard_normal(301)
        s, sure = np.arange(301.0), np.ones(301)
        edges = Edges(s, upper, lower + rough, sure, sure)
        held = tuple(i for i in STRAIGHT if i != EDGE)
        fit = fit_helix(edges, section, p * (np.arange(PARAMETERS) != TILT), held)
        bundles.append((edges, BundleFit(fit, 0.0, 300.0, float("nan"))))
    told = shape_of(bundles, 0.0)
    assert bundles[0][1].fit.diameter_px == pytest.approx(DIAMETER_PX, abs=0.2)
    assert abs(told.width_px) < told.sd_px


def test_without_a_fit_nothing_is_told() -> None:
    assert shape_of([], 1.0) == UNKNOWN
    assert UNKNOWN.starts() == []


def test_a_shape_that_blur_has_rounded_off_overrules_no_light() -> None:
    """Of eight strings shaken and defocused it told 9 px less with an sd of 4, half a strand's
    radius being 2.5, and moved what the light had told to 0.1 px by 2."""
    bundles = [fitted(6, 0.0, phase) for phase in (0.2, 0.9, 1.6)]
    assert shape_of(bundles, 0.1 * DIAMETER_PX) == UNKNOWN
    assert shape_of(bundles, 0.0) != UNKNOWN


def test_edges_that_no_helix_fits_tell_nothing() -> None:
    edges, found = fitted(2, 0.0, 0.2)
    lost = replace(edges, upper_weight=0.0 * edges.s_px, lower_weight=0.0 * edges.s_px)
    assert shape_of([(lost, found)], 1.0) == UNKNOWN


def test_a_limb_without_light_is_placed_by_the_shape() -> None:
    """One lamp 70 degrees to the side and hardly any light from elsewhere: what is seen of the dark
    limb is where the lamp's light ends, taken here for the edge, as a first look does. 3.4 px."""
    rho_px, shadow_px = 10.0, 3.4
    offsets = offsets_for(rho_px)
    turn = np.deg2rad(70.0)
    lit, dark = (
        tube(offsets + off, rho_px, 1.0, 0.01, np.cos(turn), sign * np.sin(turn))
        for off, sign in ((0.0, 1.0), (shadow_px, -1.0))
    )
    profiles = seen(rho_px, lit, offsets), seen(rho_px, dark, offsets)
    told = Shape(-shadow_px, 1.0)
    *_, places = fit_shading(profiles, rho_px, shape=told)
    assert abs(float(places.sum()) + shadow_px) < 1.0
    assert abs(float(places[0])) < 0.3  # the lit limb is told by its light


def test_a_side_that_hardly_has_the_masks_level_is_still_matched() -> None:
    """The outline of the mask says nothing there of how far inside the edge it runs: matches that
    began as far out as it seemed found nothing, and such a film was not measured at all."""
    pixels = picture(dark_on_bright=False)
    measurer = Measurer(Rig(strings=Strings(count=2), view=View(separator_side="none")))
    measurer.prime([pixels])
    looks = measurer.looks
    assert looks is not None
    strand_px = looks.diameter_px / looks.section.diameter_d
    cut = cut_frame(pixels, looks.sight, strand_px, looks.half_px)
    assert cut is not None
    cut = replace(cut, mask_levels=(0.6, 0.6))
    side = looks.shading[0]
    weak = 0.99 * cut.mask_levels[0] * np.minimum(side.template / side.template.max(), 1.0)
    weak[1.5 * side.rho_px < TEMPLATE_GRID_PX] = 1.01 * cut.mask_levels[0]
    found = find_edges(cut, (replace(side, added=weak - side.template), looks.shading[1]))
    assert (found.upper_weight > 0.0).mean() > 0.5


@pytest.mark.parametrize("width_px", [-20.0, 20.0])
def test_a_width_that_no_two_edges_have_is_no_fault(width_px: float) -> None:
    """Poor fits of a two-coloured film told of one; nothing was learnt from it then."""
    rho = 6.0
    offsets = offsets_for(rho)
    profile = seen(rho, tube(offsets, rho, 0.9, 0.4, 0.5, 0.2), offsets)
    *sides, places = fit_shading((profile, profile), rho, shape=Shape(width_px, 0.05))
    assert np.isfinite(places).all()
    assert all(np.isfinite(side.blur_px) for side in sides)


def test_a_shape_that_its_own_frames_contradict_overrules_no_light() -> None:
    """Widths that scatter by a seventh of D over three frames, far from what the light tells."""
    sure, unsure = Shape(9.0, 3.0), Shape(9.0, 3.0, freedom=2.0)
    assert sure.joined(0.0, 0.5).width_px > 3.0
    assert unsure.joined(0.0, 0.5).width_px < 1.5


@pytest.mark.parametrize(
    ("outside_px", "is_known"), [((0.0, 0.0, 0.0), True), ((0.0, 1.0, -1.0), False)]
)
def test_a_few_widths_that_scatter_leave_few_degrees_of_freedom(
    outside_px: tuple[float, ...], is_known: bool
) -> None:
    phases = (0.2, 0.9, 1.6)
    told = shape_of([fitted(2, off, at) for off, at in zip(outside_px, phases, strict=True)], 0.0)
    assert np.isinf(told.freedom) == is_known
    assert is_known or told.freedom < 10.0


def with_a_border(rough_px: float) -> tuple[Edges, BundleFit]:
    """Two strands whose lower edges lie 2 px too far in, and along neither outline nor line: off by
    `rough_px` to and fro, over stretches of 12 px."""
    edges, found = fitted(2, 0.0, 0.9)
    to_and_fro = rough_px * np.where(np.arange(301) % 24 < 12, 1.0, -1.0)
    lit = replace(edges, lower_px=edges.lower_px + 2.0 + to_and_fro)
    held = tuple(i for i in STRAIGHT if i != EDGE)
    return lit, replace(found, fit=fit_helix(lit, found.fit.section, found.fit.p, held))


def test_what_a_border_of_light_hides_is_known_by_the_outline_of_the_other_side() -> None:
    """The limb beyond the border of what is lit is ground to the eye; such edges run roughly."""
    assert hidden_px([]) == 0.0
    assert hidden_px([fitted(2, 0.0, phase) for phase in (0.2, 0.9)]) == 0.0
    assert hidden_px([fitted(2, -1.0, phase) for phase in (0.2, 0.9)]) == 0.0  # as far in, but even
    border, strand_px = with_a_border(1.2), 0.25 * DIAMETER_PX
    missing = DIAMETER_PX - border[1].fit.diameter_px
    assert missing > 0.5
    assert 0.5 * missing < hidden_px([border]) <= 0.6 * strand_px


def test_no_shape_overrules_the_light_where_no_limb_hides() -> None:
    """Strands that show without light as well as lit: a shape that says otherwise, told from edges
    that files blur, made a width of 80 px known to 14."""
    told = Shape(15.0, 4.1).joined(0.0, 0.15, hides=False)
    assert abs(told.width_px) < 0.2
    assert told.sd_px < 0.2
