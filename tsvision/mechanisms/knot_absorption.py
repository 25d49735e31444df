"""Past an onset a share of each turn goes into knots."""

from __future__ import annotations

import numpy as np

from tsvision.mechanisms.drifting import varying
from tsvision.mechanisms.shelf import Mechanism, Parameter, Shape, Values
from tsvision.mechanisms.state import State, softplus
from tsvision.units import RAD_PER_TURN

_SHARE = Parameter(
    "share",
    "1",
    "share of each further turn that knots take up",
    low=0.0,
    high=1.0,
    prior="uniform",
    starts=(0.3, 0.8),
)
_ONSET = Parameter(
    "onset_turns",
    "turns",
    "turns at which the first knot forms",
    low=0.1,
    high=0.97,
    of="span_turns",
    prior="uniform",
    starts=(0.2, 0.4, 0.55, 0.7, 0.85),
    null=None,
)
_WIDTH = Parameter(
    "width_turns",
    "turns",
    "over how many turns the share is reached",
    low=0.005,
    high=0.3,
    of="span_turns",
    prior="uniform",
    starts=(0.2,),
    null=None,
)


def _past(state: State, p: Values) -> np.ndarray:
    return state.alpha_rad - RAD_PER_TURN * p["onset_turns"]


def _kink(state: State, p: Values) -> dict[str, np.ndarray]:
    return {"alpha_rad": state.alpha_rad - p["share"] * np.maximum(_past(state, p), 0.0)}


def _rounded(state: State, p: Values) -> dict[str, np.ndarray]:
    taken = softplus(_past(state, p), RAD_PER_TURN * p["width_turns"])
    return {"alpha_rad": state.alpha_rad - p["share"] * taken}


def _growing(state: State, p: Values) -> dict[str, np.ndarray]:
    """The share itself grows from 0 at the onset: knots come one by one."""
    past = np.maximum(_past(state, p), 0.0)
    width = RAD_PER_TURN * p["width_turns"]
    return {"alpha_rad": state.alpha_rad - p["share"] * (past + width * np.expm1(-past / width))}


_MAIN = Shape("kink", "α = α₀ − q max(α₀ − 2π n₀, 0)", (_SHARE, _ONSET), {"knots": _kink})
MECHANISM = Mechanism(
    name="knot_absorption",
    title="Knots take up turns",
    claim="past an onset knots take up a share of every turn: displacement and angle lag",
    touches=("displacement_mm", "helix_angle_deg", "twist_turns", "torque_Nmm", "pitch_mm"),
    source="the paper's knots from 60 turns on; a turn that makes a knot lays no helix",
    shapes=(
        _MAIN,
        Shape(
            "rounded",
            "the kink rounded over w",
            (_SHARE, _ONSET, _WIDTH),
            {"knots": _rounded},
        ),
        Shape(
            "growing",
            "share q [1 − exp(−(turns − n₀)/w)] past n₀",
            (_SHARE, _ONSET, _WIDTH),
            {"knots": _growing},
        ),
        varying(_MAIN),
    ),
    checks="look for knots on the frames past the onset",
)
