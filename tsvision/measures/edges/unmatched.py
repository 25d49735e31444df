"""Sides of the bundle that the learnt edge profile did not match, filled in from the outline.

Where a shadow touches the strings or colour is smeared, one side's profile may match hardly
anywhere. For the envelope, which asks how far out the strings reach and not where their limb lies
to a tenth of a pixel, the outline at the mask's level then serves better than nothing: with one
edge alone, a coil cannot be told from a wider bundle.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tsvision.measures.edges.cut import Cut
from tsvision.measures.edges.edges import Edges
from tsvision.measures.edges.find import rough_edges

LEAST_MATCHED = 0.5  # share of the bundle's columns: a side matched in fewer is filled in
MATCHED = 0.1  # weight from which an edge counts as matched
FILLED = 0.21  # weight of an edge taken from the outline: seen, and no more
FEWEST = 20  # matched columns that tell how far the outline lies off


def with_outline(edges: Edges, cut: Cut) -> Edges:
    """`edges`, a side that was hardly matched filled in from the outline of `cut`."""
    bundle = cut.silhouette.bundle
    weights = (edges.upper_weight, edges.lower_weight)
    if not bundle.any() or all(_well_matched(w, bundle) for w in weights):
        return edges
    upper, lower = (rows - cut.half_px for rows in rough_edges(cut))
    up = _filled(edges.upper_px, edges.upper_weight, upper, cut)
    low = _filled(edges.lower_px, edges.lower_weight, lower, cut)
    return replace(edges, upper_px=up[0], upper_weight=up[1], lower_px=low[0], lower_weight=low[1])


def _well_matched(weight: np.ndarray, bundle: np.ndarray) -> bool:
    return bool((weight > MATCHED)[bundle].mean() >= LEAST_MATCHED)


def _filled(
    place_px: np.ndarray, weight: np.ndarray, rough_px: np.ndarray, cut: Cut
) -> tuple[np.ndarray, np.ndarray]:
    matched, bundle = weight > MATCHED, cut.silhouette.bundle
    if _well_matched(weight, bundle):
        return place_px, weight
    both = matched & np.isfinite(rough_px)
    off = float(np.median((place_px - rough_px)[both])) if both.sum() >= FEWEST else 0.0
    empty = ~matched & bundle & np.isfinite(rough_px)
    return np.where(empty, rough_px + off, place_px), np.where(empty, FILLED, weight)
