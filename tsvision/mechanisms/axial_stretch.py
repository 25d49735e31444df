"""Strings stretch along themselves under their tension."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tsvision.mechanisms.drifting import easing, varying
from tsvision.mechanisms.shelf import Effect, Mechanism, Parameter, Shape, Values
from tsvision.mechanisms.state import State, tension_at

_COMPLIANCE = Parameter(
    "compliance_1_N",
    "1/N",
    "1/EA of one string",
    low=0.0,
    high=0.02,
    typical=5e-4,  # fibres break at 3 to 4 % strain, some hundred N
    starts=(0.7, 3.0),
)
_TAIL = Parameter(
    "tail_mm_per_N",
    "mm/N",
    "length of one string outside the zone over EA, and what the frame gives way",
    low=0.0,
    high=1.0,
    typical=0.03,  # 60 mm of string at the compliance that is typical above
    starts=(0.7, 3.0),
)
_EXPONENT = Parameter(
    "exponent",
    "1",
    "power of the tension",
    low=0.3,
    high=2.0,
    prior="uniform",
    starts=(0.2,),
    null=None,
)


def _stretching(strain: Callable[[State, np.ndarray, Values], np.ndarray]) -> Effect:
    """Length of string in the zone, X = L + x, grows by `strain`; so much less is drawn in."""

    def effect(state: State, p: Values) -> dict[str, np.ndarray]:
        tension = tension_at(state, state.radius_mm)
        length = state.zone_mm + state.displacement_mm
        return {"displacement_mm": state.displacement_mm - length * strain(state, tension, p)}

    return effect


def _beyond_untwisted(state: State, p: Values) -> dict[str, np.ndarray]:
    tension = tension_at(state, state.radius_mm)
    length = state.zone_mm + state.displacement_mm
    start = np.hypot(state.zone_mm, state.hole_mm / 2) * state.at.tension_N
    change = p["compliance_1_N"] * (length * tension - start)
    return {"displacement_mm": state.displacement_mm - change}


def _outside(state: State, p: Values) -> dict[str, np.ndarray]:
    """Beyond the zone the string is straight, as long at any turns, under F/N."""
    lost = p["tail_mm_per_N"] * state.at.tension_N
    return {"displacement_mm": state.displacement_mm - lost}


def _power(state: State, tension: np.ndarray, p: Values) -> np.ndarray:
    typical = state.reference.tension_mean_N
    return p["compliance_1_N"] * typical * (tension / typical) ** p["exponent"]


_LOAD = frozenset({"load"})
_SEVERAL = frozenset({"load", "loads"})  # under one load it is but another zero
_MAIN = Shape(
    "hooke",
    "x = x₀ − (L + x₀) T/EA",
    (_COMPLIANCE,),
    {"draw": _stretching(lambda state, tension, p: p["compliance_1_N"] * tension)},
    _LOAD,
)
MECHANISM = Mechanism(
    name="axial_stretch",
    title="Axial stretch",
    claim="the strings stretch along themselves: less is drawn in as load and helix angle grow",
    touches=("displacement_mm",),
    source="Hooke: strain = T/EA with T = F/(N cos β)",
    shapes=(
        _MAIN,
        Shape(
            "from_zero",
            "x = x₀ − [(L + x₀) T − X(0) F/N]/EA: displacement is zeroed under load",
            (_COMPLIANCE,),
            {"draw": _beyond_untwisted},
            _LOAD,
        ),
        Shape(
            "load_alone",
            "x = x₀ − (L + x₀) (F/N)/EA",
            (_COMPLIANCE,),
            {
                "draw": _stretching(
                    lambda state, tension, p: p["compliance_1_N"] * state.at.tension_N
                )
            },
            _LOAD,
        ),
        Shape(
            "power",
            "strain = c T₀ (T/T₀)^q",
            (_COMPLIANCE, _EXPONENT),
            {"draw": _stretching(_power)},
            _LOAD,
        ),
        Shape(
            "tail",
            "x = x₀ − (L_tail/EA) F/N: the string outside the zone, or the frame",
            (_TAIL,),
            {"draw": _outside},
            _SEVERAL,
        ),
        varying(_MAIN),
        easing(_MAIN),
    ),
    checks="hang another load on the untwisted strings and read the displacement",
)
