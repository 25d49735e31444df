"""Strings lengthen with time under load."""

from __future__ import annotations

import numpy as np

from tsvision.mechanisms.drifting import varying
from tsvision.mechanisms.shelf import Mechanism, Parameter, Shape, Values
from tsvision.mechanisms.state import State

_RATE = Parameter(
    "creep_mm_per_decade",
    "mm",
    "length gained per decade of time at the data's mean load",
    low=0.0,
    high=10.0,
    typical=0.4,
    starts=(0.7,),
)
_START = Parameter(
    "start_s",
    "s",
    "time from which decades count",
    low=0.1,
    high=1000.0,
    prior="log_uniform",
    starts=(0.3, 0.7),
    null=None,
)


def _share_of_load(state: State) -> np.ndarray:
    return state.at.load_N / state.reference.load_mean_N


def _elapsed(state: State) -> np.ndarray:
    return np.maximum(state.at.time_s, 0.0)


def _decades(state: State, p: Values) -> dict[str, np.ndarray]:
    lost = p["creep_mm_per_decade"] * _share_of_load(state) * np.log10(1.0 + _elapsed(state))
    return {"displacement_mm": state.displacement_mm - lost}


def _decades_from(state: State, p: Values) -> dict[str, np.ndarray]:
    grown = np.log10(1.0 + _elapsed(state) / p["start_s"])
    lost = p["creep_mm_per_decade"] * _share_of_load(state) * grown
    return {"displacement_mm": state.displacement_mm - lost}


def _without_load(state: State, p: Values) -> dict[str, np.ndarray]:
    lost = p["creep_mm_per_decade"] * np.log10(1.0 + _elapsed(state))
    return {"displacement_mm": state.displacement_mm - lost}


def _power(state: State, p: Values) -> dict[str, np.ndarray]:
    grown = (_elapsed(state) / state.reference.span_s) ** p["exponent"]
    return {
        "displacement_mm": state.displacement_mm - p["creep_mm"] * _share_of_load(state) * grown
    }


_END = Parameter(
    "creep_mm",
    "mm",
    "length gained by the end of the longest run at the data's mean load",
    low=0.0,
    high=20.0,
    typical=1.0,
    starts=(0.7,),
)
_EXPONENT = Parameter(
    "exponent",
    "1",
    "power of time",
    low=0.15,
    high=1.0,
    prior="uniform",
    starts=(0.2, 0.7),
    null=None,
)
_BOTH = frozenset({"load", "time"})
_MAIN = Shape(
    "decades",
    "x = x₀ − c (F/F_mean) log₁₀(1 + t/1 s)",
    (_RATE,),
    {"draw": _decades},
    _BOTH,
)
MECHANISM = Mechanism(
    name="creep",
    title="Creep",
    claim="the strings lengthen with time under load, so that later readings fall short",
    touches=("displacement_mm",),
    source="logarithmic creep of polyethylene fibre: so many mm a decade of time, with the load",
    shapes=(
        _MAIN,
        Shape(
            "decades_from",
            "x = x₀ − c (F/F_mean) log₁₀(1 + t/t₀)",
            (_RATE, _START),
            {"draw": _decades_from},
            _BOTH,
        ),
        Shape(
            "without_load",
            "x = x₀ − c log₁₀(1 + t/1 s)",
            (_RATE,),
            {"draw": _without_load},
            frozenset({"time"}),
        ),
        Shape(
            "power",
            "x = x₀ − c (F/F_mean) (t/t_end)^q",
            (_END, _EXPONENT),
            {"draw": _power},
            _BOTH,
        ),
        varying(_MAIN),
    ),
    checks="hold the motor still under load and watch the displacement",
)
