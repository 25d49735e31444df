"""`tsvision invert`: turns for a displacement, with a chosen model."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from cli import actuator_options as options
from cli import model_option
from cli.shared_options import with_options


@with_options(geometry=options.read_geometry)
def command(
    displacement: Annotated[
        str, typer.Option("--displacement", "-x", help="mm: 5,10,20 or start:stop:step")
    ],
    model: Annotated[
        str, typer.Option("--model", "-m", help="One of the shelf, or verdict.json.")
    ] = ("constant_radius"),
    as_json: options.JsonOption = False,
    *,
    geometry: Any,
) -> None:
    """Motor turns that give each displacement; empty where the model has no answer."""
    from tsvision.actuator.geometry import known_values
    from tsvision.jsonable import to_json

    chosen = model_option.choose(model)
    geometry = model_option.completed(chosen, geometry)
    wanted = options.numbers(displacement, "--displacement")
    turns = chosen.turns_for_displacement(wanted, **model_option.keywords(chosen, geometry))
    pairs = list(zip(wanted.tolist(), turns.tolist(), strict=True))
    if as_json:
        rows = [{"displacement_mm": x, "turns": n} for x, n in pairs]
        answer = {"model": chosen.name, "geometry": known_values(geometry), "rows": rows}
        print(to_json(answer), end="")
        return
    print("displacement_mm,turns")
    for x, n in pairs:
        print(f"{x:g},{format(n, '.4f') if n == n else ''}")
