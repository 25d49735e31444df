"""What the extension gains on data that it has not seen, with the selection inside every fold."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tsvision.diagnosis.candidates import Selection
from tsvision.diagnosis.fit import Fit
from tsvision.diagnosis.problem import Problem
from tsvision.diagnosis.select import select
from tsvision.mechanisms import Simulation

TURN_BLOCKS = 4
MOST_FOLDS = 6
DRAWS = 1000
LEAST_TRAINING = 4
BY_TURNS = "leave-one-turn-block-out"
PROMISE = 1.5  # times by which a fit must undercut the base, for what was left out to judge it
KEPT = 0.2  # share of that (in squares) which must come true there
LEAST_FOLDS = 3  # two leave a single load to learn from, which shows no effect of load


@dataclass(frozen=True)
class Gain:
    """Root mean squares over the rows left out, in the unit of `observable`.

    `base` is the base model as it came, `refitted` the base with its inputs fitted within their
    tolerances, `extended` what the selection inside each fold chose; `ratio` = base / extended
    with a 95 % interval from resampling whole run branches. `chosen` tells what each fold chose.
    """

    scheme: str
    observable: str
    base: float
    refitted: float
    extended: float
    ratio: float
    low: float
    high: float
    chosen: tuple[tuple[str, ...], ...]


def held_out_gain(problem: Problem, selection: Selection, rows: np.ndarray) -> Gain | None:
    """Gain over the folds of the best scheme that the table allows; None where there is none.

    `rows` (n,) marks those that count (of one observable, outliers left out).
    """
    scheme, folds = _folds(problem, rows)
    if len(folds) < 2:
        return None
    off: dict[str, list[np.ndarray]] = {"base": [], "refitted": [], "extended": []}
    block: list[np.ndarray] = []
    chosen = []
    for fold in folds:
        train = subset(problem, ~fold)
        inside = select(train, hints=selection)
        best = inside.chosen.best if inside.chosen else inside.base
        chosen.append(inside.chosen.names if inside.chosen else ())
        test = np.flatnonzero(fold & rows)
        value = problem.table.value[test]
        off["base"].append(value - as_it_came(problem)[test])
        off["refitted"].append(value - predict_rows(problem, inside.base, ~fold)[test])
        off["extended"].append(value - predict_rows(problem, best, ~fold)[test])
        block.append(test)
    joined = {name: np.concatenate(parts) for name, parts in off.items()}
    base, refitted, extended = (rms(joined[name]) for name in off)
    low, high = _interval(problem, joined, np.concatenate(block))
    return Gain(
        scheme=scheme,
        observable=problem.table.observables[problem.table.observable[np.flatnonzero(rows)[0]]],
        base=base,
        refitted=refitted,
        extended=extended,
        ratio=base / extended,
        low=low,
        high=high,
        chosen=tuple(chosen),
    )


def denies(gain: Gain, fitted_rms: float) -> bool:
    """Whether what was left out denies causes that leave `fitted_rms` of the rows they were fitted
    to: a set that bends to every row it is shown predicts none that it is not.

    Little is asked, since true effects of load or time carry badly to other loads. Turns that were
    left out deny nothing: an effect that sets in there cannot be learnt elsewhere.
    """
    if gain.scheme == BY_TURNS or len(gain.chosen) < LEAST_FOLDS:
        return False
    promised = gain.base**2 - fitted_rms**2
    came_true = gain.base**2 - gain.extended**2
    return gain.base > PROMISE * fitted_rms and came_true < KEPT * promised


def subset(problem: Problem, keep: np.ndarray) -> Problem:
    """The same problem (groups, nuisances, reference) on fewer rows."""
    return replace(
        problem,
        table=problem.table.select(keep),
        offsets=problem.offsets[keep],
        wander=problem.wander[keep],
        row_scale=problem.row_scale[keep],
    )


def as_it_came(problem: Problem) -> np.ndarray:
    """The base model's rows with all inputs as stated, (n,)."""
    z = np.zeros((1, problem.nuisances))
    return problem.predict(Simulation(base=problem.base), z[:, :0], z)[0]


def predict_rows(problem: Problem, fitted: Fit, known: np.ndarray) -> np.ndarray:
    """All rows (n,) from a fit to the rows `known`; runs not in them get no offset."""
    rows = problem.predict(fitted.simulation, fitted.u[None], fitted.z[None])[0]
    seen = np.any(problem.offsets[known] != 0, axis=0)
    return rows + problem.offsets @ np.where(seen, fitted.offsets, 0.0)


def rms(off: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(off**2)))


def _folds(problem: Problem, rows: np.ndarray) -> tuple[str, list[np.ndarray]]:
    """Masks (n,) of what is left out, by load, else bundle, else run, else block of turns."""
    table = problem.table
    at = table.at
    load, strings = at.load_N[table.condition], at.strings[table.condition]
    turns = at.turns[table.condition]
    labels = [
        ("leave-one-load-out", np.round(load, 3) if table.load_recorded else np.zeros(table.rows)),
        ("leave-one-N-out", strings),
        ("leave-one-run-out", table.run.astype(float)),
        (BY_TURNS, _turn_blocks(turns)),
    ]
    for scheme, label in labels:
        values = np.unique(label[rows])
        if len(values) < 2:
            continue
        if len(values) > MOST_FOLDS:  # neighbours share a fold
            label = np.digitize(label, np.quantile(values, np.linspace(0, 1, MOST_FOLDS + 1)[1:-1]))
            values = np.unique(label[rows])
        folds = [label == value for value in values]
        if all(np.sum(rows & ~fold) >= LEAST_TRAINING for fold in folds):
            return scheme, folds
    return "", []


def _turn_blocks(turns: np.ndarray) -> np.ndarray:
    levels = np.unique(turns)
    if len(levels) < 2 * TURN_BLOCKS:
        return np.searchsorted(levels, turns).astype(float)
    edges = np.quantile(levels, np.linspace(0, 1, TURN_BLOCKS + 1)[1:-1])
    return np.digitize(turns, edges).astype(float)


def _interval(
    problem: Problem, off: dict[str, np.ndarray], index: np.ndarray
) -> tuple[float, float]:
    """Resample run branches (or rows, where there are few) with a fixed seed."""
    table = problem.table
    label = table.run[index] * 2 + table.at.unwinding[table.condition[index]]
    blocks = np.unique(label, return_inverse=True)[1]
    if blocks.max() < 5:
        blocks = np.arange(len(index))
    draw = np.random.default_rng(0).multinomial(
        blocks.max() + 1, np.full(blocks.max() + 1, 1 / (blocks.max() + 1)), size=DRAWS
    )
    base, extended = (draw @ np.bincount(blocks, off[name] ** 2) for name in ("base", "extended"))
    low, high = np.quantile(np.sqrt(base / np.maximum(extended, 1e-12)), [0.025, 0.975])
    return float(low), float(high)
