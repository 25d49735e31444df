"""From a table to a verdict: fit, select, test, weigh, propose."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from tsvision.diagnosis.confounding import equivalent_sets
from tsvision.diagnosis.fit import Fit, fit, posterior
from tsvision.diagnosis.gain import Gain, as_it_came, held_out_gain
from tsvision.diagnosis.lack_of_fit import PLACES, LackOfFit, lack_of_fit
from tsvision.diagnosis.next_experiment import Proposal, propose
from tsvision.diagnosis.problem import Problem, from_value, parameters, prepare, to_value
from tsvision.diagnosis.select import Candidate, Selection, select, weighed
from tsvision.diagnosis.table import Table
from tsvision.diagnosis.units_check import check_units
from tsvision.diagnosis.verdict import Cause, Estimate, Verdict
from tsvision.diagnosis.words import paragraph
from tsvision.mechanisms import MECHANISMS, Simulation
from tsvision.mechanisms.shelf import OBSERVABLES

MISFIT_P = 1e-3  # structure in the residual that chance hardly makes
MOST_LEFT = 0.3  # share of the base's structured misfit that a named cause may leave
OUTLIER_WEIGHT = 0.2  # of a Student-t residual: beyond about 4.5 times the noise
SHOWN = 30
SHOWN_RIVALS = 4
TWIN_SLACK = 15.0  # log evidence: a twin that fell further behind did not converge
MOST_RIVALS = 4  # whose predictions are set against each other


def diagnose(table: Table, base: str = "constant_radius") -> Verdict:
    """What the base model gets wrong about the table. Raises InputError on impossible units."""
    problem = prepare(table, base)
    check_units(problem)
    before = lack_of_fit(problem, fit(problem, Simulation(base=base)))
    problem = _with_noise_prior(problem, before)
    selection = select(problem)
    best = selection.chosen.best if selection.chosen else selection.base
    after = lack_of_fit(problem, best) if selection.chosen else before
    status, explained = _status(problem, selection, before, after)
    sets, survivors = equivalent_sets(selection, table.observables, after.p > MISFIT_P)
    if status == "explained" and len(sets) > 1:
        status = "ambiguous"
    counted = _counted(problem, best)
    gain = held_out_gain(problem, selection, counted)
    named = explained and selection.chosen is not None
    return _compose(
        problem, selection, status, sets if named else [], survivors, best, after, counted, gain
    )


def _with_noise_prior(problem: Problem, before: LackOfFit) -> Problem:
    """The AR(1) coefficient as the saturated model sees it, as every model's prior."""
    if not before.tested:  # too few rows to know of any: none is assumed
        return replace(problem, rho_sd=np.full(len(problem.rho_sd), 0.01))
    return replace(problem, rho_mean=before.rho, rho_sd=np.maximum(before.rho_sd, 0.05))


def _status(
    problem: Problem, selection: Selection, before: LackOfFit, after: LackOfFit
) -> tuple[str, bool]:
    """Status, and whether the chosen causes may be named."""
    if selection.chosen is None:
        wrong = before.tested and before.p < MISFIT_P
        return ("unexplained", False) if wrong else ("no_discrepancy", False)
    if (
        after.tested
        and after.p < MISFIT_P
        and _share_left(problem, selection.chosen.best, before, after) > MOST_LEFT
    ):
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
    base = {"model": problem.base, key: _rms(table.value - plain, counted), "unit": unit}
    shown = best if sets else selection.base
    extended = {key: _rms(table.value - shown.predicted, counted), "unit": unit}
    causes = tuple(_causes(problem, best)) if sets else ()
    following = _plain(_proposal(problem, selection, sets, survivors)) if sets else None
    rivals = _rivals(selection, sets)
    gained = None if gain is None else _gain_dict(gain)
    residual = _residual(problem, status, selection, after)
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
        exact_equivalences=_exact(sets, table.observables),
        data=_data(problem, best, counted),
        model=_model(problem, shown),
        rows=_rows(problem, plain, shown),
        notes=table.notes,
        paragraph=paragraph(
            status,
            causes,
            tuple(sets),
            base,
            extended,
            None if gain is None else {**gained, **_short(gain)},  # type: ignore[dict-item]
            following,
            residual,
            unit,
            rivals,
        ),
    )


def _rms(off: np.ndarray, rows: np.ndarray) -> float:
    return float(np.sqrt(np.mean(off[rows] ** 2)))


def _causes(problem: Problem, best: Fit) -> list[Cause]:
    found = posterior(problem, best)
    units = {key: p.unit for key, p in parameters(best.simulation)}
    return [
        Cause(
            name=part.mechanism,
            title=MECHANISMS[part.mechanism].title,
            shape=part.shape.name,
            equation=part.shape.equation,
            claim=MECHANISMS[part.mechanism].claim,
            parameters={
                p.name: Estimate(*found[part.key(p.name)], units[part.key(p.name)])
                for p in part.shape.parameters
            },
        )
        for part in best.simulation.parts
    ]


