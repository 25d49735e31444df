"""The radius grows as more string is drawn in (the earlier models' reading)."""

from __future__ import annotations

import numpy as np

from tsvision.mechanisms.shelf import Mechanism, Parameter, Shape, Values
from tsvision.mechanisms.state import State

ROUNDS = 8


def _swelling(state: State, p: Values) -> dict[str, np.ndarray]:
    """r = r₀ (X/L)^q with X = √(L² + (S/2 + α r)²), solved by fixed-point iteration."""
    radius = state.radius_mm
    for _ in range(ROUNDS):
        across = state.hole_mm / 2 + state.alpha_rad * radius
        lay = across / state.zone_mm
        radius = state.radius_mm * (1.0 + lay * lay) ** (0.5 * p["exponent"])
    return {"radius_mm": radius}


MECHANISM = Mechanism(
    name="variable_radius",
    title="Radius grows with contraction",
    claim="the string drawn in thickens the bundle: r grows as a power of (L + x)/L",
    touches=("displacement_mm", "diameter_mm", "helix_angle_deg", "torque_Nmm", "pitch_mm"),
    source="the variable-radius model that the paper compares with (there the power is 1/2)",
    shapes=(
        Shape(
            "power",
            "r = r₀ ((L + x)/L)^q",
            (
                Parameter(
                    "exponent",
                    "1",
                    "q; 1/2 is the variable-radius model",
                    low=0.0,
                    high=0.5,
                    typical=0.1,
                    starts=(0.5,),
                ),
            ),
            {"tension": _swelling},
        ),
    ),
    checks="measure D at few and at many turns under one load",
)
