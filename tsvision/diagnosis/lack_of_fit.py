"""Is there structure left in the residuals: along turns, with load, with branch, or by run.

The residuals are projected on hat functions of turns (alone, times load, times branch) and on a
parabola per run; the noise and its AR(1) coefficient come from what even this saturated model
leaves (REML), so that a smooth misfit cannot pass as correlated noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc

from tsvision.diagnosis.fit import Fit
from tsvision.diagnosis.problem import Problem

RHO_GRID = np.arange(0.0, 0.91, 0.1)
MOST_NODES = 12
PLACES = {
    "turns": "along turns, alike in all runs",
    "load": "along turns, in proportion to the load",
    "branch": "between winding and unwinding",
    "run": "from run to run",
}


@dataclass(frozen=True)
class LackOfFit:
    """p-value (1 when nothing can be tested), where it lives, and how large it is.

    `structured` maps an observable to the rms of its structured residual in its own unit, and
    `smooth` (n,) is that residual by row. `rho` and `rho_sd` are REML's, by observable.
    """

    p: float
    place: str
    observable: str
    structured: dict[str, float]
    smooth: np.ndarray
    rho: np.ndarray
    rho_sd: np.ndarray
    tested: bool


def lack_of_fit(problem: Problem, fitted: Fit) -> LackOfFit:
    """Test every observable of a fit for structure; Bonferroni over places and observables."""
    table = problem.table
    smooth = np.zeros(table.rows)
    rho, rho_sd = np.zeros(len(table.observables)), np.full(len(table.observables), 0.3)
    structured: dict[str, float] = {}
    tests: list[tuple[float, str, str]] = []
    for k, name in enumerate(table.observables):
        rows = np.flatnonzero(table.observable == k)
        blocks = _blocks(problem, rows)
        design = _own_design(fitted.jacobian[rows])
        if not blocks or len(rows) - design.shape[1] - _width(blocks) < 4:
            continue
        found = _Saturated(problem, fitted, rows, design, blocks)
        rho[k], rho_sd[k] = found.rho, found.rho_sd
        smooth[rows] = found.smooth
        structured[name] = found.structured
        tests += [(p, place, name) for place, p in found.tests.items()]
    if not tests:
        return LackOfFit(1.0, "", "", structured, smooth, rho, rho_sd, tested=False)
    p, place, observable = min(tests)
    p = min(1.0, p * len(tests))
    return LackOfFit(p, place, observable, structured, smooth, rho, rho_sd, tested=True)


def _own_design(jacobian: np.ndarray) -> np.ndarray:
    """The columns of the fit's Jacobian that move these rows at all."""
    return jacobian[:, np.any(jacobian != 0, axis=0)]


def _width(blocks: dict[str, np.ndarray]) -> int:
    return sum(block.shape[1] for block in blocks.values())


def hats(turns: np.ndarray, most: int) -> np.ndarray:
    """Linear B-splines on at most `most` nodes at quantiles of the turn levels, (n, k)."""
    levels = np.unique(np.round(turns, 6))
    nodes = levels if len(levels) <= most else np.quantile(levels, np.linspace(0, 1, most))
    if len(nodes) < 2:
        return np.zeros((len(turns), 0))
    return np.column_stack([np.interp(turns, nodes, unit) for unit in np.eye(len(nodes))])


