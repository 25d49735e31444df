"""`tsvision predict`: displacement for turns, with a chosen model."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from cli import actuator_options as options


def command(
    turns: Annotated[str, typer.Option("--turns", "-t", help="0,10,20 or start:stop:step")],
    model: Annotated[str, typer.Option("--model", "-m", help="One of the shelf.")] = (
        "constant_radius"
    ),
    paper: options.PaperOption = None,
    rig: options.RigOption = None,
    strings: options.StringsOption = None,
    string_diameter: options.StringDiameterOption = None,
    zone: options.ZoneOption = None,
    hole_distance: options.HoleDistanceOption = None,
    diameter: options.DiameterOption = None,
    section: options.SectionOption = "pair_core",
    pitch: options.PitchOption = None,
    as_json: options.JsonOption = False,
) -> None:
    """Displacement in mm (and its slope) at each turn count."""
    from tsvision.actuator.geometry import known_values, model_keywords
    from tsvision.models.choose import choose_model

    chosen = choose_model(model)
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
    )
    at = options.numbers(turns, "--turns")
    keywords = chosen.geometry(model_keywords(geometry))
    x = chosen.displacement_mm(at, **keywords)
    slope = chosen.slope_mm_per_turn(at, **keywords)
    if as_json:
        rows = [
            {"turns": t, "displacement_mm": _or_none(a), "slope_mm_per_turn": _or_none(b)}
            for t, a, b in zip(at.tolist(), x.tolist(), slope.tolist(), strict=True)
        ]
        answer = {"model": chosen.name, "geometry": known_values(geometry), "rows": rows}
        print(json.dumps(answer, indent=2))
        return
    print("turns,displacement_mm,slope_mm_per_turn")
    for t, a, b in zip(at, x, slope, strict=True):
        print(f"{t:g},{a:.4f},{b:.4f}")


def _or_none(value: float) -> float | None:
    return value if value == value else None
