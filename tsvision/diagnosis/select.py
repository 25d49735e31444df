"""Which causes do the data support: base, singles, pairs and triples by their evidence."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from tsvision.diagnosis.fit import Fit, Noise, fit
from tsvision.diagnosis.lack_of_fit import lack_of_fit
from tsvision.diagnosis.problem import USUAL_NOISE, Problem, bounds, parameters
from tsvision.mechanisms import MECHANISMS, Shape, Simulation
from tsvision.mechanisms.shelf import Part

ALARM = 5.0  # log evidence that a cause must gain over the base
LARGER = 5.0  # more, for each cause beyond the first, where no smaller set is over the alarm
CLASS_WIDTH = 3.0  # sets this close to the best cannot be told from it
FIRST_PARTNERS = 5  # mechanisms that are tried as the first of a pair
PAIRS_REFINED = 14
BY_TOTAL = 2 / 3  # of them by the evidence expected in all, the others by the gain alone
FRESH = 3  # mechanisms whose pairs are also tried from fresh starts
ALWAYS = ("radius_bias", "coiling")
MISFIT_P = 1e-3
PAIRS_EXTENDED = 3  # to triples
TRIPLES_REFINED = 6
DEEPENED = 7
HOPELESS = 20.0  # log evidence behind the best, beyond half the best's gain
SECOND_ALARM = 4.0  # log evidence that a further cause must gain …
SECOND_SHARE = 0.012  # … and at least this share of what the first gained, …
KIN_SHARE = 0.05  # … or this, where both say how r goes with the turns: one form that fits badly
KIN = {"radius_bias", "radius_step", "variable_radius"}
LEAST_SHARE = 0.01  # of the base's misfit that a further cause must account for, or …
LEAST_SIZE = 0.7  # … of a reading's usual noise
PRIOR_LOG_ODDS = {"variable_radius": -1.0}  # the paper refutes it for the overtwist phase


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


def select(problem: Problem, hints: Selection | None = None) -> Selection:
    """Fit base, singles, pairs (and triples) and choose.

    `hints` (a selection on more rows of the same table) gives starting points; evidence is computed
    anew, but shapes that were hopeless there are not tried again.
    """
    base = fit(problem, Simulation(base=problem.base))
    hints = None if hints is None else _hopeful(hints)
    singles = _singles(problem, base, hints)
    candidates = list(singles)
    worth = [c for c in singles if c.log_evidence - base.log_evidence > -1.0] or singles[:1]
    if worth and _may_be_more(singles, base):
        candidates += _extended(problem, worth[:FIRST_PARTNERS], hints)
        if hints is None and _leaves_structure(problem, base, singles[0]):
            candidates = _merged(problem, candidates, _fresh_pairs(problem, singles))
    chosen = _choose(problem, base, candidates)
    if chosen is not None and len(chosen.names) == 2:
        pairs = sorted((c for c in candidates if len(c.names) == 2), key=lambda c: -c.log_evidence)
        candidates += _extended(problem, pairs[:PAIRS_EXTENDED], hints, TRIPLES_REFINED)
        chosen = _choose(problem, base, candidates)
    if chosen is not None and len(chosen.names) == 3 and hints is None:
        candidates = _merged(problem, candidates, _other_shapes(problem, chosen.best))
        chosen = _choose(problem, base, candidates)
    ranked = tuple(sorted(candidates, key=lambda c: -c.log_evidence))
    return Selection(base, ranked, chosen)


def _leaves_structure(problem: Problem, base: Fit, best: Candidate) -> bool:
    """Whether the best single cause is one, but plainly not the whole story."""
    if best.log_evidence - base.log_evidence < ALARM:
        return False
    return lack_of_fit(problem, best.best).p < MISFIT_P


def _fresh_pairs(problem: Problem, singles: list[Candidate]) -> list[Fit]:
    """Pairs of the likeliest mechanisms from fresh starts: what a single cause bends to fit may lie
    far from where the pair does. ALWAYS among them is what strands as rods show together."""
    first = singles[:FRESH]
    first += [c for c in singles[FRESH:] if c.names[0] in ALWAYS]
    options = {c.names[0]: _options(problem, c) for c in first}
    torque = "torque_Nmm" in problem.table.observables
    extra = MECHANISMS["bending_stiffness"].shapes[0]  # without it no torque fits anything
    found = []
    for a, b in itertools.combinations(options, 2):
        for shapes in {*zip(options[a], options[b], strict=True)}:
            parts = [
                Part(name, MECHANISMS[name].shape(s))
                for name, s in zip((a, b), shapes, strict=True)
            ]
            if torque and "bending_stiffness" not in (a, b):
                parts.append(Part("bending_stiffness", extra))
            found.append(fit(problem, Simulation(tuple(parts), problem.base)))
    return found


def _options(problem: Problem, single: Candidate) -> tuple[str, str]:
    """Two shapes to start from: the one best alone, and the main one or its form by load."""
    name = single.names[0]
    usable = [shape.name for shape in usable_shapes(problem, name)]
    by_load = [shape for shape in usable if shape.endswith("by_load")]
    return single.best.simulation.parts[0].shape.name, (by_load or usable)[0]


def _other_shapes(problem: Problem, best: Fit) -> list[Fit]:
    """The same set with one part in another shape, from where the set stands."""
    found = []
    for i, part in enumerate(best.simulation.parts):
        for shape in usable_shapes(problem, part.mechanism):
            if shape.name == part.shape.name:
                continue
            parts = list(best.simulation.parts)
            parts[i] = Part(part.mechanism, shape)
            simulation = replace(best.simulation, parts=tuple(parts))
            start = _carried_over(problem, best, simulation)
            found.append(fit(problem, simulation, start, noise=(best.sigma, best.rho)))
    return found


def _carried_over(problem: Problem, best: Fit, simulation: Simulation) -> np.ndarray:
    """The fit's values for parameters of the same name, their first start for the others."""
    known = dict(zip((key for key, _ in parameters(best.simulation)), best.u, strict=True))
    u = []
    for key, p in parameters(simulation):
        low, high = bounds(p)
        u.append(float(np.clip(known.get(key, p.starts[0]), low, high)))
    return np.concatenate([best.z, u, best.offsets])


