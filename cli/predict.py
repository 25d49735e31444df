"""`tsvision predict`: displacement for turns, with a chosen model."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
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
    hole_diameter: options.HoleDiameterOption = None,
    pitch: options.PitchOption = None,
    load: options.LoadOption = None,
    friction: Annotated[float, typer.Option("--friction", help="μ at the hole's edge.")] = 0.0,
    as_json: options.JsonOption = False,
) -> None:
    """Displacement (mm), slope, and with --load the motor torque; onset and limit besides."""
    from tsvision.actuator.geometry import known_values, model_keywords
    from tsvision.actuator.outlook import outlook
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
        hole_diameter_mm=hole_diameter,
        pitch_mm=pitch,
        load_N=load,
    )
    at = options.numbers(turns, "--turns")
    keywords = chosen.geometry(model_keywords(geometry))
    columns = {
        "turns": at,
        "displacement_mm": chosen.displacement_mm(at, **keywords),
        "slope_mm_per_turn": chosen.slope_mm_per_turn(at, **keywords),
    }
    if geometry.strings is not None and geometry.load_N == geometry.load_N:
        from tsvision.actuator.statics import statics

        numbers = {name: float(value) for name, value in keywords.items()}  # type: ignore[arg-type]
        acting = statics(chosen, at, numbers, geometry.load_N, geometry.strings, friction)
        columns["torque_winding_Nmm"] = 1000 * acting.torque_winding_Nm
        columns["torque_unwinding_Nmm"] = 1000 * acting.torque_unwinding_Nm
        columns["string_tension_N"] = acting.string_tension_N
    ahead = outlook(geometry)
    if as_json:
        rows = [
            {name: _or_none(float(column[k])) for name, column in columns.items()}
            for k in range(at.size)
        ]
        answer = {
            "model": chosen.name,
            "geometry": known_values(geometry),
            "rows": rows,
            "overtwist_onset": asdict(ahead.onset) if ahead.onset else None,
            "reversible": asdict(ahead.limit) if ahead.limit else None,
        }
        print(json.dumps(answer, indent=2))
        return
    print(",".join(columns))
    for k in range(at.size):
        values = [f"{column[k]:.4f}" for name, column in columns.items() if name != "turns"]
        print(",".join([f"{at[k]:g}", *values]))
    for line in ahead.lines:
        print(line, file=sys.stderr)


def _or_none(value: float) -> float | None:
    return value if value == value else None
