"""The fit of a helix's silhouette to two measured edges."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numba
import numpy as np

from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.relief import explained
from tsvision.measures.helix.silhouette import (
    CROWD,
    KC,
    OPEN,
    PARAMETERS,
    PHI,
    PHIC,
    RC,
    RHO,
    K,
    Section,
    gradient,
    model_edges,
    rounded_off,
    silhouette,
    turned_on,
    turning,
    twist,
)
from tsvision.measures.numeric.sums import summed

ROUGHLY = 6  # steps of a fit, after which it is known by how much blur moves the outline
LEAST_GAIN = 1e-5  # of what is left, by which a step has to better a fit to be worth its time


class Hold(NamedTuple):
    """What is known of free parameters beforehand: px2 (12,), px^2 that lying 1 off toward (12,)
    costs."""

    toward: np.ndarray
    px2: np.ndarray


UNHELD = Hold(np.zeros(PARAMETERS), np.zeros(PARAMETERS))


class Problem(NamedTuple):
    """What a silhouette is fitted to. site_radius, site_angle (N,), site_give (N, 2, 5): strands of
    the section; observed (2, M): edges at z0_px, z0_px + 1, ..., each counted by weights (2, M),
    and its residual by worth (2, M); scale_px: residual from which an edge point counts less;
    step_px: sampling along a strand; hold: of the free parameters."""

    site_radius: np.ndarray
    site_angle: np.ndarray
    site_give: np.ndarray
    z0_px: float
    observed: np.ndarray
    weights: np.ndarray
    worth: np.ndarray
    scale_px: float
    step_px: float
    hold: Hold


@dataclass(frozen=True)
class HelixFit:
    """Result of a fit: `p` (12,) and its covariance (12, 12), rms residual px (counted by `worth`),
    robust cost; blur_px of the edges fitted; relief: share of the light inside that it explains, 0
    where not looked at; uneven: its coil goes wider and narrower within the stretch, of which the
    typical radius is told (`unevenly`)."""

    p: np.ndarray
    covariance: np.ndarray
    rms_px: float
    cost: float
    points: int
    section: Section
    z_px: tuple[float, float]
    blur_px: float = 0.0
    relief: float = 0.0
    uneven: bool = False

    def seen_edges(self, z0: float, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Upper and lower edge (count,) at z0, z0 + 1, ... as a picture so blurred shows them."""
        sharp = model_edges(self.p, self.section, z0, count)
        if self.blur_px <= 0.0:
            return sharp
        off = rounded_off(self.p, self.section, z0, count, self.blur_px)
        return sharp[0] + off[0], sharp[1] + off[1]

    @property
    def coiled(self) -> bool:
        return bool(self.p[RC] > 0.0)

    @property
    def diameter_px(self) -> float:
        return _diameter_px(self.p, self.section)

    @property
    def diameter_px_sd(self) -> float:
        return float(np.sqrt(max(self.derived[1][0, 0], 0.0)))

    @property
    def strands_off_px(self) -> np.ndarray:
        """How far each strand's centre lies from the bundle's, (N,); in a bend, in the mean."""
        off_d = (1.0 + self.p[OPEN]) * self.section.radius_d
        if self.section.give_d is not None:
            off_d = off_d + self.p[CROWD] * self.section.give_d[:, 0, 0]
        return np.asarray(2.0 * self.p[RHO] * off_d)

    @property
    def pitch_px(self) -> float:
        """Along the bundle's own centre line."""
        return _pitch_px(self.p)

    @property
    def stretch(self) -> float:
        """Length of the bundle's centre line per length of axis, sqrt(1 + kappa^2)."""
        return float(np.sqrt(1.0 + (self.p[RC] * self.p[KC]) ** 2))

    @cached_property
    def derived(self) -> tuple[np.ndarray, np.ndarray]:
        """(D, pitch, tan beta) and their covariance (3, 3), to first order."""

        def values(p: np.ndarray) -> np.ndarray:
            diameter, pitch = _diameter_px(p, self.section), _pitch_px(p)
            return np.array([diameter, pitch, np.pi * diameter / pitch])

        base = values(self.p)
        jac = np.zeros((3, PARAMETERS))
        for i in (RHO, K, OPEN, CROWD, RC, KC) if self.coiled else (RHO, K, OPEN):
            step = 1e-5 * max(abs(self.p[i]), 1e-3)
            moved = self.p.copy()
            moved[i] += step
            jac[:, i] = (values(moved) - base) / step
        return base, jac @ self.covariance @ jac.T


