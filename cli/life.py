"""`tsvision life`: cycles to failure, models fitted to the paper's or one's own table."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cli import actuator_options as options

if TYPE_CHECKING:
    from tsvision.life.claims import Claim
    from tsvision.life.fit import LifeFit
    from tsvision.life.table import LifeTests


def command(
    data: Annotated[
        Path | None,
        typer.Argument(
            help="CSV: load_N or load_kgf, turns, cycles, contraction_mm, broke; none: the paper's."
        ),
    ] = None,
    load: options.LoadOption = None,
    turns: Annotated[float | None, typer.Option("--turns", help="Turns a cycle.")] = None,
    contraction: Annotated[
        float | None, typer.Option("--contraction", help="Contraction a cycle, mm.")
    ] = None,
    as_json: options.JsonOption = False,
) -> None:
    """Fit all life models, test the paper's claims; --load, --turns, --contraction: predict."""
    from tsvision.jsonable import to_json
    from tsvision.life.claims import test_claims
    from tsvision.life.fit import fit_all
    from tsvision.life.table import paper_tests, read_tests

    tests = paper_tests() if data is None else read_tests(data)
    fits, claims = fit_all(tests), test_claims(tests)
    wanted = _condition(load, turns, contraction)
    if as_json:
        print(to_json(_as_data(tests, fits, claims, wanted)), end="")
    else:
        print("\n".join(_as_text(tests, fits, claims, wanted)))


def _condition(
    load: float | None, turns: float | None, contraction: float | None
) -> LifeTests | None:
    """The one condition to predict; None when nothing was asked."""
    import numpy as np

    from tsvision.errors import InputError
    from tsvision.life.table import LifeTests

    given = {"--load": load, "--turns": turns, "--contraction": contraction}
    if all(value is None for value in given.values()):
        return None
    for name, value in given.items():
        if value is None or not (math.isfinite(value) and value > 0):
            raise InputError(
                f"{name} is {value}; a prediction needs --load N, --turns and --contraction mm > 0"
            )
    one = np.ones(1)
    return LifeTests("asked", one * load, one * turns, one * contraction, one, one > 0)  # type: ignore[operator]


def _predictions(fits: list[LifeFit], wanted: LifeTests | None) -> list[dict[str, object]]:
    from tsvision.life.fit import predict_cycles

    if wanted is None:
        return []
    rows: list[dict[str, object]] = []
    for fit in fits:
        middle, low, high = (float(v[0]) for v in predict_cycles(fit, wanted))
        rows.append({"model": fit.model, "cycles": middle, "low": low, "high": high})
    return rows


def _as_data(
    tests: LifeTests, fits: list[LifeFit], claims: list[Claim], wanted: LifeTests | None
) -> dict[str, object]:
    from tsvision.life.shelf import LIFE_MODELS

    return {
        "data": tests.name,
        "tests": len(tests.cycles),
        "broke": int(tests.broke.sum()),
        "level": 0.95,
        "models": [
            {
                "model": fit.model,
                "equation": LIFE_MODELS[fit.model].equation,
                "parameters": fit.parameters,
                "scatter_factor": math.exp(fit.scatter),
                "aicc": fit.aicc,
                "left_out_factor": fit.left_out_factor,
            }
            for fit in fits
        ],
        "claims": claims,
        "predictions": _predictions(fits, wanted),
    }


def _as_text(
    tests: LifeTests, fits: list[LifeFit], claims: list[Claim], wanted: LifeTests | None
) -> list[str]:
    from tsvision.life.shelf import LIFE_MODELS

    stopped = len(tests.cycles) - int(tests.broke.sum())
    lines = [
        f"{tests.name}: {len(tests.cycles)} tests, {stopped} stopped with the string whole",
        "",
    ]
    lines.append(f"{'model':<34}{'ΔAICc':>7}{'scatter':>9}{'left out':>10}  parameters [95 %]")
    for fit in fits:
        above = fit.aicc - fits[0].aicc
        values = ", ".join(
            f"{name} {e.value:.3g} [{e.low:.3g}, {e.high:.3g}]"
            for name, e in fit.parameters.items()
        )
        scatter, left_out = f"×{math.exp(fit.scatter):.2f}", f"×{fit.left_out_factor:.2f}"
        lines.append(f"{fit.model:<34}{above:>7.1f}{scatter:>9}{left_out:>10}  {values}")
        lines.append(f"{'':<34}{LIFE_MODELS[fit.model].equation}")
    lines += ["", "scatter: factor by which single strings differ; left out: rms factor by which a"]
    lines += ["test is missed by a fit to the others. F in N, x in mm.", "", "The paper's claims:"]
    lines += [_claim_text(claim) for claim in claims]
    for row in _predictions(fits, wanted):
        head = (
            ""
            if row["model"] != fits[0].model
            else "\nLife asked for, 95 % interval of one string:\n"
        )
        span = f"{row['cycles']:.0f} cycles [{row['low']:.0f}, {row['high']:.0f}]"
        lines.append(f"{head}  {row['model']:<34}{span}")
    return lines


def _claim_text(claim: Claim) -> str:
    e = claim.estimate
    number = f"{e.value:.2f} [{e.low:.2f}, {e.high:.2f}], p = {claim.p_value:.2g}"
    return f"  {claim.verdict.upper()}: {claim.claim}\n      {claim.quantity}: {number}"
