"""Is there structure left in the residuals: along turns, with load, with branch, or by run.

The residuals are projected on saturated models, and outliers that stand alone are left out first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tsvision.diagnosis.fit import Fit
from tsvision.diagnosis.problem import USUAL_NOISE, Problem
from tsvision.diagnosis.saturated import (
    RHO_GRID,
    Design,
    Saturated,
    clock_blocks,
    common_blocks,
    range_of,
    run_blocks,
    series_blocks,
)

MISFIT_P = 1e-3  # structure in the residual that chance hardly makes
OUTLIER = 5.0  # studentised residual
MOST_OUTLIERS = 0.1  # share of the rows that may be left out beyond those the fit distrusts
TRIFLE = 0.2  # of what such readings are usually good to: structure that small is none
GROSS = 3.0  # times that, or what they are stated to be good to: noise that repeats is no excuse
LEAST_FREE = 4  # degrees of freedom beyond a saturated model
MOST_WILD = 0.15  # of the rows: where more are off, company is chance
DISTRUSTED = 0.25  # Student-t weight: beyond about four times the noise
PLACES = {
    "turns": "along turns, alike in all runs",
    "load": "along turns, in proportion to the load",
    "branch": "between winding and unwinding",
    "run": "from run to run",
    "clock": "with time, within runs",
    "series": "within single runs, differently in each",
}


@dataclass(frozen=True)
class LackOfFit:
    """p-value (1 when nothing can be tested), where it lives, and how large it is.

    `structured` maps an observable to the rms of its structured residual in its own unit, and
    `smooth` (n,) is that residual by row. `gross` says that `observable`'s is too large for noise,
    whatever its correlation. `rho` and `rho_sd` are REML's, by observable.
    """

    p: float
    place: str
    observable: str
    structured: dict[str, float]
    smooth: np.ndarray
    rho: np.ndarray
    rho_sd: np.ndarray
    tested: bool
    gross: bool = False

    @property
    def wrong(self) -> bool:
        """Whether what is left is structure, and no noise."""
        return self.tested and (self.p < MISFIT_P or self.gross)


def lack_of_fit(problem: Problem, fitted: Fit) -> LackOfFit:
    """Test every observable of a fit for structure; Bonferroni over places and observables."""
    table = problem.table
    smooth = np.zeros(table.rows)
    rho, rho_sd = np.zeros(len(table.observables)), np.full(len(table.observables), 0.3)
    structured: dict[str, float] = {}
    tests: list[tuple[float, str, str]] = []
    # By how many times structure exceeds what is usual and what the rows scatter by: few rows leave
    # the correlation open, so that a smooth misfit of any size might be noise that repeats.
    gross: dict[str, float] = {}
    tested = False
    design = _design(problem, fitted)
    for k, name in enumerate(table.observables):
        rows = np.flatnonzero(table.observable == k)
        found = _saturated(problem, fitted, rows, design.of(rows))
        if not found:
            continue
        likely = _likely_rho(found)
        rho[k] = likely @ RHO_GRID
        rho_sd[k] = np.sqrt(likely @ (RHO_GRID - rho[k]) ** 2 + 0.03**2)
        telling = min(found, key=lambda s: min(s.tests.values(), default=1.0))
        smooth[rows] = telling.smooth
        structured[name] = telling.structured
        tested = True
        if telling.structured < table.drifts.get(name, TRIFLE * USUAL_NOISE[name]):
            continue
        tests += [(p, place, name) for s in found for place, p in s.tests.items()]
        times = telling.structured / max(_usual(problem, name), telling.scatter)
        if times > GROSS:
            gross[name] = times
    if not tests:
        return LackOfFit(1.0, "", "", structured, smooth, rho, rho_sd, tested)
    p, place, observable = min(tests)
    if gross and p * len(tests) > MISFIT_P:
        largest = max(gross, key=lambda name: gross[name])
        p, place, observable = min(test for test in tests if test[2] == largest)
    p = min(1.0, p * len(tests))
    return LackOfFit(p, place, observable, structured, smooth, rho, rho_sd, True, bool(gross))


def _usual(problem: Problem, name: str) -> float:
    """What such readings are usually good to, or as stated where that is more."""
    stated = float(problem.noise_usual[problem.table.observables.index(name)])
    return max(stated, USUAL_NOISE[name])


def _saturated(problem: Problem, fitted: Fit, rows: np.ndarray, design: Design) -> list[Saturated]:
    """The saturated models that the rows of one observable can bear."""
    models = [
        blocks
        for make in (common_blocks, series_blocks, run_blocks, clock_blocks)
        if (blocks := make(problem, rows))
        and len(rows) - design.rows.shape[1] - sum(b.shape[1] for b in blocks.values())
        >= LEAST_FREE
    ]
    if not models:
        return []
    # An outlier that one model bends to may stand out in the other.
    residual = (problem.table.value - fitted.predicted)[rows]
    wild = _alone(problem, rows, residual, fitted.weight[rows] < DISTRUSTED)
    for blocks in models:
        wild = _outliers(residual, np.column_stack([design.rows, *blocks.values()]), wild)
    return [Saturated(problem, residual, wild, rows, design, blocks) for blocks in models]


def _likely_rho(found: list[Saturated]) -> np.ndarray:
    """What is likely of the AR(1) coefficient: structure that only the series see would pass as
    correlation in the first model."""
    first = found[0]
    series = next((s for s in found if "series" in s.tests), first)
    return 0.5 * (first.likely + series.likely) if series.rho < first.rho else first.likely


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


def _design(problem: Problem, fitted: Fit) -> Design:
    """How the fit's tolerances, parameters and offsets move the rows; only parameters are free."""
    free = np.full(len(fitted.u), np.nan)
    return Design(fitted.jacobian, np.concatenate([fitted.z, free, fitted.offsets]))


def _outliers(residual: np.ndarray, design: np.ndarray, suspect: np.ndarray) -> np.ndarray:
    """`suspect` (n,) with those added, one after the other, whose residual stands out.

    Studentised by the scatter without the row itself, since a rich model bends to an outlier.
    """
    wild = suspect.copy()
    for _ in range(int(MOST_OUTLIERS * len(wild))):
        kept = np.flatnonzero(~wild)
        basis = range_of(design[kept])
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
