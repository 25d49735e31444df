"""A dead zone: the first turns of the motor do not reach the bundle."""

from __future__ import annotations

import numpy as np

from tsvision.mechanisms.shelf import Mechanism, Parameter, Shape, State, Values, softplus, varying
from tsvision.units import RAD_PER_TURN

_LOST = Parameter(
    "lost_turns",
    "turns",
    "turns that lay no strand",
    low=0.0,
    high=10.0,
    typical=1.5,
    starts=(0.7,),
)


def _sharp(state: State, p: Values) -> dict[str, np.ndarray]:
    return {"alpha_rad": np.maximum(state.alpha_rad - RAD_PER_TURN * p["lost_turns"], 0.0)}


def _rounded(state: State, p: Values) -> dict[str, np.ndarray]:
    width = RAD_PER_TURN * p["width_turns"]
    shift = RAD_PER_TURN * p["lost_turns"]
    zero = softplus(-shift, width)  # nothing is laid at 0 turns
    return {"alpha_rad": np.maximum(softplus(state.alpha_rad - shift, width) - zero, 0.0)}


def _settling(state: State, p: Values) -> dict[str, np.ndarray]:
    width = np.maximum(RAD_PER_TURN * p["width_turns"], 1e-6)
    lost = RAD_PER_TURN * p["lost_turns"]
    return {
        "alpha_rad": np.maximum(state.alpha_rad - lost * -np.expm1(-state.alpha_rad / width), 0)
    }


def _width(low: float, high: float) -> Parameter:
    return Parameter(
        "width_turns",
        "turns",
        "over how many turns the dead zone ends",
        low=low,
        high=high,
        prior="uniform",
        starts=(0.3,),
        null=None,
    )


_MAIN = Shape("sharp", "α = max(α_motor − 2π n, 0)", (_LOST,), {"motor": _sharp})
MECHANISM = Mechanism(
    name="lost_turns",
    title="Lost turns",
    claim="the first turns are lost: slack, a dead zone or play lays no strand near zero turns",
    touches=("displacement_mm", "helix_angle_deg", "twist_turns", "torque_Nmm"),
    source="slack strings and coupling play; flat near zero, then a constant shift in turns",
    shapes=(
        _MAIN,
        Shape(
            "rounded",
            "α = hinge of α_motor − 2π n, rounded over w",
            (_LOST, _width(0.1, 3.0)),
            {"motor": _rounded},
        ),
        Shape(
            "settling",
            "α = α_motor − 2π n (1 − exp(−turns / w))",
            (_LOST, _width(0.2, 6.0)),
            {"motor": _settling},
        ),
        varying(_MAIN),
    ),
    checks="count the strands' turns on a frame at few motor turns",
)
