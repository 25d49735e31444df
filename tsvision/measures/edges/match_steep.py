"""Edges where the outline runs steeply, matched square to it.

Along a coil the outline turns until it runs across the axis. A column of the strip meets it at a
grazing angle there: the edge's ramp is drawn out over many rows, and the neighbouring coil lies
among them. Where the picture's own gradient says so, the edge is looked for along that.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numba
import numpy as np

from tsvision.measures.edges.match import match_edges, reach_px
from tsvision.measures.edges.shading import Shading

GRADIENT_SD_PX = 1.2
GRADIENT_REACH_PX = 5  # to either side, that it is told from
MAYBE_STEEP = 0.7  # slope of rough edges from which the gradient beside them is looked at, ...
BESIDE = 4  # ... and how many columns to either side: a rough edge may have jumped there
STEEP = 1.0  # slope of the outline from which it counts as steep
STEEPEST = 5.0  # beyond that a column meets the outline too flatly to say where


class Steep(NamedTuple):
    """columns (M,) where the outline runs steeply; matched: edge row, depth and residual (M,) as of
    `match_edges` there, NaN where nothing matched."""

    columns: np.ndarray
    matched: tuple[np.ndarray, np.ndarray, np.ndarray]


def match_steep(
    contrast: np.ndarray,
    rough: np.ndarray,
    slope: np.ndarray,
    outward: int,
    shading: Shading,
    limit_px: float,
) -> Steep | None:
    """Match the shading's template square to the outline in those columns where it runs steeply;
    None where it does in none.

    contrast (R, M); rough (M,) rows of the rough edge, NaN to skip, and its slope (M,); outward +1
    when larger rows lie outside. What the match moved the edge by goes to first order into its row.
    """
    asked = _asked(rough, slope)
    if not asked.size:
        return None
    along, across = _outwards(contrast, rough, asked)
    steep = np.abs(along) > STEEP * np.abs(across)
    if not steep.any():
        return None
    columns = np.zeros(rough.size, dtype=bool)
    columns[asked[steep]] = True
    meets = steep & (np.abs(along) < STEEPEST * across * outward)
    at, along, across = asked[meets], along[meets], across[meets]
    edge, depth, residual = (np.full(rough.size, np.nan) for _ in range(3))
    if at.size:
        far = int(np.ceil(reach_px(shading, limit_px) + limit_px)) + 1
        t = np.arange(-far, far + 1, dtype=np.float32)[:, None]
        x = (at + t * along).astype(np.float32)
        y = (rough[at] + t * across).astype(np.float32)
        whole = np.asarray(contrast, np.float32)
        square = cv2.remap(whole, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        level = np.zeros(at.size)
        found, depth[at], residual[at] = match_edges(
            square.astype(float), level + far, 1, shading, level, limit_px
        )
        edge[at] = rough[at] + (found - far) / across
    return Steep(columns, (edge, depth, residual))


@numba.njit(cache=True)
def _asked(rough, slope):  # pragma: no cover - compiled
    """Columns (K,) whose rough edge is known and may run steeply, by its slope or a neighbour's."""
    asked = np.zeros(rough.size, np.bool_)
    for c in range(rough.size):
        if abs(slope[c]) > MAYBE_STEEP:
            asked[max(c - BESIDE, 0) : c + BESIDE + 1] = True
    return np.flatnonzero(asked & np.isfinite(rough))


@numba.njit(cache=True)
def _outwards(contrast, row, at):  # pragma: no cover - compiled
    """Unit vector (K,), (K,) along and across the axis, down the gradient of a contrast (R, M)
    under a Gaussian window about the row (M,) of each column in `at` (K,)."""
    rows, columns = contrast.shape
    reach = GRADIENT_REACH_PX
    spread = 1.0 / (2.0 * GRADIENT_SD_PX**2)
    beside = np.arange(-reach, reach + 1).astype(np.float64)
    window = np.exp(-spread * beside * beside)
    along, across = np.empty(at.size), np.empty(at.size)
    for k in range(at.size):
        c, middle = at[k], row[at[k]]
        first = int(np.floor(middle)) - reach + 1
        rise_along = rise_across = 0.0
        for r in range(first, first + 2 * reach):
            line = contrast[min(max(r, 0), rows - 1)]
            level = slant = 0.0
            for i in range(window.size):
                value = window[i] * line[min(max(c + i - reach, 0), columns - 1)]
                level += value
                slant += beside[i] * value
            weight = np.exp(-spread * (r - middle) ** 2)
            rise_along += weight * slant
            rise_across += weight * (r - middle) * level
        size = max(np.hypot(rise_along, rise_across), 1e-9)
        along[k], across[k] = -rise_along / size, -rise_across / size
    return along, across
