"""The bundle turns by another factor than the motor: slip, or a wrong gear ratio."""

from __future__ import annotations

import numpy as np

from tsvision.mechanisms.drifting import easing, varying
from tsvision.mechanisms.shelf import SHOW_ROTATION, Mechanism, Parameter, Shape, Values
from tsvision.mechanisms.state import State


def _proportional(state: State, p: Values) -> dict[str, np.ndarray]:
    return {"alpha_rad": state.alpha_rad * (1.0 - p["slip"])}


def _growing(state: State, p: Values) -> dict[str, np.ndarray]:
    share = state.at.turns / state.reference.span_turns
    return {"alpha_rad": state.alpha_rad * (1.0 - p["slip"] * share)}


def _with_load(state: State, p: Values) -> dict[str, np.ndarray]:
    share = state.at.load_N / state.reference.load_max_N
    return {"alpha_rad": state.alpha_rad * (1.0 - p["slip"] * share)}


def _saturating(state: State, p: Values) -> dict[str, np.ndarray]:
    reached = -np.expm1(-state.at.turns / p["width_turns"])
    return {"alpha_rad": state.alpha_rad * (1.0 - p["slip"] * reached)}


def _slip(low: float, meaning: str) -> Parameter:
    starts = (0.7, -0.7) if low < 0 else (0.7,)
    return Parameter("slip", "1", meaning, low=low, high=0.6, typical=0.08, starts=starts)


_MAIN = Shape(
    "proportional",
    "α = (1 − slip) α_motor",
    (_slip(-0.4, "share of the turns that is lost; below 0: a gear ratio that is off"),),
    {"motor": _proportional},
)
MECHANISM = Mechanism(
    name="angle_scale",
    title="Slip or gear ratio",
    claim="the bundle gets only a share of the motor's rotation (slip), or the gear ratio is off",
    touches=SHOW_ROTATION,
    source="slip of the connector and gear ratio; D is left as it is",
    shapes=(
        _MAIN,
        Shape(
            "growing",
            "α = (1 − slip · turns / largest turns) α_motor",
            (_slip(0.0, "share of the turns lost at the largest turn count"),),
            {"motor": _growing},
        ),
        Shape(
            "with_load",
            "α = (1 − slip · F / largest F) α_motor",
            (_slip(0.0, "share of the turns lost at the largest load"),),
            {"motor": _with_load},
            needs=frozenset({"loads"}),
        ),
        Shape(
            "saturating",
            "α = (1 − slip [1 − exp(−turns/w)]) α_motor",
            (
                _slip(0.0, "share of the turns lost in the end"),
                Parameter(
                    "width_turns",
                    "turns",
                    "turns over which slip sets in, as the torque grows",
                    low=0.05,
                    high=0.6,
                    of="span_turns",
                    prior="uniform",
                    starts=(0.4,),
                    null=None,
                ),
            ),
            {"motor": _saturating},
            log_odds=-1.0,
        ),
        varying(_MAIN),
        easing(_MAIN),
    ),
    checks="mark the connector and count its turns on the film",
)
