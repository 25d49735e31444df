"""A stretch whose coil goes wider and narrower within it, fitted anew where no even coil is.

The strands of a bundle hardly change from frame to frame: as thick, and as twisted per length of
it, as in the frame that told them best. How wide the coil is at each place the swing of the edges'
middle says, and where it is in its turn; the strands' angle is tried all round. Then all of it is
fitted, what the strands are being held by what was known of them.
"""

from __future__ import annotations

from dataclasses import replace

import numba
import numpy as np

from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix import silhouette as helix
from tsvision.measures.helix import uneven
from tsvision.measures.helix.carried import CHANGE_PX2, RADIUS_PX2, RATE_PX2
from tsvision.measures.helix.coil_radius import coil_px, radius_like
from tsvision.measures.helix.fit import HelixFit, Hold, Problem
from tsvision.measures.helix.loose import WIDENED
from tsvision.measures.helix.silhouette import KC, OPEN, RC, K, rounded_off
from tsvision.measures.helix.uneven import Strands

PIECES_A_COIL = 4.0  # of the radius
PHASES, BEST = 8, 2  # of the strands' angle that are tried, and gone on with
STEPS, WIDER = 12, 4.0  # of a descent, the first of which lets larger residuals count
STRANDS_SD = 0.03  # share by which strands' thickness and twist are another than was known
FARTHEST = 0.15  # of both: beyond, something else was fitted


def fit_unevenly(part: Edges, found: HelixFit, like: HelixFit, scale_px: float) -> HelixFit | None:
    """The edges of a stretch that a fit was made of, by strands as in another one, coiling as fast;
    None where they do not tell how its middle swings. Of its coil the typical radius is told.

    scale_px: residual at which an edge point begins to count less. Thickness and twist of the
    strands are held by `STRANDS_SD`, as if told by edges that lie as far off as the other's."""
    count = part.s_px.size
    z0 = -0.5 * (count - 1)
    rate = float(like.p[KC])
    pieces = max(int(np.ceil(count / coil_px(rate, like.diameter_px) * PIECES_A_COIL)), 3)
    radius = radius_like(part, like)
    if rate <= 0.0 or not np.isfinite(radius).all():
        return None
    observed = part.observed
    if part.blur_px > 0.0:
        observed = observed - rounded_off(found.p, found.section, z0, count, part.blur_px)
    start = _begun(like.p, part, observed, radius, pieces)
    hold = Hold(start.copy(), np.zeros(start.size))
    noise = (WIDENED * max(like.rms_px, 1e-3)) ** 2
    hold.px2[[uneven.RHO, uneven.TWIST]] = noise / (STRANDS_SD * start[:2]) ** 2
    hold.px2[uneven.KC], hold.px2[uneven.KC1] = RATE_PX2 / rate**2, CHANGE_PX2 / rate**2
    hold.px2[uneven.R :] = RADIUS_PX2
    step = max(0.35, min(1.0, 0.12 * float(start[0])))
    section = like.section
    problem = Problem(*section.outer, z0, observed, part.trusted, part.worth, scale_px, step, hold)
    radius_d, angle, give = section.outer
    strands = Strands((1.0 + like.p[OPEN]) * radius_d, angle, give, float(like.p[helix.CROWD]))
    q, cost, rms, covariance = _fitted(start, strands, problem, 2.0 * np.pi / section.fold)
    if not (np.abs(q[:2] / start[:2] - 1.0) < FARTHEST).all():
        return None
    p = uneven.in_the_middle(q, like.p)
    p[RC] = float(np.median(np.abs(uneven.radii(q, z0, count))))
    stretch = float(np.hypot(1.0, p[RC] * p[KC]))
    p[K] = q[uneven.TWIST] * stretch - p[KC] / stretch
    whole = np.zeros_like(like.covariance)
    told = np.array([helix.RHO, K])
    turned = np.array([1.0, stretch])
    whole[np.ix_(told, told)] = max(rms, 1e-3) ** 2 * covariance * np.outer(turned, turned)
    return replace(
        found, p=p, covariance=whole, cost=cost, rms_px=rms, section=section, uneven=True
    )


def _begun(
    like: np.ndarray, part: Edges, observed: np.ndarray, radius: np.ndarray, pieces: int
) -> np.ndarray:
    """Parameters (8 + n,) of a stretch whose middle swings as it is seen to."""
    count, rate = radius.size, float(like[KC])
    z = np.arange(count) - 0.5 * (count - 1)
    both = np.minimum(*part.trusted) > 0.0
    middle = 0.5 * (observed[0] + observed[1])
    basis = np.stack([np.ones(count), z, radius * np.cos(rate * z), radius * np.sin(rate * z)])
    y0, slope, even, odd = np.linalg.lstsq(basis[:, both].T, middle[both], rcond=None)[0]
    q = uneven.even(like, pieces + 3)
    turn = np.arctan2(-odd, even)
    q[uneven.CHI] += turn - q[uneven.THETA]
    q[uneven.THETA], q[uneven.Y0], q[uneven.SLOPE], q[uneven.KC] = turn, y0, slope, rate
    at = (np.arange(pieces + 3) - 1.0) / pieces * (count - 1) + z[0]
    q[uneven.R :] = np.interp(at, z, radius)
    return q


@numba.njit(cache=True, error_model="numpy")
def _fitted(start, strands, problem, turn):  # pragma: no cover - compiled
    """Parameters, cost, rms and the covariance (2, 2) of thickness and twist, per px2, of the best
    that several angles of the strands lead to, `turn` apart the same."""
    free = np.arange(start.size)
    costs = np.empty(PHASES)
    count = problem.observed.shape[1]
    for k in range(PHASES):
        begun = start.copy()
        begun[uneven.CHI] += k * turn / PHASES
        seen = uneven.drawn(begun, strands, problem.z0_px, count, problem.step_px)
        costs[k], _ = uneven.cost_of(begun, free, seen, problem, WIDER * problem.scale_px)
    best, best_cost = start, np.inf
    for k in np.argsort(costs)[:BEST]:
        begun = start.copy()
        begun[uneven.CHI] += k * turn / PHASES
        wide = WIDER * problem.scale_px
        q, _, _ = uneven.descend(begun, free[2:], strands, problem, STEPS, wide)
        q, cost, total = uneven.descend(q, free, strands, problem, STEPS, problem.scale_px)
        if cost < best_cost * max(total, 1e-9):
            best, best_cost = q, cost / max(total, 1e-9)
    rms, covariance = uneven.spread(best, free, strands, problem)
    return best, best_cost, rms, covariance
