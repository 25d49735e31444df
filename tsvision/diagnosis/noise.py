"""The noise: Student-t of unknown scale per observable, AR(1) within runs, and their priors."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.special import gammaln

from tsvision.diagnosis.problem import LEAST_NOISE, Problem
from tsvision.mechanisms.shelf import Simulation

MOST_RHO = 0.9
RHO_SLACK = 2.0  # a misfit must not pass as correlation: at most so many sd over the prior


class Noise:
    """Turns residuals into innovations in units of the noise: AR(1) within runs, scaled."""

    def __init__(self, problem: Problem, sigma: np.ndarray, rho: np.ndarray) -> None:
        self.sigma, self.rho = sigma, rho
        chain = problem.chain
        self.before = chain.before
        follows = chain.follows * rho[problem.table.observable]
        self.back = follows * chain.ratio
        lead = np.sqrt(1.0 - rho**2)[problem.table.observable]
        lead = np.where(chain.first, lead, 1.0)
        self.scale = lead / (sigma[problem.table.observable] * problem.row_scale)
        self.log_det = float(np.sum(np.log(self.scale)))
        self.nu = problem.tail

    def whiten(self, array: np.ndarray) -> np.ndarray:
        """Along the row axis: (n,), (S, n) or (S, n, P) with the row axis second to last there."""
        if array.ndim == 3:
            return (array - self.back[:, None] * array[:, self.before]) * self.scale[:, None]
        return (array - self.back * array[..., self.before]) * self.scale


def minus_log_likelihood(innovation: np.ndarray, noise: Noise) -> np.ndarray:
    """Of innovations (..., n), summed over the rows: Student-t, with the scales' determinant."""
    nu = noise.nu
    bowl = 0.5 * (nu + 1) * np.log1p(innovation**2 / nu)
    return np.sum(bowl, axis=-1) - noise.log_det - innovation.shape[-1] * _peak(nu)


@cache
def _peak(nu: float) -> float:
    """Log density of Student's t at 0."""
    return float(gammaln((nu + 1) / 2) - gammaln(nu / 2) - 0.5 * np.log(nu * np.pi))


def weights_of(innovation: np.ndarray, nu: float) -> np.ndarray:
    """What each row counts in the re-weighted least squares of the Student-t mode, (..., n)."""
    return (nu + 1) / (nu + innovation**2)


def first_noise(problem: Problem) -> np.ndarray:
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


def new_sigma(
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
        log = log - np.minimum(np.maximum(slope / (2.0 * ratio + worth), -1.0), 1.0)
    fresh = np.exp(log)
    return np.maximum(fresh, _floor(problem))


def new_rho(
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


def noise_cost(problem: Problem, sigma: np.ndarray, rho: np.ndarray) -> float:
    """Minus the log prior of scales and correlations, up to a constant."""
    away = (rho - problem.rho_mean) / problem.rho_sd
    off = np.log(sigma / problem.noise_usual) / problem.noise_sd
    return 0.5 * float(np.sum(away**2) + np.sum(off**2))
