"""`tsvision invert`: turns for a displacement, with a chosen model."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from cli import actuator_options as options
from cli import model_option


def command(
    displacement: Annotated[
        str, typer.Option("--displacement", "-x", help="mm: 5,10,20 or start:stop:step")
    ],
    model: Annotated[
        str, typer.Option("--model", "-m", help="One of the shelf, or verdict.json.")
    ] = ("constant_radius"),
    paper: options.PaperOption = None,
    rig: options.RigOption = None,
    strings: options.StringsOption = None,
    string_diameter: options.StringDiameterOption = None,
    zone: options.ZoneOption = None,
    hole_distance: options.HoleDistanceOption = None,
    diameter: options.DiameterOption = None,
    section: options.SectionOption = "pair_core",
    pitch: options.PitchOption = None,
    load: options.LoadOption = None,
    as_json: options.JsonOption = False,
) -> None:
    """Motor turns that give each displacement; empty where the model has no answer."""
    from tsvision.actuator.geometry import known_values

    chosen = model_option.choose(model)
    geometry = options.resolve(
        paper,
        rig,
        section,
        strings=strings,
        string_diameter_mm=string_diameter,
        twisting_zone_mm=zone,
        hole_distance_mm=hole_distance,
        bundle_diameter_mm=diameter,
        pitch_mm=pitch,
        load_N=load,
    )
    geometry = model_option.completed(chosen, geometry)
    wanted = options.numbers(displacement, "--displacement")
    turns = chosen.turns_for_displacement(wanted, **model_option.keywords(chosen, geometry))
    pairs = [
        (x, n if n == n else None) for x, n in zip(wanted.tolist(), turns.tolist(), strict=True)
    ]
    if as_json:
        rows = [{"displacement_mm": x, "turns": n} for x, n in pairs]
        answer = {"model": chosen.name, "geometry": known_values(geometry), "rows": rows}
        print(json.dumps(answer, indent=2))
        return
    print("displacement_mm,turns")
    for x, n in pairs:
        print(f"{x:g},{'' if n is None else format(n, '.4f')}")
