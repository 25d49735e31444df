"""Edges at reduced size: what a search by trial needs, at a share of the time."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.silhouette import rescaled

SEARCH_DIAMETER_PX = 16.0  # wider bundles are searched at reduced size, then fitted in full


@dataclass(frozen=True)
class Reduced:
    """edges in units of `factor` px of the full picture, their middle `shift` px beyond its own."""

    edges: Edges
    factor: float
    shift: float

    def down(self, p: np.ndarray) -> np.ndarray:
        """Parameters (12,) of the full picture as they are here."""
        return rescaled(p, self.factor, self.shift)

    def up(self, p: np.ndarray) -> np.ndarray:
        """Parameters (12,) found here as they are in the full picture."""
        return rescaled(p, 1.0 / self.factor, -self.shift / self.factor)


def reduced(edges: Edges, factor: float) -> Reduced:
    """The edges `factor` times smaller; themselves where that is 1 or less."""
    if factor <= 1.0:
        return Reduced(edges, 1.0, 0.0)
    small = _shrunk(edges, factor)
    middle = 0.5 * float(edges.s_px[0] + edges.s_px[-1])
    return Reduced(small, factor, 0.5 * float(small.s_px[0] + small.s_px[-1]) * factor - middle)


def _shrunk(edges: Edges, factor: float) -> Edges:
    """The same outline in units of `factor` px, resampled on unit spacing; without light."""
    s = edges.s_px / factor
    grid = np.arange(np.ceil(s[0]), np.floor(s[-1]) + 1e-9)
    nearest = np.clip(np.searchsorted(s, grid), 0, s.size - 1)
    return replace(
        edges,
        s_px=grid,
        upper_px=np.interp(grid, s, edges.upper_px / factor),
        lower_px=np.interp(grid, s, edges.lower_px / factor),
        upper_weight=edges.upper_weight[nearest],
        lower_weight=edges.lower_weight[nearest],
        blur_px=edges.blur_px / factor,
        light=None,
    )
