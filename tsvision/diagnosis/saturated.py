"""Saturated models of one observable's residuals: what any cause at all might explain.

Hat functions of turns (alone, times load, times branch) with a parabola per run; hat functions for
every run; a polynomial of turns for every run and branch; one of time for every run. The noise and
its AR(1) coefficient come from what even these leave (REML), so that a smooth misfit cannot pass as
correlated noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc

from tsvision.diagnosis.problem import Problem

RHO_GRID = np.arange(0.0, 0.91, 0.1)
SHARES, SHARES_SERIES = 3, 7  # points by which what is likely of rho is averaged over
MOST_NODES = 16
RUN_NODES = 6
DEGREE = 3
CLOCK_DEGREE = 9  # two periods of a slow drift in a run
CLOCK_ROWS = 2.5  # rows for each of its columns


def hats(turns: np.ndarray, most: int) -> np.ndarray:
    """Linear B-splines on at most `most` nodes at quantiles of the turn levels, (n, k)."""
    levels = np.unique(np.round(turns, 6))
    nodes = levels if len(levels) <= most else np.quantile(levels, np.linspace(0, 1, most))
    if len(nodes) < 2:
        return np.zeros((len(turns), 0))
    return np.column_stack([np.interp(turns, nodes, unit) for unit in np.eye(len(nodes))])


def common_blocks(problem: Problem, rows: np.ndarray) -> dict[str, np.ndarray]:
    """Basis functions by place, as many as the rows can bear."""
    table = problem.table
    at = table.at.take(table.condition[rows])
    runs = np.unique(table.run[rows])
    several_loads = np.all(np.isfinite(at.load_N)) and np.ptp(at.load_N) > 0
    sides = 1 + several_loads + (0 < at.unwinding.sum() < len(rows))
    room = int(len(rows) * 0.6) - 2 * len(runs) * (len(runs) > 2)
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


def series_blocks(problem: Problem, rows: np.ndarray) -> dict[str, np.ndarray]:
    """A polynomial of turns for every run and branch of at least DEGREE + 4 rows."""
    table = problem.table
    at = table.at.take(table.condition[rows])
    label = table.run[rows] * 2 + at.unwinding
    scaled = 2.0 * at.turns / max(at.turns.max(), 1e-9) - 1.0
    shapes = np.polynomial.legendre.legvander(scaled, DEGREE)
    kinds = [k for k in np.unique(label) if np.sum(label == k) >= DEGREE + 4]
    if len(kinds) < 2:
        return {}
    return {"series": np.hstack([shapes * (label == k)[:, None] for k in kinds])}


def run_blocks(problem: Problem, rows: np.ndarray) -> dict[str, np.ndarray]:
    """A curve along turns for every run, the same on both of its branches: what one run shows going
    and coming is no chance, whatever its form."""
    table = problem.table
    at = table.at.take(table.condition[rows])
    runs = np.unique(table.run[rows])
    if len(runs) < 2 or not 0 < at.unwinding.sum() < len(rows):
        return {}
    curve = hats(at.turns, RUN_NODES)
    return {"run": np.hstack([curve * (table.run[rows] == r)[:, None] for r in runs])}


def clock_blocks(problem: Problem, rows: np.ndarray) -> dict[str, np.ndarray]:
    """A polynomial of time (else of the way gone) for every run that winds and unwinds: what drifts
    with the clock passes smoothly through the reversal."""
    table = problem.table
    at = table.at.take(table.condition[rows])
    runs, count = np.unique(table.run[rows], return_counts=True)
    degree = min(CLOCK_DEGREE, int(count.min() / CLOCK_ROWS) - 1)
    if degree <= DEGREE or not 0 < at.unwinding.sum() < len(rows):
        return {}
    way = np.where(at.unwinding, 2.0 * at.peak_turns - at.turns, at.turns)
    clock = at.time_s if np.all(np.isfinite(at.time_s)) else way
    blocks = []
    for run in runs:
        own = table.run[rows] == run
        low, high = clock[own].min(), clock[own].max()
        scaled = 2.0 * (clock - low) / max(high - low, 1e-9) - 1.0
        shapes = np.polynomial.legendre.legvander(np.where(own, scaled, 0.0), degree)
        blocks.append(shapes * own[:, None])
    return {"clock": np.hstack(blocks)}


@dataclass(frozen=True)
class Design:
    """How a fit can move some rows (n, P): `moved` (P,) is how far it has moved each column that
    has a unit normal prior (tolerances, offsets) from the middle of that, NaN where it is free."""

    rows: np.ndarray
    moved: np.ndarray

    def of(self, keep: np.ndarray) -> Design:
        """For some of the rows, without the columns that do not touch them."""
        rows = self.rows[keep]
        touching = np.any(rows != 0, axis=0)
        return Design(rows[:, touching], self.moved[touching])


class _Whitener:
    """AR(1) whitening of one observable's rows; a row's predecessor is the last one kept."""

    def __init__(self, problem: Problem, rows: np.ndarray, wild: np.ndarray) -> None:
        table = problem.table
        bad = np.zeros(table.rows, dtype=bool)
        bad[rows] = wild
        position = np.full(table.rows + 1, -1)
        position[rows[~wild]] = np.arange(np.sum(~wild))
        before = table.before[rows[~wild]]
        while np.any(step := (before >= 0) & bad[before]):
            before = np.where(step, table.before[before], before)
        self.before = position[before]
        self.first = self.before < 0
        self.heavy = 1.0 / problem.row_scale[rows[~wild]]

    def __call__(self, array: np.ndarray, rho: float) -> np.ndarray:
        back = np.where(self.first, 0.0, rho)
        lead = np.where(self.first, np.sqrt(1 - rho**2), 1.0)
        scaled = (array.T * self.heavy).T
        return ((scaled.T - back * scaled[self.before].T) * lead).T


class Saturated:
    """One observable's residual on the fit's own design and all blocks, at the best rho.

    `scatter` is the noise from row to row, in the rows' unit: what it is if it does not repeat.
    """

    def __init__(
        self,
        problem: Problem,
        residual: np.ndarray,
        wild: np.ndarray,
        rows: np.ndarray,
        design: Design,
        blocks: dict[str, np.ndarray],
    ) -> None:
        whiten = _Whitener(problem, rows, wild)
        extra = np.column_stack(list(blocks.values()))
        everywhere = extra
        design, extra, residual = design.of(~wild), extra[~wild], residual[~wild]
        blocks = {place: block[~wild] for place, block in blocks.items()}
        everything = np.column_stack([design.rows, extra])
        self.scatter = _noise_beyond(whiten(residual, 0.0), whiten(everything, 0.0))[0] ** 0.5
        self.likely = _rho_likelihood(whiten, residual, everything)
        self.rho = float(self.likely @ RHO_GRID)
        # p averaged over what is likely of rho, by points of equal share. A polynomial for every
        # series leaves little to know rho by: its upper tail matters there.
        many = SHARES_SERIES if {"series", "clock"} & set(blocks) else SHARES
        points = [_quantile(self.likely, (i + 0.5) / many) for i in range(many)]
        found = [_tests(whiten, residual, design, blocks, rho) for rho in points]
        self.tests = {k: float(np.mean([tests[k] for tests, _ in found])) for k in blocks}
        noise2 = float(np.mean([noise for _, noise in found]))
        coefficients, self.structured = _structure(whiten, residual, extra, noise2, self.rho)
        self.smooth = everywhere @ coefficients


def _quantile(likely: np.ndarray, share: float) -> float:
    """A quantile of the AR(1) coefficient, between the points of the grid."""
    step = RHO_GRID[1] - RHO_GRID[0]
    edges = np.concatenate([[0.0], np.cumsum(likely)])
    return float(np.clip(np.interp(share, edges, (np.arange(len(edges)) - 0.5) * step), 0.0, 0.95))


def _tests(
    whiten: _Whitener,
    residual: np.ndarray,
    design: Design,
    blocks: dict[str, np.ndarray],
    rho: float,
) -> tuple[dict[str, float], float]:
    """p of an F-test for each block at one rho, and the noise variance beyond all blocks.

    The priors stand as rows, in units of the noise: tolerances and offsets that were free would
    take up what only inputs many standard deviations off could do.
    """
    e = whiten(residual, rho)
    own = whiten(design.rows, rho)
    fresh = {place: whiten(block, rho) for place, block in blocks.items()}
    noise2, free = _noise_beyond(e, np.column_stack([own, *fresh.values()]))
    known = np.flatnonzero(np.isfinite(design.moved))
    held = np.sqrt(noise2) * np.eye(len(design.moved))[known]
    e = np.concatenate([e, -np.sqrt(noise2) * design.moved[known]])
    own = range_of(np.vstack([own, held]))
    e = e - own @ (own.T @ e)
    found = {}
    for place, block in fresh.items():
        block = np.vstack([block, np.zeros((len(known), block.shape[1]))])
        basis = range_of(block - own @ (own.T @ block))
        many = max(basis.shape[1], 1)
        statistic = float(np.sum((basis.T @ e) ** 2)) / many / noise2
        found[place] = float(fdtrc(many, free, statistic))
    return found, noise2


def _noise_beyond(e: np.ndarray, everything: np.ndarray) -> tuple[float, int]:
    """The noise variance that is left beyond `everything`, and its degrees of freedom."""
    full = range_of(everything)
    free = max(len(e) - full.shape[1], 1)
    left = e - full @ (full.T @ e)
    return max(float(left @ left) / free, 1e-12), free


def _rho_likelihood(whiten: _Whitener, residual: np.ndarray, everything: np.ndarray) -> np.ndarray:
    """Restricted likelihood of the AR(1) coefficient on RHO_GRID, adding up to 1."""
    scores = []
    # One fixed basis of full rank: the determinant must not see how columns were scaled.
    full_rank = range_of((everything.T * whiten.heavy).T) if everything.shape[1] else everything
    full_rank = (full_rank.T / whiten.heavy).T
    for rho in RHO_GRID:
        upper, left = np.linalg.qr(whiten(full_rank, rho))[::-1]
        e = whiten(residual, rho)
        left = e - left @ (left.T @ e)
        free = len(e) - full_rank.shape[1]
        determinant = 0.5 * whiten.first.sum() * np.log(1 - rho**2)
        determinant -= float(np.sum(np.log(np.abs(np.diag(upper)))))
        scores.append(-0.5 * free * np.log(left @ left + 1e-12) + determinant)
    likely = np.exp(np.array(scores) - max(scores))
    return likely / likely.sum()


def _structure(
    whiten: _Whitener, residual: np.ndarray, extra: np.ndarray, noise2: float, rho: float
) -> tuple[np.ndarray, float]:
    """Coefficients of the smooth residual on `extra`, its rms with the noise's share taken off."""
    e = whiten(residual, rho)
    coefficients = np.linalg.lstsq(whiten(extra, rho), e, rcond=1e-8)[0]
    plain = range_of((extra.T * whiten.heavy).T)
    raw = residual * whiten.heavy
    chance = plain.shape[1] * noise2 / max(1 - rho**2, 0.1)
    explained = max(float(np.sum((plain.T @ raw) ** 2)) - chance, 0.0)
    return coefficients, float(np.sqrt(explained / np.sum(whiten.heavy**2)))


def range_of(matrix: np.ndarray) -> np.ndarray:
    """An orthonormal basis of the columns' range (by the Gram matrix: many rows, few columns)."""
    if matrix.shape[1] == 0:
        return matrix
    size = np.linalg.norm(matrix, axis=0)
    unit = matrix / np.where(size > 0, size, 1.0)
    values, vectors = np.linalg.eigh(unit.T @ unit)
    keep = values > 1e-9 * values[-1]
    return np.linalg.qr(unit @ vectors[:, keep])[0]
