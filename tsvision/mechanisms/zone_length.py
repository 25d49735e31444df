"""The twisting zone is longer or shorter than stated."""

from __future__ import annotations

import numpy as np

from tsvision.mechanisms.drifting import easing, varying
from tsvision.mechanisms.shelf import Mechanism, Parameter, Shape, Values
from tsvision.mechanisms.state import State


def _shift(state: State, p: Values) -> dict[str, np.ndarray]:
    return {"zone_mm": np.maximum(state.zone_mm + p["zone_length_change_mm"], 0.1)}


_MAIN = Shape(
    "shift",
    "L = L_stated + δL",
    (
        Parameter(
            "zone_length_change_mm",
            "mm",
            "δL",
            low=-0.5,
            high=0.5,
            typical=0.08,
            of="zone_mm",
            starts=(-0.7, 0.7),
        ),
    ),
    {"geometry": _shift},
)
MECHANISM = Mechanism(
    name="zone_length",
    title="Zone length off",
    claim="the twisting zone L is longer or shorter than stated",
    touches=("displacement_mm", "helix_angle_deg", "torque_Nmm", "pitch_mm", "turns_seen"),
    source="the paper's L; its ends (apex, clamp) are not where a ruler puts them",
    shapes=(
        _MAIN,
        varying(_MAIN),
        easing(_MAIN),
    ),
    checks="measure from the separator's exit face to the connector, and where the strands meet",
)
