"""Past an onset the bundle coils: each further turn draws a constant length."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tsvision.mechanisms.shelf import Effect, Mechanism, Parameter, Shape, Values
from tsvision.mechanisms.state import State, softplus
from tsvision.units import RAD_PER_TURN

_ONSET = Parameter(
    "onset_turns",
    "turns",
    "turns of the bundle at which coiling sets in (at the lowest load)",
    low=0.05,
    high=0.97,
    of="span_turns",
    prior="uniform",
    starts=(0.15, 0.3, 0.45, 0.6, 0.75, 0.9),
    null=None,
)
_LENGTH = Parameter(
    "length_per_turn_mm",
    "mm",
    "length that each turn past the onset draws",
    low=0.05,
    high=9.0,
    of="radius_mm",
    prior="uniform",
    starts=(0.3, 0.6),
    null=None,
)
_WITH_LOAD = Parameter(
    "onset_load_exponent",
    "1",
    "power by which the onset moves with the load",
    low=-0.5,
    high=1.5,
    typical=0.5,
    starts=(0.0, 0.8),
    null=None,
)
_SLOPE = Parameter(
    "slope_ratio",
    "1",
    "slope past the onset over the slope at the onset",
    low=0.3,
    high=2.5,
    prior="uniform",
    starts=(0.3,),
    null=None,
)
_JUMP = Parameter(
    "jump_mm",
    "mm",
    "length that the first coil draws at once",
    low=0.0,
    high=6.0,
    of="radius_mm",
    prior="uniform",
    starts=(0.3,),
    null=None,
)
_WIDTH = Parameter(
    "width_turns",
    "turns",
    "over how many turns coiling takes over",
    low=0.005,
    high=0.25,
    of="span_turns",
    prior="uniform",
    starts=(0.2,),
    null=None,
)
Onset = Callable[[State, Values], np.ndarray]


def _common(state: State, p: Values) -> np.ndarray:
    return p["onset_turns"]


def _by_load(state: State, p: Values) -> np.ndarray:
    ratio = state.at.load_N / state.reference.load_min_N
    return p["onset_turns"] * ratio ** p["onset_load_exponent"]


def _freeze(onset: Onset) -> Effect:
    """The strands' own helix stays as it was at the onset; the rest of the turns go to coils."""

    def effect(state: State, p: Values) -> dict[str, np.ndarray]:
        past = state.alpha_rad - RAD_PER_TURN * onset(state, p)
        if "width_turns" in p:
            taken = np.minimum(softplus(past, RAD_PER_TURN * p["width_turns"]), state.alpha_rad)
        else:
            taken = np.maximum(past, 0.0)
        return {"alpha_rad": state.alpha_rad - taken, "coiled_rad": taken}

    return effect


def _draw(state: State, p: Values) -> dict[str, np.ndarray]:
    drawn = p["length_per_turn_mm"] * state.coiled_rad / RAD_PER_TURN
    return {"displacement_mm": state.displacement_mm + drawn}


def _draw_with_jump(state: State, p: Values) -> dict[str, np.ndarray]:
    """Straight helix and coils are stable side by side: the first coil snaps in, from one turn
    level to the next."""
    turns = state.coiled_rad / RAD_PER_TURN
    drawn = p["length_per_turn_mm"] * turns
    drawn = drawn + p["jump_mm"] * np.minimum(turns / state.reference.gap_turns, 1.0)
    return {"displacement_mm": state.displacement_mm + drawn}


def _draw_with_rounded_jump(state: State, p: Values) -> dict[str, np.ndarray]:
    """A supple string's first coil grows over some turns; what it draws follows the share of each
    turn that coils take."""
    turns = state.coiled_rad / RAD_PER_TURN
    share = -np.expm1(-turns / p["width_turns"])  # the softplus's own slope
    drawn = p["length_per_turn_mm"] * turns + p["jump_mm"] * share
    return {"displacement_mm": state.displacement_mm + drawn}


def _slope_mm_per_turn(state: State) -> np.ndarray:
    """The slope of the frozen helix: dx/dturns = 2π r (S/2 + α r)/(L + x)."""
    across = state.hole_mm / 2 + state.alpha_rad * state.radius_mm
    return RAD_PER_TURN * state.radius_mm * across / np.hypot(state.zone_mm, across)


def _locked(state: State, p: Values) -> dict[str, np.ndarray]:
    drawn = _slope_mm_per_turn(state) * state.coiled_rad / RAD_PER_TURN
    return {"displacement_mm": state.displacement_mm + drawn}


def _draw_share(state: State, p: Values) -> dict[str, np.ndarray]:
    drawn = p["slope_ratio"] * _slope_mm_per_turn(state) * state.coiled_rad / RAD_PER_TURN
    return {"displacement_mm": state.displacement_mm + drawn}


MECHANISM = Mechanism(
    name="coiling",
    title="Coiling",
    claim="past an onset the bundle coils: each turn draws a constant length, torque stays flat",
    touches=("displacement_mm", "helix_angle_deg", "twist_turns", "torque_Nmm", "pitch_mm"),
    source="rod simulation of two strands; the paper's almost linear contraction past 20 turns",
    shapes=(
        Shape(
            "common_onset",
            "x = x(n₀) + c (turns − n₀) past n₀",
            (_ONSET, _LENGTH),
            {"coils": _freeze(_common), "draw": _draw},
        ),
        Shape(
            "locked_slope",
            "x = x(n₀) + x'(n₀) (turns − n₀) past n₀",
            (_ONSET,),
            {"coils": _freeze(_common), "draw": _locked},
        ),
        Shape(
            "onset_by_load",
            "x = x(n₀) + c (turns − n₀) past n₀ = n (F/F_min)^q",
            (_ONSET, _LENGTH, _WITH_LOAD),
            {"coils": _freeze(_by_load), "draw": _draw},
            frozenset({"loads"}),
        ),
        Shape(
            "slope_by_load",
            "x = x(n₀) + c x'(n₀) (turns − n₀) past n₀ = n (F/F_min)^q",
            (_ONSET, _SLOPE, _WITH_LOAD),
            {"coils": _freeze(_by_load), "draw": _draw_share},
            frozenset({"loads"}),
        ),
        Shape(
            "snap_by_load",
            "x = x(n₀) + δ + c (turns − n₀) past n₀ = n (F/F_min)^q",
            (_ONSET, _LENGTH, _WITH_LOAD, _JUMP),
            {"coils": _freeze(_by_load), "draw": _draw_with_jump},
            frozenset({"loads"}),
            log_odds=-1.0,
            jumps=True,
        ),
        Shape(
            "snap",
            "x = x(n₀) + δ + c (turns − n₀) past n₀",
            (_ONSET, _LENGTH, _JUMP),
            {"coils": _freeze(_common), "draw": _draw_with_jump},
            log_odds=-1.0,
            jumps=True,
        ),
        Shape(
            "rounded",
            "the straight line, rounded in over w",
            (_ONSET, _LENGTH, _WIDTH),
            {"coils": _freeze(_common), "draw": _draw},
        ),
        Shape(
            "rounded_snap",
            "the first coil's length δ and the straight line, both rounded in over w",
            (_ONSET, _LENGTH, _WIDTH, _JUMP),
            {"coils": _freeze(_common), "draw": _draw_with_rounded_jump},
        ),
    ),
    checks="look for coils on the frames past the onset; the torque is flat there",
)
