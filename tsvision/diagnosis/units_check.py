"""Mixed units are noticed by magnitude and asked about; nothing is converted in silence."""

from __future__ import annotations

import numpy as np

from tsvision.diagnosis.gain import as_it_came
from tsvision.diagnosis.problem import Problem
from tsvision.errors import InputError

# factor that the values would be off by -> what they look like
LOOKS = {
    "displacement_mm": {1e-3: "m", 1e-1: "cm", 1e3: "µm"},
    "diameter_mm": {1e-3: "m", 1e3: "µm"},
    "hole_distance_mm": {1e-3: "m", 1e3: "µm"},
    "helix_angle_deg": {np.pi / 180: "rad"},
    "twist_turns": {2 * np.pi: "rad", 360.0: "degrees"},
    "pitch_mm": {1e-3: "m", 1e3: "µm"},
    "turns_seen": {},
    "torque_Nmm": {1e-3: "N m"},
}
NEAR = 1.6  # a value within this factor of the model's value times the unit's
ENOUGH = 4


def check_units(problem: Problem) -> None:
    """Raise InputError where a run's values of one observable look like another unit."""
    table = problem.table
    plain = as_it_came(problem)
    for k, name in enumerate(table.observables):
        telling = (table.observable == k) & (np.abs(plain) > _least(name)) & (table.value != 0)
        ratio = np.abs(table.value / np.where(plain == 0, 1.0, plain))
        for factor, unit in LOOKS[name].items():
            near = telling & (ratio > factor / NEAR) & (ratio < factor * NEAR)
            for run, label in enumerate(table.runs):
                here = telling & (table.run == run)
                few = here.sum() < ENOUGH
                if here.any() and near[here].mean() > (0.99 if few else 0.8):
                    right = name.rsplit("_", 1)[1]
                    raise InputError(
                        f"run '{label}': its {name} are about {factor:.3g} times what the model "
                        f"expects: are they in {unit}? give them in {right}"
                    )
            if near.sum() > max(ENOUGH, 0.3 * telling.sum()):
                raise InputError(
                    f"{int(near.sum())} values of {name} are about {factor:.3g} times what the "
                    f"model expects: are they in {unit}? give all in one unit"
                )


def _least(name: str) -> float:
    return {"displacement_mm": 0.5, "helix_angle_deg": 3.0, "torque_Nmm": 0.5}.get(name, 0.0)
