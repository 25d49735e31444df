"""Strings resist bending: laying them takes more torque than the load's work alone."""

from __future__ import annotations

import numpy as np

from tsvision.mechanisms.shelf import Mechanism, Parameter, Shape, Values
from tsvision.mechanisms.state import State


def _stiff(state: State, p: Values) -> dict[str, np.ndarray]:
    """dU/dα of U = N (B/2) κ² X with κ = sin²ψ/a, X = L/cos ψ, tan ψ = α a / L.

    The derivative is (N B / 2a) (4 sin³ψ cos²ψ + sin⁵ψ); a is the radius the strings turn at.
    """
    lay = np.arctan2(state.alpha_rad * state.radius_mm, state.zone_mm)
    sine, cosine = np.sin(lay), np.cos(lay)
    shape = 4.0 * sine**3 * cosine**2 + sine**5
    stiff = p["bending_stiffness_Nmm2"] * state.at.strings / (2.0 * state.radius_mm)
    return {"torque_extra_Nmm": state.torque_extra_Nmm + stiff * shape}


MECHANISM = Mechanism(
    name="bending_stiffness",
    title="Bending stiffness",
    claim="the strings resist being bent into a helix, which takes torque beyond the load's work",
    touches=("torque_Nmm",),
    source="elastic rods: energy (B/2) κ² per length; displacement is left as it is",
    shapes=(
        Shape(
            "elastic",
            "torque = F dx/dα + (N B / 2r)(4 sin³β cos²β + sin⁵β)",
            (
                Parameter(
                    "bending_stiffness_Nmm2",
                    "N mm²",
                    "B of one string",
                    low=0.0,
                    high=20.0,
                    typical=0.7,
                    starts=(0.7,),
                ),
            ),
            {"view": _stiff},
        ),
    ),
    checks="let one string sag over an edge under its own weight",
)