def _diameter_px(p: np.ndarray, section: Section) -> float:
    farthest_d = section.farthest_d(float(p[OPEN]), float(p[CROWD]) if p[RC] > 0.0 else 0.0)
    return float(2.0 * p[RHO] * (1.0 + 2.0 * farthest_d))


def _pitch_px(p: np.ndarray) -> float:
    """Along the bundle's own centre line."""
    return 2.0 * math.pi / max(abs(float(twist(p))), 1e-12)


def with_relief(edges: Edges, fit: HelixFit) -> HelixFit:
    """The fit with what it explains of the light inside `edges`, those that it was made of. Bands
    of several colours are no relief: of four strands, two of either colour, strands of twice the
    pitch explain more than they do themselves."""
    light = edges.relief_light
    if light is None:
        return fit
    return replace(fit, relief=explained(light, fit.p, fit.section, edges.blur_px))


def descend(
    edges: Edges,
    section: Section,
    start: np.ndarray,
    free: tuple[int, ...],
    scale_px: float,
    iterations: int,
    hold: Hold = UNHELD,
) -> tuple[np.ndarray, float]:
    """A few steps of the fit from `start` (12,): parameters and mean robust cost, nothing else."""
    problem = _problem(edges, section, edges.observed, scale_px, _step(start), hold)
    free_ids = np.array(free, dtype=np.int64)
    normal = np.empty((len(free), len(free)))
    p, cost, total = minimise(np.asarray(start, dtype=float), free_ids, problem, iterations, normal)
    return p, float(cost) / max(float(total), 1e-9)


def _problem(
    edges: Edges,
    section: Section,
    observed: np.ndarray,
    scale_px: float,
    step_px: float,
    hold: Hold,
) -> Problem:
    """Edges observed (2, M), z counted from their middle."""
    z0_px = 0.5 * float(edges.s_px[0] - edges.s_px[-1])
    weights, worth = edges.trusted, edges.worth
    return Problem(*section.outer, z0_px, observed, weights, worth, scale_px, step_px, hold)


def _step(p: np.ndarray) -> float:
    """Sampling along a strand, px."""
    return max(0.35, min(1.0, 0.12 * float(p[RHO])))


def fit_helix(
    edges: Edges,
    section: Section,
    start: np.ndarray,
    free: tuple[int, ...],
    scale_px: float = 0.5,
    iterations: int = 25,
    near: bool = False,
    hold: Hold = UNHELD,
) -> HelixFit:
    """Fit the silhouette to a window of edges, from `start` (12,), over the `free` parameters.

    scale_px: residual at which an edge point begins to count less (Geman-McClure). z is counted
    from the middle. near: whether the start shows the outline roughly already.
    """
    z0 = 0.5 * float(edges.s_px[0] - edges.s_px[-1])
    step = _step(start)
    normal = np.empty((len(free), len(free)))
    free_ids = np.array(free, dtype=np.int64)
    p = np.asarray(start, dtype=float)
    observed = edges.observed
    if edges.blur_px > 0.0:
        # By how much blur moves the outline is small, and known as soon as the outline is, roughly.
        if not near:
            p, _ = descend(edges, section, p, free, scale_px, ROUGHLY, hold)
        observed = observed - rounded_off(p, section, z0, edges.s_px.size, edges.blur_px)
    problem = _problem(edges, section, observed, scale_px, step, hold)
    p, cost, total = minimise(p, free_ids, problem, iterations, normal)
    rms, points = _rms(
        observed,
        *model_edges(p, section, z0, edges.s_px.size),
        edges.worth,
        edges.upper_weight,
        edges.lower_weight,
        np.array(edges.trust),
        3 * scale_px,
    )
    covariance = np.zeros((PARAMETERS, PARAMETERS))
    variance = max(rms, 1e-3) ** 2
    covariance[free_ids[:, None], free_ids] = _inverse(normal / variance)
    return HelixFit(
        p=p,
        covariance=covariance,
        rms_px=rms,
        cost=float(cost) / max(float(total), 1e-9),
        points=points,
        section=section,
        z_px=(float(edges.s_px[0]), float(edges.s_px[-1])),
        blur_px=edges.blur_px,
    )


