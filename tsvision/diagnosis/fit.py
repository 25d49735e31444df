"""Fit one simulation to a table: robust, with nuisances, correlated noise, and its evidence.

Posterior mode by Levenberg-Marquardt on re-weighted residuals (Student-t noise), with the noise
scale of each observable from MacKay's evidence procedure and an AR(1) term per observable. The log
evidence is Laplace's, with the cut of the priors at their bounds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tsvision.diagnosis.evidence import log_evidence_of
from tsvision.diagnosis.layout import Layout, start_grid
from tsvision.diagnosis.linearised import bounded_step, leverage_of, rows_and_jacobian, steps
from tsvision.diagnosis.noise import (
    Noise,
    first_noise,
    minus_log_likelihood,
    new_rho,
    new_sigma,
    weights_of,
)
from tsvision.diagnosis.problem import Problem, bounds, parameters, to_value
from tsvision.mechanisms.shelf import Simulation

MOST_STARTS = 40
SCOUTS = 3
SCOUTING_STEPS = 5
SETTLED = 5e-3  # of the log posterior, of the noise's log scale and correlation


@dataclass(frozen=True)
class Fit:
    """A fitted simulation. `u` (P,) in prior units, `z` (Z,), `offsets` (R,), all at the mode.

    `covariance` is that of (z, u, offsets). `innovation` (n,) are residuals freed of AR(1) in
    units of the noise, `predicted` (n,) the rows with offsets.
    """

    simulation: Simulation
    u: np.ndarray
    z: np.ndarray
    offsets: np.ndarray
    covariance: np.ndarray
    sigma: np.ndarray
    rho: np.ndarray
    predicted: np.ndarray
    innovation: np.ndarray
    weight: np.ndarray
    jacobian: np.ndarray
    log_evidence: float
    dof: float

    @property
    def names(self) -> tuple[str, ...]:
        return self.simulation.names


def fit(
    problem: Problem,
    simulation: Simulation,
    start: np.ndarray | None = None,
    most_steps: int = 25,
    noise: tuple[np.ndarray, np.ndarray] | None = None,
) -> Fit:
    """Fit `simulation` from `start` (a whole vector z, u, offsets), else from several starts."""
    layout = Layout(problem, simulation)
    sigma, rho = noise or (first_noise(problem), problem.rho_mean.copy())
    if start is not None:
        theta = layout.clip(start)
        return _descend(problem, simulation, layout, theta, sigma, rho, most_steps)
    thetas, sigma = _best_starts(problem, simulation, layout, sigma, rho)
    if len(thetas) == 1:
        return _descend(problem, simulation, layout, thetas[0], sigma, rho, most_steps)
    # An onset is easily trapped: a few starts go some steps before the best goes on.
    tried = [
        _descend(problem, simulation, layout, theta, sigma, rho, SCOUTING_STEPS) for theta in thetas
    ]
    best = max(tried, key=lambda f: f.log_evidence)
    theta = np.concatenate([best.z, best.u, best.offsets])
    return _descend(problem, simulation, layout, theta, best.sigma, best.rho, most_steps)


def _best_starts(
    problem: Problem,
    simulation: Simulation,
    layout: Layout,
    sigma: np.ndarray,
    rho: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Try the product of the parameters' starts with two steps each.

    Returns the best few that lie apart (K, P), and the noise about the best.
    """
    grid = start_grid((p for _, p in layout.keys), MOST_STARTS)
    thetas = np.zeros((len(grid), layout.total))
    thetas[:, layout.nz : layout.moved] = grid
    thetas = layout.clip(thetas)
    for _ in range(2):
        noise = Noise(problem, sigma, rho)
        rows, jacobian = rows_and_jacobian(problem, simulation, layout, thetas)
        innovation = noise.whiten(problem.table.value - rows)
        weight = weights_of(innovation, problem.tail)
        white = noise.whiten(jacobian)
        step = steps(layout, thetas, innovation, white, weight, 1e-3)
        moved = layout.clip(thetas + step)
        rows = problem.predict(simulation, *_split(layout, moved))
        rows = rows + moved[:, layout.moved :] @ problem.offsets.T
        after = noise.whiten(problem.table.value - rows)
        costs = [
            minus_log_likelihood(e, noise) + layout.penalty(t)
            for e, t in ((innovation, thetas), (after, moved))
        ]
        better = costs[1] < costs[0]
        thetas = np.where(better[:, None], moved, thetas)
        cost = np.where(better, costs[1], costs[0])
        keep = np.argsort(cost)[:12]
        thetas = thetas[keep]
        best = np.where(better[keep[0]], after[keep[0]], innovation[keep[0]])
        sigma = new_sigma(problem, sigma, best, weights_of(best, problem.tail), np.zeros(len(best)))
    own = slice(layout.nz, layout.moved)
    apart = [thetas[0]]
    for theta in thetas[1:]:
        away = min(float(np.max(np.abs(theta[own] - a[own]), initial=0.0)) for a in apart)
        if away > 0.12 and len(apart) < SCOUTS:
            apart.append(theta)
    return np.array(apart), sigma


