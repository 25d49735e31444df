"""The distance between the separator's holes is not what was stated (or was left out)."""

from __future__ import annotations

import numpy as np

from tsvision.mechanisms.drifting import easing, varying
from tsvision.mechanisms.shelf import Mechanism, Parameter, Shape, Values
from tsvision.mechanisms.state import State


def _shift(state: State, p: Values) -> dict[str, np.ndarray]:
    return {"hole_mm": np.maximum(state.hole_mm + p["hole_distance_change_mm"], 0.0)}


_MAIN = Shape(
    "shift",
    "S = S_stated + δS",
    (
        Parameter(
            "hole_distance_change_mm",
            "mm",
            "δS",
            low=-5.0,
            high=5.0,
            typical=1.5,  # a hole's own width, where edges were taken for centres
            starts=(-0.6, 0.6),
        ),
    ),
    {"geometry": _shift},
)
MECHANISM = Mechanism(
    name="hole_distance",
    title="Hole distance off",
    claim="the separator's holes are another distance S apart than stated (or S was left out)",
    touches=("displacement_mm", "hole_distance_mm", "torque_Nmm", "pitch_mm"),
    source="the paper's S; earlier models leave it out (S = 0)",
    shapes=(
        _MAIN,
        varying(_MAIN),
        easing(_MAIN),
    ),
    checks="measure the holes' distance on the separator",
)
