"""From a table to a verdict: fit, select, test, weigh, propose."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tsvision.diagnosis.candidates import Candidate, Selection
from tsvision.diagnosis.confounding import equivalent_sets
from tsvision.diagnosis.facts import (
    OUTLIER_WEIGHT,
    causes_of,
    data_of,
    exact_equivalences,
    gain_dict,
    model_of,
    proposal_dict,
    residual_of,
    rivals_of,
    rows_of,
    short_gain,
)
from tsvision.diagnosis.fit import Fit, fit
from tsvision.diagnosis.gain import Gain, as_it_came, denies, held_out_gain, rms
from tsvision.diagnosis.lack_of_fit import LackOfFit, lack_of_fit
from tsvision.diagnosis.observations import Table
from tsvision.diagnosis.problem import Problem, prepare
from tsvision.diagnosis.proposal import proposal_of
from tsvision.diagnosis.select import select
from tsvision.diagnosis.units_check import check_units
from tsvision.diagnosis.verdict import Verdict
from tsvision.diagnosis.words import paragraph
from tsvision.mechanisms import Simulation
from tsvision.mechanisms.shelf import OBSERVABLES

MOST_LEFT = 0.3  # share of the base's structured misfit that a named cause may leave
SHOWN = 30


def diagnose(table: Table, base: str = "constant_radius") -> Verdict:
    """What the base model gets wrong about the table. Raises InputError on impossible units."""
    problem = prepare(table, base)
    check_units(problem)
    before = lack_of_fit(problem, fit(problem, Simulation(base=base)))
    problem = with_noise_prior(problem, before)
    selection = select(problem)
    best = selection.chosen.best if selection.chosen else selection.base
    after = lack_of_fit(problem, best) if selection.chosen else before
    status, explained = _status(problem, selection, before, after)
    sets, survivors = equivalent_sets(selection, table.observables, not after.wrong)
    if status == "explained" and len(sets) > 1:
        status = "ambiguous"
    counted = _counted(problem, best)
    gain = held_out_gain(problem, selection, counted)
    off = table.value - best.predicted
    if explained and gain is not None and denies(gain, rms(off[counted])):
        status, explained = "unexplained", False
    named = explained and selection.chosen is not None
    return _compose(
        problem, selection, status, sets if named else [], survivors, best, after, counted, gain
    )


def with_noise_prior(problem: Problem, before: LackOfFit) -> Problem:
    """The AR(1) coefficient as the saturated model sees it, as every model's prior."""
    if not before.tested:  # too few rows to know of any: none is assumed
        return replace(problem, rho_sd=np.full(len(problem.rho_sd), 0.01))
    rho_sd = np.maximum(before.rho_sd, 0.05)
    return replace(problem, rho_mean=before.rho, rho_sd=rho_sd, rho_tested=True)


def _status(
    problem: Problem, selection: Selection, before: LackOfFit, after: LackOfFit
) -> tuple[str, bool]:
    """Status, and whether the chosen causes may be named."""
    if selection.chosen is None:
        return ("unexplained", False) if before.wrong else ("no_discrepancy", False)
    if after.wrong and _share_left(problem, selection.chosen.best, before, after) > MOST_LEFT:
        return "unexplained", False
    return "explained", True


def _share_left(problem: Problem, best: Fit, before: LackOfFit, after: LackOfFit) -> float:
    """Structured misfit left over the base's, each observable in units of its own noise."""
    count = np.bincount(problem.table.observable, minlength=len(problem.table.observables))
    sizes = []
    for found in (after, before):
        parts = [
            count[k] * (found.structured.get(name, 0.0) / best.sigma[k]) ** 2
            for k, name in enumerate(problem.table.observables)
        ]
        sizes.append(sum(parts))
    return float(np.sqrt(sizes[0] / max(sizes[1], 1e-12)))


def _counted(problem: Problem, best: Fit) -> np.ndarray:
    """Rows by which the models are compared: displacement if there is any, outliers left out."""
    return (problem.table.observable == 0) & (best.weight > OUTLIER_WEIGHT)


def _compose(
    problem: Problem,
    selection: Selection,
    status: str,
    sets: list[tuple[str, ...]],
    survivors: list[Candidate],
    best: Fit,
    after: LackOfFit,
    counted: np.ndarray,
    gain: Gain | None,
) -> Verdict:
    table = problem.table
    plain = as_it_came(problem)
    unit = OBSERVABLES[table.observables[0]]
    key = "rmse_mm" if unit == "mm" else "rmse"
    base = {"model": problem.base, key: rms((table.value - plain)[counted]), "unit": unit}
    shown = best if sets else selection.base
    extended = {key: rms((table.value - shown.predicted)[counted]), "unit": unit}
    chosen = selection.chosen
    causes = tuple(causes_of(problem, chosen)) if sets and chosen is not None else ()
    following = proposal_dict(proposal_of(problem, selection, sets, survivors)) if sets else None
    rivals = rivals_of(selection, sets)
    gained = None if gain is None else gain_dict(gain)
    residual = residual_of(problem, status, selection, after, gain)
    return Verdict(
        status=status,
        causes=causes,
        equivalent=tuple(sets),
        base=base,
        extended=extended,
        gain=gained,
        evidence=tuple(
            {"causes": list(c.names), "log_evidence_gain": round(selection.gain(c), 2)}
            for c in selection.candidates[:SHOWN]
        ),
        rivals=tuple(rivals),
        next_experiment=following,
        residual=residual,
        exact_equivalences=exact_equivalences(sets, table.observables),
        data=data_of(problem, best),
        model=model_of(problem, shown),
        rows=rows_of(problem, plain, shown),
        notes=table.notes,
        paragraph=paragraph(
            status,
            causes,
            tuple(sets),
            base,
            extended,
            None if gain is None else {**gained, **short_gain(gain)},  # type: ignore[dict-item]
            following,
            residual,
            unit,
            rivals,
        ),
    )