@numba.njit(cache=True)
def _rms(
    observed, upper, lower, worth, upper_weight, lower_weight, trust, most
):  # pragma: no cover - compiled
    """rms of what residuals (2, M) of seen edges stay below `most`, and their number; inf of none.
    Squares count by how much either edge is trusted."""
    squares, sides = np.empty(observed.size), np.empty(observed.size)
    count = 0
    for side in range(2):
        model, weight = (upper, upper_weight) if side == 0 else (lower, lower_weight)
        for c in range(model.size):
            r = (observed[side, c] - model[c]) * np.sqrt(worth[side, c])
            if weight[c] > 0.0 and abs(r) < most:
                squares[count], sides[count] = r * r, trust[side]
                count += 1
    if not count:
        return np.inf, 0
    squares, sides = squares[:count], sides[:count]
    return np.sqrt(summed(squares * sides) / summed(sides)), count


def _inverse(system: np.ndarray) -> np.ndarray:
    """Of normal equations (m, m); where the edges do not tell all parameters, of what they do."""
    try:
        return np.linalg.inv(system)
    except np.linalg.LinAlgError:
        return np.linalg.pinv(system)


@numba.njit(cache=True, error_model="numpy")
def _normal_equations(p, free, problem, normal, right):  # pragma: no cover - compiled
    """Gauss-Newton system of the free parameters with Tukey-like (Geman-McClure) weights; returns
    cost and weight sum."""
    radius, angle, give, z0, observed, weights, worth, scale, step, hold = problem
    count = observed.shape[1]
    upper, lower = np.empty(count), np.empty(count)
    at_u, at_l = np.zeros((count, 2)), np.zeros((count, 2))
    silhouette(p, radius, angle, give, z0, count, upper, lower, at_u, at_l, step)
    # One row a parameter: sums over points are quick along rows.
    grads, residuals, counts = (
        np.empty((free.size, 2 * count)),
        np.empty(2 * count),
        np.empty(2 * count),
    )
    cost = 0.0
    total = 0.0
    used = 0
    # Cosines and sines take most of the time: they are told once a px, and between by their series.
    reach = int(p[RHO] * (2.0 + 2.0 * (1.0 + p[OPEN] + abs(p[CROWD])) * radius.max())) + 2
    first = z0 - reach
    cos_psi, sin_psi = turning(p[K], p[PHI], first, count + 2 * reach)
    cos_theta, sin_theta = turning(p[KC] if p[RC] > 0.0 else 0.0, p[PHIC], first, count + 2 * reach)
    cos_site, sin_site = np.cos(angle), np.sin(angle)
    of_all = np.empty(PARAMETERS)
    for side in range(2):
        for c in range(count):
            weight = weights[side, c]
            if weight <= 0.0:
                continue
            r = observed[side, c] - (upper[c] if side == 0 else lower[c])
            if not abs(r) < 1e6:
                continue
            t = (r / scale) ** 2 * worth[side, c]
            cost += weight * t / (1.0 + t)
            total += weight
            z = at_u[c, 0] if side == 0 else at_l[c, 0]
            i = int(at_u[c, 1]) if side == 0 else int(at_l[c, 1])
            sense = 1.0 - 2.0 * side
            j = min(max(int(z - first + 0.5), 0), cos_psi.size - 1)
            off = z - first - j
            cp, sp = turned_on(p[K], off, cos_psi[j], sin_psi[j])
            cp, sp = cp * cos_site[i] - sp * sin_site[i], sp * cos_site[i] + cp * sin_site[i]
            ct, st = 1.0, 0.0
            if p[RC] > 0.0:
                ct, st = turned_on(p[KC], off, cos_theta[j], sin_theta[j])
            gradient(c + z0, z, radius[i], give, i, sense, p, cp, sp, ct, st, of_all)
            for a in range(free.size):
                grads[a, used] = of_all[free[a]]
            residuals[used] = r
            counts[used] = weight * worth[side, c] / ((1.0 + t) * (1.0 + t))
            used += 1
    counted = np.empty(used)
    for a in range(free.size):
        of_a = grads[a]
        for c in range(used):
            counted[c] = counts[c] * of_a[c]
        right[a] = sum_of_products(counted, residuals, used)
        for b in range(a + 1):
            normal[a, b] = normal[b, a] = sum_of_products(counted, grads[b], used)
        off, px2 = p[free[a]] - hold.toward[free[a]], hold.px2[free[a]]
        right[a] -= px2 * off
        normal[a, a] += px2
        cost += px2 * (off / scale) ** 2
    return cost, total


