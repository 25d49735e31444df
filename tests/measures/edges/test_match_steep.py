"""Edges where the outline runs across the axis rather than along it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from tsvision.measures.edges.edges import Edges
from tsvision.measures.edges.match_steep import match_steep
from tsvision.measures.edges.shading import plain_shading
from tsvision.measures.helix.fit import fit_helix
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
from tsvision.measures.numeric.line import slope_of

RHO_PX = 6.0
FINE = 8


def flank(slope: float, middle: float, neighbour: float) -> np.ndarray:
    """(61, 81) a bright half plane whose border rises by `slope` through row 30 at column `middle`,
    and across a gap of so many px another."""
    n, s = (np.arange(FINE * size) / FINE - 0.5 + 0.5 / FINE for size in (61, 81))
    off = (n[:, None] - 30.0 - slope * (s[None, :] - middle)) / np.hypot(1.0, slope)
    fine = ((off < 0.0) | (off > neighbour)).astype(float)
    mean = fine.reshape(61, FINE, 81, FINE).mean(axis=(1, 3))
    return gaussian_filter(mean, 0.8)


@pytest.mark.parametrize("slope", [1.6, 3.0, -2.5])
def test_a_steep_flank_is_found_square_to_itself(slope: float) -> None:
    middle = 40.3
    contrast = flank(slope, middle, neighbour=9.0)
    columns = np.arange(81.0)
    true = 30.0 + slope * (columns - middle)
    rough = np.where(np.abs(columns - middle) < 20.0 / abs(slope), true + 0.8, np.nan)
    known = np.isfinite(rough)
    slopes = slope_of(rough, known, 1.0)
    steep = match_steep(contrast, rough, slopes, 1, plain_shading(RHO_PX), 2.5)
    assert steep is not None
    assert steep.columns[known].all() and not steep.columns[~known].any()
    error = (steep.matched[0] - true)[known] / np.hypot(1.0, slope)
    assert np.isfinite(error).all()
    assert np.abs(error).max() < 0.1


@pytest.mark.parametrize("slope", [0.4, 0.9])  # of the rough edge: as it is, and misled
def test_what_runs_along_the_axis_is_left_alone(slope: float) -> None:
    contrast = flank(0.4, 40.0, neighbour=40.0)
    s = np.arange(81.0)
    rough = np.where(np.abs(s - 40.0) < 25.0, 30.0 + 0.4 * (s - 40.0), np.nan)
    slopes = np.full(81, slope)
    assert match_steep(contrast, rough, slopes, 1, plain_shading(RHO_PX), 2.5) is None


def test_slope_of_a_line_with_gaps() -> None:
    s = np.arange(60.0)
    line = 0.7 * s + 2.0
    known = (s < 20) | (s > 26)
    assert slope_of(np.where(known, line, 1e3), known, 1.0)[6:-6] == pytest.approx(0.7)
    assert not slope_of(line, s < 3, 1.0).any()


def test_small_errors_along_the_axis_do_not_make_the_right_fit_look_poor() -> None:
    """Each column's edge taken half a pixel further on or back, as a smeared flank shows it."""
    section, count = pair_core(2), 241
    p = np.zeros(PARAMETERS)
    p[RHO] = 10.0 / section.diameter_d
    p[K], p[PHI], p[RC], p[KC], p[PHIC] = 0.19, 0.4, 9.0, 2.0 * np.pi / 38.0, 1.0
    upper, lower = model_edges(p, section, -120.0, count)
    jitter = 0.5 * np.random.default_rng(1).standard_normal((2, count))
    moved = [e + np.gradient(e) * j for e, j in zip((upper, lower), jitter, strict=True)]
    edges = Edges(np.arange(float(count)), *moved, *np.ones((2, count)))
    along_n = fit_helix(edges, section, p, FREE_COILED)
    square = fit_helix(replace(edges, half_slope=1.0), section, p, FREE_COILED)
    assert square.cost < 0.8 * along_n.cost
    assert square.pitch_px == pytest.approx(along_n.pitch_px, rel=0.01)
