"""How fits to the same edges count against each other."""

from __future__ import annotations

import numpy as np

from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.fit import HelixFit
from tsvision.measures.helix.silhouette import passing

POOR = 0.45  # cost above which a fit is not believed without having looked further, ...
PLAIN = 0.12  # ... unless so little of it is left by what it explains of the light inside

PLAINLY = 0.2  # cost below which a fit leaves nothing to look into
BEYOND_NOISE = 0.12  # of cost that a right fit may have besides what the edges' noise costs


def told_by_noise(edges: Edges, fit: HelixFit, scale_px: float) -> bool:
    """Whether noise alone explains what a fit leaves of its edges: nothing else is to be sought."""
    return fit.cost < noise_cost(edges, scale_px) + BEYOND_NOISE


def is_plain(edges: Edges, fit: HelixFit, scale_px: float) -> bool:
    """Whether a fit leaves nothing of its edges that a coil, or other strands, could explain."""
    return fit.cost < PLAINLY or told_by_noise(edges, fit, scale_px)


def noise_cost(edges: Edges, scale_px: float) -> float:
    """What the noise of the edges, which neighbouring columns do not share, adds to the cost of any
    fit. An outline differs from the mean of its neighbours by much less."""
    sides = ((edges.upper_px, edges.upper_weight), (edges.lower_px, edges.lower_weight))
    cost = total = 0.0
    for edge, weight in sides:
        off = edge[1:-1] - 0.5 * (edge[:-2] + edge[2:])
        t = off**2 / 1.5 / scale_px**2  # the mean of two has noise of its own
        known = np.minimum(np.minimum(weight[:-2], weight[2:]), weight[1:-1])
        cost += float((known * t / (1.0 + t)).sum())
        total += float(known.sum())
    return cost / max(total, 1e-9)


def doubt(p: np.ndarray, expected_rate: float) -> float:
    """By how much the cost of a fit (12,) counts more, 1 or above, because strands and coils turn
    much more often, or much less, than the motor has. Where two fits are nearly as good the motor
    decides; a good fit stands against it, for a motor's count can be wrong."""
    total = passing(p)
    if not (np.isfinite(expected_rate) and expected_rate > 0.0) or total <= 0.0:
        return 1.0
    off = np.log(total / expected_rate)
    return float(np.exp(0.5 * max(off - 0.2, -0.8 - off, 0.0)))


def weighed(fit: HelixFit, expected_rate: float) -> float:
    """Cost of a fit as it counts against others of the same edges: less by as much as it explains
    of the light inside the outline (in amplitude, as its residuals go), more where the motor speaks
    against it."""
    unexplained = float(np.sqrt(1.0 - fit.relief))
    return fit.cost * doubt(fit.p, expected_rate) * unexplained


def believed(fit: HelixFit) -> bool:
    """Whether a fit need not be looked further for."""
    return fit.cost < POOR or fit.cost * (1.0 - fit.relief) < PLAIN


def unsure(fit: HelixFit) -> bool:
    """Whether strands may coil otherwise than was fitted, or where no coil was."""
    return not believed(fit)
