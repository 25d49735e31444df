"""The noun between physics and pictures: the actuator at one turn count."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from synth.centre_line import CentreLine
from synth.effects import Effective
from synth.knots import KnotState


@dataclass(frozen=True)
class State:
    """The actuator at one motor turn count; lengths mm, angles rad, `sign` +1 winds Z.

    `peak_turns` is the largest |motor turns| so far.

    `sites_mm` (N, 2) strand centres at the bundle's start; `has_bundle` is False while the
    strands do not touch yet (up to about a quarter turn); `followed` is geometry or law.
    """

    motor_turns: float
    wound_turns: float
    peak_turns: float
    lost_turns: float
    sign: float
    has_bundle: bool
    apex_mm: float
    zone_mm: float
    pitch_mm: float
    coil_radius_mm: float
    leg_turns: float
    sites_mm: np.ndarray
    diameter_mm: float
    line: CentreLine
    knots: tuple[KnotState, ...]
    real: Effective
    followed: str
