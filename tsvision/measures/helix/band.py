"""At which rates strands can turn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.silhouette import KC, RC

SHORTEST_PITCH = 0.9  # in diameters, k alone
MOST_TURNS = 2.5  # times as often as the motor has turned, or this many turns in the window, ...
LOBES = 1.5  # ... is the highest rate tried where turns are known


@dataclass(frozen=True)
class Band:
    """Strand rates to scan, rad/px; `expected`: rate of strands and coiling together that the
    motor's turns lead one to expect; `led`: such a rate to begin from as well, whatever the scan
    shows. NaN when unknown."""

    low: float
    high: float
    expected: float = float("nan")
    led: float = float("nan")


def full_band(
    edges: Edges, diameter_px: float, expected_rate: float, coil: np.ndarray | None = None
) -> Band:
    """Every strand rate that a bundle of this width can show within the window.

    Along a coiled centre line it is longer than the axis, and so are the rates per px of that; its
    torsion twists the bundle already, so that the strands may even turn backwards about it. Not
    about a coil that is hardly one: a rod begins to coil at less than the rate of its twist.
    """
    span = max(float(edges.s_px[-1] - edges.s_px[0]), 1.0)
    stretch = 1.0 if coil is None else float(np.hypot(1.0, coil[RC] * coil[KC]))
    low = 0.35 * 2.0 * np.pi / span
    if coil is not None:
        low = -float(coil[KC]) * min(0.8 / stretch, 2.0 * (1.0 - 1.0 / stretch))
    high = stretch * 2.0 * np.pi / max(SHORTEST_PITCH * diameter_px, 4.0)
    if np.isfinite(expected_rate) and expected_rate > 0.0:
        high = min(high, max(MOST_TURNS * expected_rate, 2.0 * np.pi * LOBES / span))
    return Band(low, max(high, low + 2.0 * np.pi / span), expected_rate, expected_rate)