def _blocks(problem: Problem, rows: np.ndarray) -> dict[str, np.ndarray]:
    """Basis functions by place, as many as the rows can bear."""
    table = problem.table
    at = table.at.take(table.condition[rows])
    runs = np.unique(table.run[rows])
    several_loads = np.all(np.isfinite(at.load_N)) and np.ptp(at.load_N) > 0
    sides = 1 + several_loads + (0 < at.unwinding.sum() < len(rows))
    room = int(len(rows) * 0.55) - 2 * len(runs) * (len(runs) > 2)
    most = min(MOST_NODES, room // sides)
    if most < 3:
        return {}
    base = hats(at.turns, most)
    blocks = {"turns": base}
    if several_loads:
        load = at.load_N - at.load_N.mean()
        blocks["load"] = base * (load / np.abs(load).max())[:, None]
    if 0 < at.unwinding.sum() < len(rows):
        blocks["branch"] = base * np.where(at.unwinding, 0.5, -0.5)[:, None]
    if len(runs) > 2:
        scaled = at.turns / max(at.turns.max(), 1e-9)
        member = (table.run[rows][:, None] == runs[None, :]).astype(float)
        blocks["run"] = np.hstack([member * scaled[:, None], member * (scaled**2)[:, None]])
    return blocks


class _Saturated:
    """One observable's residual on the fit's own design and all blocks, at the best rho."""

    def __init__(
        self,
        problem: Problem,
        fitted: Fit,
        rows: np.ndarray,
        design: np.ndarray,
        blocks: dict[str, np.ndarray],
    ) -> None:
        table = problem.table
        position = np.full(table.rows + 1, -1)
        position[rows] = np.arange(len(rows))
        before = position[table.before[rows]]
        first = before < 0
        scale = problem.row_scale[rows]
        heavy = np.sqrt(np.minimum(fitted.weight[rows], 1.0)) / scale
        residual = (table.value - fitted.predicted)[rows]
        everything = np.column_stack([design, *blocks.values()])

        def whiten(array: np.ndarray, rho: float) -> np.ndarray:
            back = np.where(first, 0.0, rho)
            lead = np.where(first, np.sqrt(1 - rho**2), 1.0) * heavy
            if array.ndim == 1:
                return (array - back * array[before]) * lead
            return (array - back[:, None] * array[before]) * lead[:, None]

        scores = []
        for rho in RHO_GRID:
            basis, spread = _range(whiten(everything, rho))
            e = whiten(residual, rho)
            left = e - basis @ (basis.T @ e)
            free = len(rows) - basis.shape[1]
            # The likelihood of the error contrasts; `first` rows carry the sqrt(1 - rho²).
            determinant = 0.5 * first.sum() * np.log(1 - rho**2)
            scores.append(-0.5 * free * np.log(left @ left + 1e-12) + determinant - spread)
        likely = np.exp(np.array(scores) - max(scores))
        likely /= likely.sum()
        self.rho = float(likely @ RHO_GRID)
        self.rho_sd = float(np.sqrt(likely @ (RHO_GRID - self.rho) ** 2 + 0.03**2))
        e = whiten(residual, self.rho)
        full, _ = _range(whiten(everything, self.rho))
        own, _ = _range(whiten(design, self.rho))
        free = max(len(rows) - full.shape[1], 1)
        left = e - full @ (full.T @ e)
        self.noise2 = max(float(left @ left) / free, 1e-12)
        self.tests = {}
        for place, block in blocks.items():
            fresh = whiten(block, self.rho)
            fresh = fresh - own @ (own.T @ fresh)
            basis, _ = _range(fresh)
            if basis.shape[1]:
                statistic = float(np.sum((basis.T @ e) ** 2)) / basis.shape[1] / self.noise2
                self.tests[place] = float(fdtrc(basis.shape[1], free, statistic))
        extra = np.column_stack(list(blocks.values()))
        coefficients = np.linalg.lstsq(whiten(extra, self.rho), e, rcond=1e-8)[0]
        self.smooth = extra @ coefficients
        plain, _ = _range(extra / scale[:, None] * np.minimum(heavy * scale, 1)[:, None])
        raw = residual * heavy
        explained = float(np.sum((plain.T @ raw) ** 2)) - plain.shape[1] * self.noise2 / max(
            1 - self.rho**2, 0.1
        )
        self.structured = float(np.sqrt(max(explained, 0.0) / np.sum(heavy**2)))


def _range(matrix: np.ndarray) -> tuple[np.ndarray, float]:
    """An orthonormal basis of the columns' range, and half the log determinant of M'M there."""
    if matrix.shape[1] == 0:
        return matrix, 0.0
    size = np.linalg.norm(matrix, axis=0)
    left, values, _ = np.linalg.svd(matrix / np.where(size > 0, size, 1.0), full_matrices=False)
    keep = values > 1e-6 * values[0]
    return left[:, keep], float(np.sum(np.log(values[keep])))
