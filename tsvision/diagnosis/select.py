"""Which causes do the data support: base, singles, pairs and triples by their evidence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tsvision.diagnosis.candidates import (
    Candidate,
    Selection,
    again,
    are_kin,
    merged,
    pool,
    usable_shapes,
    weighed,
)
from tsvision.diagnosis.fit import Fit, fit
from tsvision.diagnosis.lack_of_fit import MISFIT_P, lack_of_fit
from tsvision.diagnosis.larger_sets import (
    extended,
    fresh_pairs,
    off_its_bounds,
    other_shapes,
    without_one,
)
from tsvision.diagnosis.problem import USUAL_NOISE, Problem
from tsvision.mechanisms import MECHANISMS, Simulation
from tsvision.mechanisms.drifting import ELASTIC

ALARM = 3.0  # log evidence that a cause must gain over the base, where readings are independent, …
ALARM_BY_RHO = 8.0  # … and more, times what the mean AR(1) coefficient exceeds USUAL_RHO by: it is
USUAL_RHO = 0.2  # known to some tenths only, and evidence stands on it
UNKNOWN_RHO = 0.45  # taken for the coefficient where too few rows tell of any
LARGER = 5.0  # more, for each cause beyond the first, where no smaller set is over the alarm
CLASS_WIDTH = 3.0  # sets this close to the best cannot be told from it
FIRST_PARTNERS = 5  # mechanisms that are tried as the first of a pair
PAIRS_EXTENDED = 3  # to triples
TRIPLES_REFINED = 6
HARDLY_ALL_P = 0.05  # lack of fit of the best pair below which triples are tried
IDLE = 2.0  # log evidence behind the base, where nothing was chosen
HOPELESS = 20.0  # log evidence behind the best, beyond half the best's gain
SECOND_ALARM = 2.5  # log evidence that a further cause must gain …
SECOND_SHARE = 0.008  # … and at least this share of what the first gained, …
KIN_SHARE = 0.05  # … or this, where both say how r goes with the turns
ALIKE = 0.5  # log evidence that says nothing of which of two shapes it is
LEAST_SHARE = 0.01  # of the base's misfit that a further cause must account for, or …
LEAST_SIZE = 0.7  # … of a reading's usual noise


def select(problem: Problem, hints: Selection | None = None) -> Selection:
    """Fit base, singles, pairs (and triples) and choose.

    `hints` (a selection on more rows of the same table) gives starting points; evidence is computed
    anew, but shapes that were hopeless there are not tried again.
    """
    base = fit(problem, Simulation(base=problem.base))
    hints = None if hints is None else _hopeful(hints)
    singles = _singles(problem, hints)
    candidates = list(singles)
    worth = [c for c in singles if c.log_evidence - base.log_evidence > -1.0] or singles[:1]
    if worth:
        candidates += extended(problem, worth[:FIRST_PARTNERS], hints)
        if hints is None and _leaves_structure(problem, base, singles[0]):
            candidates = merged(problem, candidates, fresh_pairs(problem, singles))
    chosen = _choose(problem, base, candidates)
    if chosen is not None and len(chosen.names) == 2:
        candidates = _beyond_pairs(problem, candidates, chosen, hints)
        chosen = _choose(problem, base, candidates)
    if chosen is not None and len(chosen.names) == 3 and hints is None:
        fits = other_shapes(problem, chosen.best) + without_one(problem, chosen.best)
        candidates = merged(problem, candidates, fits)
        chosen = _choose(problem, base, candidates)
    if chosen is not None:
        plain = _said_plainly(chosen)
        candidates = [plain if c is chosen else c for c in candidates]
        chosen = plain
    ranked = tuple(sorted(candidates, key=lambda c: -c.log_evidence))
    return Selection(base, ranked, chosen)


def _beyond_pairs(
    problem: Problem, candidates: list[Candidate], chosen: Candidate, hints: Selection | None
) -> list[Candidate]:
    """The chosen pair in other shapes; where even the best pair leaves anything, also from fresh
    starts, and triples."""
    if hints is None:
        fits = other_shapes(problem, chosen.best)
        for likely in (chosen.best, max(fits, key=weighed, default=chosen.best)):
            fits += off_its_bounds(problem, likely)
        candidates = merged(problem, candidates, fits)
        best = _pairs(candidates)[0].best
        if lack_of_fit(problem, best).p >= HARDLY_ALL_P:
            return candidates
        candidates = merged(problem, candidates, other_shapes(problem, best, fresh=True))
    pairs = _pairs(candidates)[:PAIRS_EXTENDED]
    return candidates + extended(problem, pairs, hints, TRIPLES_REFINED)


def _pairs(candidates: list[Candidate]) -> list[Candidate]:
    """The pairs, by falling evidence."""
    return sorted((c for c in candidates if len(c.names) == 2), key=lambda c: -c.log_evidence)


def _leaves_structure(problem: Problem, base: Fit, best: Candidate) -> bool:
    """Whether the best single cause is one, but plainly not the whole story."""
    if best.log_evidence - base.log_evidence < alarm_of(problem):
        return False
    return lack_of_fit(problem, best.best).p < MISFIT_P


def _hopeful(hints: Selection) -> Selection:
    """Without the fits so far behind that no fold can lift them to the top."""
    lowest = hints.base.log_evidence - IDLE
    if hints.chosen is not None:
        best = hints.chosen.log_evidence
        lowest = best - HOPELESS - 0.5 * hints.gain(hints.chosen)
    kept = []
    for candidate in hints.candidates:
        fits = tuple(f for f in candidate.fits if weighed(f) > lowest)
        if fits:
            kept.append(replace(candidate, fits=fits))
    return replace(hints, candidates=tuple(kept))


def _singles(problem: Problem, hints: Selection | None) -> list[Candidate]:
    found = []
    known = {} if hints is None else {c.names: c for c in hints.candidates}
    for name in MECHANISMS:
        shapes = usable_shapes(problem, name)
        if not shapes:
            continue
        if hints is not None:
            if (name,) not in known:
                continue
            fits = [again(problem, old) for old in known[(name,)].fits]
        else:
            fits = [
                fit(problem, MECHANISMS[name].extend(Simulation(base=problem.base), shape.name))
                for shape in shapes
            ]
        found.append(pool(problem, (name,), fits))
    return sorted(found, key=lambda c: -c.log_evidence)


def _choose(problem: Problem, base: Fit, candidates: list[Candidate]) -> Candidate | None:
    """The best single over the alarm; a larger set only for its own, substantial gain."""
    chosen: Candidate | None = None
    level = base.log_evidence
    first_gain = 0.0
    alarm = alarm_of(problem)
    for size in (1, 2, 3):
        need = alarm + LARGER * (size - 1) if chosen is None else SECOND_ALARM
        worth = [c for c in candidates if len(c.names) == size and c.log_evidence - level > need]
        for larger in sorted(worth, key=lambda c: -c.log_evidence):
            gain = larger.log_evidence - level
            if chosen is not None and (
                gain < _further_share(larger.names) * first_gain
                or _is_trifle(problem, _plainest(chosen), larger.best)
            ):
                continue
            first_gain = max(first_gain, gain)
            chosen, level = larger, larger.log_evidence
            break
    return chosen


def alarm_of(problem: Problem) -> float:
    """Log evidence at which something is said to be wrong."""
    rho = UNKNOWN_RHO
    if problem.rho_tested:
        count = np.bincount(problem.table.observable, minlength=len(problem.rho_mean))
        rho = float(np.average(problem.rho_mean, weights=count))
    return ALARM + ALARM_BY_RHO * max(rho - USUAL_RHO, 0.0)


def _plainest(candidate: Candidate) -> Fit:
    """Its likeliest fit in a shape whose size does not drift: drift may stand in for what a further
    cause does, and then that cause is no trifle."""
    plain = (
        f
        for f in candidate.fits
        if not any(part.shape.name.endswith(ELASTIC) for part in f.simulation.parts)
    )
    return next(plain, candidate.best)


def _said_plainly(candidate: Candidate) -> Candidate:
    """With a shape that does not drift as its best, where the likeliest is no likelier than that:
    what drifts may stand in for what another part's shape tells outright, such as a jump."""
    plain = _plainest(candidate)
    if weighed(candidate.best) - weighed(plain) >= ALIKE:
        return candidate
    others = tuple(f for f in candidate.fits if f is not plain)
    return replace(candidate, best=plain, fits=(plain, *others))


