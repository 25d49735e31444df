"""Coils that go wider and narrower within the stretch that is fitted, drawn as spheres in space."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.measures.swept import LENGTH_PX, TWIST, D, bundle, from_the_axis
from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.bundle import FLANK, SCALE_PX, fit_window
from tsvision.measures.helix.section import pair_core
from tsvision.measures.helix.unevenly import fit_unevenly
from tsvision.measures.zone.fits import as_uneven

WAIST, BULGE = (-0.85, 10.0), (0.7, 22.0)  # share of the radius at most, sd in px


def coil_with(share: float, sd_px: float, noise_px: float) -> Edges:
    s = np.arange(LENGTH_PX)
    radius = 8.0 * (1.0 + share * np.exp(-0.5 * ((s - 400.0) / sd_px) ** 2))
    edges, _ = bundle(from_the_axis(radius))
    noise = noise_px * np.random.default_rng(2).standard_normal((2, LENGTH_PX))
    return replace(edges, upper_px=edges.upper_px + noise[0], lower_px=edges.lower_px + noise[1])


@pytest.mark.parametrize("where", [WAIST, BULGE])
@pytest.mark.parametrize("noise_px", [0.0, 0.3])
def test_strands_are_as_thick_and_twisted_as_beside_it(
    where: tuple[float, float], noise_px: float
) -> None:
    edges = coil_with(*where, noise_px)
    like = fit_window(edges, pair_core(2), 60.0, 220.0, D, np.nan)
    found = fit_window(edges, pair_core(2), 340.0, 460.0, D, np.nan)
    assert like is not None and found is not None
    part = replace(edges.window(340.0, 460.0), half_slope=FLANK)
    fit = fit_unevenly(part, found.fit, like.fit, SCALE_PX)
    assert fit is not None and fit.uneven
    assert fit.cost < 0.5 * found.fit.cost
    assert fit.diameter_px == pytest.approx(D, rel=0.015)
    assert fit.pitch_px == pytest.approx(2.0 * np.pi / TWIST, rel=0.025)


def test_an_even_coil_stays_as_it_is() -> None:
    edges = coil_with(0.0, 1.0, 0.2)
    found = fit_window(edges, pair_core(2), 340.0, 460.0, D, np.nan)
    assert as_uneven(edges, found, found) is found


def test_what_a_helix_describes_badly_is_told_unevenly() -> None:
    edges = coil_with(1.2, 22.0, 0.0)
    like = fit_window(edges, pair_core(2), 60.0, 220.0, D, np.nan)
    found = fit_window(edges, pair_core(2), 340.0, 460.0, D, np.nan)
    told = as_uneven(edges, found, like)
    assert told is not None and told.fit.uneven
    assert told.fit.diameter_px == pytest.approx(D, rel=0.015)
