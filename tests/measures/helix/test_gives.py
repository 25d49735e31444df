"""What strands give, as several frames of a recording tell it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.measures.coils import behind_the_apex, touching_coil
from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.bundle import SCALE_PX, fit_window
from tsvision.measures.helix.crowded import crowded
from tsvision.measures.helix.fit import fit_helix
from tsvision.measures.helix.gives import gives_alike
from tsvision.measures.helix.section import pair_core
from tsvision.measures.helix.silhouette import (
    FREE_COILED,
    KC,
    PARAMETERS,
    PHI,
    PHIC,
    RC,
    RHO,
    K,
    model_edges,
)

NOISE_PX = 0.2
RIGID = np.append(np.ones(PARAMETERS - 1), 0.0)  # times parameters: of strands that do not give


def noisy(edges: Edges, seed: int, px: float = NOISE_PX) -> Edges:
    noise = px * np.random.default_rng(seed).standard_normal((2, edges.s_px.size))
    return replace(edges, upper_px=edges.upper_px + noise[0], lower_px=edges.lower_px + noise[1])


def rigid_coil(strings: int, radius_px: float) -> tuple[Edges, float]:
    """The outline of a coil whose strands do not give, and its D."""
    section = pair_core(strings)
    p = np.zeros(PARAMETERS)
    p[RHO] = 15.0 / section.diameter_d
    p[K], p[PHI], p[RC], p[KC], p[PHIC] = 0.04, 0.4, radius_px, 0.08, 1.0
    upper, lower = model_edges(p, section, -150.0, 301)
    return Edges(np.arange(301.0), upper, lower, *np.ones((2, 301))), 30.0


@pytest.mark.parametrize("strings", [6, 8])
def test_coils_of_strands_that_touch_tell_that_they_give(strings: int) -> None:
    seen = []
    for seed, past_onset in enumerate((1.2, 1.3, 1.4)):
        edges, diameter, _ = touching_coil(strings, past_onset)
        seen.append((noisy(edges, seed), behind_the_apex(edges, diameter)))
    share, sd = gives_alike(seen, pair_core(strings), diameter).gives
    assert share > 0.45
    assert sd < 0.3


@pytest.mark.parametrize("strings", [6, 8])
def test_coils_of_a_rigid_section_tell_that_they_do_not(strings: int) -> None:
    coils = [rigid_coil(strings, radius_px)[0] for radius_px in (6.0, 7.0, 8.0)]
    seen = [(noisy(edges, seed), (0.0, 300.0)) for seed, edges in enumerate(coils)]
    share, sd = gives_alike(seen, pair_core(strings), 30.0).gives
    assert share < 0.2
    assert sd < 0.3


def test_no_frame_is_a_witness_of_its_own() -> None:
    edges, diameter, _ = touching_coil(6)
    section = pair_core(6)
    assert gives_alike([(edges, behind_the_apex(edges, diameter))], section, diameter) is section


def test_strands_that_are_known_to_give_are_no_thinner_where_noise_hides_it() -> None:
    """In noise one outline alone says too little of what its strands do."""
    edges, diameter, _ = touching_coil(6)
    stretch = behind_the_apex(edges, diameter)
    found = fit_window(edges, pair_core(6), *stretch, diameter, float("nan"))
    assert found is not None
    off = {}
    for gives in ((0.0, 0.5), (0.7, 0.2)):
        section = replace(pair_core(6), gives=gives)
        each = []
        for seed in range(5):
            part = noisy(edges.window(*stretch), seed, 1.0)
            rigid = fit_helix(part, section, found.fit.p * RIGID, FREE_COILED, SCALE_PX)
            each.append(crowded(part, rigid, SCALE_PX).diameter_px / diameter - 1.0)
        off[gives] = abs(float(np.mean(each)))
    assert off[0.7, 0.2] < 0.03
    assert off[0.0, 0.5] > 0.035
