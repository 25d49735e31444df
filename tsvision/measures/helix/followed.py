"""A coiled fit followed along the bundle, half a coil at a time, to both its ends.

A fit knows the stretch that it was made of; a bundle that overtwists coils wider here and narrower
there. The stretch beside it is fitted from what it was found to be, and so on. What is read there
is how often strands and coils together pass before the camera, K + KC per px of axis: whatever the
coil's radius, and however its torsion turns the strands, those passings are the turns. (A bundle
whose middle line does not cross itself in the picture has no more to its linking number than its
strands' turning in the picture's own frame.) Where no helix like the first describes the stretch -
a waist narrower than a coil, a knot - nothing is told.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numba
import numpy as np

from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.bundle import FLANK, SCALE_PX, BundleFit
from tsvision.measures.helix.coil_radius import coil_px
from tsvision.measures.helix.fit import Hold, Problem, minimise
from tsvision.measures.helix.reduced import reduced
from tsvision.measures.helix.silhouette import (
    KC,
    PHI,
    PHIC,
    RC,
    SLOPE,
    Y0,
    K,
    moved,
    rescaled,
    twist,
)
from tsvision.measures.helix.weigh import POOR, noise_cost

FOLLOWED_DIAMETER_PX = 12.0  # wider bundles are followed at reduced size
FREE = np.array([K, PHI, Y0, SLOPE, RC, KC, PHIC])  # strands are as thick everywhere
STEP, WINDOW = 0.5, 1.5  # of a coil: from place to place, and what is fitted about each
SHORTEST = 2.5  # D, of what is fitted
SEEN = 0.4  # of its columns, with both edges
STEPS = 2  # of a descent, which begins close to where it ends, ...
BEGUN_STEPS = 12  # ... and of the first
SAMPLING_PX = 0.35  # along a strand
# What a place may cost above the edges' noise: twice what the fit's own does, within these.
LIKE, LEAST_COST, MOST_COST = 2.0, 0.06, 0.12
# Coils may turn by these factors as fast as the fit's, and strands be twisted so much more or less
# per length of bundle, which passes its torque on.
SLOWEST, FASTEST, TWIST_OFF = 0.6, 1.7, 0.15
REACH = 0.6  # of a step about a place: so far it tells all, and fades to nothing at twice that


@dataclass(frozen=True)
class Followed:
    """Places s_px (K,), in order, that a helix describes; there strands and coils turn at rate (K,)
    rad per px of axis, and stretch (K,) px of bundle lie on one; reach_px: see REACH."""

    s_px: np.ndarray
    rate: np.ndarray
    stretch: np.ndarray
    reach_px: float

    def told(self, s_px: np.ndarray) -> np.ndarray:
        """How much is told of each s (M,), 0..1."""
        last = self.s_px.size - 1
        after = np.searchsorted(self.s_px, s_px)
        beside = self.s_px[np.clip([after - 1, after], 0, last)]
        away = np.abs(beside - s_px).min(axis=0)
        return np.asarray(np.clip(2.0 - away / self.reach_px, 0.0, 1.0))

    def unbroken(self, start_px: float, end_px: float, ends_px: float) -> bool:
        """Whether all between two s is told, but for so much at either end."""
        near = self.s_px[0] <= start_px + ends_px and self.s_px[-1] >= end_px - ends_px
        return bool(near and np.diff(self.s_px).max(initial=0.0) <= 3.0 * self.reach_px)


def follow(found: BundleFit, edges: Edges, start_px: float, end_px: float) -> Followed | None:
    """A coiled fit followed between two s; None where its own stretch is told by too few edges, or
    is described no better than others would have to be."""
    fit = found.fit
    coil = coil_px(float(fit.p[KC]), fit.diameter_px)
    half = 0.5 * max(WINDOW * coil, SHORTEST * fit.diameter_px)
    part = replace(edges.window(start_px, end_px), half_slope=FLANK, light=None)
    if part.s_px.size < 2.0 * half:
        return None
    small = reduced(part, fit.diameter_px / FOLLOWED_DIAMETER_PX)
    middle = 0.5 * float(part.s_px[0] + part.s_px[-1])
    own = 0.5 * (fit.z_px[0] + fit.z_px[1])
    p = small.down(rescaled(fit.p, 1.0, middle - own))
    scale = 2.0 * SCALE_PX / small.factor
    lines = small.edges.observed, small.edges.trusted, small.edges.worth

    def fitted(
        p: np.ndarray, s_px: np.ndarray, most: float, steps: int
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        at = (s_px - middle - small.shift) / small.factor
        reach = half / small.factor
        found = _fitted(p, at, reach, *lines, *fit.section.outer, scale, most, steps)
        return found  # type: ignore[no-any-return]

    begun, cost, _ = fitted(p, np.array([own]), np.inf, BEGUN_STEPS)
    noise = noise_cost(edges.window(*fit.z_px), 2.0 * SCALE_PX)
    most = noise + float(np.clip(LIKE * (cost[0] - noise), LEAST_COST, MOST_COST))
    most = min(most, POOR)
    if not cost[0] < most:
        return None
    step = STEP * coil
    up = np.arange(own + step, end_px - half, step)
    down = np.arange(own - step, start_px + half, -step)
    found_up, _, good_up = fitted(begun[0], up, most, STEPS)
    found_down, _, good_down = fitted(begun[0], down, most, STEPS)
    all_p = np.concatenate([found_down[::-1], begun, found_up])
    good = np.concatenate([good_down[::-1], [True], good_up])
    s_px = np.concatenate([down[::-1], [own], up])[good]
    rates = all_p[good][:, [K, KC]].sum(axis=1) / small.factor
    stretch = np.hypot(1.0, all_p[good][:, RC] * all_p[good][:, KC])
    return Followed(s_px, rates, stretch, REACH * step)


@numba.njit(cache=True, error_model="numpy")
def _fitted(
    p, places, half, observed, weights, worth, site_radius, site_angle, give, scale, most, steps
):  # pragma: no cover - compiled
    """Parameters (K, 12), costs (K,) and whether they hold (K,) at places (K,), one behind the
    other, each fitted from the last that held. Parameters and places count from the middle of the
    edges (2, M)."""
    count = observed.shape[1]
    first = -0.5 * (count - 1)
    found = np.empty((places.size, p.size))
    costs, good = np.full(places.size, np.inf), np.zeros(places.size, np.bool_)
    unused = np.empty((FREE.size, FREE.size))
    unheld = Hold(np.zeros(p.size), np.zeros(p.size))
    own, coils, last = twist(p), p[KC], p
    for k in range(places.size):
        low = max(int(np.ceil(places[k] - half - first)), 0)
        high = min(int(np.floor(places[k] + half - first)) + 1, count)
        found[k] = last
        seen = 0
        for c in range(low, high):
            seen += min(weights[0, c], weights[1, c]) > 0.0
        if seen < max(SEEN * (high - low), FREE.size):
            continue
        middle = first + 0.5 * (low + high - 1)
        problem = Problem(
            site_radius,
            site_angle,
            give,
            -0.5 * (high - 1 - low),
            observed[:, low:high].copy(),
            weights[:, low:high].copy(),
            worth[:, low:high].copy(),
            scale,
            SAMPLING_PX,
            unheld,
        )
        q, cost, total = minimise(moved(last, middle), FREE, problem, steps, unused)
        found[k] = moved(q, -middle)
        costs[k] = cost / max(total, 1e-9)
        like = SLOWEST < q[KC] / coils < FASTEST and abs(twist(q) / own - 1.0) < TWIST_OFF
        good[k] = costs[k] < most and like
        if good[k]:
            last = found[k]
    return found, costs, good
