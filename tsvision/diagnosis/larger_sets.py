"""Pairs and triples: which to try, from where, and in which shapes.

A set is screened by one linear step from the fit of its smaller one, in which the priors stand as
rows; the best are refined, and the best of those tried again, from fresh starts and in plainer
shapes.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np

from tsvision.diagnosis.candidates import (
    Candidate,
    Selection,
    again,
    carried_over,
    pool,
    sorted_names,
    usable_shapes,
    weighed,
)
from tsvision.diagnosis.fit import Fit, fit
from tsvision.diagnosis.layout import Layout, start_grid
from tsvision.diagnosis.linearised import rows_and_jacobian, steps
from tsvision.diagnosis.noise import Noise, minus_log_likelihood, weights_of
from tsvision.diagnosis.problem import Problem, bounds, parameters
from tsvision.mechanisms import MECHANISMS, Shape, Simulation
from tsvision.mechanisms.drifting import ELASTIC
from tsvision.mechanisms.shelf import Part

PAIRS_REFINED = 14
BY_TOTAL = 2 / 3  # of them by the evidence expected in all, the others by the gain alone
SCREENED_STARTS = 24
FRESH = 3  # mechanisms whose pairs are also tried from fresh starts
ALWAYS = ("radius_bias", "coiling")
DEEPENED = 7
TRAPPED = 10.0  # log evidence by which a larger set may stand behind the smaller one in it
NEXT_TO_NOTHING = 0.03  # of the size that is expected
AT_BOUND = 1e-6  # in prior units
ONSETS, SLIDING_STEPS = 60, 3  # tried where something jumps, and steps of the rest at each


def fresh_pairs(problem: Problem, singles: list[Candidate]) -> list[Fit]:
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


def other_shapes(problem: Problem, best: Fit, fresh: bool = False) -> list[Fit]:
    """The same set with one part in another shape, from where the set stands; or `fresh`, from
    starts of its own in shapes that do not drift."""
    found = []
    for i, part in enumerate(best.simulation.parts):
        for shape in usable_shapes(problem, part.mechanism):
            if shape.name == part.shape.name or (fresh and shape.name.endswith(ELASTIC)):
                continue
            parts = list(best.simulation.parts)
            parts[i] = Part(part.mechanism, shape)
            simulation = replace(best.simulation, parts=tuple(parts))
            if fresh:
                found.append(fit(problem, simulation))
            else:
                start = carried_over(best, simulation)
                noise = (best.sigma, best.rho)
                if shape.jumps:
                    start = slid(problem, simulation, start, noise, i)
                found.append(fit(problem, simulation, start, noise=noise))
    return found


def off_its_bounds(problem: Problem, best: Fit) -> list[Fit]:
    """The set once more, what stands at a bound from its first start; none where nothing does. At a
    bound the rest has made up for a parameter, and no slope leads out."""
    start = np.array([p.starts[0] for _, p in parameters(best.simulation)])
    limits = np.array([bounds(p) for _, p in parameters(best.simulation)])
    bound = np.any(np.isclose(best.u[:, None], limits, rtol=0.0, atol=AT_BOUND), axis=1)
    if not bound.any():
        return []
    theta = np.concatenate([best.z, np.where(bound, start, best.u), best.offsets])
    return [fit(problem, best.simulation, theta, noise=(best.sigma, best.rho))]


def slid(
    problem: Problem,
    simulation: Simulation,
    start: np.ndarray,
    noise: tuple[np.ndarray, np.ndarray],
    part: int,
) -> np.ndarray:
    """`start` with one part's onset where the rest, fitted to it by linear steps, leaves least.

    What jumps at an onset cannot be followed down to it: to either side of a row the slope by the
    onset says nothing of the next, and a fit stays where it began.
    """
    layout = Layout(problem, simulation)
    at = layout.nz + sum(len(p.shape.parameters) for p in simulation.parts[:part])
    names = [p.name for p in simulation.parts[part].shape.parameters]
    onset = at + names.index("onset_turns")
    low, high = layout.low[onset], layout.high[onset]
    thetas = np.repeat(start[None], ONSETS, axis=0)
    thetas[:, onset] = np.linspace(low, high, ONSETS)
    model = Noise(problem, *noise)
    for _ in range(SLIDING_STEPS):
        rows, jacobian = rows_and_jacobian(problem, simulation, layout, thetas)
        innovation = model.whiten(problem.table.value - rows)
        white = model.whiten(jacobian)
        white[:, :, onset] = 0.0
        step = steps(layout, thetas, innovation, white, weights_of(innovation, problem.tail), 1e-3)
        step[:, onset] = 0.0
        thetas = layout.clip(thetas + step)
    rows, _ = rows_and_jacobian(problem, simulation, layout, thetas)
    innovation = model.whiten(problem.table.value - rows)
    cost = minus_log_likelihood(innovation, model) + layout.penalty(thetas)
    best: np.ndarray = thetas[int(np.nanargmin(cost))]
    return best


def without_one(problem: Problem, best: Fit) -> list[Fit]:
    """The set less each of its parts, from where the set stands: a further cause may have but led
    the others to where they fit."""
    found = []
    for part in best.simulation.parts:
        rest = tuple(p for p in best.simulation.parts if p is not part)
        simulation = replace(best.simulation, parts=rest)
        start = carried_over(best, simulation)
        found.append(fit(problem, simulation, start, noise=(best.sigma, best.rho)))
    return found


def extended(
    problem: Problem,
    firsts: list[Candidate],
    hints: Selection | None,
    most: int = PAIRS_REFINED,
) -> list[Candidate]:
    """Each of `firsts` with one more mechanism: screened by one linear step, the best refined."""
    if hints is not None:
        sizes = {len(f.names) + 1 for f in firsts}
        old = [c for c in hints.candidates if len(c.names) in sizes]
        return [pool(problem, c.names, [again(problem, f) for f in c.fits]) for c in old]
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
            names = sorted_names((*start_fit.names, part.mechanism))
            if names not in fits and len(fits) < room:
                fits[names] = [_refine(problem, start_fit, part, start)]
    _deepen(problem, fits, by_total)
    return [pool(problem, names, found) for names, found in fits.items()]


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
            if sorted_names((*start_fit.names, part.mechanism)) != names:
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
            start = carried_over(found, simulation)
            fits.append(fit(problem, simulation, start, noise=(found.sigma, found.rho)))
    return fits


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
            starts = start_grid(shape.parameters, SCREENED_STARTS)
            change = change_by(problem, first, part, starts)
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
            start = _sized(shape, starts[best], float(share[best]))
            found.append((float(gain[best]), first, part, start))
    return found


def _sized(shape: Shape, start: np.ndarray, share: float) -> np.ndarray:
    """A start (P,) with the sizes that the linear step expects: many times too large a start is
    trapped where the rest has bent to it."""
    sizes = np.array([p.null == 0.0 for p in shape.parameters])
    return np.where(sizes, share * start, start)


def change_by(problem: Problem, first: Fit, part: Part, starts: np.ndarray) -> np.ndarray:
    """What the added part changes in the rows at its starting values (S, n)."""
    together = replace(first.simulation, parts=(*first.simulation.parts, part))
    own = np.repeat(first.u[None], len(starts), axis=0)
    z = np.repeat(first.z[None], len(starts), axis=0)
    rows = problem.predict(together, np.hstack([own, starts]), z)
    return rows - problem.predict(first.simulation, first.u[None], first.z[None])


def _refine(problem: Problem, first: Fit, part: Part, start: np.ndarray) -> Fit:
    """`first` with one more part, from `start` (P,); from next to nothing of it where the fit ends
    worse than without the part, trapped while the others made room."""
    together = replace(first.simulation, parts=(*first.simulation.parts, part))
    found = fit(problem, together, _joined(first, together, start), noise=(first.sigma, first.rho))
    if weighed(found) > weighed(first) - TRAPPED:
        return found
    start = _sized(part.shape, start, NEXT_TO_NOTHING)
    again = fit(problem, together, _joined(first, together, start), noise=(first.sigma, first.rho))
    return max(found, again, key=weighed)


def _joined(first: Fit, together: Simulation, start: np.ndarray) -> np.ndarray:
    """The whole vector: the smaller fit's, with `start` for the part that was added last."""
    limits = np.array([bounds(p) for _, p in parameters(together)])
    u = np.clip(np.concatenate([first.u, start]), *limits.T)
    return np.concatenate([first.z, u, first.offsets])
