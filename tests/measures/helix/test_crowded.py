"""Coils whose strands give way: in space, as the renderer's contact leaves them, and rigid ones."""

from __future__ import annotations

import numpy as np
import pytest

from tests.measures.coils import behind_the_apex, touching_coil
from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.bundle import SCALE_PX, fit_window
from tsvision.measures.helix.crowded import crowded, given_way
from tsvision.measures.helix.fit import fit_helix
from tsvision.measures.helix.section import pair_core, room_needed
from tsvision.measures.helix.silhouette import (
    CROWD,
    FREE_COILED,
    KC,
    PARAMETERS,
    PHI,
    PHIC,
    RC,
    RHO,
    K,
    model_edges,
    waves,
)


def nearest(strings: int, twist: float, curvature: float, share: float) -> float:
    """Of any two strands that give a share of all in a bend, along an arc of a circle; d."""
    section = pair_core(strings)
    give = given_way(section, twist, curvature)
    room = room_needed(section, twist)
    z = np.linspace(-2.0 * np.pi / twist, 2.0 * np.pi / twist, 2001)
    strands = []
    for radius, angle, gives in zip(section.radius_d, section.angle_rad, give, strict=True):
        psi = angle + twist * z
        out, on = share * (gives @ waves(psi) - np.array([[room * radius], [0.0]]))
        out = out + (1.0 + room) * radius
        about = 1.0 / curvature - (out * np.cos(psi) - on * np.sin(psi))
        aside = out * np.sin(psi) + on * np.cos(psi)
        turn = curvature * z
        strands.append(np.stack([about * np.cos(turn), about * np.sin(turn), aside], axis=1))
    return min(
        float(np.linalg.norm(other[None] - one[500:1500:10, None], axis=2).min())
        for i, one in enumerate(strands)
        for other in strands[:i]
    )


@pytest.mark.parametrize("strings", [5, 6, 8])
def test_strands_that_give_way_overlap_no_more(strings: int) -> None:
    """Steep ones, in a bend of five strand diameters: a tenth of d before, to first order none."""
    before, after = (nearest(strings, 0.7, 0.2, share) for share in (0.0, 1.0))
    assert before < 0.93
    assert 1.0 - after < 0.5 * (1.0 - before)


@pytest.mark.parametrize("strings", [6, 8])
def test_the_coil_of_strands_that_touch_is_no_thinner(strings: int) -> None:
    """By contact solved in space, which shares nothing with what is fitted."""
    edges, diameter, pitch = touching_coil(strings)
    stretch = behind_the_apex(edges, diameter)
    found = fit_window(edges, pair_core(strings), *stretch, diameter, float("nan"))
    assert found is not None and found.fit.coiled
    assert found.fit.diameter_px == pytest.approx(diameter, rel=0.015)
    assert found.fit.pitch_px == pytest.approx(pitch, rel=0.012)


@pytest.mark.parametrize("strings", [5, 6, 7, 8])
def test_a_rigid_section_does_not_give(strings: int) -> None:
    section = pair_core(strings)
    p = np.zeros(PARAMETERS)
    p[RHO] = 15.0 / section.diameter_d
    p[K], p[PHI], p[RC], p[KC], p[PHIC] = 0.08, 0.4, 8.0, 0.06, 1.0
    noise = 0.1 * np.random.default_rng(strings).standard_normal((2, 301))
    upper, lower = noise + model_edges(p, section, -150.0, 301)
    edges = Edges(np.arange(301.0), upper, lower, *np.ones((2, 301)))
    rigid = fit_helix(edges, section, p, FREE_COILED, SCALE_PX)
    found = crowded(edges, rigid, SCALE_PX)
    assert found.diameter_px == pytest.approx(30.0, abs=0.15)
    assert found.p[CROWD] < 0.1


def test_a_coil_that_no_edge_lies_near_asks_nothing_of_its_strands() -> None:
    """What edges are off by is infinite then, and so was the hold on what strands give: learning
    from such frames ended the program."""
    section = pair_core(6)
    p = np.zeros(PARAMETERS)
    p[RHO] = 15.0 / section.diameter_d
    p[K], p[PHI], p[RC], p[KC], p[PHIC] = 0.08, 0.4, 8.0, 0.06, 1.0
    upper, lower = model_edges(p, section, -150.0, 301)
    edges = Edges(np.arange(301.0), upper + 500.0, lower + 500.0, *np.ones((2, 301)))
    lost = fit_helix(edges, section, p, FREE_COILED, iterations=0)
    assert np.isinf(lost.rms_px)
    assert np.isfinite(crowded(edges, lost, SCALE_PX).p).all()
