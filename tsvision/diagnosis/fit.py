"""Fit one simulation to a table: robust, with nuisances, correlated noise, and its evidence.

Posterior mode by Levenberg-Marquardt on re-weighted residuals (Student-t noise), with the noise
scale of each observable from MacKay's evidence procedure and an AR(1) term per observable. The log
evidence is Laplace's, with the cut of the priors at their bounds.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.special import gammaln, ndtr

from tsvision.diagnosis.problem import LEAST_NOISE, Problem, bounds, parameters, to_value
from tsvision.mechanisms.shelf import Simulation

STEP = 1e-5
MOST_RHO = 0.9
MOST_NUISANCE = 4.0  # standard deviations: beyond that an input is wrong, which is a cause
RHO_SLACK = 2.0  # a misfit must not pass as correlation: at most so many sd over the prior
UNIFORM_RIDGE = 1.0  # a weak pull that keeps a flat direction finite; undone in the evidence
MOST_STARTS = 40
SCOUTS = 3
SCOUTING_STEPS = 5
MISLED = 0.1  # how often what the pictures of a run showed is wrong, or not there to be seen
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


class _Layout:
    """Where the parts of the parameter vector (z, u, offsets) lie, and their bounds and priors."""

    def __init__(self, problem: Problem, simulation: Simulation) -> None:
        self.keys = list(parameters(simulation))
        self.nz = problem.nuisances
        self.nu = len(self.keys)
        self.moved = self.nz + self.nu
        self.total = self.moved + problem.offsets.shape[1]
        self.low = np.full(self.total, -np.inf)
        self.high = np.full(self.total, np.inf)
        self.low[: self.nz], self.high[: self.nz] = -MOST_NUISANCE, MOST_NUISANCE
        self.ridge = np.ones(self.total)
        self.centre = np.zeros(self.total)
        self.log_prior = 0.0
        for i, (_, p) in enumerate(self.keys, start=self.nz):
            self.low[i], self.high[i] = bounds(p)
            if p.prior == "normal":
                self.log_prior -= float(np.log(ndtr(self.high[i]) - ndtr(self.low[i])))
            else:
                self.ridge[i], self.centre[i] = UNIFORM_RIDGE, 0.5
                self.log_prior += 0.5 * float(np.log(2 * np.pi))
        self.shaping = np.zeros(self.total, dtype=bool)
        self.shaping[self.nz : self.moved] = [p.null is None for _, p in self.keys]
        self.curved = np.array([p.prior == "normal" for _, p in self.keys], dtype=bool)

    def penalty(self, theta: np.ndarray) -> np.ndarray:
        """Half the squared distance from the priors' centres, over the last axis."""
        away = theta - self.centre
        return 0.5 * np.sum(self.ridge * away * away, axis=-1)

    def clip(self, theta: np.ndarray) -> np.ndarray:
        return np.minimum(np.maximum(theta, self.low), self.high)


def fit(
    problem: Problem,
    simulation: Simulation,
    start: np.ndarray | None = None,
    most_steps: int = 25,
    noise: tuple[np.ndarray, np.ndarray] | None = None,
) -> Fit:
    """Fit `simulation` from `start` (a whole vector z, u, offsets), else from several starts."""
    layout = _Layout(problem, simulation)
    sigma, rho = noise or (_first_noise(problem), problem.rho_mean.copy())
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