def _further_share(names: tuple[str, ...]) -> float:
    """What a further cause must gain, as a share of the first's gain."""
    return KIN_SHARE if are_kin(names) else SECOND_SHARE


def _is_trifle(problem: Problem, smaller: Fit, larger: Fit) -> bool:
    """Whether what the larger fit takes off the smaller one's misfit matters to nobody.

    With little noise any trifle has evidence. It is one when it is under LEAST_SHARE of the base's
    misfit, as it came, and under LEAST_SIZE of what such readings are usually good to.
    """
    table = problem.table
    kinds = len(table.observables)
    z = np.zeros((1, problem.nuisances))
    plain = problem.predict(Simulation(base=problem.base), z[:, :0], z)[0]
    trusted = larger.weight > 0.2
    count = np.maximum(np.bincount(table.observable, trusted, kinds), 1.0)
    before, after, base = (
        np.bincount(table.observable, trusted * (table.value - rows) ** 2, kinds) / count
        for rows in (smaller.predicted, larger.predicted, plain)
    )
    gone = np.sqrt(np.maximum(before - after, 0.0))
    usual = np.array([USUAL_NOISE[name] for name in table.observables])
    return bool(np.all((gone < LEAST_SHARE * np.sqrt(base)) & (gone < LEAST_SIZE * usual)))