def _split(layout: Layout, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return theta[:, layout.nz : layout.moved], theta[:, : layout.nz]


def _descend(
    problem: Problem,
    simulation: Simulation,
    layout: Layout,
    theta: np.ndarray,
    sigma: np.ndarray,
    rho: np.ndarray,
    most_steps: int,
) -> Fit:
    value = problem.table.value
    damping = 1e-3
    noise = Noise(problem, sigma, rho)
    rows, jacobian = rows_and_jacobian(problem, simulation, layout, theta[None])
    innovation = noise.whiten(value - rows[0])
    still = np.zeros(layout.total, dtype=bool)
    for _ in range(most_steps):
        weight = weights_of(innovation, problem.tail)
        white = noise.whiten(jacobian)[0]
        heavy = white * weight[:, None]
        normal = heavy.T @ white
        cost = minus_log_likelihood(innovation, noise) + layout.penalty(theta)
        step = bounded_step(layout, theta, innovation, heavy, normal, damping, still)
        trial = layout.clip(theta + step)
        new_rows, new_jacobian = rows_and_jacobian(problem, simulation, layout, trial[None])
        new_innovation = noise.whiten(value - new_rows[0])
        gain = cost - minus_log_likelihood(new_innovation, noise) - layout.penalty(trial)
        if np.isfinite(gain) and gain >= 0:
            theta, rows, jacobian, innovation = trial, new_rows, new_jacobian, new_innovation
            damping = max(damping * 0.2, 1e-9)
            still = np.zeros(layout.total, dtype=bool)
        else:
            # An onset on a turn level is a kink, where the slope misleads: next time without it.
            still = np.zeros_like(still) if still.any() else layout.shaping
            damping *= 1.0 if still.any() else 8.0
            gain = 1.0 if damping < 1e6 else 0.0
        # The leverage changes little in a step: the old linearisation serves for the noise.
        leverage, _ = leverage_of(layout, white, heavy, normal)
        noise, change = _noise_anew(problem, noise, innovation, value - rows[0], leverage)
        innovation = noise.whiten(value - rows[0])
        if gain < SETTLED and change < SETTLED:
            break
    return _finish(problem, simulation, layout, theta, rows[0], jacobian, noise)


def _noise_anew(
    problem: Problem,
    old: Noise,
    innovation: np.ndarray,
    residual: np.ndarray,
    leverage: np.ndarray,
) -> tuple[Noise, float]:
    """The noise after a step, and by how much its log scale and correlation have changed."""
    weight = weights_of(innovation, problem.tail)
    sigma = new_sigma(problem, old.sigma, innovation, weight, leverage)
    rho = new_rho(problem, residual, sigma, weight)
    change = np.max(np.abs(np.log(sigma / old.sigma))) + np.max(np.abs(rho - old.rho))
    return Noise(problem, sigma, rho), float(change)


def _finish(
    problem: Problem,
    simulation: Simulation,
    layout: Layout,
    theta: np.ndarray,
    rows: np.ndarray,
    jacobian: np.ndarray,
    noise: Noise,
) -> Fit:
    innovation = noise.whiten(problem.table.value - rows)
    weight = weights_of(innovation, problem.tail)
    white = noise.whiten(jacobian)[0]
    heavy = white * weight[:, None]
    leverage, covariance = leverage_of(layout, white, heavy, heavy.T @ white)
    return Fit(
        simulation=simulation,
        u=theta[layout.nz : layout.moved],
        z=theta[: layout.nz],
        offsets=theta[layout.moved :],
        covariance=covariance,
        sigma=noise.sigma,
        rho=noise.rho,
        predicted=rows,
        innovation=innovation,
        weight=weight,
        jacobian=jacobian[0],
        log_evidence=log_evidence_of(problem, layout, theta, covariance, innovation, noise),
        dof=float(problem.table.rows - leverage.sum()),
    )


def posterior(problem: Problem, fitted: Fit) -> dict[str, tuple[float, float, float]]:
    """Each parameter's value and 95 % interval in its own unit, cut at its bounds."""
    from scipy.special import stdtrit

    reach = float(stdtrit(max(fitted.dof, 1.0), 0.975))
    out = {}
    for key, p in parameters(fitted.simulation):
        u, sd = standing_of(problem, fitted, key)
        ends = np.clip([u, u - reach * sd, u + reach * sd], *bounds(p))
        value, a, b = (float(to_value(p, e, problem.reference)) for e in ends)
        out[key] = (value, a, b)
    return out


def standing_of(problem: Problem, fitted: Fit, key: str) -> tuple[float, float]:
    """Where a parameter stands and its standard deviation, in prior units."""
    i = [name for name, _ in parameters(fitted.simulation)].index(key)
    at = problem.nuisances + i
    return float(fitted.u[i]), float(np.sqrt(fitted.covariance[at, at]))