def _merged(problem: Problem, old: list[Candidate], fits: list[Fit]) -> list[Candidate]:
    """Candidates with further fits taken in."""
    pooled: dict[tuple[str, ...], list[Fit]] = {c.names: list(c.fits) for c in old}
    for found in fits:
        pooled.setdefault(_sorted_names(found.names), []).append(found)
    return [_pool(problem, names, group) for names, group in pooled.items()]


def _hopeful(hints: Selection) -> Selection:
    """Without the fits so far behind that no fold can lift them to the top."""
    if hints.chosen is None:
        return hints
    best = hints.chosen.log_evidence
    lowest = best - HOPELESS - 0.5 * hints.gain(hints.chosen)
    kept = []
    for candidate in hints.candidates:
        fits = tuple(f for f in candidate.fits if weighed(f) > lowest)
        if fits:
            kept.append(replace(candidate, fits=fits))
    return replace(hints, candidates=tuple(kept))


def _may_be_more(singles: list[Candidate], base: Fit) -> bool:
    return bool(singles) and base.log_evidence < 1e9


def _singles(problem: Problem, base: Fit, hints: Selection | None) -> list[Candidate]:
    found = []
    known = {} if hints is None else {c.names: c for c in hints.candidates}
    for name in MECHANISMS:
        shapes = usable_shapes(problem, name)
        if not shapes:
            continue
        if hints is not None:
            if (name,) not in known:
                continue
            fits = [_again(problem, old) for old in known[(name,)].fits]
        else:
            fits = [
                fit(problem, MECHANISMS[name].extend(Simulation(base=problem.base), shape.name))
                for shape in shapes
            ]
        found.append(_pool(problem, (name,), fits))
    return sorted(found, key=lambda c: -c.log_evidence)


def _again(problem: Problem, old: Fit) -> Fit:
    """Fit the same simulation to other rows, from where it stood."""
    start = np.concatenate([old.z, old.u, old.offsets])
    return fit(problem, old.simulation, start, most_steps=8, noise=(old.sigma, old.rho))


