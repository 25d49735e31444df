"""On the way back the bundle lags behind the motor."""

from __future__ import annotations

import numpy as np

from tsvision.mechanisms.drifting import varying
from tsvision.mechanisms.shelf import SHOW_ROTATION, Mechanism, Parameter, Shape, Values
from tsvision.mechanisms.state import State
from tsvision.units import RAD_PER_TURN

_PLAY = Parameter(
    "backlash_turns",
    "turns",
    "turns of play when the motor reverses",
    low=0.0,
    high=8.0,
    typical=0.8,
    starts=(0.7,),
)
_WIDTH = Parameter(
    "width_turns",
    "turns",
    "turns after the reversal over which the play is taken up",
    low=0.01,
    high=0.5,
    of="span_turns",
    prior="uniform",
    starts=(0.2,),
    null=None,
)


def _kept(state: State, p: Values) -> dict[str, np.ndarray]:
    """The bundle cannot be wound further than the motor went: the play is taken up first."""
    lag = np.minimum(p["backlash_turns"], state.at.peak_turns - state.at.turns)
    return {"alpha_rad": state.alpha_rad + RAD_PER_TURN * np.where(state.at.unwinding, lag, 0.0)}


def _constant(state: State, p: Values) -> dict[str, np.ndarray]:
    lag = np.where(state.at.unwinding, RAD_PER_TURN * p["backlash_turns"], 0.0)
    return {"alpha_rad": state.alpha_rad + lag}


def _gradual(state: State, p: Values) -> dict[str, np.ndarray]:
    back = (state.at.peak_turns - state.at.turns) / p["width_turns"]
    lag = RAD_PER_TURN * p["backlash_turns"] * -np.expm1(-back)
    return {"alpha_rad": state.alpha_rad + np.where(state.at.unwinding, lag, 0.0)}


def _closing(state: State, p: Values) -> dict[str, np.ndarray]:
    """Friction along the bundle: the lag is a share of the turns still laid, and ends with them."""
    share = state.at.turns / np.maximum(state.at.peak_turns, 1e-9)
    lag = RAD_PER_TURN * p["backlash_turns"] * 4.0 * share * (1.0 - share)
    return {"alpha_rad": state.alpha_rad + np.where(state.at.unwinding, lag, 0.0)}


_BACK = frozenset({"unwinding"})
_MAIN = Shape(
    "kept", "α = α_motor + min(2π b, α_peak − α_motor)", (_PLAY,), {"motor": _kept}, _BACK
)
MECHANISM = Mechanism(
    name="backlash",
    title="Backlash",
    claim="when the motor reverses, the bundle follows late: unwinding lies above winding",
    touches=SHOW_ROTATION,
    source="play of gears and coupling, friction between the strands",
    shapes=(
        _MAIN,
        Shape("constant", "α = α_motor + 2π b", (_PLAY,), {"motor": _constant}, _BACK),
        Shape(
            "gradual",
            "α = α_motor + 2π b [1 − exp(−(turns since reversal)/w)]",
            (_PLAY, _WIDTH),
            {"motor": _gradual},
            _BACK,
        ),
        Shape(
            "closing",
            "α = α_motor + 2π b · 4 s (1 − s), s = turns / peak turns",
            (_PLAY,),
            {"motor": _closing},
            _BACK,
        ),
        varying(_MAIN),
    ),
    checks="film the connector and the strands at the reversal",
)
