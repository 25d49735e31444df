"""Strands in the bundle's own shadow are outlined; soft shadows, fibres and specks are not."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from tsvision.measures.edges.dim import dim_edges
from tsvision.measures.edges.falloff import falloff_along
from tsvision.measures.edges.strands import Silhouette

COLUMNS, HALF, WIDTH, STRAND = 300, 60, 24.0, 8.0
LIT, FAR = 10, 20  # last lit row above and below the axis, and where dim strands end above it
N = np.arange(-HALF, HALF + 1)


def strip(beyond: np.ndarray) -> np.ndarray:
    """Lit strings about the axis and `beyond` (R, M) added, seen through a lens, with noise."""
    lit = np.repeat((np.abs(N) <= LIT)[:, None].astype(float), COLUMNS, axis=1)
    seen = gaussian_filter1d(lit + beyond, 1.0, axis=0)
    return seen + 0.005 * np.random.default_rng(3).standard_normal(seen.shape)


def found(beyond: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    limit = np.full(COLUMNS, LIT + 1.0)  # where the blur falls through a tenth
    all_columns = np.ones(COLUMNS, bool)
    lit = Silhouette(-limit, limit, all_columns, np.nan, ~all_columns)
    return dim_edges(strip(beyond), lit, WIDTH, STRAND)


def dim_strands(level: float) -> np.ndarray:
    """Dim strands above the lit ones, for 30 columns of every 60."""
    there = ((N > LIT) & (N <= FAR))[:, None] & (np.arange(COLUMNS) % 60 < 30)
    return level * there


@pytest.mark.parametrize("level", [0.08, 0.15])
def test_dim_strands_are_outlined_on_their_side_alone(level: float) -> None:
    upper, lower = found(dim_strands(level))
    there = np.arange(COLUMNS) % 60 < 30
    assert np.isnan(lower).all() and np.isnan(upper[~there]).mean() > 0.9
    assert np.isfinite(upper[there]).mean() > 0.9
    assert abs(np.nanmedian(upper) - HALF - FAR - 0.5) < 0.6


def test_strands_as_dark_as_the_noise_are_not() -> None:
    upper, lower = found(dim_strands(0.01))
    assert np.isnan(upper).all() and np.isnan(lower).all()


def test_a_strip_that_ends_beside_the_strings_shows_no_dim_ones() -> None:
    """With no ground in view that tells how steeply ground falls, nothing is told from it."""
    limit = np.full(COLUMNS, HALF - 0.5 * WIDTH)
    all_columns = np.ones(COLUMNS, bool)
    wide = Silhouette(-limit, limit, all_columns, np.nan, ~all_columns)
    upper, lower = dim_edges(strip(dim_strands(0.15)), wide, WIDTH, STRAND)
    assert np.isnan(upper).all() and np.isnan(lower).all()


def test_a_shadow_on_the_ground_is_soft_and_no_strand() -> None:
    edge = np.clip((N - LIT - 5.0) / 16.0, 0.0, 1.0)
    upper, lower = found(np.repeat(-0.12 * edge[:, None], COLUMNS, axis=1))
    assert np.isnan(upper).all() and np.isnan(lower).all()


def test_fibres_are_no_strands() -> None:
    fibres = np.zeros((N.size, COLUMNS))
    for start in range(20, 280, 40):
        for step in range(18):  # off at 45 degrees, two pixels thick
            fibres[HALF + LIT + step : HALF + LIT + step + 2, start + step] = 0.4
    upper, lower = found(fibres)
    assert np.isnan(upper).all() and np.isnan(lower).all()


def test_contrast_that_falls_off_is_followed_and_legs_are_not() -> None:
    s = np.arange(COLUMNS)
    light = np.interp(s, [0, 100, 299], [1.0, 1.0, 0.5])
    core = light.copy()
    core[:40] = 0.02  # the legs stand apart, ground on the axis
    read = falloff_along(core, 12.0)
    np.testing.assert_allclose(read[60:280], light[60:280], atol=0.06)
    assert (read[:40] > 0.9).all()


def test_even_light_is_left_alone() -> None:
    core = np.linspace(1.0, 0.92, COLUMNS)
    np.testing.assert_array_equal(falloff_along(core, 12.0), 1.0)


def test_without_strings_on_the_axis_nothing_falls_off() -> None:
    np.testing.assert_array_equal(falloff_along(np.full(COLUMNS, np.nan), 12.0), 1.0)
