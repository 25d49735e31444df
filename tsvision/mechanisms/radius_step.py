"""Past an onset the bundle's radius jumps (a second layer, a flip of the section)."""

from __future__ import annotations

import numpy as np

from tsvision.mechanisms.drifting import varying
from tsvision.mechanisms.shelf import Mechanism, Parameter, Shape, Values
from tsvision.mechanisms.state import State, bounded

_SIZE = Parameter(
    "step_mm",
    "mm",
    "change of the radius",
    low=-0.6,
    high=1.0,
    typical=0.12,
    of="radius_mm",
    starts=(0.7, -0.7),
)
_ONSET = Parameter(
    "onset_turns",
    "turns",
    "turns at which it sets in",
    low=0.08,
    high=0.97,
    of="span_turns",
    prior="uniform",
    starts=(0.15, 0.3, 0.45, 0.6, 0.75, 0.9),
    null=None,
)
_WIDTH = Parameter(
    "width_turns",
    "turns",
    "over how many turns it grows",
    low=0.005,
    high=0.3,
    of="span_turns",
    prior="uniform",
    starts=(0.3,),
    null=None,
)


def _grown(state: State, p: Values, share: np.ndarray) -> dict[str, np.ndarray]:
    return {"radius_mm": np.maximum(state.radius_mm + p["step_mm"] * share, 1e-4)}


def _sharp(state: State, p: Values) -> dict[str, np.ndarray]:
    """From one turn level to the next: finer than that the data cannot tell."""
    past = (state.at.turns - p["onset_turns"]) / state.reference.gap_turns
    return _grown(state, p, bounded(past, 0.0, 1.0))


def _sigmoid(state: State, p: Values) -> dict[str, np.ndarray]:
    steps = bounded((state.at.turns - p["onset_turns"]) / p["width_turns"], -40.0, 40.0)
    return _grown(state, p, 1.0 / (1.0 + np.exp(-steps)))


def _ramp(state: State, p: Values) -> dict[str, np.ndarray]:
    return _grown(
        state, p, bounded((state.at.turns - p["onset_turns"]) / p["width_turns"], 0.0, 1.0)
    )


def _settling(state: State, p: Values) -> dict[str, np.ndarray]:
    past = np.maximum(state.at.turns - p["onset_turns"], 0.0)
    return _grown(state, p, -np.expm1(-past / p["width_turns"]))


_MAIN = Shape("sharp", "r = r₀ + δ for turns > n₀", (_SIZE, _ONSET), {"geometry": _sharp})
MECHANISM = Mechanism(
    name="radius_step",
    title="Step of the radius",
    claim="past an onset the bundle is thicker (or thinner): a layer forms, the section flips",
    touches=("displacement_mm", "diameter_mm", "helix_angle_deg", "torque_Nmm", "pitch_mm"),
    source="change of packing of the section; overtwisted bundles thicken in mid-span",
    shapes=(
        _MAIN,
        Shape(
            "sigmoid",
            "r = r₀ + δ/(1 + exp(−(turns − n₀)/w))",
            (_SIZE, _ONSET, _WIDTH),
            {"geometry": _sigmoid},
        ),
        Shape(
            "ramp", "r rises by δ from n₀ to n₀ + w", (_SIZE, _ONSET, _WIDTH), {"geometry": _ramp}
        ),
        Shape(
            "settling",
            "r = r₀ + δ [1 − exp(−(turns − n₀)/w)] past n₀",
            (_SIZE, _ONSET, _WIDTH),
            {"geometry": _settling},
        ),
        varying(_MAIN),
    ),
    checks="look at D on the frames before and after the onset",
)
