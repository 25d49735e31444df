"""Torque, transmission, stiffness and speed of an actuator, for any model on the shelf.

Virtual work: without losses the motor torque is T = F dx/dα. String that slides over the edge of
the separator's hole loses tension as on a capstan, e^(μ θ), θ the angle by which it is bent
there, cos θ = L / (L + x). Winding, the motor works against that loss; unwinding, it is spared.
Each of the N strings carries F / N outside the separator and F e^(μ θ) / N inside while winding.
Without a separator no string slides over an edge, and what stretches is the string's own length.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tsvision.data import table
from tsvision.errors import InputError
from tsvision.models import DisplacementModel
from tsvision.units import RAD_PER_TURN, rpm_to_rad_s

MM_PER_M = 1000.0


@dataclass(frozen=True)
class Motor:
    """A gearmotor with a straight torque-speed line; speed and torque at its output shaft."""

    no_load_rpm: float
    stall_torque_Nm: float


@dataclass(frozen=True)
class Statics:
    """Arrays of the turns' shape. NaN where the model has no solution, or stiffness no EA.

    `transmission_rad_per_mm` is the motor's angle for a mm of stroke; `stiffness_N_per_mm` the
    load's, motor held; `torque_*` in N m; `string_tension_N` in one string while winding.
    """

    turns: np.ndarray
    displacement_mm: np.ndarray
    transmission_rad_per_mm: np.ndarray
    torque_winding_Nm: np.ndarray
    torque_unwinding_Nm: np.ndarray
    string_tension_N: np.ndarray
    stiffness_N_per_mm: np.ndarray
    torque_stiffness_Nmm_per_rad: np.ndarray


def paper_motor() -> Motor:
    """The paper's gearmotor: 100:1, 320 r.p.m. and 0.22 N m, all at the output shaft."""
    stated = table("stated").set_index("key")["value"]
    return Motor(float(stated["motor_speed_rpm"]), float(stated["motor_stall_torque_Nm"]))


def statics(
    model: DisplacementModel,
    turns: ArrayLike,
    geometry: dict[str, float],
    load_N: float,
    strings: int,
    friction: float = 0.0,
    axial_stiffness_N: float = float("nan"),
) -> Statics:
    """Statics at each turn count. `friction` is μ at the hole's edge, `axial_stiffness_N` EA of
    one string; strings stretch over the length L + x that lies between hole and motor, or over
    their own where the model has no separator.
    InputError on a negative load or friction."""
    for name, value in (("load", load_N), ("friction", friction)):
        if not (np.isfinite(value) and value >= 0):
            raise InputError(f"the {name} is {value:g}; give a finite number of at least 0")
    n = np.asarray(turns, dtype=float)
    x = model.displacement_mm(n, **geometry)
    feed_mm_per_rad = model.slope_mm_per_turn(n, **geometry) / RAD_PER_TURN
    zone = geometry["twisting_zone_mm"]
    if model.separator:
        length_mm = zone + x
        capstan = np.exp(friction * np.arccos(np.clip(zone / length_mm, -1.0, 1.0)))
    else:
        length_mm = np.full_like(x, np.hypot(zone, geometry.get("hole_distance_mm", 0.0) / 2))
        capstan = np.ones_like(x)
    ideal_Nm = load_N * feed_mm_per_rad / MM_PER_M
    step = 1e-4  # turns; the slope has no second derivative on the shelf
    bend = (
        model.slope_mm_per_turn(n + step, **geometry)
        - model.slope_mm_per_turn(np.maximum(n - step, 0.0), **geometry)
    ) / (np.minimum(n, step) + step)
    with np.errstate(divide="ignore"):  # at rest and without S an angle gives no stroke yet
        transmission = 1 / feed_mm_per_rad
    return Statics(
        turns=n,
        displacement_mm=x,
        transmission_rad_per_mm=transmission,
        torque_winding_Nm=ideal_Nm * capstan,
        torque_unwinding_Nm=ideal_Nm / capstan,
        string_tension_N=load_N / strings * capstan,
        stiffness_N_per_mm=strings * axial_stiffness_N / length_mm,
        torque_stiffness_Nmm_per_rad=load_N * bend / RAD_PER_TURN**2,
    )


def motor_speed_rpm(motor: Motor, torque_Nm: ArrayLike) -> np.ndarray:
    """Speed on the motor's line at a torque; NaN at and beyond stall, never above no load."""
    share = np.asarray(torque_Nm, dtype=float) / motor.stall_torque_Nm
    return motor.no_load_rpm * np.where(share < 1, 1 - np.maximum(share, 0.0), np.nan)


def speed_mm_s(found: Statics, motor: Motor) -> np.ndarray:
    """Speed of the load while winding under that load, mm/s."""
    turning = rpm_to_rad_s(motor_speed_rpm(motor, found.torque_winding_Nm))
    return turning / found.transmission_rad_per_mm


def stroke_time_s(found: Statics, motor: Motor) -> float:
    """Time to wind from the first to the last of `found.turns` (rising), s; NaN if it stalls."""
    turning = motor_speed_rpm(motor, found.torque_winding_Nm) / 60.0
    return float(np.trapezoid(1 / turning, found.turns))
