"""The bundle gets thinner as the tension squeezes it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tsvision.mechanisms.drifting import easing, varying
from tsvision.mechanisms.shelf import Effect, Mechanism, Parameter, Shape, Values
from tsvision.mechanisms.state import State, tension_at

ROUNDS = 4  # each round multiplies the error of r by the exponent, some hundredths to 0.3


def _squeezing(factor: Callable[[State, np.ndarray, Values], np.ndarray]) -> Effect:
    """r = r₀ · factor(T), with T from the radius that results (a short fixed-point iteration)."""

    def effect(state: State, p: Values) -> dict[str, np.ndarray]:
        radius = state.radius_mm
        for _ in range(ROUNDS):
            radius = state.radius_mm * factor(state, tension_at(state, radius), p)
        return {"radius_mm": radius}

    return effect


def _power(state: State, tension: np.ndarray, p: Values) -> np.ndarray:
    ratio = np.maximum(tension / state.reference.tension_min_N, 1e-3)
    return ratio ** -p["exponent"]


def _power_from(state: State, tension: np.ndarray, p: Values) -> np.ndarray:
    return np.maximum(tension / p["reference_N"], 1e-3) ** -p["exponent"]


def _linear(state: State, tension: np.ndarray, p: Values) -> np.ndarray:
    return np.maximum(1.0 - p["compliance_1_N"] * tension, 0.05)


def _stiffening(state: State, tension: np.ndarray, p: Values) -> np.ndarray:
    return 1.0 - p["share"] * -np.expm1(-tension / p["tension_N"])


def _yielding(state: State, tension: np.ndarray, p: Values) -> np.ndarray:
    return 1.0 - p["share"] * tension / (tension + p["tension_N"])


def _load_alone(state: State, tension: np.ndarray, p: Values) -> np.ndarray:
    return np.maximum(state.at.tension_N / state.reference.tension_min_N, 1e-3) ** -p["exponent"]


_EXPONENT = Parameter(
    "exponent", "1", "power by which r falls with T", low=0.0, high=0.6, typical=0.08, starts=(0.7,)
)
_COMPLIANCE = Parameter(
    "compliance_1_N",
    "1/N",
    "share of the radius lost per N of tension",
    low=0.0,
    high=0.02,
    typical=2e-3,
    starts=(0.7, 0.2),
)
_SHARE = Parameter(
    "share",
    "1",
    "share of the radius lost in the end",
    low=0.0,
    high=0.8,
    typical=0.15,
    starts=(0.7,),
)
_TENSION = Parameter(
    "tension_N",
    "N",
    "tension over which that happens",
    low=0.3,
    high=6.0,
    of="tension_mean_N",
    prior="log_uniform",
    starts=(0.3, 0.6),
    null=None,
)
_REFERENCE = Parameter(
    "reference_N",
    "N",
    "tension at which the stated diameter holds",
    low=0.1,
    high=3.0,
    of="tension_mean_N",
    prior="log_uniform",
    starts=(0.3, 0.7),
    null=None,
)
_LOAD = frozenset({"load"})
_MAIN = Shape("power", "r = r₀ (T/T_min)^−k", (_EXPONENT,), {"tension": _squeezing(_power)}, _LOAD)
MECHANISM = Mechanism(
    name="radial_compression",
    title="Radial compression",
    claim="the strings' tension squeezes the bundle thinner, more with load and with helix angle",
    touches=("displacement_mm", "diameter_mm", "helix_angle_deg", "torque_Nmm", "pitch_mm"),
    source="T = F/(N cos β); the paper's life-cycle table suggests r falling as a weak power of T",
    shapes=(
        _MAIN,
        Shape(
            "linear",
            "r = r₀ (1 − c T)",
            (_COMPLIANCE,),
            {"tension": _squeezing(_linear)},
            _LOAD,
            log_odds=-3.0,  # fibres pressed together stiffen, and a straight law ends at r = 0
        ),
        Shape(
            "power_from",
            "r = r₀ (T/T_ref)^−k",
            (_EXPONENT, _REFERENCE),
            {"tension": _squeezing(_power_from)},
            _LOAD,
        ),
        Shape(
            "stiffening",
            "r = r₀ [1 − c (1 − exp(−T/T_s))]",
            (_SHARE, _TENSION),
            {"tension": _squeezing(_stiffening)},
            _LOAD,
        ),
        Shape(
            "yielding",
            "r = r₀ [1 − c T/(T + T_s)]",
            (_SHARE, _TENSION),
            {"tension": _squeezing(_yielding)},
            _LOAD,
        ),
        Shape(
            "load_alone",
            "r = r₀ (F/F_min)^−k",
            (_EXPONENT,),
            {"tension": _squeezing(_load_alone)},
            frozenset({"loads"}),
        ),
        varying(_MAIN),
        easing(_MAIN),
    ),
    checks="measure D at the lowest and the highest load, at few and at many turns",
)
