"""The next reading for a class: its members, and twins by construction, set against each other."""

from __future__ import annotations

import numpy as np

from tsvision.diagnosis.candidates import Candidate, Selection
from tsvision.diagnosis.confounding import TELL_RADIUS
from tsvision.diagnosis.fit import Fit, fit
from tsvision.diagnosis.next_experiment import Proposal, propose
from tsvision.diagnosis.problem import Problem, from_value, to_value
from tsvision.diagnosis.resolving import Rival
from tsvision.diagnosis.select import alarm_of
from tsvision.mechanisms import MECHANISMS, Simulation

TWIN_SLACK = 15.0  # log evidence: a twin that fell further behind did not converge
MOST_SHOWN = 4  # whose predictions are set against each other at one place
NEAR = 8.0  # log evidence behind the best of those that new readings might bring back
MOST_RIVALS = 10


def proposal_of(
    problem: Problem,
    selection: Selection,
    sets: list[tuple[str, ...]],
    survivors: list[Candidate],
) -> Proposal | None:
    """What would part the class; with a class of one, the chosen set from the runner-up.

    Twins by construction are fitted here in the chosen's own shapes. No further displacement can
    part them, so displacement is then not proposed. (A camera's error of the stated diameter has
    no fit of its own: to the machine it is a radius that is off.)
    """
    inside = [*survivors]
    inside += [c for c in selection.candidates if c.names in sets and c not in survivors]
    rivals = [Rival(c.best, c.log_evidence) for c in inside]
    best = rivals[0]
    fitted = {tuple(sorted(c.names)) for c in inside}
    twins = [names for names in sets if tuple(sorted(names)) not in fitted]
    for names in twins:
        twin = None if "camera_scale" in names else _twin(problem, best.fitted, names)
        if twin is not None and twin.log_evidence > best.fitted.log_evidence - TWIN_SLACK:
            rivals.append(Rival(twin, best.log_evidence))
    same = [c for c in selection.candidates if len(c.names) == len(sets[0]) and c not in inside]
    outside = [Rival(c.best, c.log_evidence) for c in same]
    if len(rivals) == 1:
        rivals += outside[:1]
        outside = outside[1:]
    shown = min(len(rivals), MOST_SHOWN)
    rivals += [r for r in outside if r.log_evidence > best.log_evidence - NEAR]
    exact = any({"radius_bias", "angle_scale"} & set(n) for n in sets) and len(sets) > 1
    blind = exact and not TELL_RADIUS & set(problem.table.observables)
    skip = frozenset(problem.table.observables) if blind else frozenset()
    base = Rival(selection.base, selection.base.log_evidence)
    rivals, decided = rivals[:MOST_RIVALS], len(sets) == 1
    return propose(problem, rivals, base, alarm_of(problem), shown, decided=decided, skip=skip)


PARALLEL = {  # shapes of radius_bias and of angle_scale that give the same x
    "absolute": "proportional",
    "settling": "saturating",
    "absolute_varying": "proportional_varying",
}


def _twin(problem: Problem, chosen: Fit, names: tuple[str, ...]) -> Fit | None:
    """The chosen fit with the radius' error handed over to the angle, or the other way round."""
    swap = {"radius_bias": "angle_scale", "angle_scale": "radius_bias"}
    to_angle = "radius_bias" in chosen.names
    shapes = PARALLEL if to_angle else {b: a for a, b in PARALLEL.items()}
    simulation = Simulation(base=problem.base)
    start = []
    values = iter(chosen.u)
    for part in chosen.simulation.parts:
        own = [next(values) for _ in part.shape.parameters]
        name, shape = part.mechanism, part.shape.name
        if name in swap and name not in names:
            if shape not in shapes:
                return None
            name, shape = swap[name], shapes[shape]
            size = part.shape.parameters[0]
            mirrored = MECHANISMS[name].shape(shape).parameters[0]
            radius = problem.reference.radius_mm
            share = -float(to_value(size, np.array(own[0]), problem.reference))
            share = share / radius if to_angle else share * radius
            own[0] = from_value(mirrored, share, problem.reference)
        simulation = MECHANISMS[name].extend(simulation, shape)
        start += own
    theta = np.concatenate([chosen.z, start, chosen.offsets])
    return fit(problem, simulation, theta, noise=(chosen.sigma, chosen.rho))
