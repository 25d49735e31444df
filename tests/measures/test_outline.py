"""Two knots less than a coil of the bundle apart, drawn from their centre line."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from tsvision.images.strip import Axis
from tsvision.measures.helix import Edges
from tsvision.measures.looks import Looks
from tsvision.measures.outline import add_outline
from tsvision.records import FrameRow

D, LENGTH = 28.0, 700
BUNDLE, KNOT = (7.0, 96.0), (16.0, 40.0)  # radius and period of the coils, px


def looks() -> Looks:
    axis = Axis(np.array([[0.0, 200.0], [LENGTH, 200.0]]), np.array([0.0, LENGTH]))
    fake: Any = SimpleNamespace(
        diameter_px=D,
        zero_px=0.0,
        scale=SimpleNamespace(mm_per_px=0.03),
        sight=SimpleNamespace(axis=axis),
        strand_count=6,
    )
    return cast(Looks, fake)


def outlined(knots: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """(centre, length) in px of the knots found, where those between the given s were drawn."""
    s = np.arange(float(LENGTH))
    knotted = np.zeros(s.size, dtype=bool)
    for low, high in knots:
        knotted |= (s > low) & (s < high)
    radius = np.where(knotted, KNOT[0], BUNDLE[0])
    phase = np.cumsum(2.0 * np.pi / np.where(knotted, KNOT[1], BUNDLE[1]))
    middle = radius * np.cos(phase)
    ones = np.ones(s.size)
    edges = Edges(s, middle + 0.5 * D, middle - 0.5 * D, ones, ones)
    row = FrameRow(frame=0, file="", turns=30.0, diameter_px=D, diameter_px_sd=0.2)
    found = add_outline(row, edges, looks(), None, None, float("nan")).knots
    return [(k.centre_mm / 0.03, k.length_mm / 0.03) for k in found]


def test_neighbours_are_told_apart() -> None:
    """The gap of 50 px is half a coil of the bundle, and more than a coil of the knots."""
    found = outlined([(180.0, 300.0), (350.0, 480.0)])
    assert [centre for centre, _ in found] == pytest.approx([240.0, 415.0], abs=0.5 * D)
    assert all(length == pytest.approx(125.0, abs=D) for _, length in found)


@pytest.mark.parametrize("length", [60.0, 130.0, 280.0])
def test_one_knot_stays_one(length: float) -> None:
    ((centre, seen),) = outlined([(200.0, 200.0 + length)])
    assert centre == pytest.approx(200.0 + 0.5 * length, abs=0.5 * D)
    assert seen == pytest.approx(length, abs=D)
