"""What the outline tells of a coil: its baseline, and a swing no wider than what is seen."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tsvision.measures.helix import KC, RC, Edges
from tsvision.measures.outline import add_outline
from tsvision.records import FrameRow

D, RADIUS, COIL_PX, COUNT = 20.0, 8.0, 40.0, 900
LOOKS: Any = SimpleNamespace(
    diameter_px=D,
    zero_px=0.0,
    strand_count=2,
    scale=SimpleNamespace(mm_per_px=0.03),
    sight=SimpleNamespace(
        axis=SimpleNamespace(is_straight=True, at=lambda s: np.stack([s, 0 * s], axis=-1))
    ),
)
ROW = FrameRow(frame=0, file="", turns=30.0, diameter_px=D, pitch_px=2 * D)


def two_strands(lobe_px: float) -> Edges:
    """A coil of `RADIUS` whose strands' lobes come every `lobe_px`."""
    s = np.arange(COUNT, dtype=float)
    middle = RADIUS * np.cos(2 * np.pi * s / COIL_PX)
    half = 0.25 * D * (1.0 + np.abs(np.cos(np.pi * s / lobe_px)))
    ones = np.ones(COUNT)
    return Edges(s, middle + half, middle - half, ones, ones)


def fit(radius_px: float) -> Any:
    p = np.zeros(12)
    p[RC], p[KC] = radius_px, 2 * np.pi / COIL_PX
    return SimpleNamespace(fit=SimpleNamespace(p=p, coiled=True, pitch_px=2 * D))


@pytest.mark.parametrize("lobe_px", [17.0, 20.0, 23.7, 31.0])
def test_an_even_coil_has_its_own_baseline_and_no_knot(lobe_px: float) -> None:
    told = add_outline(ROW, two_strands(lobe_px), LOOKS, fit(RADIUS), None, float("nan"))
    assert told.row.baseline_envelope_px == pytest.approx(D + 2 * RADIUS, rel=0.03)
    assert told.row.coil_amplitude_px == pytest.approx(RADIUS)
    assert not told.knots


def test_a_fitted_coil_wider_than_the_strings_are_seen_is_not_believed() -> None:
    told = add_outline(ROW, two_strands(23.7), LOOKS, fit(30.0), None, float("nan"))
    assert 0.5 * RADIUS < told.row.coil_amplitude_px < 1.1 * RADIUS
