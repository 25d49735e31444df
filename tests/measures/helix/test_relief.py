"""The light inside the outline tells coils apart that have nearly the same outline."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from tests.measures.lit import BLUR_PX, COLUMNS, lit
from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.band import Band
from tsvision.measures.helix.branches import best_branch
from tsvision.measures.helix.fit import fit_helix, with_relief
from tsvision.measures.helix.relief import explained, scan_relief
from tsvision.measures.helix.search import search_straight
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
from tsvision.measures.helix.weigh import weighed

LIGHTS = {"from the camera": (0.0, 0.0, 1.0), "from the side": (0.3, 0.6, 0.75)}


def coil(strings: int, phase: float = 0.4) -> np.ndarray:
    """(10,) a bundle of 20 px that coils by 8 px every 38."""
    p = np.zeros(PARAMETERS)
    p[RHO] = 10.0 / pair_core(strings).diameter_d
    p[K], p[PHI], p[RC], p[KC], p[PHIC] = 0.19, phase, 8.0, 2.0 * np.pi / 38.0, 1.0
    return p


def lobes_off(p: np.ndarray, strings: int, more: int) -> list[np.ndarray]:
    """The same coil with so many lobes more a turn of it, at twelve phases."""
    found = []
    for phase in np.linspace(0.0, np.pi, 12, endpoint=False):
        found.append(p.copy())
        found[-1][K] += more * p[KC] / pair_core(strings).lobes
        found[-1][PHI] = phase
    return found


@pytest.mark.parametrize("strings", [2, 4])
@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("light", LIGHTS)
def test_the_right_strands_explain_most_of_the_light(strings: int, side: int, light: str) -> None:
    p, section = coil(strings), pair_core(strings)
    picture = lit(p, strings, LIGHTS[light], side)
    right = explained(picture, p, section, BLUR_PX)
    wrong = [
        explained(picture, q, section, BLUR_PX)
        for more in (-1, 1)
        for q in lobes_off(p, strings, more)
    ]
    assert right > 0.7
    assert 1.0 - max(wrong) > 2.0 * (1.0 - right)  # what is left unexplained decides


def test_a_scan_of_rates_and_phases_finds_the_strands() -> None:
    p, section = coil(2, phase=1.3), pair_core(2)
    picture = lit(p, 2, LIGHTS["from the camera"], -1)
    rates, phases = np.linspace(0.05, 0.35, 61), np.linspace(0.0, np.pi, 12, endpoint=False)
    start = p.copy()
    start[K], start[PHI] = 0.11, 0.0
    shares = scan_relief(picture, start, section, rates, phases)
    i, j = np.unravel_index(np.argmax(shares), shares.shape)
    assert rates[i] == pytest.approx(p[K], abs=0.006)
    assert abs((phases[j] - p[PHI] + 0.5 * np.pi) % np.pi - 0.5 * np.pi) < 0.3


def test_where_nothing_is_seen_inside_nothing_is_explained() -> None:
    p, section = coil(2), pair_core(2)
    picture = (lit(p, 2, LIGHTS["from the camera"], 1) > 0.1).astype(np.float32)
    noise = 0.02 * np.random.default_rng(3).standard_normal(picture.shape).astype(np.float32)
    assert explained(picture + noise, p, section, BLUR_PX) < 0.35
    assert explained(noise, p, section, BLUR_PX) < 0.05
    p[RHO] = 0.4
    assert explained(noise[:, :8], p, section, BLUR_PX) == 0.0


@pytest.mark.parametrize("more", [-1, 1])
def test_light_leads_back_from_a_lobe_too_few_or_too_many(more: int) -> None:
    """Flanks lost, as they are in pictures, a lobe more or less a turn fits nearly as well."""
    p, section = coil(2), pair_core(2)
    upper, lower = model_edges(p, section, -0.5 * (COLUMNS - 1), COLUMNS)
    flat = [(np.abs(np.gradient(e)) < 0.7).astype(float) for e in (upper, lower)]
    picture = lit(p, 2, LIGHTS["from the side"], 1)
    edges = Edges(np.arange(float(COLUMNS)), upper, lower, *flat, light=picture, blur_px=BLUR_PX)
    starts = lobes_off(p, 2, more)
    fits = [fit_helix(replace(edges, blur_px=0.0), section, q, FREE_COILED, 0.5) for q in starts]
    wrong = min(fits, key=lambda fit: fit.cost)
    assert abs(wrong.p[K] / p[K] - 1.0) > 0.1  # or there is nothing to lead back from
    band = Band(0.02, 0.5)
    best = best_branch(replace(edges, blur_px=0.0), with_relief(edges, wrong), band, 0.5)
    assert best.pitch_px == pytest.approx(replace(wrong, p=p).pitch_px, rel=0.01)
    # Against the light the motor alone decides between two fits as good as each other.
    dark = with_relief(replace(edges, light=0.0 * picture), wrong)
    assert weighed(dark, float("nan")) == pytest.approx(wrong.cost, rel=1e-6)


def test_light_tells_strands_whose_lobes_are_levelled() -> None:
    """Blur, shake and coding leave a part of the lobes of a thin bundle and ripples of their own.
    The outline alone finds the strands in nine of twelve such, with the light inside in all."""
    p, section = coil(2), pair_core(2)
    p[RC] = p[KC] = p[PHIC] = 0.0
    p[K] = 0.26
    outline = np.array(model_edges(p, section, -0.5 * (COLUMNS - 1), COLUMNS))
    lobes = outline - outline.mean(axis=1, keepdims=True)
    picture = lit(p, 2, LIGHTS["from the side"], 1)
    found = []
    for seed in range(12):
        noise = np.random.default_rng(seed).standard_normal(outline.shape)
        ripples = gaussian_filter1d(noise, 2.0, axis=1)
        upper, lower = outline - 0.6 * lobes + 0.8 * ripples / ripples.std()
        dark = Edges(np.arange(float(COLUMNS)), upper, lower, *np.ones((2, COLUMNS)))
        both = [
            search_straight(seen, section, 20.0, Band(0.1, 0.7, 0.26, 0.26), 0.5)
            for seen in (dark, replace(dark, light=picture))
        ]
        found.append([fit is not None and abs(fit.p[K] / 0.26 - 1.0) < 0.03 for fit in both])
    without, with_light = np.sum(found, axis=0)
    assert without <= 10 and with_light == 12


def test_bands_of_two_colours_are_no_relief() -> None:
    """Of four strands, two bright and two dark, four of twice the pitch explain several times as
    much light as they do themselves: pitches came out twice as long (`wild 1417`)."""
    p, section = coil(4), pair_core(4)
    p[RC] = p[KC] = p[PHIC] = 0.0
    side_by_side = np.argsort(section.angle_rad % (2.0 * np.pi))
    paint = np.ones(4)
    paint[side_by_side[2:]] = 0.1
    picture = lit(p, 4, LIGHTS["from the side"], 1, paint=tuple(paint))
    slow = [p.copy() for _ in range(24)]
    for q, phase in zip(slow, np.linspace(0.0, np.pi, len(slow), endpoint=False), strict=True):
        q[[K, PHI]] = 0.5 * p[K], phase
    misled = max(slow, key=lambda q: explained(picture, q, section, BLUR_PX))
    assert explained(picture, misled, section, BLUR_PX) > 0.4
    assert explained(picture, p, section, BLUR_PX) < 0.2
    outline = model_edges(p, section, -0.5 * (COLUMNS - 1), COLUMNS)
    edges = Edges(np.arange(float(COLUMNS)), *outline, *np.ones((2, COLUMNS)), light=picture)
    for start in (p, misled):
        fit = fit_helix(edges, section, start, (RHO, K, PHI), 0.5)
        assert with_relief(edges, fit).relief > 0.0
        assert with_relief(replace(edges, painted=True), fit) is fit
