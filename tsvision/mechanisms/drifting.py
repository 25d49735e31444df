"""Shapes whose size drifts or settles: nature does not share our formulas."""

from __future__ import annotations

import numpy as np

from tsvision.mechanisms.shelf import Effect, Parameter, Shape, Values
from tsvision.mechanisms.state import State

ELASTIC = ("_varying", "_easing")  # how the names of such shapes end


def varying(shape: Shape) -> Shape:
    """`shape` with its size (its first parameter) drifting a little with turns and load.

    Nature does not share our formulas: a cause that is 20 % stronger at one end of the data than
    at the other is still that cause, and must not call for a second one.
    """
    size = shape.parameters[0].name

    def wrapped(effect: Effect) -> Effect:
        def inner(state: State, p: Values) -> dict[str, np.ndarray]:
            turns = 2.0 * state.at.turns / state.reference.span_turns - 1.0
            load = state.at.load_N / state.reference.load_mean_N - 1.0
            drift = p["drift_with_turns"] * turns + p["drift_with_load"] * load
            drift = drift + p["drift_with_both"] * turns * load
            return effect(state, {**p, size: p[size] * (1.0 + drift)})

        return inner

    return Shape(
        f"{shape.name}_varying",
        f"{shape.equation}, its size drifting with turns and load",
        (*shape.parameters, _drift("turns"), _drift("load"), _drift("both")),
        {stage: wrapped(effect) for stage, effect in shape.effects.items()},
        shape.needs | {"loads"},
        shape.log_odds - 1.0,
    )


def easing(shape: Shape) -> Shape:
    """`shape` with its size (its first parameter) settling over the first turns, from less or from
    more: a bundle has to be laid before anything about it is what it will be."""
    size = shape.parameters[0].name

    def wrapped(effect: Effect) -> Effect:
        def inner(state: State, p: Values) -> dict[str, np.ndarray]:
            missing = p["missing_at_first"] * np.exp(-state.at.turns / p["easing_turns"])
            return effect(state, {**p, size: p[size] * (1.0 - missing)})

        return inner

    return Shape(
        f"{shape.name}_easing",
        f"{shape.equation}, its size settling over the first turns",
        (*shape.parameters, *_EASING),
        {stage: wrapped(effect) for stage, effect in shape.effects.items()},
        shape.needs,
        shape.log_odds - 1.0,
    )


_EASING = (
    Parameter(
        "missing_at_first",
        "1",
        "share of the size that is not there at 0 turns (below 0: that is there besides)",
        low=-1.0,
        high=1.0,
        typical=0.4,
        starts=(0.7, -0.7),
        null=None,
    ),
    Parameter(
        "easing_turns",
        "turns",
        "turns over which it settles",
        low=0.02,
        high=0.4,
        of="span_turns",
        prior="uniform",
        starts=(0.25,),
        null=None,
    ),
)


def _drift(what: str) -> Parameter:
    return Parameter(
        f"drift_with_{what}",
        "1",
        f"relative change of the size over the range of {what}"
        + (", turns times load" if what == "both" else ""),
        low=-0.7,
        high=0.7,
        typical=0.2,
        starts=(0.0,),
        null=None,
    )
