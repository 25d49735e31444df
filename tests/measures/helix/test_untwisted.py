"""Legs and strands side by side, which some helix fits as well."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from tests.measures.lit import lit
from tests.srgb import encode
from tsvision.flags import Flag, flags_from_text
from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.bundle import BundleFit, fit_window
from tsvision.measures.helix.section import pair_core
from tsvision.measures.helix.silhouette import PARAMETERS, PHI, RHO, K, model_edges
from tsvision.measures.helix.untwisted import is_smooth, is_tapered
from tsvision.measures.recording import Measurer
from tsvision.measures.zone.width import width_between_knots
from tsvision.records import Camera, Frame, Rig, Strings, View


def of_eight(edges: Edges, diameter_px: float, rate: float = float("nan")) -> BundleFit:
    """What eight strands make of some edges."""
    last = float(edges.s_px[-1])
    fit = fit_window(edges, pair_core(8), 0.0, last, diameter_px, rate)
    assert fit is not None
    return fit


def roughened(edges: Edges, sd_px: float, seed: int) -> Edges:
    noise = sd_px * np.random.default_rng(seed).standard_normal((2, edges.s_px.size))
    return replace(edges, upper_px=edges.upper_px + noise[0], lower_px=edges.lower_px + noise[1])


@pytest.mark.parametrize("seed", range(3))
def test_a_leg_of_four_strands_is_no_bundle_of_eight(seed: int) -> None:
    """Its edges are straight lines, a little oblique; some helix of eight comes near them."""
    s = np.arange(700.0)
    even = np.ones(s.size)
    leg = roughened(Edges(s, 35.0 + 0.01 * s, -36.0 + 0.012 * s, even, even), 0.3, seed)
    assert is_smooth(leg, of_eight(leg, 71.0))


@pytest.mark.parametrize("seed", range(3))
def test_a_bundle_of_eight_is_not_smooth(seed: int) -> None:
    """Its edges swing by 2.5 px, in noise of 0.3."""
    section, s = pair_core(8), np.arange(500.0)
    p = np.zeros(PARAMETERS)
    p[[RHO, K]] = 12.0 / section.diameter_d, 2.0 * np.pi / 90.0
    upper, lower = model_edges(p, section, -250.0, s.size)
    even = np.ones(s.size)
    bundle = roughened(Edges(s, upper, lower, even, even), 0.3, seed)
    fit = of_eight(bundle, 24.0)
    assert fit.fit.pitch_px == pytest.approx(90.0, rel=0.02)
    assert not is_smooth(bundle, fit)


@pytest.mark.slow
def test_a_picture_of_such_a_leg_tells_no_width() -> None:
    """Eight strings make a bundle of 96 px, four side by side a smooth strip of 72."""
    rng = np.random.default_rng(1)
    n = np.abs(np.arange(400.0) - 200.0)[:, None] / 36.0
    light = 0.05 + 0.6 * np.sqrt(np.clip(1.0 - n**2, 0.0, 1.0)) * np.ones((1, 900))
    light = cv2.GaussianBlur(light, (0, 0), 1.0) + 0.01 * rng.standard_normal(light.shape)
    strings, camera = Strings(count=8, diameter_mm=0.24), Camera(mm_per_px=0.24 * 3.6458 / 96.0)
    measurer = Measurer(Rig(strings=strings, camera=camera, view=View(separator_side="none")))
    pictures = [encode(light), encode(light)]
    measurer.prime(pictures)
    assert measurer.looks is not None
    row = measurer.measure(Frame(0, "", pictures[0]), 3.0).row
    assert np.isnan(row.diameter_px) and np.isnan(row.pitch_px)
    assert Flag.NO_BUNDLE in flags_from_text(row.flags)


def in_light(strings: int, rate: float) -> Edges:
    """What a picture blurred by 2 px shows of some of eight strands that would be 24 px wide: edges
    that are all but straight, and light inside."""
    p = np.zeros(PARAMETERS)
    p[[RHO, K, PHI]] = 12.0 / pair_core(8).diameter_d, rate, 0.4
    light = lit(p, strings, (0.3, 0.3, 0.9), 1, blur_px=2.0)
    columns = light.shape[1]
    rng = np.random.default_rng(1)
    light = light + 0.02 * rng.standard_normal(light.shape).astype(np.float32)
    outline = np.array(model_edges(p, pair_core(strings), -0.5 * (columns - 1), columns))
    level = gaussian_filter1d(outline, 3.0, axis=1) + 0.5 * rng.standard_normal(outline.shape)
    s, sure = np.arange(float(columns)), np.ones(columns)
    return Edges(s, *level, sure, sure, blur_px=2.0, light=light)


@pytest.mark.parametrize("rate", [0.08, 0.114])
def test_ridges_tell_of_strands_whose_lobes_blur_has_levelled(rate: float) -> None:
    """Eight strands of 7 px in a blur of 2 px at 9 turns were taken for too few turns (`wild
    902`)."""
    edges = in_light(8, rate)
    found = of_eight(edges, 24.0, rate)
    assert not is_smooth(edges, found)
    assert found.fit.p[K] == pytest.approx(rate, rel=0.03)


@pytest.mark.parametrize("rate", [0.08, 0.114])
def test_strands_side_by_side_show_no_ridges_that_turn(rate: float) -> None:
    edges = in_light(4, 1e-6)
    assert is_smooth(edges, of_eight(edges, 24.0, rate))


def bounded(width_px: np.ndarray) -> Edges:
    """What lies evenly about a line, found with noise."""
    noise = 0.3 * np.random.default_rng(1).standard_normal((2, width_px.size))
    half, sure = 0.5 * width_px, np.ones(width_px.size)
    return Edges(
        np.arange(width_px.size, dtype=float), half + noise[0], noise[1] - half, sure, sure
    )


S = np.arange(150.0)


@pytest.mark.parametrize("together", [0.2, -0.2])
def test_borders_that_run_together_are_those_of_two_legs(together: float) -> None:
    """Where they meet at the picture's border their distance was told as D, 30 px of 90 too wide
    (`wild 830`, and `796` where nothing fitted)."""
    legs = bounded(80.0 - together * (S - 75.0))
    assert is_tapered(legs)
    assert np.isnan(width_between_knots(legs, 90.0))


@pytest.mark.parametrize(
    "width_px",
    [80.0 - 0.01 * S, 40.0 + 15.0 * np.abs(np.cos(S / 30.0)), 80.0 + 40.0 * (S > 110)],
    ids=["seen aslant", "strands", "a knot at its end"],
)
def test_a_bundle_does_not_taper(width_px: np.ndarray) -> None:
    assert not is_tapered(bounded(width_px))