def _pool(problem: Problem, names: tuple[str, ...], fits: list[Fit]) -> Candidate:
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
    return Candidate(names, pooled, fits[0], tuple(fits))


def weighed(fitted: Fit) -> float:
    """Log evidence with the shapes' prior odds."""
    return fitted.log_evidence + sum(part.shape.log_odds for part in fitted.simulation.parts)


def _choose(problem: Problem, base: Fit, candidates: list[Candidate]) -> Candidate | None:
    """The best single over the alarm; a larger set only for its own, substantial gain."""
    chosen: Candidate | None = None
    level = base.log_evidence
    first_gain = 0.0
    for size in (1, 2, 3):
        need = ALARM + LARGER * (size - 1) if chosen is None else SECOND_ALARM
        worth = [c for c in candidates if len(c.names) == size and c.log_evidence - level > need]
        for larger in sorted(worth, key=lambda c: -c.log_evidence):
            gain = larger.log_evidence - level
            if chosen is not None and (
                gain < _further_share(larger.names) * first_gain
                or _is_trifle(problem, chosen.best, larger.best)
            ):
                continue
            first_gain = max(first_gain, gain)
            chosen, level = larger, larger.log_evidence
            break
    return chosen


def _further_share(names: tuple[str, ...]) -> float:
    """What a further cause must gain, as a share of the first's gain."""
    return KIN_SHARE if len(KIN & set(names)) > 1 else SECOND_SHARE


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


# ------------------------------------------------------------------ larger sets


def _extended(
    problem: Problem,
    firsts: list[Candidate],
    hints: Selection | None,
    most: int = PAIRS_REFINED,
) -> list[Candidate]:
    """Each of `firsts` with one more mechanism: screened by one linear step, the best refined."""
    if hints is not None:
        sizes = {len(f.names) + 1 for f in firsts}
        old = [c for c in hints.candidates if len(c.names) in sizes]
        return [_pool(problem, c.names, [_again(problem, f) for f in c.fits]) for c in old]
    screened: list[tuple[float, Fit, Part, np.ndarray]] = []
    for first in firsts:
        screened += _screen(problem, first.best)
    fits: dict[tuple[str, ...], list[Fit]] = {}
    # What is expected in all counts. But where both single causes fit badly, each alone may stand
    # far behind one that resembles their sum, and a linear step then promises too little.
    by_total = sorted(screened, key=lambda item: -item[0] - weighed(item[1]))
    by_gain = sorted(screened, key=lambda item: -item[0])
    for order, room in ((by_total, round(BY_TOTAL * most)), (by_gain, most)):
        for _, start_fit, part, start in order:
            names = _sorted_names((*start_fit.names, part.mechanism))
            if names not in fits and len(fits) < room:
                fits[names] = [_refine(problem, start_fit, part, start)]
    _deepen(problem, fits, by_total)
    return [_pool(problem, names, found) for names, found in fits.items()]


