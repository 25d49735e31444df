"""Where a helix fit starts."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.band import full_band
from tsvision.measures.helix.bundle import SCALE_PX, _carried_on, fit_window
from tsvision.measures.helix.search import search_straight
from tsvision.measures.helix.section import pair_core
from tsvision.measures.helix.silhouette import (
    KC,
    PARAMETERS,
    PHI,
    PHIC,
    RC,
    RHO,
    K,
    model_edges,
    passing,
)

NAN = float("nan")


def eight(diameter_px: float, rate: float, phase: float = 0.4) -> np.ndarray:
    """(12,) a straight bundle of eight strands."""
    p = np.zeros(PARAMETERS)
    p[RHO], p[K], p[PHI] = 0.5 * diameter_px / pair_core(8).diameter_d, rate, phase
    return p


def dim_above(p: np.ndarray, columns: int, inside_px: float, seed: int) -> Edges:
    """Edges whose upper ones lie so far inside, and not evenly, and are trusted little."""
    upper, lower = model_edges(p, pair_core(8), -0.5 * (columns - 1), columns)
    rng = np.random.default_rng(seed)
    uneven = gaussian_filter1d(rng.standard_normal(columns), 4.0)
    upper = upper - inside_px - 0.4 * inside_px * uneven / uneven.std()
    lower = lower + 0.15 * rng.standard_normal(columns)
    sure = np.ones(columns)
    return Edges(np.arange(float(columns)), upper, lower, sure, sure, trust=(0.14, 1.0))


@pytest.mark.parametrize("seed", range(8))
def test_the_edge_that_is_trusted_tells_where_the_axis_lies(seed: int) -> None:
    """Steep strands of 3 px, a limb 2.4 px inside (`wild 901`): begun from the middle of both edges
    the strands were found a lobe off, or as a coil of no radius."""
    edges = dim_above(eight(23.0, 0.15), 189, 2.4, seed)
    band = full_band(edges, 23.0, 0.146)
    fit = search_straight(edges, pair_core(8), 23.0, band, SCALE_PX)
    assert fit is not None
    assert fit.p[K] == pytest.approx(0.15, rel=0.01)


def coiled(passes: float) -> np.ndarray:
    """(12,) eight strands that coil by 0.14 D every 63 px, strands and coil passing so often."""
    p = eight(23.0, 0.0)
    p[RC], p[KC], p[PHIC] = 3.2, 0.1, 1.0
    p[K] = passes - p[KC]
    return p


def seen(p: np.ndarray, columns: int = 185) -> Edges:
    edges = model_edges(p, pair_core(8), -0.5 * (columns - 1), columns)
    noise = 0.15 * np.random.default_rng(2).standard_normal((2, columns))
    return Edges(np.arange(float(columns)), *(edges + noise), *np.ones((2, columns)))


def test_a_coil_is_led_on_by_what_strands_and_coil_turn_together() -> None:
    """From 18 turns to 25 in one step: coils pass as often, so that the strands alone have to turn
    as much more often as the motor has turned. Led on by as large a share only they were found a
    lobe off, the pitch 11 % long (`wild 901`)."""
    first = fit_window(seen(coiled(0.22)), pair_core(8), 0.0, 184.0, 23.0, 0.22)
    assert first is not None and first.fit.coiled
    assert passing(first.fit.p) == pytest.approx(0.22, rel=0.01)
    after = _carried_on(seen(coiled(0.30)), first, 0.30, SCALE_PX)
    assert after is not None and after.coiled
    assert passing(after.p) == pytest.approx(0.30, rel=0.01)