def _rows_and_jacobian(
    problem: Problem, simulation: Simulation, layout: _Layout, theta: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Predictions (S, n) and their derivatives (S, n, P) for parameter sets theta (S, P)."""
    many, moved = len(theta), layout.moved
    sign = np.where(theta[:, :moved] + STEP > layout.high[:moved], -STEP, STEP)
    block = np.repeat(theta[:, None, :moved], moved + 1, axis=1)
    index = np.arange(moved)
    block[:, index + 1, index] += sign
    flat = block.reshape(-1, moved)
    rows = problem.predict(simulation, flat[:, layout.nz :], flat[:, : layout.nz])
    rows = rows.reshape(many, moved + 1, -1)
    slope = (rows[:, 1:] - rows[:, :1]) / sign[:, :, None]
    jacobian = np.empty((many, rows.shape[2], layout.total))
    jacobian[:, :, :moved] = np.swapaxes(slope, 1, 2)
    jacobian[:, :, moved:] = problem.offsets
    return rows[:, 0] + theta[:, moved:] @ problem.offsets.T, jacobian


class Noise:
    """Turns residuals into innovations in units of the noise: AR(1) within runs, scaled."""

    def __init__(self, problem: Problem, sigma: np.ndarray, rho: np.ndarray) -> None:
        table = problem.table
        self.first = table.before < 0
        self.before = np.where(self.first, 0, table.before)
        self.back = np.where(self.first, 0.0, rho[table.observable])
        lead = np.where(self.first, np.sqrt(1.0 - rho[table.observable] ** 2), 1.0)
        self.scale = lead / (sigma[table.observable] * problem.row_scale)
        # A row's own scale also weighs its predecessor, so that value_sd may vary along a run.
        self.ratio = problem.row_scale / problem.row_scale[self.before]
        self.log_det = float(np.sum(np.log(self.scale)))
        self.nu = problem.tail

    def whiten(self, array: np.ndarray) -> np.ndarray:
        """Along the row axis: (n,), (S, n) or (S, n, P) with the row axis second to last there."""
        if array.ndim == 3:
            back = (self.back * self.ratio)[:, None]
            return (array - back * array[:, self.before]) * self.scale[:, None]
        return (array - self.back * self.ratio * array[..., self.before]) * self.scale


def _minus_log_likelihood(innovation: np.ndarray, noise: Noise) -> np.ndarray:
    nu = noise.nu
    bowl = 0.5 * (nu + 1) * np.log1p(innovation**2 / nu)
    constant = gammaln((nu + 1) / 2) - gammaln(nu / 2) - 0.5 * np.log(nu * np.pi)
    return np.sum(bowl, axis=-1) - noise.log_det - innovation.shape[-1] * float(constant)


def _weights(innovation: np.ndarray, nu: float) -> np.ndarray:
    return (nu + 1) / (nu + innovation**2)


def _first_noise(problem: Problem) -> np.ndarray:
    """A generous start: the spread about the base model as it came."""
    z = np.zeros((1, problem.nuisances))
    off = problem.table.value - problem.predict(Simulation(base=problem.base), z[:, :0], z)[0]
    spread = [
        np.median(np.abs(off[mask])) if np.any(mask) else 1.0
        for mask in (problem.table.observable == k for k in range(len(problem.table.observables)))
    ]
    return np.maximum(np.array(spread), 2 * _floor(problem))


@cache
def _least(observables: tuple[str, ...]) -> np.ndarray:
    return np.array([LEAST_NOISE[name] for name in observables])


def _floor(problem: Problem) -> np.ndarray:
    return _least(problem.table.observables)


def _best_starts(
    problem: Problem,
    simulation: Simulation,
    layout: _Layout,
    sigma: np.ndarray,
    rho: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Try the product of the parameters' starts with two steps each.

    Returns the best few that lie apart (K, P), and the noise about the best.
    """
    thetas = layout.clip(_starts(layout))
    for _ in range(2):
        noise = Noise(problem, sigma, rho)
        rows, jacobian = _rows_and_jacobian(problem, simulation, layout, thetas)
        innovation = noise.whiten(problem.table.value - rows)
        weight = _weights(innovation, problem.tail)
        white = noise.whiten(jacobian)
        step = _steps(layout, thetas, innovation, white, weight, 1e-3)
        moved = layout.clip(thetas + step)
        rows = problem.predict(simulation, *_split(layout, moved))
        rows = rows + moved[:, layout.moved :] @ problem.offsets.T
        after = noise.whiten(problem.table.value - rows)
        costs = [
            _minus_log_likelihood(e, noise) + layout.penalty(t)
            for e, t in ((innovation, thetas), (after, moved))
        ]
        better = costs[1] < costs[0]
        thetas = np.where(better[:, None], moved, thetas)
        cost = np.where(better, costs[1], costs[0])
        keep = np.argsort(cost)[:12]
        thetas = thetas[keep]
        best = np.where(better[keep[0]], after[keep[0]], innovation[keep[0]])
        sigma = _new_sigma(problem, sigma, best, _weights(best, problem.tail), np.zeros(len(best)))
    own = slice(layout.nz, layout.moved)
    apart = [thetas[0]]
    for theta in thetas[1:]:
        away = min(float(np.max(np.abs(theta[own] - a[own]), initial=0.0)) for a in apart)
        if away > 0.12 and len(apart) < SCOUTS:
            apart.append(theta)
    return np.array(apart), sigma


def _split(layout: _Layout, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return theta[:, layout.nz : layout.moved], theta[:, : layout.nz]


def _starts(layout: _Layout) -> np.ndarray:
    grid = np.zeros((1, layout.total))
    for i, (_, p) in enumerate(layout.keys, start=layout.nz):
        grid = np.repeat(grid, len(p.starts), axis=0)
        grid[:, i] = np.tile(p.starts, len(grid) // len(p.starts))
    return grid[:: max(1, -(-len(grid) // MOST_STARTS))]


def _steps(
    layout: _Layout,
    theta: np.ndarray,
    innovation: np.ndarray,
    white: np.ndarray,
    weight: np.ndarray,
    damping: float,
) -> np.ndarray:
    """Damped Gauss-Newton steps for many parameter sets (S, P)."""
    heavy = white * weight[..., None]
    normal = np.swapaxes(heavy, 1, 2) @ white
    slope = np.einsum("snp,sn->sp", heavy, innovation) - layout.ridge * (theta - layout.centre)
    index = np.arange(layout.total)
    normal[:, index, index] = normal[:, index, index] * (1.0 + damping) + layout.ridge
    return np.linalg.solve(normal, slope[..., None])[..., 0]


def _descend(
    problem: Problem,
    simulation: Simulation,
    layout: _Layout,
    theta: np.ndarray,
    sigma: np.ndarray,
    rho: np.ndarray,
    most_steps: int,
) -> Fit:
    value = problem.table.value
    damping = 1e-3
    noise = Noise(problem, sigma, rho)
    rows, jacobian = _rows_and_jacobian(problem, simulation, layout, theta[None])
    innovation = noise.whiten(value - rows[0])
    still = np.zeros(layout.total, dtype=bool)
    for _ in range(most_steps):
        weight = _weights(innovation, problem.tail)
        white = noise.whiten(jacobian)[0]
        heavy = white * weight[:, None]
        normal = heavy.T @ white
        cost = _minus_log_likelihood(innovation, noise) + layout.penalty(theta)
        step = _bounded_step(layout, theta, innovation, heavy, normal, damping, still)
        trial = layout.clip(theta + step)
        new_rows, new_jacobian = _rows_and_jacobian(problem, simulation, layout, trial[None])
        new_innovation = noise.whiten(value - new_rows[0])
        gain = cost - _minus_log_likelihood(new_innovation, noise) - layout.penalty(trial)
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
        leverage, _ = _leverage(layout, white, heavy, normal)
        old = sigma, rho
        weight = _weights(innovation, problem.tail)
        sigma = _new_sigma(problem, sigma, innovation, weight, leverage)
        rho = _new_rho(problem, value - rows[0], sigma, weight)
        change = np.max(np.abs(np.log(sigma / old[0]))) + np.max(np.abs(rho - old[1]))
        noise = Noise(problem, sigma, rho)
        innovation = noise.whiten(value - rows[0])
        if gain < SETTLED and change < SETTLED:
            break
    return _finish(problem, simulation, layout, theta, rows[0], jacobian, sigma, rho)


def _bounded_step(
    layout: _Layout,
    theta: np.ndarray,
    innovation: np.ndarray,
    heavy: np.ndarray,
    normal: np.ndarray,
    damping: float,
    still: np.ndarray,
) -> np.ndarray:
    """A step that holds `still` parameters, and those that would leave their bounds."""
    slope = heavy.T @ innovation - layout.ridge * (theta - layout.centre)
    index = np.arange(layout.total)
    damped = normal.copy()
    damped[index, index] = damped[index, index] * (1.0 + damping) + layout.ridge
    held = ((theta <= layout.low) & (slope < 0)) | ((theta >= layout.high) & (slope > 0))
    held = held | still
    if not held.any():
        return np.linalg.solve(damped, slope)
    free = np.flatnonzero(~held)
    step = np.zeros(layout.total)
    step[free] = np.linalg.solve(damped[np.ix_(free, free)], slope[free])
    return step


def _leverage(
    layout: _Layout, white: np.ndarray, heavy: np.ndarray, normal: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Share of each row's information that the parameters took (n,), and the covariance."""
    index = np.arange(layout.total)
    precision = normal.copy()
    precision[index, index] += layout.ridge
    covariance = np.linalg.inv(precision)
    return np.sum((heavy @ covariance) * white, axis=1), covariance


def _new_sigma(
    problem: Problem,
    sigma: np.ndarray,
    innovation: np.ndarray,
    weight: np.ndarray,
    leverage: np.ndarray,
) -> np.ndarray:
    """Noise of each observable: weighted squares over the degrees of freedom left."""
    observable = problem.table.observable
    many = len(sigma)
    left = np.bincount(observable, 1.0 - leverage, many)
    squares = np.bincount(observable, weight * innovation**2, many) * sigma**2
    # The prior on log sigma, about `usual`: a few Newton steps on its stationarity condition
    # left - squares / sigma² + log(sigma / usual) / sd² = 0, which is monotone in log sigma.
    log = np.log(np.maximum(sigma, 1e-9))
    usual, worth = np.log(problem.noise_usual), problem.noise_sd**-2.0
    left = np.maximum(left, 0.0)
    for _ in range(4):
        ratio = squares * np.exp(-2.0 * log)
        slope = left - ratio + worth * (log - usual)
        log = log - np.clip(slope / (2.0 * ratio + worth), -1.0, 1.0)
    fresh = np.exp(log)
    return np.maximum(fresh, _floor(problem))


def _new_rho(
    problem: Problem, residual: np.ndarray, sigma: np.ndarray, weight: np.ndarray
) -> np.ndarray:
    """AR(1) coefficient of each observable, pulled towards its prior."""
    table = problem.table
    follow = np.flatnonzero(table.before >= 0)
    kind = table.observable[follow]
    unit = residual / (sigma[table.observable] * problem.row_scale)
    # An outlier says nothing about correlation: both ends must carry weight.
    trust = np.minimum(weight[follow], 1.0) * np.minimum(weight[table.before[follow]], 1.0)
    behind = unit[table.before[follow]]
    many = len(sigma)
    cross = np.bincount(kind, trust * unit[follow] * behind, many)
    square = np.bincount(kind, trust * behind**2, many)
    worth = 1.0 / problem.rho_sd**2
    rho = (cross + worth * problem.rho_mean) / (square + worth)
    most = np.minimum(problem.rho_mean + RHO_SLACK * problem.rho_sd, MOST_RHO)
    return np.clip(rho, 0.0, most)


def _finish(
    problem: Problem,
    simulation: Simulation,
    layout: _Layout,
    theta: np.ndarray,
    rows: np.ndarray,
    jacobian: np.ndarray,
    sigma: np.ndarray,
    rho: np.ndarray,
) -> Fit:
    noise = Noise(problem, sigma, rho)
    innovation = noise.whiten(problem.table.value - rows)
    weight = _weights(innovation, problem.tail)
    white = noise.whiten(jacobian)[0]
    heavy = white * weight[:, None]
    leverage, covariance = _leverage(layout, white, heavy, heavy.T @ white)
    log_evidence = (
        -float(_minus_log_likelihood(innovation, noise))
        - _prior_cost(layout, theta)
        + layout.log_prior
        + 0.5 * float(np.linalg.slogdet(covariance)[1])
        + _inside(layout, theta, covariance)
        + _seen(problem, layout, theta)
        - _noise_cost(problem, sigma, rho)
    )
    return Fit(
        simulation=simulation,
        u=theta[layout.nz : layout.moved],
        z=theta[: layout.nz],
        offsets=theta[layout.moved :],
        covariance=covariance,
        sigma=sigma,
        rho=rho,
        predicted=rows,
        innovation=innovation,
        weight=weight,
        jacobian=jacobian[0],
        log_evidence=log_evidence,
        dof=float(problem.table.rows - leverage.sum()),
    )


def _prior_cost(layout: _Layout, theta: np.ndarray) -> float:
    """The penalty of the Gaussian priors alone: the ridge on uniform ones is none of the prior."""
    gaussian = np.ones(layout.total, dtype=bool)
    gaussian[layout.nz : layout.moved] = layout.curved
    return 0.5 * float(np.sum(theta[gaussian] ** 2))


def _inside(layout: _Layout, theta: np.ndarray, covariance: np.ndarray) -> float:
    """Log share of the posterior's Gaussian that lies within the bounds."""
    own = slice(layout.nz, layout.moved)
    sd = np.sqrt(np.diag(covariance)[own])
    inside = ndtr((layout.high[own] - theta[own]) / sd) - ndtr((layout.low[own] - theta[own]) / sd)
    return float(np.sum(np.log(np.maximum(inside, 1e-12))))


def _seen(problem: Problem, layout: _Layout, theta: np.ndarray) -> float:
    """Log odds of what pictures showed, given the onsets at `theta`, against not having looked."""
    odds = 0.0
    for i, (key, p) in enumerate(layout.keys, start=layout.nz):
        mechanism, _, name = key.partition(".")
        if name != "onset_turns":
            continue
        onset = float(to_value(p, theta[i], problem.reference))
        for sight in problem.table.sightings:
            if sight.mechanism != mechanism:
                continue
            ratio = 0.0
            if sight.observed:
                width = max(sight.high - sight.low, 0.1 * problem.reference.span_turns)
                away = max(sight.low - onset, onset - sight.high, 0.0) / (0.25 * width)
                ratio = problem.reference.span_turns / width * float(np.exp(-0.5 * away**2))
            odds += float(np.log(MISLED + (1.0 - MISLED) * ratio))
    return odds


def _noise_cost(problem: Problem, sigma: np.ndarray, rho: np.ndarray) -> float:
    away = (rho - problem.rho_mean) / problem.rho_sd
    off = np.log(sigma / problem.noise_usual) / problem.noise_sd
    return 0.5 * float(np.sum(away**2) + np.sum(off**2))


def posterior(problem: Problem, fitted: Fit) -> dict[str, tuple[float, float, float]]:
    """Each parameter's value and 95 % interval in its own unit, cut at its bounds."""
    from scipy.special import stdtrit

    reach = float(stdtrit(max(fitted.dof, 1.0), 0.975))
    nz = problem.nuisances
    out = {}
    for i, (key, p) in enumerate(parameters(fitted.simulation)):
        sd = float(np.sqrt(fitted.covariance[nz + i, nz + i]))
        low, high = bounds(p)
        ends = np.clip([fitted.u[i], fitted.u[i] - reach * sd, fitted.u[i] + reach * sd], low, high)
        value, a, b = (float(to_value(p, e, problem.reference)) for e in ends)
        out[key] = (value, a, b)
    return out
