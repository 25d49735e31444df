"""A dead zone: the first turns of the motor do not reach the bundle."""

from __future__ import annotations

import numpy as np

from tsvision.mechanisms.drifting import varying
from tsvision.mechanisms.shelf import SHOW_ROTATION, Mechanism, Parameter, Shape, Values
from tsvision.mechanisms.state import State
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
    """A hyperbola through the origin with the sharp form's shift far out."""
    shift = RAD_PER_TURN * p["lost_turns"] / (1.0 - p["rounding"])
    past = state.alpha_rad - shift
    return {
        "alpha_rad": 0.5 * (past + np.sqrt(past**2 + 4.0 * p["rounding"] * shift * state.alpha_rad))
    }


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
    touches=SHOW_ROTATION,
    source="slack strings and coupling play; flat near zero, then a constant shift in turns",
    shapes=(
        _MAIN,
        Shape(
            "rounded",
            "α = ½ [p + √(p² + 4 κ s α_motor)], p = α_motor − s, s = 2π n/(1 − κ)",
            (
                _LOST,
                Parameter(
                    "rounding",
                    "1",
                    "κ: 0 is a sharp corner",
                    low=0.005,
                    high=0.6,
                    prior="uniform",
                    starts=(0.3,),
                    null=None,
                ),
            ),
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
