"""The camera's scale is off."""

from __future__ import annotations

import numpy as np

from tsvision.mechanisms.drifting import easing, varying
from tsvision.mechanisms.shelf import Mechanism, Parameter, Shape, Values
from tsvision.mechanisms.state import State


def _scale(state: State, p: Values) -> dict[str, np.ndarray]:
    return {"camera": state.camera * (1.0 + p["scale_error"])}


_MAIN = Shape(
    "factor",
    "seen = (1 + c) · true, for D, p and the hole distance in the picture; turns seen / (1 + c)",
    (
        Parameter(
            "scale_error",
            "1",
            "c",
            low=-0.5,
            high=0.5,
            typical=0.06,
            starts=(0.5, -0.5),
        ),
    ),
    {"view": _scale},
)
MECHANISM = Mechanism(
    name="camera_scale",
    title="Camera scale off",
    claim="the camera's mm per px is off: lengths in the picture are wrong, the machine is right",
    touches=("diameter_mm", "hole_distance_mm", "pitch_mm", "turns_seen"),
    source="depth error dz changes the scale by dz/Z; refraction, refocusing",
    shapes=(
        _MAIN,
        varying(_MAIN),
        easing(_MAIN),
    ),
    checks="film a gauge pin of known diameter at the bundle's distance",
)
