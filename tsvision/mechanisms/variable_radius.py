"""The radius grows as more string is drawn in (the earlier models' reading)."""

from __future__ import annotations

import numpy as np

from tsvision.mechanisms.shelf import Mechanism, Parameter, Shape, Values
from tsvision.mechanisms.state import State

ROUNDS = 8


def swelling(state: State, p: Values) -> dict[str, np.ndarray]:
    """r = r₀ (X/L)^q with X = √(L² + (S/2 + α r)²), and the torque that this takes.

    Newton's method on u = X/L, begun above its root, from where it never overshoots. Nothing is
    stored in a bundle that thickens, so the torque is F dx/dα with r growing along: 1/(1 − k) of
    that at the radius reached, k = q (S/2 + α r) α r/X².
    """
    q = p["exponent"]
    half = state.hole_mm / (2.0 * state.zone_mm)
    arc = state.alpha_rad * state.radius_mm / state.zone_mm
    u = (arc + np.sqrt(1.0 + half)) ** 2
    for _ in range(ROUNDS):
        laid = arc * u**q
        way = np.hypot(1.0, half + laid)
        u = u + (way - u) / (1.0 - q * (half + laid) * laid / (way * u))
    laid = arc * u**q
    radius = state.radius_mm * u**q
    growing = q * (half + laid) * laid / u**2
    at_rest = state.at.load_N * radius * (half + laid) / u
    return {
        "radius_mm": radius,
        "torque_extra_Nmm": state.torque_extra_Nmm + at_rest * growing / (1.0 - growing),
    }


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
            {"tension": swelling},
        ),
    ),
    checks="measure D at few and at many turns under one load",
)
