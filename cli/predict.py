"""`tsvision predict`: displacement for turns, with a chosen model."""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cli import actuator_options as options
from cli import model_option
from cli.shared_options import with_options

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike

    from tsvision.actuator.geometry import Geometry
    from tsvision.models import DisplacementModel


@with_options(geometry=options.read_geometry)
def command(
    turns: Annotated[str, typer.Option("--turns", "-t", help="0,10,20 or start:stop:step")],
    model: Annotated[
        str, typer.Option("--model", "-m", help="One of the shelf, or verdict.json.")
    ] = ("constant_radius"),
    friction: Annotated[float, typer.Option("--friction", help="μ at the hole's edge.")] = 0.0,
    axial_stiffness: Annotated[
        float | None, typer.Option("--axial-stiffness", help="EA of one string, N.")
    ] = None,
    motor_rpm: Annotated[
        float | None, typer.Option("--motor-rpm", help="No-load speed at the output shaft.")
    ] = None,
    motor_torque: Annotated[
        float | None, typer.Option("--motor-torque", help="Stall torque there, N m.")
    ] = None,
    as_json: options.JsonOption = False,
    *,
    geometry: Any,
) -> None:
    """Displacement (mm), slope, and with --load the motor torque; onset and limit besides."""
    from tsvision.actuator.geometry import known_values
    from tsvision.actuator.outlook import outlook
    from tsvision.errors import InputError
    from tsvision.jsonable import to_json

    given = {
        "--axial-stiffness": axial_stiffness,
        "--motor-rpm": motor_rpm,
        "--motor-torque": motor_torque,
    }
    for option, value in given.items():
        if value is not None and not 0 < value < math.inf:
            raise InputError(f"{option} {value:g}: must be a finite number greater than 0")
    chosen = model_option.choose(model)
    at = options.numbers(turns, "--turns")
    geometry = model_option.completed(chosen, geometry)
    keywords = model_option.keywords(chosen, geometry)
    columns = {
        "turns": at,
        "displacement_mm": chosen.displacement_mm(at, **keywords),
        "slope_mm_per_turn": chosen.slope_mm_per_turn(at, **keywords),
    }
    if geometry.strings is not None and geometry.load_N == geometry.load_N:
        motor = (motor_rpm, motor_torque)
        columns |= _statics(chosen, at, keywords, geometry, friction, axial_stiffness, motor)
    ahead = outlook(geometry)
    if as_json:
        rows = [{name: column[k] for name, column in columns.items()} for k in range(at.size)]
        answer = {
            "model": chosen.name,
            "geometry": known_values(geometry),
            "rows": rows,
            "overtwist_onset": ahead.onset,
            "reversible": ahead.limit,
        }
        print(to_json(answer), end="")
        return
    print(",".join(columns))
    for k in range(at.size):
        values = [f"{column[k]:.4f}" for name, column in columns.items() if name != "turns"]
        print(",".join([f"{at[k]:g}", *values]))
    for line in ahead.lines:
        print(line, file=sys.stderr)


def _statics(
    model: DisplacementModel,
    turns: np.ndarray,
    keywords: dict[str, ArrayLike],
    geometry: Geometry,
    friction: float,
    axial_stiffness: float | None,
    motor: tuple[float | None, float | None],
) -> dict[str, np.ndarray]:
    """Torque and tension; stiffness and speed where string and motor are known."""
    from tsvision.actuator.statics import Motor, paper_motor, speed_mm_s, statics

    numbers = {name: float(value) for name, value in keywords.items()}  # type: ignore[arg-type]
    elastic = math.nan if axial_stiffness is None else axial_stiffness
    count = geometry.strings or 0
    acting = statics(model, turns, numbers, geometry.load_N, count, friction, elastic)
    columns = {
        "transmission_rad_per_mm": acting.transmission_rad_per_mm,
        "torque_winding_Nmm": 1000 * acting.torque_winding_Nm,
        "torque_unwinding_Nmm": 1000 * acting.torque_unwinding_Nm,
        "string_tension_N": acting.string_tension_N,
    }
    if axial_stiffness is not None:
        columns["stiffness_N_per_mm"] = acting.stiffness_N_per_mm
    if any(value is not None for value in motor):
        own, (rpm, torque) = paper_motor(), motor
        used = Motor(
            own.no_load_rpm if rpm is None else rpm,
            own.stall_torque_Nm if torque is None else torque,
        )
        columns["speed_mm_s"] = speed_mm_s(acting, used)
    return columns
