"""Is there structure left in the residuals: along turns, with load, with branch, or by run.

The residuals are projected on saturated models: hat functions of turns (alone, times load, times
branch) with a parabola per run, and a polynomial of its own for every run and branch. The noise
and its AR(1) coefficient come from what even these leave (REML), so that a smooth misfit cannot
pass as correlated noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc

from tsvision.diagnosis.fit import Fit
from tsvision.diagnosis.problem import RUN_GAIN, USUAL_NOISE, Problem

MISFIT_P = 1e-3  # structure in the residual that chance hardly makes
RHO_GRID = np.arange(0.0, 0.91, 0.1)
SHARES, SHARES_SERIES = 3, 7  # points by which what is likely of rho is averaged over
MOST_NODES = 16
DEGREE = 3
OUTLIER = 5.0  # studentised residual
MOST_OUTLIERS = 0.1  # share of the rows that may be left out beyond those the fit distrusts
TRIFLE = 0.2  # of what such readings are usually good to: structure that small is none
MOST_WILD = 0.15  # of the rows: where more are off, company is chance
DISTRUSTED = 0.25  # Student-t weight: beyond about four times the noise
PLACES = {
    "turns": "along turns, alike in all runs",
    "load": "along turns, in proportion to the load",
    "branch": "between winding and unwinding",
    "run": "from run to run",
    "series": "within single runs, differently in each",
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
    tested = False
    movable = _movable(problem, fitted)
    for k, name in enumerate(table.observables):
        rows = np.flatnonzero(table.observable == k)
        design = _own_design(movable[rows])
        models = [
            blocks
            for blocks in (_common_blocks(problem, rows), _series_blocks(problem, rows))
            if blocks and len(rows) - design.shape[1] - _width(blocks) >= 4
        ]
        if not models:
            continue
        # An outlier that one model bends to may stand out in the other.
        residual = (table.value - fitted.predicted)[rows]
        wild = _alone(problem, rows, residual, fitted.weight[rows] < DISTRUSTED)
        for blocks in models:
            wild = _outliers(residual, np.column_stack([design, *blocks.values()]), wild)
        found = [_Saturated(problem, residual, wild, rows, design, blocks) for blocks in models]
        likely = found[0].likely.copy()
        if len(found) > 1 and found[1].rho < found[0].rho:
            # Structure that only the second sees would pass as correlation in the first.
            likely = 0.5 * (likely + found[1].likely)
        rho[k] = likely @ RHO_GRID
        rho_sd[k] = np.sqrt(likely @ (RHO_GRID - rho[k]) ** 2 + 0.03**2)
        telling = min(found, key=lambda s: min(s.tests.values(), default=1.0))
        smooth[rows] = telling.smooth
        structured[name] = telling.structured
        tested = True
        if telling.structured < table.drifts.get(name, TRIFLE * USUAL_NOISE[name]):
            continue
        tests += [(p, place, name) for s in found for place, p in s.tests.items()]
    if not tests:
        return LackOfFit(1.0, "", "", structured, smooth, rho, rho_sd, tested)
    p, place, observable = min(tests)
    p = min(1.0, p * len(tests))
    return LackOfFit(p, place, observable, structured, smooth, rho, rho_sd, tested=True)


def _alone(
    problem: Problem, rows: np.ndarray, residual: np.ndarray, wild: np.ndarray
) -> np.ndarray:
    """`wild` (n,) without those that have company: two readings of the same turns, or next to them
    in their series, that are off to the same side, and none to the other. That is structure."""
    if not 0 < wild.sum() < MOST_WILD * len(wild):
        return wild
    table = problem.table
    at = table.at.take(table.condition[rows])
    level = np.round(at.turns, 3)
    series = table.run[rows] * 2 + at.unwinding
    step = float(np.median(np.diff(np.unique(level)))) if len(np.unique(level)) > 1 else 0.0
    side = np.sign(residual) * wild
    kept = wild.copy()
    for i in np.flatnonzero(wild):
        near = (level == level[i]) | (
            (series == series[i]) & (np.abs(level - level[i]) <= 2.5 * step)
        )
        near[i] = False
        if np.sum(side[near] == side[i]) >= 2 and not np.any(side[near] == -side[i]):
            kept[i] = False
    return kept


def _movable(problem: Problem, fitted: Fit) -> np.ndarray:
    """The fit's Jacobian without the gains of single runs, which are known to be small: free ones
    would pass any difference between runs."""
    small = [column.startswith(RUN_GAIN) for column in problem.columns]
    free = np.ones(fitted.jacobian.shape[1], dtype=bool)
    free[: len(small)] = ~np.array(small, dtype=bool)
    return fitted.jacobian[:, free]


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


def _common_blocks(problem: Problem, rows: np.ndarray) -> dict[str, np.ndarray]:
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


def _series_blocks(problem: Problem, rows: np.ndarray) -> dict[str, np.ndarray]:
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


class _Saturated:
    """One observable's residual on the fit's own design and all blocks, at the best rho."""

    def __init__(
        self,
        problem: Problem,
        residual: np.ndarray,
        wild: np.ndarray,
        rows: np.ndarray,
        design: np.ndarray,
        blocks: dict[str, np.ndarray],
    ) -> None:
        whiten = _Whitener(problem, rows, wild)
        extra = np.column_stack(list(blocks.values()))
        everywhere = extra
        design, extra, residual = design[~wild], extra[~wild], residual[~wild]
        blocks = {place: block[~wild] for place, block in blocks.items()}
        everything = np.column_stack([design, extra])
        self.likely = _rho_likelihood(whiten, residual, everything)
        self.rho = float(self.likely @ RHO_GRID)
        # p averaged over what is likely of rho, by points of equal share. A polynomial for every
        # series leaves little to know rho by: its upper tail matters there.
        many = SHARES_SERIES if "series" in blocks else SHARES
        points = [_quantile(self.likely, (i + 0.5) / many) for i in range(many)]
        own = _range(design)
        found = [_tests(whiten, residual, own, blocks, rho) for rho in points]
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
    design: np.ndarray,
    blocks: dict[str, np.ndarray],
    rho: float,
) -> tuple[dict[str, float], float]:
    """p of an F-test for each block at one rho, and the noise variance beyond all blocks.

    `design` and `blocks` are bases of full rank; together they need not be.
    """
    e = whiten(residual, rho)
    own = np.linalg.qr(whiten(design, rho))[0]
    e = e - own @ (own.T @ e)
    fresh = {place: whiten(block, rho) for place, block in blocks.items()}
    fresh = {place: block - own @ (own.T @ block) for place, block in fresh.items()}
    full = _range(np.column_stack(list(fresh.values())))
    free = max(len(e) - own.shape[1] - full.shape[1], 1)
    left = e - full @ (full.T @ e)
    noise2 = max(float(left @ left) / free, 1e-12)
    found = {}
    for place, block in fresh.items():
        basis = full if len(fresh) == 1 else _range(block)
        many = max(basis.shape[1], 1)
        statistic = float(np.sum((basis.T @ e) ** 2)) / many / noise2
        found[place] = float(fdtrc(many, free, statistic))
    return found, noise2


def _outliers(residual: np.ndarray, design: np.ndarray, suspect: np.ndarray) -> np.ndarray:
    """`suspect` (n,) with those added, one after the other, whose residual stands out.

    Studentised by the scatter without the row itself, since a rich model bends to an outlier.
    """
    wild = suspect.copy()
    for _ in range(int(MOST_OUTLIERS * len(wild))):
        kept = np.flatnonzero(~wild)
        basis = _range(design[kept])
        free = len(kept) - basis.shape[1]
        if free < 8:
            break
        off = residual[kept] - basis @ (basis.T @ residual[kept])
        leave = np.maximum(1.0 - np.sum(basis**2, axis=1), 0.05)
        share = np.minimum(off**2 / (leave * max(float(off @ off), 1e-300)), 1.0 - 1e-9)
        student = np.sqrt(share * (free - 1) / (1.0 - share))
        worst = int(np.argmax(student))
        if student[worst] < OUTLIER:
            break
        wild[kept[worst]] = True
    return wild


def _rho_likelihood(whiten: _Whitener, residual: np.ndarray, everything: np.ndarray) -> np.ndarray:
    """Restricted likelihood of the AR(1) coefficient on RHO_GRID, adding up to 1."""
    scores = []
    # One fixed basis of full rank: the determinant must not see how columns were scaled.
    full_rank = _range((everything.T * whiten.heavy).T) if everything.shape[1] else everything
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
    plain = _range((extra.T * whiten.heavy).T)
    raw = residual * whiten.heavy
    chance = plain.shape[1] * noise2 / max(1 - rho**2, 0.1)
    explained = max(float(np.sum((plain.T @ raw) ** 2)) - chance, 0.0)
    return coefficients, float(np.sqrt(explained / np.sum(whiten.heavy**2)))


def _range(matrix: np.ndarray) -> np.ndarray:
    """An orthonormal basis of the columns' range (by the Gram matrix: many rows, few columns)."""
    if matrix.shape[1] == 0:
        return matrix
    size = np.linalg.norm(matrix, axis=0)
    unit = matrix / np.where(size > 0, size, 1.0)
    values, vectors = np.linalg.eigh(unit.T @ unit)
    keep = values > 1e-9 * values[-1]
    return np.linalg.qr(unit @ vectors[:, keep])[0]
