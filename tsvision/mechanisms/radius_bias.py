"""The bundle's working radius is not D/2 as assumed."""

from __future__ import annotations

import numpy as np

from tsvision.mechanisms.drifting import easing, varying
from tsvision.mechanisms.shelf import Mechanism, Parameter, Shape, Values
from tsvision.mechanisms.state import State


def _absolute(state: State, p: Values) -> dict[str, np.ndarray]:
    return {"radius_mm": np.maximum(state.radius_mm + p["radius_change_mm"], 1e-4)}


def _relative(state: State, p: Values) -> dict[str, np.ndarray]:
    return {"radius_mm": state.radius_mm * (1.0 + p["radius_change_share"])}


def _settling(state: State, p: Values) -> dict[str, np.ndarray]:
    laid = -np.expm1(-state.at.turns / p["width_turns"])
    return {"radius_mm": np.maximum(state.radius_mm + p["radius_change_mm"] * laid, 1e-4)}


_SETTLING_WIDTH = Parameter(
    "width_turns",
    "turns",
    "turns over which the bundle settles at its own radius",
    low=0.01,
    high=0.2,
    of="span_turns",
    prior="uniform",
    starts=(0.4,),
    null=None,
)
_MAIN = Shape(
    "absolute",
    "r = D/2 + δr",
    (
        Parameter(
            "radius_change_mm",
            "mm",
            "δr, added to D/2",
            low=-0.75,
            high=0.75,
            typical=0.15,
            of="radius_mm",
            starts=(-0.7, 0.7, -3.0),
        ),
    ),
    {"geometry": _absolute},
)
MECHANISM = Mechanism(
    name="radius_bias",
    title="Radius off",
    claim="the strings turn at another radius than half the stated diameter at all turns",
    touches=("displacement_mm", "diameter_mm", "helix_angle_deg", "torque_Nmm", "pitch_mm"),
    source="the paper takes r = D/2; a rod simulation follows the strand centres, r = (D - d)/2",
    shapes=(
        _MAIN,
        Shape(
            "relative",
            "r = (D/2) (1 + δ)",
            (
                Parameter(
                    "radius_change_share",
                    "1",
                    "δ, share of D/2",
                    low=-0.75,
                    high=0.75,
                    typical=0.15,
                    starts=(-0.7, 0.7, -3.0),
                ),
            ),
            {"geometry": _relative},
            needs=frozenset({"bundles"}),
        ),
        Shape(
            "settling",
            "r = D/2 + δr [1 − exp(−turns/w)]",
            (*_MAIN.parameters, _SETTLING_WIDTH),
            {"geometry": _settling},
            log_odds=-1.0,
        ),
        varying(_MAIN),
        easing(_MAIN),
    ),
    checks="measure D beside the separator with a caliper or a calibrated camera",
)
