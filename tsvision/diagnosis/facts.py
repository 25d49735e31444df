"""The parts of a verdict: causes, rivals, residual, data, model and rows, as JSON's types."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from tsvision.diagnosis.averaging import posterior_over_shapes
from tsvision.diagnosis.candidates import Candidate, Selection, weighed
from tsvision.diagnosis.confounding import ONE_RADIUS, TELL_RADIUS
from tsvision.diagnosis.fit import Fit, posterior
from tsvision.diagnosis.gain import Gain
from tsvision.diagnosis.lack_of_fit import PLACES, LackOfFit
from tsvision.diagnosis.next_experiment import Proposal
from tsvision.diagnosis.problem import ZEROED, Problem, parameters
from tsvision.diagnosis.verdict import Cause, Estimate
from tsvision.mechanisms import MECHANISMS
from tsvision.mechanisms.shelf import OBSERVABLES
from tsvision.mechanisms.state import NOMINAL

OUTLIER_WEIGHT = 0.2  # of a Student-t residual: beyond about 4.5 times the noise
SHOWN_RIVALS = 4


def causes_of(problem: Problem, chosen: Candidate) -> list[Cause]:
    """The parts of the best fit with their parameters and 95 % intervals."""
    best = chosen.best
    found = posterior_over_shapes(problem, chosen)
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


def rivals_of(selection: Selection, sets: list[tuple[str, ...]]) -> list[dict[str, Any]]:
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


def proposal_dict(proposal: Proposal | None) -> dict[str, Any] | None:
    """A proposal as JSON's types."""
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
        "chance_to_resolve": proposal.chance,
    }


def gain_dict(gain: Gain) -> dict[str, Any]:
    """A gain as JSON's types; keys end in _mm where the rows are lengths."""
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


def short_gain(gain: Gain) -> dict[str, float]:
    """What the paragraph needs of a gain."""
    return {"base": gain.base, "extended": gain.extended}


def residual_of(
    problem: Problem, status: str, selection: Selection, after: LackOfFit, gain: Gain | None
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
        if gain is not None and not after.wrong:
            residual["hint"] = _unforeseen(gain)
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


def _unforeseen(gain: Gain) -> str:
    unit = OBSERVABLES[gain.observable]
    return (
        f"what fits these data does not foresee those left out ({gain.scheme}), where it is "
        f"{gain.extended:.3g} {unit} off and the base {gain.base:.3g} {unit}"
    )


def _hint(after: LackOfFit) -> str:
    if not after.wrong:
        return "nothing but noise is left"
    name = after.observable
    size = after.structured[name]
    return (
        f"a misfit of {name} of {size:.2g} {OBSERVABLES[name]} (rms) is left, {PLACES[after.place]}"
    )


def exact_equivalences(
    sets: list[tuple[str, ...]], observables: tuple[str, ...]
) -> tuple[dict, ...]:
    """Mechanisms that no reading of these observables can part, and why."""
    telling = TELL_RADIUS & set(observables)
    ones = max((sum(name in ONE_RADIUS for name in names) for names in sets), default=0)
    if not telling and any("radius_bias" in names for names in sets):
        why = (
            "displacement and helix angle depend on α r alone, and the stated diameter may come "
            "from a picture; measure the diameter or the strands' turns to part them"
        )
    elif telling == {"diameter_mm"} and ones == 2:
        why = (
            "displacement, helix angle and diameter tell two numbers, α r and r times the camera's "
            "scale: any two of these make up for each other; count the strands' turns to part them"
        )
    else:
        return ()
    return ({"mechanisms": list(ONE_RADIUS), "why": why},)


def data_of(problem: Problem, best: Fit) -> dict[str, Any]:
    """What the table held, the noise and the tolerances that were assumed."""
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


def model_of(problem: Problem, shown: Fit) -> dict[str, Any]:
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
        "nominal": {name: _common(getattr(at, name)) for name in NOMINAL},
        "shifts": _shifts(problem, shown),
        # In units of the formula's x at 0 turns, which differs from bundle to bundle.
        "zeroed_share": float(np.sqrt(ZEROED) * shown.offsets[-1]) if shown.offsets.size else 0.0,
    }


def _common(values: np.ndarray) -> float:
    """What all have in common; NaN where they differ, for a mean of several would be of none."""
    return float(values[0]) if np.ptp(values) < 1e-9 else float("nan")


def _shifts(problem: Problem, shown: Fit) -> list[dict[str, float]]:
    """How far the fit moved the inputs of each bundle within their tolerances."""
    at = problem.table.at
    state = problem.state(shown.z[None])
    moved = np.broadcast_arrays(
        state.radius_mm / at.radius_mm - 1.0,
        state.zone_mm - at.twisting_zone_mm,
        state.hole_mm - at.hole_distance_mm,
    )
    stated = np.column_stack([at.strings, at.radius_mm, at.twisting_zone_mm, at.hole_distance_mm])
    first = np.unique(np.round(stated, 9), axis=0, return_index=True)[1]
    return [
        {
            "strings": float(at.strings[i]),
            "radius_mm": float(at.radius_mm[i]),
            "radius_share": float(moved[0][0, i]),
            "zone_change_mm": float(moved[1][0, i]),
            "hole_change_mm": float(moved[2][0, i]),
        }
        for i in first
    ]


def rows_of(problem: Problem, plain: np.ndarray, shown: Fit) -> tuple[dict[str, Any], ...]:
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
