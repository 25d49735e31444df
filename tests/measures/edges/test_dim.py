"""Strands in the bundle's own shadow, and limbs darker than their ground, are outlined; soft
shadows, fibres and specks are not."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from tsvision.measures.edges.dim import dim_edges, sunk_edges
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


def outlined() -> Silhouette:
    limit = np.full(COLUMNS, LIT + 1.0)  # where the blur falls through a tenth
    all_columns = np.ones(COLUMNS, bool)
    return Silhouette(-limit, limit, all_columns, np.nan, ~all_columns)


def found(beyond: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return dim_edges(strip(beyond), outlined(), WIDTH, STRAND)


def sunk(beyond: np.ndarray, side: int | None = None) -> tuple[np.ndarray, np.ndarray]:
    return sunk_edges(strip(beyond), outlined(), WIDTH, STRAND, side)


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


def test_a_dark_fringe_and_what_rings_beyond_it_are_no_strands() -> None:
    """Files store colour in blocks that ring beside a bundle: first below the ground, then above.
    Where it ends the outline of an overtwisted bundle had spikes that were told as three knots."""
    fringe = -0.09 * ((N > LIT + 3) & (N <= FAR - 2))
    beyond = 0.07 * ((N > FAR - 2) & (N <= FAR + 2))
    there = np.arange(COLUMNS) % 60 < 30
    upper, lower = found((fringe + beyond)[:, None] * there)
    assert np.isnan(upper).all() and np.isnan(lower).all()


def test_fibres_are_no_strands() -> None:
    fibres = np.zeros((N.size, COLUMNS))
    for start in range(20, 280, 40):
        for step in range(18):  # off at 45 degrees, two pixels thick
            fibres[HALF + LIT + step : HALF + LIT + step + 2, start + step] = 0.4
    upper, lower = found(fibres)
    assert np.isnan(upper).all() and np.isnan(lower).all()


def lobes(level: float, share: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Limbs (R, COLUMNS) of some contrast above the lit strands, in a share of the columns, and
    where they end (COLUMNS,)."""
    ends = LIT + 4.5 + 2.0 * np.cos(np.arange(COLUMNS) / 3.0)
    there = (N[:, None] > LIT) & (N[:, None] <= np.round(ends))
    return level * (there & (np.arange(COLUMNS) % 100 < 100.0 * share)), ends


@pytest.mark.parametrize("level", [-0.1, -0.25])
def test_limbs_darker_than_the_ground_are_outlined_lobe_by_lobe(level: float) -> None:
    dark, ends = lobes(level)
    upper, lower = sunk(dark)
    assert np.isnan(lower).all() and np.isfinite(upper).mean() > 0.95
    off = upper - HALF - np.round(ends) - 0.5
    assert np.nanmedian(np.abs(off)) < 0.6 and np.nanpercentile(np.abs(off), 90) < 1.6


def test_a_limb_that_is_known_to_be_sunk_is_sought_wherever_it_is() -> None:
    dark, _ = lobes(-0.2, share=0.3)
    assert np.isnan(sunk(dark)[0]).all()  # of a third of a bundle alone nothing is concluded
    upper, lower = sunk(dark, side=1)
    assert 0.2 < np.isfinite(upper).mean() < 0.45 and np.isnan(lower).all()


@pytest.mark.parametrize("side", [None, 1, -1])
def test_bare_ground_is_no_sunk_limb(side: int | None) -> None:
    upper, lower = sunk(np.zeros((N.size, COLUMNS)), side)
    assert np.isnan(upper).all() and np.isnan(lower).all()


def test_a_soft_shadow_beside_the_strands_is_no_sunk_limb() -> None:
    shade = -0.2 * np.clip((LIT + 22.0 - N) / 16.0, 0.0, 1.0) * (N > LIT)
    upper, lower = sunk(np.repeat(shade[:, None], COLUMNS, axis=1))
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
