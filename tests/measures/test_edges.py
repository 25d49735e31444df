"""Edges of a shaded, blurred tube drawn from the formula: where the model must find them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from tsvision.measures.edges import fit_shading, make_shading, match_edges, sample_profiles

FINE = 0.01


def tube(
    offsets_px: np.ndarray, rho_px: float, blur_px: float, a: float, b: float, c: float
) -> np.ndarray:
    """Brightness at `offsets_px` inside a tube's edge; light is never negative."""
    t = np.arange(-14.0, 30.0, FINE)
    x = np.clip(1.0 - t / rho_px, -1.0, 1.0)
    light = a + np.maximum(b * np.sqrt(1.0 - x * x) + c * x, 0.0)
    inside = np.where(np.abs(t) < 0.5 * FINE, 0.5, t > 0.0)
    soft = gaussian_filter1d(inside * light, blur_px / FINE)
    return np.interp(offsets_px, t, soft)


def offsets_for(rho_px: float) -> np.ndarray:
    return np.arange(-5.0, max(0.85 * rho_px, 2.5) + 1e-9, 0.25)


@pytest.mark.parametrize("rho_px", [6.0, 10.0, 15.0])
@pytest.mark.parametrize("sense", [1, -1])
def test_a_plain_step_is_placed_exactly(rho_px: float, sense: int) -> None:
    """Silhouette lighting: 0.4 px off before, under 0.03 px after."""
    offsets = offsets_for(rho_px)
    profile = tube(offsets + 0.4, rho_px, 1.0, 1.0, 0.0, 0.0)
    *sides, place = fit_shading((profile, profile), offsets, rho_px, sense)
    np.testing.assert_allclose(place, -0.4, atol=0.03)
    assert sides[0].blur_px == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("rho_px", [6.0, 10.0, 15.0])
def test_the_edge_of_a_front_lit_tube_lies_outside_its_half_level(rho_px: float) -> None:
    """Ambient 0.2, lamp beside the camera: the half level is 0.5 to 1.3 px inside. The model is
    within 0.25 px: ramp and place trade against each other, most where the strand is thin."""
    offsets = offsets_for(rho_px)
    profile = tube(offsets, rho_px, 1.0, 0.2, 0.8, 0.0)
    half = float(np.interp(0.5 * profile.max(), profile, offsets))
    assert half > 0.4
    *_, place = fit_shading((profile, profile), offsets, rho_px)
    np.testing.assert_allclose(place, 0.0, atol=0.3)


@pytest.mark.parametrize("edge", [20.0, 20.3, 20.5, 20.8])
@pytest.mark.parametrize("outward", [1, -1])
def test_every_column_is_matched_wherever_its_edge_lies(edge: float, outward: int) -> None:
    """Noise-free columns of the template's own shape, started up to 1 px off. Measured: 0.013 px,
    a quarter of the step on which the template is sampled."""
    shade = make_shading(8.0, 1.0, (0.3, 0.7, 0.1))
    rows = np.arange(41.0)
    column = 5.0 + 30.0 * tube(outward * (edge - rows), 8.0, 1.0, 0.3, 0.7, 0.1)
    values = np.repeat(column[:, None], 5, axis=1).astype(np.float32)
    start = edge + np.array([-1.0, -0.5, 0.0, 0.5, np.nan])
    found, depth, residual = match_edges(values, start, outward, shade, np.zeros(5))
    np.testing.assert_allclose(found[:4], edge, atol=0.02)
    np.testing.assert_allclose(depth[:4], 30.0, rtol=0.02)
    assert residual[:4].max() < 0.1
    assert np.isnan(found[4])


def test_profiles_are_read_from_outside_to_inside() -> None:
    rows = np.arange(30.0)[:, None] * np.ones((1, 3))
    offsets = np.array([-2.0, 0.0, 3.5])
    upper = sample_profiles(rows, np.full(3, 20.0), 1, offsets)
    lower = sample_profiles(rows, np.full(3, 10.0), -1, offsets)
    np.testing.assert_allclose(upper, [[22.0, 20.0, 16.5]] * 3)
    np.testing.assert_allclose(lower, [[8.0, 10.0, 13.5]] * 3)
    assert np.isnan(sample_profiles(rows, np.full(3, 29.0), 1, offsets)[:, 0]).all()
