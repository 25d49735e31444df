"""A coil carried along its bundle from place to place, each fitted from the one before.

Where it coils evenly a helix describes what is about a place. Where it does not, a stretch that
coils wider and narrower is fitted (`uneven`): begun as the one before goes on, or with a coil that
comes back as wide as elsewhere, or from the helix that was found, and where the one before was lost
anew, with the coil lying as the middle of the edges does and its strands at several angles.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from tsvision.measures.helix import uneven
from tsvision.measures.helix.fit import Hold, Problem, minimise
from tsvision.measures.helix.silhouette import (
    CROWD,
    KC,
    OPEN,
    PARAMETERS,
    PHI,
    PHIC,
    RC,
    RHO,
    SLOPE,
    Y0,
    K,
    moved,
    twist,
)

FREE = np.array([K, PHI, Y0, SLOPE, RC, KC, PHIC])  # strands are as thick everywhere
SEEN = 0.4  # of a place's columns, with both edges
SAMPLING_PX, UNEVEN_SAMPLING_PX = 0.35, 0.5  # along a strand
# Coils may turn by these factors as fast as the first, and strands be twisted so much more or less
# per length of bundle, which passes its torque on.
SLOWEST, FASTEST, TWIST_OFF = 0.6, 1.7, 0.15
PIECES = 5  # of an uneven stretch's radius
COMES_BACK = 0.6  # of a stretch, beyond which a coil may be as wide as elsewhere again
# What lying 100 % off costs the rate of an uneven coil, and its change; and one px off its radius.
RATE_PX2, CHANGE_PX2, RADIUS_PX2 = 0.3, 1.0, 0.02
# Of a helix's cost, that an uneven stretch has to come below to count; else it is noise that both
# leave, and a helix that costs so many times as much is well enough from there on.
HELPS, LIKE_NOISE = 0.8, 1.1
STEPS = 2  # of a descent of a helix, which begins close to where it ends
UNEVEN_STEPS = 8
WIDER = 4.0  # times the scale of residuals: at first, larger ones count
PHASES = 6  # of the strands that are tried where the coil was lost


class Seen(NamedTuple):
    """Edges (2, M) whose middle is z = 0, each counted by weights, its residuals by worth (2, M);
    scale_px: residual from which a point counts less."""

    observed: np.ndarray
    weights: np.ndarray
    worth: np.ndarray
    scale_px: float


class Sites(NamedTuple):
    """Of the strands: radius, angle (N,) and give (N, 2, 5) of the section (`Section.outer`), and
    how far it turns until it looks the same."""

    radius_d: np.ndarray
    angle_rad: np.ndarray
    give_d: np.ndarray
    turn_rad: float


class Limits(NamedTuple):
    """Costs: below `tight` a helix describes a place well, below `most` it or an uneven stretch
    describes it at all."""

    tight: float
    most: float


@numba.njit(cache=True, error_model="numpy")
def carried(p, places, half, seen, sites, limits, steps):  # pragma: no cover - compiled
    """Parameters (K, 12), costs (K,) and whether a helix tells them well (K,) of what lies up to
    `half` about places (K,), one behind the other, beginning from p (12,). All count from z = 0;
    what is not told costs inf. steps: of a helix's descents."""
    found = np.empty((places.size, p.size))
    costs, well = np.full(places.size, np.inf), np.zeros(places.size, np.bool_)
    system = np.empty((FREE.size, FREE.size))
    unheld = Hold(np.zeros(PARAMETERS), np.zeros(PARAMETERS))
    strands = uneven.Strands(
        (1.0 + p[OPEN]) * sites.radius_d, sites.angle_rad, sites.give_d, p[CROWD]
    )
    radii = PIECES + 3
    hold = _held(p, radii)
    own = twist(p)
    last, lost = p, False
    before, before_at = np.zeros(uneven.R + radii), np.nan
    k, gone_back, tight = 0, -1, limits.tight
    while k < places.size:
        here = k
        found[k] = last
        known, middle, problem = _about(places[k], half, seen, sites, SAMPLING_PX, unheld)
        k += 1
        if not known:
            continue
        start = moved(last, middle)
        q, cost, total = minimise(start, FREE, problem, steps, system)
        cost = cost / max(total, 1e-9)
        if not (SLOWEST < q[KC] / p[KC] < FASTEST and abs(twist(q) / own - 1.0) < TWIST_OFF):
            cost = np.inf
        found[here], costs[here] = moved(q, -middle), cost
        if cost < tight:
            well[here] = cost < limits.tight
            last, lost, before_at = found[here], False, np.nan
            # Where it coils evenly every other place is enough.
            if k < places.size - 1:
                well[k] = well[here]
                k += 1
            continue
        if here >= 2 and costs[here - 1] == np.inf and costs[here - 2] < tight and gone_back < here:
            k, gone_back = here - 1, here
            well[k] = False
            costs[here] = np.inf
            continue
        _, _, problem = _about(places[here], half, seen, sites, UNEVEN_SAMPLING_PX, hold)
        goes_on = uneven.even(start, radii)
        if before_at == before_at:
            goes_on = uneven.onward(before, middle - before_at, -problem.z0_px)
        upward = places[-1] >= places[0]
        best, best_cost = goes_on, np.inf
        for attempt in range(4):
            begun = goes_on.copy()
            if attempt == 1:
                for m in range(radii):
                    share = (m - 1.0) / PIECES
                    if (share if upward else 1.0 - share) > COMES_BACK:
                        begun[uneven.R + m] = p[RC]
            elif attempt == 2:
                begun = uneven.even(q, radii)
            elif attempt == 3:
                if not lost:
                    break
                begun = uneven.even(_anew(start, problem, own, sites.turn_rad), radii)
            begun[uneven.TWIST], begun[uneven.RHO] = own, p[RHO]
            hold.toward[uneven.R :] = begun[uneven.R :]
            tried, its = _descended(begun, strands, problem)
            if its < best_cost and SLOWEST < tried[uneven.KC] / p[KC] < FASTEST:
                best, best_cost = tried, its
            if best_cost < (tight if attempt == 0 else limits.most):
                break
            if attempt == 1 and cost < limits.most and best_cost > HELPS * cost:
                break
        if cost < limits.most and best_cost > HELPS * cost:
            # It is noise that a helix leaves, not its coil.
            tight = max(tight, LIKE_NOISE * cost)
            last, lost, before_at = found[here], False, np.nan
            continue
        lost = not best_cost < limits.most
        costs[here] = np.inf if lost else best_cost
        before_at = np.nan
        if not lost:
            before, before_at = best, middle
            last = found[here] = moved(uneven.in_the_middle(best, q), -middle)
    return found, costs, well