@numba.njit(cache=True, error_model="numpy")
def sum_of_products(x, y, count):  # pragma: no cover - compiled
    """Four sums side by side: none waits for the one before, and their order is always the same."""
    first = second = third = fourth = 0.0
    whole = count - count % 4
    for i in range(0, whole, 4):
        first += x[i] * y[i]
        second += x[i + 1] * y[i + 1]
        third += x[i + 2] * y[i + 2]
        fourth += x[i + 3] * y[i + 3]
    for i in range(whole, count):
        first += x[i] * y[i]
    return (first + second) + (third + fourth)


@numba.njit(cache=True, error_model="numpy")
def minimise(p0, free, problem, iterations, normal_out):  # pragma: no cover - compiled
    """Levenberg-Marquardt over the free parameters (m,); returns (p, cost, weight sum), and their
    normal equations in normal_out (m, m)."""
    p = p0.copy()
    m = free.size
    normal, right = np.empty((m, m)), np.empty(m)
    cost, total = _normal_equations(p, free, problem, normal, right)
    lam = 1e-3
    for _ in range(iterations):
        improved = False
        for _try in range(6):
            damped = normal.copy()
            for a in range(m):
                damped[a, a] += lam * normal[a, a] + 1e-12
            delta = np.linalg.solve(damped, right)
            # Nothing to be gained: to see that it is so costs as much as a step.
            if delta @ right / problem.scale_px**2 < LEAST_GAIN * cost:
                break
            trial = p.copy()
            for a in range(m):
                trial[free[a]] += delta[a]
            # About a coiled line, whose torsion twists it already, strands may turn backwards.
            low = -0.9 * trial[6] / np.sqrt(1.0 + (trial[5] * trial[6]) ** 2)
            ok = trial[0] > 0.3 and trial[5] >= 0.0 and trial[1] > (low if trial[5] > 0.0 else 0.0)
            if ok:
                new_normal, new_right = np.empty((m, m)), np.empty(m)
                new_cost, new_total = _normal_equations(trial, free, problem, new_normal, new_right)
                if new_cost < cost:
                    gain = cost - new_cost
                    p, cost, total = trial, new_cost, new_total
                    normal, right = new_normal, new_right
                    lam = max(lam * 0.3, 1e-7)
                    improved = True
                    break
            lam *= 6.0
        if not improved or gain < LEAST_GAIN * cost:
            break
    normal_out[:] = normal
    return p, cost, total
