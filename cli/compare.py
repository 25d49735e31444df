"""`tsvision compare`: all displacement models on one data set, in and out of sample."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cli import actuator_options as options

if TYPE_CHECKING:
    from tsvision.comparison.compare import Comparison, Result


def command(
    data: Annotated[
        list[Path] | None,
        typer.Argument(help="CSV files (long or wide) or `measure` folders; none: the paper's."),
    ] = None,
    rig: options.RigOption = None,
    strings: options.StringsOption = None,
    string_diameter: options.StringDiameterOption = None,
    zone: options.ZoneOption = None,
    hole_distance: options.HoleDistanceOption = None,
    diameter: options.DiameterOption = None,
    pitch: options.PitchOption = None,
    load: options.LoadOption = None,
    as_json: options.JsonOption = False,
) -> None:
    """RMSE of every model: as given, refitted, and on data left out of the refit."""
    from tsvision.comparison.compare import compare
    from tsvision.comparison.sample import paper_sample, read_sample
    from tsvision.jsonable import to_json
    from tsvision.rig import load_rig

    if not data:
        sample = paper_sample()
    else:
        overrides = {
            "strings.count": strings,
            "strings.diameter_mm": string_diameter,
            "actuator.twisting_zone_mm": zone,
            "actuator.hole_distance_mm": hole_distance,
            "actuator.load_N": load,
        }
        known = load_rig(rig, {k: v for k, v in overrides.items() if v is not None})
        sample = read_sample(data, known, _value(diameter), _value(pitch))
    comparison = compare(sample)
    print(to_json(_as_data(comparison)) if as_json else _as_text(comparison) + "\n", end="")


def _value(given: float | None) -> float:
    return math.nan if given is None else given


def _as_data(comparison: Comparison) -> dict[str, object]:
    sample = comparison.sample
    return {
        "data": sample.name,
        "rows": sample.turns.size,
        "scheme": sample.scheme,
        "folds": list(sample.folds),
        "notes": list(sample.notes),
        "best": comparison.best,
        "held_out_best_mm": comparison.best_mm,
        "held_out_base_mm": comparison.base_mm,
        "ratio": comparison.ratio,
        "ratio_low": comparison.ratio_low,
        "ratio_high": comparison.ratio_high,
        "folds_won": comparison.folds_won,
        "models": comparison.results,
    }


def _as_text(comparison: Comparison) -> str:
    sample = comparison.sample
    lines = [f"{sample.name}: {sample.turns.size} displacements, {sample.scheme}"]
    lines += [f"  note: {note}" for note in sample.notes]
    lines += [
        "",
        f"{'RMSE, mm':<24}{'as given':>10}{'refitted':>10}{'held out':>10}  refitted values",
    ]
    lines += [_line(result) for result in comparison.results]
    return "\n".join([*lines, "", *_verdict(comparison)])


def _line(result: Result) -> str:
    values = ", ".join(f"{name} {value:.3g}" for name, value in result.fitted.items())
    notes = [
        text for text in (values if math.isfinite(result.refit_mm) else "", result.note) if text
    ]
    if 0 < result.defined < 1 or (result.fitted and result.defined == 0):
        notes.append(f"as given it has a solution at {result.defined:.0%} of the rows")
    numbers = [_show(v) for v in (result.as_given_mm, result.refit_mm, result.held_out_mm)]
    return f"{result.model:<24}" + "".join(f"{n:>10}" for n in numbers) + "  " + "; ".join(notes)


def _show(value: float) -> str:
    return f"{value:.2f}" if math.isfinite(value) else "-"


def _verdict(comparison: Comparison) -> list[str]:
    given = [r for r in comparison.results if math.isfinite(r.as_given_mm)]
    nothing_fitted = min(given, key=lambda r: r.as_given_mm)
    low, high, folds = comparison.ratio_low, comparison.ratio_high, len(comparison.sample.folds)
    shown = "" if low > 1 else "; the interval holds 1: no difference is shown"
    return [
        f"out of sample {comparison.best} wins: {comparison.best_mm:.2f} mm against "
        f"{comparison.base_mm:.2f} mm of the refitted constant_radius, "
        f"{comparison.ratio:.2f} times [{low:.2f}, {high:.2f}]{shown}",
        f"  (at least as good in {comparison.folds_won} of {folds} groups left out)",
        f"nothing fitted: {nothing_fitted.model} is nearest, {nothing_fitted.as_given_mm:.2f} mm",
        "no model here knows load, friction or wear: `tsvision diagnose` looks for those",
    ]
