"""How much the strands of a recording give to each other, as all its coils together tell.

Strings flatten alike in every frame: how far they give is theirs, not a frame's. One outline says
little of it in noise, and nothing in a waist; those of all frames that were learnt from do.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.bundle import FLANK, SCALE_PX, SWINGS, BundleFit, fit_window, swing_px
from tsvision.measures.helix.crowded import FEWEST, asked
from tsvision.measures.helix.silhouette import CROWD, Section
from tsvision.measures.helix.weigh import POOR

FEWEST_FRAMES = 2
PLAINLY_WORSE = 2.0  # times the best cost: beyond, waists and knots are taken for what strands give
UNTOLD_SD = 5.0  # a share that is asked as if nothing were known
# What is told is right to first order in the curvature: from coil to coil the share that fits best
# goes up and down by so much, and all of a recording share an error of light and blur.
FROM_FRAME_TO_FRAME, SHARED = 0.12, 0.15


def gives_alike(
    seen: list[tuple[Edges, tuple[float, float]]], section: Section, diameter_px: float
) -> Section:
    """The section with what its strands are expected to give, from frames' edges and a stretch of
    each; as it is where four strands or fewer hardly give, and where fewer than two frames coil: no
    frame is a witness of its own."""
    if section.count < FEWEST:
        return section
    each, before = [], None
    for edges, stretch in seen:
        part = edges.window(*stretch)
        if swing_px(part) < SWINGS * diameter_px:
            continue
        found = fit_window(edges, section, *stretch, diameter_px, float("nan"), before)
        if found is None or not found.fit.coiled or found.fit.cost > POOR:
            continue
        each.append((found.fit.cost, *_told(part, found)))
        before = found
    if len(each) < FEWEST_FRAMES:
        return section
    cost, share, sd = np.array(each).T
    plain = cost <= PLAINLY_WORSE * cost.min()
    return replace(section, gives=_joined(share[plain], sd[plain], section.gives))


def _told(part: Edges, found: BundleFit) -> tuple[float, float]:
    """The share that one frame's coil tells, and its sd."""
    fit = replace(found.fit, section=replace(found.fit.section, gives=(0.0, UNTOLD_SD)))
    free = asked(replace(part, half_slope=FLANK), fit, SCALE_PX)
    own = float(np.sqrt(free.covariance[CROWD, CROWD]))
    return float(free.p[CROWD]), float(np.hypot(own, FROM_FRAME_TO_FRAME))


def _joined(share: np.ndarray, sd: np.ndarray, known: tuple[float, float]) -> tuple[float, float]:
    """What frames (K,) and what is known beforehand tell together of another frame."""
    weight = np.append(1.0 / sd**2, 1.0 / known[1] ** 2)
    mean = float(np.average(np.append(share, known[0]), weights=weight))
    of_another = np.sqrt(1.0 / weight.sum() + FROM_FRAME_TO_FRAME**2 + SHARED**2)
    return min(max(mean, 0.0), 1.0), float(of_another)