@numba.njit(cache=True, error_model="numpy")
def at_the_end(p, place, half, seen, sites):  # pragma: no cover - compiled
    """The helix (12,) that a bundle is like where it ends and legs or connector hold it on the
    axis, z counted from there, and its cost: by an uneven stretch about a place that lies `half`
    (below 0: behind it) before that and is like p (12,). p and the place count from z = 0."""
    strands = uneven.Strands(
        (1.0 + p[OPEN]) * sites.radius_d, sites.angle_rad, sites.give_d, p[CROWD]
    )
    radii = PIECES + 3
    hold = _held(p, radii)
    known, middle, problem = _about(place, abs(half), seen, sites, UNEVEN_SAMPLING_PX, hold)
    if not known:
        return p, np.inf
    begun = uneven.even(moved(p, middle), radii)
    held = radii - 2 if half > 0.0 else 1
    begun[uneven.R + held] = 0.0
    hold.toward[uneven.R :] = begun[uneven.R :]
    free = np.arange(uneven.CHI, begun.size)
    scale = problem.scale_px
    found, cost, total = uneven.descend(begun, free, strands, problem, UNEVEN_STEPS, scale)
    reach = -problem.z0_px
    end = uneven.onward(found, reach if half > 0.0 else -reach, reach)
    end[uneven.R :] = 0.0
    return uneven.in_the_middle(end, p), cost / max(total, 1e-9)