def _deepen(
    problem: Problem,
    fits: dict[tuple[str, ...], list[Fit]],
    screened: list[tuple[float, Fit, Part, np.ndarray]],
) -> None:
    """The best few sets again: from fresh starts, and with the next shape of the screening."""
    ranked = sorted(fits, key=lambda names: -weighed(fits[names][0]))
    for names in ranked[: min(DEEPENED, len(fits) // 2)]:
        first = fits[names][0]
        fits[names] += [fit(problem, first.simulation), *_plainer(problem, first)]
        tried = {part.shape.name for part in first.simulation.parts}
        for _, start_fit, part, start in screened:
            if _sorted_names((*start_fit.names, part.mechanism)) != names:
                continue
            if {p.shape.name for p in (*start_fit.simulation.parts, part)} != tried:
                fits[names].append(_refine(problem, start_fit, part, start))
                break


def _plainer(problem: Problem, found: Fit) -> list[Fit]:
    """The same set with a part in its main shape: alone it may have had to bend to the other's
    effect, which the set now carries."""
    fits = []
    for i, part in enumerate(found.simulation.parts):
        main = MECHANISMS[part.mechanism].shapes[0]
        if part.shape.name != main.name and main in usable_shapes(problem, part.mechanism):
            parts = list(found.simulation.parts)
            parts[i] = Part(part.mechanism, main)
            simulation = replace(found.simulation, parts=tuple(parts))
            start = _carried_over(problem, found, simulation)
            fits.append(fit(problem, simulation, start, noise=(found.sigma, found.rho)))
    return fits


def _sorted_names(names: Iterable[str]) -> tuple[str, ...]:
    order = list(MECHANISMS)
    return tuple(sorted(names, key=order.index))


def _screen(problem: Problem, first: Fit) -> list[tuple[float, Fit, Part, np.ndarray]]:
    """Gain in log likelihood, to first order, of every shape added to `first`, best start each."""
    noise = Noise(problem, first.sigma, first.rho)
    heavy = np.sqrt(first.weight)
    # The priors are rows too: else the nuisances would take up what only a cause can.
    theta = np.concatenate([first.z, first.u, first.offsets])
    jacobian = np.vstack(
        [heavy[:, None] * noise.whiten(first.jacobian[None])[0], np.eye(len(theta))]
    )
    orthogonal = np.linalg.qr(jacobian)[0]
    residual = np.concatenate([heavy * first.innovation, -theta])
    residual = residual - orthogonal @ (orthogonal.T @ residual)
    kinds = len(problem.table.observables)
    observable = np.concatenate([problem.table.observable, np.full(len(theta), kinds)])
    before = np.bincount(observable, residual**2, kinds + 1) + 1e-12
    count = np.bincount(problem.table.observable, minlength=kinds)
    found = []
    for name in MECHANISMS:
        if name in first.names:
            continue
        for shape in usable_shapes(problem, name):
            part = Part(name, shape)
            starts = _start_grid(shape)
            change = _change(problem, first, part, starts)
            white = np.zeros((len(starts), len(residual)))
            white[:, : len(heavy)] = noise.whiten(change) * heavy
            white = white - (white @ orthogonal) @ orthogonal.T
            along = white @ residual
            square = np.einsum("sn,sn->s", white, white) + 1e-9
            share = np.clip(along / square, 0.0, 8.0)
            left = residual - share[:, None] * white
            after = np.array([np.bincount(observable, row, kinds + 1) for row in left**2]) + 1e-12
            gain = np.sum(0.5 * count * np.log(before[:-1] / after[:, :-1]), axis=1)
            gain += 0.5 * (before[-1] - after[:, -1])
            gain -= 0.5 * len(shape.parameters)
            best = int(np.argmax(gain))
            found.append((float(gain[best]), first, part, starts[best] * 1.0))
    return found


def _start_grid(shape: Shape) -> np.ndarray:
    grid = np.zeros((1, 0))
    for p in shape.parameters:
        grid = np.column_stack(
            [np.repeat(grid, len(p.starts), axis=0), np.tile(p.starts, len(grid))]
        )
    return grid[:: max(1, -(-len(grid) // 24))]


def _change(problem: Problem, first: Fit, part: Part, starts: np.ndarray) -> np.ndarray:
    """What the added part changes in the rows at its starting values (S, n)."""
    together = replace(first.simulation, parts=(*first.simulation.parts, part))
    own = np.repeat(first.u[None], len(starts), axis=0)
    z = np.repeat(first.z[None], len(starts), axis=0)
    rows = problem.predict(together, np.hstack([own, starts]), z)
    return rows - problem.predict(first.simulation, first.u[None], first.z[None])


def _refine(problem: Problem, first: Fit, part: Part, start: np.ndarray) -> Fit:
    together = replace(first.simulation, parts=(*first.simulation.parts, part))
    limits = [bounds(p) for _, p in parameters(together)]
    u = np.clip(np.concatenate([first.u, start]), *np.array(limits).T)
    theta = np.concatenate([first.z, u, first.offsets])
    return fit(problem, together, theta, noise=(first.sigma, first.rho))
