"""Edges where the outline runs steeply, matched square to it.

Along a coil the outline turns until it runs across the axis. A column of the strip meets it at a
grazing angle there: the edge's ramp is drawn out over many rows, and the neighbouring coil lies
among them. Where the picture's own gradient says so, the edge is looked for along that.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from tsvision.measures.edges import match_edges, reach_px
from tsvision.measures.shading import Shading

GRADIENT_SD_PX = 1.0
GRADIENT_REACH_PX = 6  # to either side, that it is told from
STEEP = 1.0  # slope of the outline from which it counts as steep
STEEPEST = 5.0  # beyond that a column meets the outline too flatly to say where


class Steep(NamedTuple):
    """columns (M,) where the outline runs steeply; matched: edge row, depth and residual (M,) as of
    `match_edges` there, NaN where nothing matched."""

    columns: np.ndarray
    matched: tuple[np.ndarray, np.ndarray, np.ndarray]


class Gradient(NamedTuple):
    """Of a contrast, along and across the axis, in no unit of note, (R, M) each, from `first_row`
    of the contrast on."""

    along: np.ndarray
    across: np.ndarray
    first_row: int


def gradient_of(contrast: np.ndarray, rows: slice = slice(None)) -> Gradient:
    """Gradient of those rows of a contrast (R, M)."""
    smooth = cv2.GaussianBlur(np.asarray(contrast[rows], np.float32), (0, 0), GRADIENT_SD_PX)
    return Gradient(
        cv2.Sobel(smooth, cv2.CV_32F, 1, 0, ksize=3),
        cv2.Sobel(smooth, cv2.CV_32F, 0, 1, ksize=3),
        rows.start or 0,
    )


def match_steep(
    contrast: np.ndarray,
    gradient: Gradient,
    rough: np.ndarray,
    outward: int,
    shading: Shading,
    limit_px: float,
) -> Steep:
    """Match the shading's template square to the outline in those columns where it runs steeply.

    contrast (R, M) and its `gradient_of`; rough (M,) rows of the rough edge, NaN to skip; outward
    +1 when larger rows lie outside. What the match moved the edge by goes to first order into its
    row.
    """
    known = np.isfinite(rough)
    along, across = _outwards(gradient, np.where(known, rough, 0.0))
    steep = known & (np.abs(along) > STEEP * np.abs(across))
    at = np.flatnonzero(steep & (np.abs(along) < STEEPEST * across * outward))
    edge, depth, residual = (np.full(rough.size, np.nan) for _ in range(3))
    if at.size:
        far = int(np.ceil(reach_px(shading) + limit_px)) + 1
        t = np.arange(-far, far + 1, dtype=np.float32)[:, None]
        x = (at + t * along[at]).astype(np.float32)
        y = (rough[at] + t * across[at]).astype(np.float32)
        whole = np.asarray(contrast, np.float32)
        square = cv2.remap(whole, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        level = np.zeros(at.size)
        found, depth[at], residual[at] = match_edges(
            square.astype(float), level + far, 1, shading, level, limit_px
        )
        edge[at] = rough[at] + (found - far) / across[at]
    return Steep(steep, (edge, depth, residual))


def _outwards(gradient: Gradient, row: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit vector (M,), (M,) along and across the axis, down the gradient at each row."""
    first = np.float32(gradient.first_row)
    at = np.arange(row.size, dtype=np.float32)[None], row.astype(np.float32)[None] - first
    along, across = (-cv2.remap(part, *at, cv2.INTER_LINEAR)[0] for part in gradient[:2])
    size = np.maximum(np.hypot(along, across), 1e-9)
    return along / size, across / size
