"""What to measure next, so that one cause stays; and where, so that they part most."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from tsvision.diagnosis.arrange import GAIN_SD
from tsvision.diagnosis.fit import Fit
from tsvision.diagnosis.problem import USUAL_NOISE, Problem
from tsvision.diagnosis.resolving import Rival, chance_to_resolve, expected
from tsvision.mechanisms.shelf import OBSERVABLES
from tsvision.mechanisms.state import Conditions

ENOUGH = 6.0  # a difference of so many standard deviations decides; more is worth nothing
ENOUGH_SWEPT = 1.2  # the same where the observable is read all along the runs, some dozens of times
BY_PARTING = 0.01  # chance to resolve that a standard deviation of parting is worth, beside it
MOST_SWEPT = 80  # conditions of the runs at hand that are thought read again
LEVELS = 8
FIRST = 0.03  # of the largest turns: before much is laid, where a step or dead zone still shows


@dataclass(frozen=True)
class Proposal:
    """One measurement: what, where, which sets it separates, by how much against the noise."""

    observable: str
    turns: float
    load_N: float
    strings: float
    branch: str
    separates: tuple[tuple[str, ...], tuple[str, ...]]
    expected_difference: float
    noise: float
    unit: str
    decisiveness: float
    chance: float  # that only the true one stays in the class, read all along the runs


def propose(
    problem: Problem,
    rivals: list[Rival],
    base: Rival,
    alarm: float,
    shown: int,
    decided: bool = False,
    skip: frozenset[str] = frozenset(),
) -> Proposal | None:
    """What to measure and where, so that one of the rivals stays: the observable that likeliest
    leaves the true one alone, at the conditions that part most of the first `shown`.

    The base is no rival; but what is known already has to stay over the `alarm`. Where one of them
    is `decided` on already, the observable is taken that parts it most from the others.
    """
    if len(rivals) < 2:
        return None
    best: tuple[float, Proposal] | None = None
    design, sweep = _grid(problem), _sweep(problem)
    survivors = [r.fitted for r in rivals[:shown]]
    for observable in OBSERVABLES:
        # The helix angle says the same as the pitch, the twist the same as the turns seen.
        if observable in skip or observable in ("pitch_mm", "turns_seen"):
            continue
        if observable == "torque_Nmm" and not np.all(np.isfinite(design.load_N)):
            continue
        parting, proposal = _proposal(problem, design, survivors, observable)
        asked = _ask(problem, sweep, observable)
        seen = [expected(asked, r.fitted) for r in (*rivals, base)]
        noise = _noise(problem, survivors[0], observable, seen[0].mean)
        chance = chance_to_resolve(rivals, seen, noise, base, alarm)
        worth = parting if decided else chance + BY_PARTING * parting
        if best is None or worth > best[0]:
            best = worth, replace(proposal, chance=chance)
    return best[1] if best else None


def _proposal(
    problem: Problem, design: Conditions, survivors: list[Fit], observable: str
) -> tuple[float, Proposal]:
    """The best conditions to read one observable at, and by how many standard deviations it parts
    the survivors, those most alike first of all."""
    asked = _ask(problem, design, observable)
    seen = [expected(asked, fitted) for fitted in survivors]
    noise = _noise(problem, survivors[0], observable, seen[0].mean)
    pairs = list(itertools.combinations(range(len(survivors)), 2))
    apart = np.array([abs(seen[a].mean - seen[b].mean) for a, b in pairs])
    spread = np.array([np.sqrt(noise**2 + seen[a].variance + seen[b].variance) for a, b in pairs])
    score = np.minimum(apart / spread, ENOUGH)
    total = score.mean(axis=0) + 1e-3 * (apart / spread).mean(axis=0)
    i = int(np.argmax(total))
    # An observable is worth what it does for the pair that it parts worst, read where it parts
    # that pair best: it will hardly be read once only.
    reach = np.minimum(score.max(axis=1), ENOUGH_SWEPT)
    worth = float(reach.min() + 0.5 * reach.mean() + 0.1 * total[i])
    pair = int(np.argmax(score[:, i]))
    a, b = pairs[pair]
    return worth, Proposal(
        observable=observable,
        turns=float(design.turns[i]),
        load_N=float(design.load_N[i]),
        strings=float(design.strings[i]),
        branch="unwind" if design.unwinding[i] else "wind",
        separates=(survivors[a].names, survivors[b].names),
        expected_difference=float(apart[pair, i]),
        noise=float(np.broadcast_to(noise, apart[pair].shape)[i]),
        unit=OBSERVABLES[observable],
        decisiveness=float(apart[pair, i] / spread[pair, i]),
        chance=float("nan"),
    )


def _sweep(problem: Problem) -> Conditions:
    """The conditions at hand, evenly thinned where they are many."""
    used = np.unique(problem.table.condition)
    return problem.table.at.take(used[:: -(-len(used) // MOST_SWEPT)])


def _grid(problem: Problem) -> Conditions:
    """Conditions within reach: turns up to the largest, the least and the largest load."""
    table = problem.table
    at = table.at
    used = np.unique(table.condition)
    turns = at.turns[used].max() * np.concatenate([[FIRST], np.linspace(0, 1, LEVELS + 1)[1:]])
    known = at.load_N[used][np.isfinite(at.load_N[used])]
    loads = [known.min(), known.max()] if known.size else [np.nan]
    back = [False, True] if at.unwinding[used].any() else [False]
    typical = {n: used[np.argmax(at.strings[used] == n)] for n in np.unique(at.strings[used])}
    cells = list(itertools.product(turns, sorted(set(loads)), back, typical))
    index = np.array([typical[cell[3]] for cell in cells])
    design = at.take(index)
    late = np.nanmax(at.time_s[used]) if np.isfinite(at.time_s[used]).any() else np.nan
    return replace(
        design,
        turns=np.array([cell[0] for cell in cells]),
        load_N=np.array([cell[1] for cell in cells]),
        unwinding=np.array([cell[2] for cell in cells]),
        peak_turns=np.full(len(cells), turns[-1]),
        time_s=np.full(len(cells), late),
    )


def _ask(problem: Problem, design: Conditions, observable: str) -> Problem:
    """The problem with the design as its rows, all of one observable."""
    table = problem.table
    source = np.array([np.argmax(table.at.strings == n) for n in design.strings])
    count = len(design.turns)
    columns = list(problem.columns)
    gains = dict(table.gain_sd)
    if observable in GAIN_SD:
        gains.setdefault(observable, GAIN_SD[observable])
    for extra in ("camera", *(f"gain {name}" for name in gains)):
        if extra not in columns:
            columns.append(extra)
    asked = replace(
        table,
        at=design,
        observables=(observable,),
        observable=np.zeros(count, dtype=int),
        condition=np.arange(count),
        run=np.zeros(count, dtype=int),
        before=np.full(count, -1),
        value=np.zeros(count),
        value_sd=np.full(count, np.nan),
        radius_sd_mm=table.radius_sd_mm[source],
        zone_sd_mm=table.zone_sd_mm[source],
        hole_sd_mm=table.hole_sd_mm[source],
        gain_sd=gains,
    )
    return replace(
        problem,
        table=asked,
        radius_group=problem.radius_group[source],
        zone_group=problem.zone_group[source],
        hole_group=problem.hole_group[source],
        columns=tuple(columns),
        offsets=np.zeros((count, 0)),
        wander=np.zeros((count, 0)),
        row_scale=np.ones(count),
    )


def _noise(problem: Problem, fitted: Fit, observable: str, seen: np.ndarray) -> np.ndarray:
    if observable in problem.table.observables:
        known = float(fitted.sigma[problem.table.observables.index(observable)])
        return np.full(seen.shape, known)
    usual = USUAL_NOISE[observable]
    return (
        np.maximum(usual, 0.03 * np.abs(seen)) if observable == "torque_Nmm" else usual + 0 * seen
    )
