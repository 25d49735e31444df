"""A simulation's rows and their slopes at some parameters, and the damped steps that follow."""

from __future__ import annotations

import numpy as np

from tsvision.diagnosis.layout import Layout
from tsvision.diagnosis.problem import Problem
from tsvision.mechanisms.shelf import Simulation

STEP = 1e-5


def rows_and_jacobian(
    problem: Problem, simulation: Simulation, layout: Layout, theta: np.ndarray
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


def steps(
    layout: Layout,
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


def bounded_step(
    layout: Layout,
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


def leverage_of(
    layout: Layout, white: np.ndarray, heavy: np.ndarray, normal: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Share of each row's information that the parameters took (n,), and the covariance."""
    index = np.arange(layout.total)
    precision = normal.copy()
    precision[index, index] += layout.ridge
    covariance = np.linalg.inv(precision)
    return np.sum((heavy @ covariance) * white, axis=1), covariance
