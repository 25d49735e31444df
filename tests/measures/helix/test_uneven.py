"""The outline of an uneven stretch: like a helix where it is even, and its derivatives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tsvision.measures.helix import uneven
from tsvision.measures.helix.crowded import given_way
from tsvision.measures.helix.section import pair_core
from tsvision.measures.helix.silhouette import (
    CROWD,
    KC,
    PARAMETERS,
    PHI,
    PHIC,
    RC,
    RHO,
    SLOPE,
    Y0,
    K,
    Section,
    model_edges,
    twist,
)

HALF_PX, COUNT = 20.0, 41
RADII = np.array([1.0, 0.8, 0.5, 0.4, 0.6, 1.0, 1.1])


def coil(crowd: float = 0.0) -> tuple[np.ndarray, Section, uneven.Strands]:
    """A coiled helix (12,), its section, and its strands."""
    section = pair_core(6)
    if crowd:
        section = replace(section, give_d=given_way(section, 0.4, 0.1))
    p = np.zeros(PARAMETERS)
    p[[RHO, RC, KC, PHI, PHIC]] = 2.0, 4.5, 2.0 * np.pi / 23.0, 0.4, 1.1
    p[[K, Y0, SLOPE, CROWD]] = 0.1, 0.3, 0.01, crowd
    return p, section, uneven.Strands(*(x.copy() for x in section.outer), crowd)


def outline(p: np.ndarray, strands: uneven.Strands) -> np.ndarray:
    seen = uneven.drawn(p, strands, -HALF_PX, COUNT, 0.02)
    return np.stack([seen.upper, seen.lower])


@pytest.mark.parametrize("crowd", [0.0, 0.6])
def test_an_even_stretch_is_a_helix(crowd: float) -> None:
    p, section, strands = coil(crowd)
    q = uneven.even(p, 7)
    helix = np.stack(model_edges(p, section, -HALF_PX, COUNT))
    np.testing.assert_allclose(outline(q, strands), helix, atol=0.04)
    np.testing.assert_allclose(uneven.in_the_middle(q, p), p, atol=1e-9)


def test_its_derivatives() -> None:
    p, _, strands = coil()
    q = uneven.even(p, RADII.size)
    q[uneven.KC1] = 0.03
    q[uneven.R :] *= RADII
    seen = uneven.drawn(q, strands, -HALF_PX, COUNT, 0.02)
    found, out = np.empty((2, COUNT, q.size)), np.empty(q.size)
    for side, at in enumerate((seen.at_upper, seen.at_lower)):
        for c in range(COUNT):
            z, i = at[c, 0], int(at[c, 1])
            sense = 1.0 - 2.0 * side
            uneven.gradient(c - HALF_PX, z, i, sense, q, strands, HALF_PX, seen, out)
            found[side, c] = out
    for k in range(q.size):
        step = np.zeros(q.size)
        step[k] = 1e-4
        slope = (outline(q + step, strands) - outline(q - step, strands)) / 2e-4
        off = np.abs(slope - found[:, :, k])
        # Where strands cross on the outline it has two.
        assert np.percentile(off, 85) < 0.02 * np.abs(slope).max() + 1e-3, k


def test_a_stretch_goes_on_as_it_was() -> None:
    p, _, strands = coil()
    q = uneven.even(p, RADII.size)
    q[uneven.KC1] = 0.02
    q[uneven.R :] *= np.linspace(1.0, 0.7, RADII.size)
    on = uneven.onward(q, 6.0, HALF_PX)
    both = outline(q, strands)[:, 12:-6], outline(on, strands)[:, 6:-12]
    np.testing.assert_allclose(*both, atol=0.02)


def test_a_radius_below_none_is_one_on_the_other_side() -> None:
    p, section, strands = coil()
    q = uneven.even(p, 7)
    q[uneven.R :] *= -1.0
    middle = uneven.in_the_middle(q, p)
    assert middle[RC] == pytest.approx(p[RC])
    helix = np.stack(model_edges(middle, section, -HALF_PX, COUNT))
    np.testing.assert_allclose(outline(q, strands), helix, atol=0.04)
    assert twist(middle) == pytest.approx(twist(p))