@numba.njit(cache=True)
def _held(p, radii):  # pragma: no cover - compiled
    """What is known of an uneven stretch of coil; of its radii, nothing yet."""
    hold = Hold(np.zeros(uneven.R + radii), np.zeros(uneven.R + radii))
    hold.toward[uneven.KC], hold.px2[uneven.KC] = p[KC], RATE_PX2 / p[KC] ** 2
    hold.px2[uneven.KC1] = CHANGE_PX2 / p[KC] ** 2
    hold.px2[uneven.R :] = RADIUS_PX2
    return hold


@numba.njit(cache=True)
def _about(place, half, seen, sites, step_px, hold):  # pragma: no cover - compiled
    """Whether enough is seen about a place, the middle of what is, and the problem that it poses,
    its z counted from there."""
    count = seen.observed.shape[1]
    first = -0.5 * (count - 1)
    low = max(int(np.ceil(place - half - first)), 0)
    high = min(int(np.floor(place + half - first)) + 1, count)
    known = 0
    for c in range(low, high):
        known += min(seen.weights[0, c], seen.weights[1, c]) > 0.0
    problem = Problem(
        sites.radius_d,
        sites.angle_rad,
        sites.give_d,
        -0.5 * (high - 1 - low),
        seen.observed[:, low:high].copy(),
        seen.weights[:, low:high].copy(),
        seen.worth[:, low:high].copy(),
        seen.scale_px,
        step_px,
        hold,
    )
    return known >= max(SEEN * (high - low), FREE.size), first + 0.5 * (low + high - 1), problem


@numba.njit(cache=True, error_model="numpy")
def _descended(begun, strands, problem):  # pragma: no cover - compiled
    """An uneven stretch fitted, strands as thick and twisted as they are, and what it costs: first
    all residuals count, then those of one outline."""
    free = np.arange(uneven.CHI, begun.size)
    scale = problem.scale_px
    found, _, _ = uneven.descend(begun, free, strands, problem, UNEVEN_STEPS, WIDER * scale)
    found, cost, total = uneven.descend(found, free, strands, problem, UNEVEN_STEPS, scale)
    return found, cost / max(total, 1e-9)


@numba.njit(cache=True, error_model="numpy")
def _anew(p, problem, twisted, turn):  # pragma: no cover - compiled
    """A helix (12,) with a coil that lies, as wide as it, where the middle of the edges swings, and
    strands twisted by so much per px of bundle; of several angles of them the best."""
    p = p.copy()
    normal, right, basis = 1e-9 * np.eye(4), np.zeros(4), np.empty(4)
    for c in range(problem.observed.shape[1]):
        weight = min(problem.weights[0, c], problem.weights[1, c])
        if weight > 0.0:
            z = problem.z0_px + c
            middle = 0.5 * (problem.observed[0, c] + problem.observed[1, c])
            basis[0], basis[1] = 1.0, z
            basis[2], basis[3] = np.cos(p[KC] * z), np.sin(p[KC] * z)
            for a in range(4):
                right[a] += weight * middle * basis[a]
                for b in range(4):
                    normal[a, b] += weight * basis[a] * basis[b]
    p[Y0], p[SLOPE], even, odd = np.linalg.solve(normal, right)
    p[RC], p[PHIC] = np.hypot(even, odd), np.arctan2(-odd, even)
    stretch = np.hypot(1.0, p[RC] * p[KC])
    p[K] = twisted * stretch - p[KC] / stretch
    unheld = Hold(np.zeros(PARAMETERS), np.zeros(PARAMETERS))
    free_of_hold = Problem(
        problem.site_radius,
        problem.site_angle,
        problem.site_give,
        problem.z0_px,
        problem.observed,
        problem.weights,
        problem.worth,
        problem.scale_px,
        problem.step_px,
        unheld,
    )
    unused = np.empty((FREE.size, FREE.size))
    best, best_cost = p, np.inf
    for _ in range(PHASES):
        p[PHI] += turn / PHASES
        q, cost, total = minimise(p, FREE, free_of_hold, STEPS, unused)
        if cost < best_cost * max(total, 1e-9):
            best, best_cost = q, cost / max(total, 1e-9)
    return best
