"""Where nuisances, parameters and offsets lie in the vector that is fitted."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.special import ndtr

from tsvision.diagnosis.problem import Problem, bounds, parameters
from tsvision.mechanisms.shelf import Parameter, Simulation

MOST_NUISANCE = 4.0  # standard deviations: beyond that an input is wrong, which is a cause
UNIFORM_RIDGE = 1.0  # a weak pull that keeps a flat direction finite; undone in the evidence


def start_grid(parameters: Iterable[Parameter], most: int) -> np.ndarray:
    """The product of the parameters' starts in prior units, thinned to at most `most` (S, P)."""
    grid = np.zeros((1, 0))
    for p in parameters:
        grid = np.column_stack(
            [np.repeat(grid, len(p.starts), axis=0), np.tile(p.starts, len(grid))]
        )
    return grid[:: max(1, -(-len(grid) // most))]


class Layout:
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
