"""Candidates: sets of mechanisms, their shapes pooled, with what the table has for them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from tsvision.diagnosis.fit import Fit, fit
from tsvision.diagnosis.problem import Problem, bounds, parameters
from tsvision.mechanisms import MECHANISMS, Shape, Simulation

PRIOR_LOG_ODDS = {"variable_radius": -1.0}  # the paper refutes it for the overtwist phase
# All of these say how r goes with the turns: together they are likelier one form that fits badly.
KIN = {"radius_bias", "radius_step", "variable_radius"}
KIN_LOG_ODDS = -3.0


@dataclass(frozen=True)
class Candidate:
    """A set of mechanisms with the evidence of its shapes pooled, and its best fit."""

    names: tuple[str, ...]
    log_evidence: float
    best: Fit
    fits: tuple[Fit, ...]


@dataclass(frozen=True)
class Selection:
    """All that was tried. `chosen` is what the data support best (the base if nothing)."""

    base: Fit
    candidates: tuple[Candidate, ...]  # by falling evidence
    chosen: Candidate | None

    def gain(self, candidate: Candidate) -> float:
        return candidate.log_evidence - self.base.log_evidence


def usable_shapes(problem: Problem, name: str) -> list[Shape]:
    """The shapes of a mechanism for which the table holds what they need."""
    mechanism = MECHANISMS[name]
    if not set(mechanism.touches) & set(problem.table.observables):
        return []
    have = available(problem)
    return [shape for shape in mechanism.shapes if shape.needs <= have]


def available(problem: Problem) -> frozenset[str]:
    """What the table tells: load, loads (several), time, unwinding, bundles (several)."""
    table = problem.table
    at = table.at.take(np.unique(table.condition))
    have = set()
    if table.load_recorded and np.all(at.load_N > 0):
        have.add("load")
        if np.ptp(at.load_N) > 1e-6 * at.load_N.max():
            have.add("loads")
    if np.all(np.isfinite(at.time_s)) and np.ptp(at.time_s) > 0:
        have.add("time")
    if at.unwinding.any():
        have.add("unwinding")
    if np.ptp(at.radius_mm) > 1e-6:
        have.add("bundles")
    return frozenset(have)


def carried_over(best: Fit, simulation: Simulation) -> np.ndarray:
    """The fit's values for parameters of the same name, their first start for the others."""
    known = dict(zip((key for key, _ in parameters(best.simulation)), best.u, strict=True))
    u = []
    for key, p in parameters(simulation):
        low, high = bounds(p)
        u.append(float(np.clip(known.get(key, p.starts[0]), low, high)))
    return np.concatenate([best.z, u, best.offsets])


def merged(problem: Problem, old: list[Candidate], fits: list[Fit]) -> list[Candidate]:
    """Candidates with further fits taken in."""
    pooled: dict[tuple[str, ...], list[Fit]] = {c.names: list(c.fits) for c in old}
    for found in fits:
        pooled.setdefault(sorted_names(found.names), []).append(found)
    return [pool(problem, names, group) for names, group in pooled.items()]


def again(problem: Problem, old: Fit) -> Fit:
    """Fit the same simulation to other rows, from where it stood."""
    start = np.concatenate([old.z, old.u, old.offsets])
    return fit(problem, old.simulation, start, most_steps=8, noise=(old.sigma, old.rho))


def pool(problem: Problem, names: tuple[str, ...], fits: list[Fit]) -> Candidate:
    """Evidence averaged over the shapes that were possible; the likeliest fit first."""
    fits = sorted(fits, key=lambda f: -weighed(f))
    once = {
        frozenset((q.mechanism, q.shape.name) for q in f.simulation.parts): f for f in fits[::-1]
    }
    fits = sorted(once.values(), key=lambda f: -weighed(f))
    evidence = np.array([weighed(f) for f in fits])
    pooled = evidence[0] + float(np.log(np.sum(np.exp(evidence - evidence[0]))))
    for name in names:
        odds = np.array([shape.log_odds for shape in usable_shapes(problem, name)])
        pooled += PRIOR_LOG_ODDS.get(name, 0.0) - float(np.log(np.sum(np.exp(odds))))
    if are_kin(names):
        pooled += KIN_LOG_ODDS
    return Candidate(names, pooled, fits[0], tuple(fits))


def are_kin(names: tuple[str, ...]) -> bool:
    """Whether two of a set say how the radius goes with the turns."""
    return len(KIN & set(names)) > 1


def weighed(fitted: Fit) -> float:
    """Log evidence with the shapes' prior odds."""
    return fitted.log_evidence + sum(part.shape.log_odds for part in fitted.simulation.parts)


def sorted_names(names: Iterable[str]) -> tuple[str, ...]:
    """Names in the shelf's order, so that a set has one key."""
    order = list(MECHANISMS)
    return tuple(sorted(names, key=order.index))
