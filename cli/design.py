"""`tsvision design`: which strings, length and turns give a wanted stroke and life."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cli import actuator_options as options

if TYPE_CHECKING:
    from tsvision.actuator.design import Candidate


def command(
    stroke: Annotated[float, typer.Option("--stroke", help="Wanted contraction, mm.")],
    load: Annotated[float, typer.Option("--load", "--load-N", help="Load, N.")],
    length: Annotated[float, typer.Option("--length", help="Most of zone plus stroke, mm.")],
    life: Annotated[float, typer.Option("--life", help="Wanted cycles to failure.")] = 0.0,
    strings: Annotated[str, typer.Option("--strings", "-N", help="Counts to try.")] = "2,4,6,8",
    string_diameter: Annotated[
        str, typer.Option("--string-diameter", help="Diameters to try, mm.")
    ] = "0.24",
    hole_distance: Annotated[float, typer.Option("--hole-distance", help="S, mm.")] = 5.0,
    hole_diameter: options.HoleDiameterOption = None,
    friction: Annotated[float, typer.Option("--friction", help="μ at the hole's edge.")] = 0.0,
    safety: Annotated[float, typer.Option("--safety", help="Breaking load over tension.")] = 4.0,
    overtwist: Annotated[
        bool, typer.Option("--overtwist/--no-overtwist", help="May the stroke pass the onset?")
    ] = True,
    motor_rpm: Annotated[
        float | None, typer.Option("--motor-rpm", help="No-load speed at the output shaft.")
    ] = None,
    motor_torque: Annotated[
        float | None, typer.Option("--motor-torque", help="Stall torque there, N m.")
    ] = None,
    model: Annotated[str, typer.Option("--model", "-m", help="Displacement model.")] = (
        "constant_radius"
    ),
    section: options.SectionOption = "packing_fraction",
    plot: Annotated[Path | None, typer.Option("--plot", help="Write a PNG or SVG.")] = None,
    every: Annotated[bool, typer.Option("--all", help="All lengths, not one per N and d.")] = False,
    as_json: options.JsonOption = False,
) -> None:
    """Candidates with their limits: onset, irreversible, strength, torque, life."""
    from tsvision.actuator.design import Wanted, candidates, shortest_of_each
    from tsvision.actuator.statics import Motor, paper_motor
    from tsvision.errors import InputError
    from tsvision.jsonable import to_json
    from tsvision.models import SECTIONS
    from tsvision.models.choose import check_strings, choose_model

    if section not in SECTIONS:
        raise InputError(f"no bundle section '{section}'; there are: {', '.join(SECTIONS)}")
    wanted = Wanted(
        stroke_mm=stroke,
        load_N=load,
        length_mm=length,
        life_cycles=life,
        hole_distance_mm=hole_distance,
        hole_diameter_mm=math.nan if hole_diameter is None else hole_diameter,
        friction=friction,
        safety=safety,
        overtwist=overtwist,
    )
    own = paper_motor()
    motor = Motor(
        own.no_load_rpm if motor_rpm is None else motor_rpm,
        own.stall_torque_Nm if motor_torque is None else motor_torque,
    )
    counts = tuple(_whole(v) for v in options.numbers(strings, "--strings"))
    diameters = tuple(float(v) for v in options.numbers(string_diameter, "--string-diameter"))
    if min(diameters) <= 0 or min(counts) < 2:
        raise InputError("a design needs strings of a diameter above 0 mm, two of them at least")
    chosen = choose_model(model)
    for count in counts:
        check_strings(chosen, count)
    tried = candidates(wanted, chosen, counts, diameters, motor, section)
    if plot is not None:
        from tsvision.actuator.plot import design_plot

        design_plot(tried, wanted, plot)
    shown = tried if every else shortest_of_each(tried)
    if as_json:
        print(to_json({"wanted": wanted, "candidates": shown}), end="")
    else:
        print("\n".join(_as_text(shown)))


def _whole(value: float) -> int:
    from tsvision.errors import InputError

    if value != int(value):
        raise InputError(f"--strings {value:g} is no whole number of strings; write 2,4,6,8")
    return int(value)


def _as_text(shown: list[Candidate]) -> list[str]:
    if not shown:
        return ["no candidate: the model has no turns for that stroke; try --length or --model"]
    head = (
        f"{'N':>2}{'d mm':>6}{'L mm':>7}{'D mm':>6}{'turns':>7}{'x %':>6}"
        f"{'onset [95 %]':>19}{'unwinds to mm':>17}{'N mm':>7}{'s':>6}"
        f"{'N/string (breaks)':>19}{'life [low]':>20}  limits broken; notes"
    )
    lines = [head]
    for c in shown:
        onset = f"{c.onset_turns:.1f} [{c.onset_low:.1f}, {c.onset_high:.1f}]"
        unwinds = f"{c.reversible_mm:.0f} (>{c.reversible_low_mm:.0f})"
        strength = f"{c.tension_N:.1f} ({c.strength_N:.0f})"
        life = f"{c.life_cycles:.0f} [{c.life_low:.0f}]"
        words = "; ".join(
            text for text in (", ".join(c.against).upper() or "ok", ", ".join(c.notes)) if text
        )
        lines.append(
            f"{c.strings:>2}{c.string_diameter_mm:>6g}{c.twisting_zone_mm:>7.1f}"
            f"{c.bundle_diameter_mm:>6.2f}{c.turns:>7.1f}{c.contraction_percent:>6.0f}"
            f"{onset:>19}{unwinds:>17}{1000 * c.torque_Nm:>7.1f}{c.stroke_s:>6.1f}"
            f"{strength:>19}{life:>20}  {words}"
        )
    return lines
