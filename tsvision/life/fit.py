"""Fit a life model by maximum likelihood, stopped tests included, with intervals.

Without stopped tests this is ordinary least squares on log(cycles) with Student-t intervals.
With them a broken test counts by the log-normal density and a stopped one by its survival; the
covariance is the inverse observed information, scaled by n/(n - p) as least squares would.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import stats
from scipy.special import log_ndtr

from tsvision.errors import InputError
from tsvision.life.shelf import LIFE_MODELS, LifeModel
from tsvision.life.table import LifeTests

LEVEL = 0.95
NEWTON_STEPS = 100


@dataclass(frozen=True)
class Estimate:
    """A value with its interval at `LEVEL`."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class LifeFit:
    """Fitted parameters (p,), covariance (p, p), log-scatter and how well it does.

    `left_out_factor` is exp(rms log error) when each test is predicted by a fit to the others;
    stopped tests count there only when the prediction falls short of what they endured.
    """

    model: str
    parameters: dict[str, Estimate]
    values: np.ndarray
    covariance: np.ndarray
    scatter: float
    freedom: int
    log_likelihood: float
    aicc: float
    left_out_factor: float


def fit_life(model: LifeModel, tests: LifeTests) -> LifeFit:
    """Fit one model; InputError when too few strings broke to fit it."""
    values, scatter, covariance, log_likelihood = _estimate(model, tests)
    size = len(values)
    freedom = int(tests.broke.sum()) - size
    factor = stats.t.ppf(0.5 + LEVEL / 2, freedom)
    half = factor * np.sqrt(np.diag(covariance))
    return LifeFit(
        model=model.name,
        parameters={
            name: Estimate(float(v), float(v - h), float(v + h))
            for name, v, h in zip(model.parameters, values, half, strict=True)
        },
        values=values,
        covariance=covariance,
        scatter=scatter,
        freedom=freedom,
        log_likelihood=log_likelihood,
        aicc=_aicc(log_likelihood, size + 1, len(tests.cycles)),
        left_out_factor=_left_out_factor(model, tests),
    )


def fit_all(tests: LifeTests) -> list[LifeFit]:
    """All models that the data can carry, best (lowest AICc) first."""
    broken = int(tests.broke.sum())
    fits = [fit_life(m, tests) for m in LIFE_MODELS.values() if broken > len(m.parameters)]
    if not fits:
        raise InputError(f"{tests.name}: {broken} strings broke; at least 2 are needed for any fit")
    return sorted(fits, key=lambda fit: fit.aicc)


def predict_cycles(fit: LifeFit, tests: LifeTests) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Median life of each condition and the interval that ONE new string falls into, cycles."""
    model = LIFE_MODELS[fit.model]
    columns = model.columns(tests)
    centre = model.offset(tests) + columns @ fit.values
    variance = fit.scatter**2 + np.einsum("ij,jk,ik->i", columns, fit.covariance, columns)
    half = stats.t.ppf(0.5 + LEVEL / 2, fit.freedom) * np.sqrt(variance)
    return np.exp(centre), np.exp(centre - half), np.exp(centre + half)


def _estimate(model: LifeModel, tests: LifeTests) -> tuple[np.ndarray, float, np.ndarray, float]:
    columns = model.columns(tests)
    goal = np.log(tests.cycles) - model.offset(tests)
    size, broken = columns.shape[1], int(tests.broke.sum())
    if broken <= size:
        raise InputError(
            f"{tests.name}: {broken} strings broke; '{model.name}' needs at least {size + 1}"
        )
    values, *_ = np.linalg.lstsq(columns, goal, rcond=None)
    spread = math.sqrt(max(float(np.mean((goal - columns @ values) ** 2)), 1e-12))
    if tests.broke.all():
        covariance = np.linalg.inv(columns.T @ columns) * spread**2
    else:
        values, spread, covariance = _with_stopped(columns, goal, tests.broke, values, spread)
    # Maximum likelihood takes the scatter too small; n/(n - p) mends it as least squares does.
    grow = broken / (broken - size)
    log_likelihood = _log_likelihood(values, spread, columns, goal, tests.broke)
    log_likelihood -= float(np.log(tests.cycles[tests.broke]).sum())
    return values, spread * math.sqrt(grow), covariance * grow, log_likelihood


def _log_likelihood(
    values: np.ndarray, scatter: float, columns: np.ndarray, goal: np.ndarray, broke: np.ndarray
) -> float:
    """Log-likelihood of log lives: density where broken, survival where stopped."""
    z = (goal - columns @ values) / scatter
    density = -0.5 * (z[broke] ** 2 + math.log(2 * math.pi)) - math.log(scatter)
    return float(density.sum() + log_ndtr(-z[~broke]).sum())


def _with_stopped(
    columns: np.ndarray, goal: np.ndarray, broke: np.ndarray, start: np.ndarray, spread: float
) -> tuple[np.ndarray, float, np.ndarray]:
    """Newton's method in Olsen's parameters (values/scatter, 1/scatter): concave everywhere."""
    point = np.append(start, 1.0) / max(spread, 1e-3)
    across = np.column_stack([-columns, goal])
    for _ in range(NEWTON_STEPS):
        gradient, hessian = _olsen(point, across, broke)
        step = np.linalg.solve(hessian, gradient)
        # 1/scatter has to stay above 0: never more than halve it in one step.
        shrink = min(1.0, 0.5 * point[-1] / step[-1]) if step[-1] > 0 else 1.0
        point = point - shrink * step
        if np.abs(step).max() < 1e-10 * np.abs(point).max():
            break
    covariance = np.linalg.inv(-_olsen(point, across, broke)[1])
    inner, inverse = point[:-1], point[-1]
    jacobian = np.column_stack([np.eye(inner.size) / inverse, -inner / inverse**2])
    return inner / inverse, float(1 / inverse), jacobian @ covariance @ jacobian.T


def _olsen(
    point: np.ndarray, across: np.ndarray, broke: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Gradient and Hessian of the log-likelihood; the standardised residual is across @ point."""
    u = across @ point
    hazard = np.exp(-0.5 * u**2 - 0.5 * math.log(2 * math.pi) - log_ndtr(-u))
    first = np.where(broke, -u, -hazard)
    second = np.where(broke, -1.0, -hazard * (hazard - u))
    gradient = first @ across
    hessian = (across * second[:, None]).T @ across
    gradient[-1] += broke.sum() / point[-1]
    hessian[-1, -1] -= broke.sum() / point[-1] ** 2
    return gradient, hessian


def _aicc(log_likelihood: float, count: int, rows: int) -> float:
    if rows - count - 1 <= 0:
        return math.inf
    return -2 * log_likelihood + 2 * count + 2 * count * (count + 1) / (rows - count - 1)


def _left_out_factor(model: LifeModel, tests: LifeTests) -> float:
    rows = np.arange(len(tests.cycles))
    if int(tests.broke.sum()) - 1 <= len(model.parameters):
        return math.nan
    errors = []
    for row in rows:
        values, *_ = _estimate(model, tests.select(rows != row))
        one = tests.select(rows == row)
        predicted = float((model.offset(one) + model.columns(one) @ values)[0])
        error = math.log(one.cycles[0]) - predicted
        if one.broke[0] or error > 0:
            errors.append(error)
    return math.exp(math.sqrt(float(np.mean(np.square(errors)))))