def _rivals(selection: Selection, sets: list[tuple[str, ...]]) -> list[dict[str, Any]]:
    """What came next: other shapes of the chosen set, and other sets of its size, with how far
    they fall behind in log evidence."""
    if not sets or selection.chosen is None:
        return []
    best = selection.chosen.best
    shapes = [
        {
            "causes": list(f.names),
            "shapes": [part.shape.name for part in f.simulation.parts],
            "behind": round(weighed(best) - weighed(f), 2),
        }
        for f in selection.chosen.fits[1:SHOWN_RIVALS]
    ]
    others = [
        {
            "causes": list(c.names),
            "shapes": [part.shape.name for part in c.best.simulation.parts],
            "behind": round(selection.chosen.log_evidence - c.log_evidence, 2),
        }
        for c in selection.candidates
        if len(c.names) == len(sets[0]) and c.names != selection.chosen.names
    ]
    return shapes + others[: SHOWN_RIVALS - 1]


def _proposal(
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
    rivals = [c.best for c in survivors]
    fitted = {tuple(sorted(f.names)) for f in rivals}
    twins = [names for names in sets if tuple(sorted(names)) not in fitted]
    for names in twins:
        twin = None if "camera_scale" in names else _twin(problem, rivals[0], names)
        if twin is not None and twin.log_evidence > rivals[0].log_evidence - TWIN_SLACK:
            rivals.append(twin)
    if len(rivals) == 1:
        own = sorted(rivals[0].names)
        same = [c for c in selection.candidates if len(c.names) == len(own)]
        rivals += [c.best for c in same if sorted(c.names) != own][:1]
    exact = any({"radius_bias", "angle_scale"} & set(n) for n in sets) and len(sets) > 1
    alone = problem.table.observables == ("displacement_mm",)
    skip = frozenset({"displacement_mm"}) if exact and alone else frozenset()
    return propose(problem, rivals[:MOST_RIVALS], skip)


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


def _plain(proposal: Proposal | None) -> dict[str, Any] | None:
    if proposal is None:
        return None
    return {
        "observable": proposal.observable,
        "turns": proposal.turns,
        "load_N": proposal.load_N,
        "strings": proposal.strings,
        "branch": proposal.branch,
        "separates": ["+".join(names) for names in proposal.separates],
        "expected_difference": proposal.expected_difference,
        "noise": proposal.noise,
        "unit": proposal.unit,
        "decisiveness": proposal.decisiveness,
    }


def _gain_dict(gain: Gain) -> dict[str, Any]:
    suffix = "_mm" if OBSERVABLES[gain.observable] == "mm" else ""
    return {
        f"held_out_rmse_base{suffix}": gain.base,
        f"held_out_rmse_base_refitted{suffix}": gain.refitted,
        f"held_out_rmse_extended{suffix}": gain.extended,
        "ratio": gain.ratio,
        "low": gain.low,
        "high": gain.high,
        "scheme": gain.scheme,
        "observable": gain.observable,
        "chosen_in_folds": [list(names) for names in gain.chosen],
    }


def _short(gain: Gain) -> dict[str, float]:
    return {"base": gain.base, "extended": gain.extended}


def _residual(
    problem: Problem, status: str, selection: Selection, after: LackOfFit
) -> dict[str, Any]:
    """How much is left, where, and a hint in words."""
    table = problem.table
    residual: dict[str, Any] = {
        "lack_of_fit_p": after.p if after.tested else None,
        "place": after.place or None,
        "observable": after.observable or None,
        "structured_rms": after.structured,
        "hint": "too few observations to tell" if not after.tested else _hint(after),
    }
    if status == "unexplained":
        residual["partly"] = list(selection.chosen.names) if selection.chosen else []
        at = table.at.take(table.condition)
        kept = [
            i
            for i in range(table.rows)
            if table.observables[table.observable[i]] == after.observable
        ]
        residual["smooth"] = [
            {
                "run": table.runs[table.run[i]],
                "turns": float(at.turns[i]),
                "load_N": float(at.load_N[i]),
                "branch": "unwind" if at.unwinding[i] else "wind",
                "residual": float(after.smooth[i]),
            }
            for i in kept
        ]
    return residual


def _hint(after: LackOfFit) -> str:
    if after.p > MISFIT_P:
        return "nothing but noise is left"
    name = after.observable
    size = after.structured[name]
    return (
        f"a misfit of {name} of {size:.2g} {OBSERVABLES[name]} (rms) is left, {PLACES[after.place]}"
    )


def _exact(sets: list[tuple[str, ...]], observables: tuple[str, ...]) -> tuple[dict, ...]:
    if observables != ("displacement_mm",) or not any("radius_bias" in s for s in sets):
        return ()
    return (
        {
            "mechanisms": ["radius_bias", "angle_scale", "camera_scale"],
            "why": "displacement depends on α r alone, and the stated diameter may come from a "
            "picture; measure the diameter or the strands' turns to part them",
        },
    )


def _data(problem: Problem, best: Fit, counted: np.ndarray) -> dict[str, Any]:
    table = problem.table
    used = table.at.take(np.unique(table.condition))
    return {
        "rows": table.rows,
        "runs": list(table.runs),
        "observables": list(table.observables),
        "loads_N": sorted({float(f) for f in np.round(used.load_N, 4)}),
        "turns": [float(used.turns.min()), float(used.turns.max())],
        "noise": dict(zip(table.observables, map(float, best.sigma), strict=True)),
        "autocorrelation": dict(zip(table.observables, map(float, best.rho), strict=True)),
        "outliers": int(np.sum(best.weight < OUTLIER_WEIGHT)),
        "tolerances": {
            "radius_mm_sd": float(np.mean(table.radius_sd_mm)),
            "twisting_zone_mm_sd": float(np.mean(table.zone_sd_mm)),
            "hole_distance_mm_sd": float(np.mean(table.hole_sd_mm)),
            "camera_scale_sd": table.camera_sd,
        },
    }


def _model(problem: Problem, shown: Fit) -> dict[str, Any]:
    """All that is needed to predict with the extended model later."""
    values = posterior(problem, shown)
    at = problem.table.at
    return {
        "base": problem.base,
        "parts": [
            {
                "mechanism": part.mechanism,
                "shape": part.shape.name,
                "values": {p.name: values[part.key(p.name)][0] for p in part.shape.parameters},
            }
            for part in shown.simulation.parts
        ],
        "reference": {
            k: getattr(problem.reference, k) for k in problem.reference.__dataclass_fields__
        },
        "nominal": {
            "twisting_zone_mm": float(at.twisting_zone_mm.mean()),
            "hole_distance_mm": float(at.hole_distance_mm.mean()),
            "radius_mm": float(at.radius_mm.mean()),
            "string_diameter_mm": float(at.string_diameter_mm.mean()),
            "strings": float(at.strings.mean()),
            "load_N": float(at.load_N.mean()),
        },
        "shifts": _shifts(problem, shown),
    }


def _shifts(problem: Problem, shown: Fit) -> dict[str, float]:
    """How far the fit moved the inputs within their tolerances, and the common zero of x."""
    table = problem.table
    state = problem.state(shown.z[None])
    zeroing = 0.0
    if problem.offsets.shape[1]:
        zeroing = float(problem.offsets[:, -1].max() * shown.offsets[-1])
    return {
        "radius_share": float(np.mean(state.radius_mm / table.at.radius_mm) - 1.0),
        "twisting_zone_mm": float(np.mean(state.zone_mm - table.at.twisting_zone_mm)),
        "hole_distance_mm": float(np.mean(state.hole_mm - table.at.hole_distance_mm)),
        "offset_mm": zeroing,
    }


def _rows(problem: Problem, plain: np.ndarray, shown: Fit) -> tuple[dict[str, Any], ...]:
    """Each row with both models' predictions, and what each part of the extended one does to it."""
    table = problem.table
    at = table.at
    effects = _effects(problem, shown)
    return tuple(
        {
            "run": table.runs[table.run[i]],
            "observable": table.observables[table.observable[i]],
            "turns": float(at.turns[c]),
            "load_N": float(at.load_N[c]),
            "branch": "unwind" if at.unwinding[c] else "wind",
            "value": float(table.value[i]),
            "base": float(plain[i]),
            "extended": float(shown.predicted[i]),
            "weight": float(shown.weight[i]),
            "effects": {name: float(change[i]) for name, change in effects.items()},
        }
        for i, c in enumerate(table.condition)
    )


def _effects(problem: Problem, shown: Fit) -> dict[str, np.ndarray]:
    """By mechanism: the rows (n,) with it less the rows without it, all else as fitted."""
    parts = shown.simulation.parts
    whole = problem.predict(shown.simulation, shown.u[None], shown.z[None])[0]
    counts = [len(part.shape.parameters) for part in parts]
    owner = np.repeat(np.arange(len(parts)), counts)
    found = {}
    for i, part in enumerate(parts):
        others = replace(shown.simulation, parts=(*parts[:i], *parts[i + 1 :]))
        rows = problem.predict(others, shown.u[None, owner != i], shown.z[None])[0]
        found[part.mechanism] = whole - rows
    return found
