"""Start of overtwist from geometry: when the helix can take no more turns.

The displacement law that fits the paper's actuator is that of ONE helix at the bundle's outer
radius, tan β = π D / p. The rule used here asks when that helix reaches the zero-twist angle of
a rope of N strands (Olsen & Bohr): from there a given length of string holds no further turn,
so the next one has to go elsewhere, into coiling. With p = L / turns:

    onset_turns = L cot(v_N) / (π D),  v_N the zero-twist pitch angle: 39.4° for N = 2, → 45°

No constant is fitted, neither per N nor at all. What the rule does not claim: that the strands
themselves are at the zero-twist angle. Their centre lines lie at a smaller radius, and by the
strict strand geometry (`RULES` has it too) N = 2 would lock at about 31 turns, where the strands'
contact leaves the axis (`models.helix_then_coil`), and hold no further turn at about 36.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import stats

from tsvision.data import table
from tsvision.models.rope_geometry import centre_radius, zero_twist_angle_rad

LEVEL = 0.95


@dataclass(frozen=True)
class PredictedOnset:
    """Turns at which overtwist starts, with an interval at `level`; β there, in rad."""

    turns: float
    low: float
    high: float
    helix_angle_rad: float
    level: float = LEVEL


def zero_twist_outer(strings: int, zone_mm: float, diameter_mm: float, string_mm: float) -> float:
    """The helix of radius D/2 reaches the zero-twist angle (the rule in use)."""
    del string_mm
    return zone_mm / (np.pi * diameter_mm * np.tan(zero_twist_angle_rad(strings)))


def right_angle_outer(strings: int, zone_mm: float, diameter_mm: float, string_mm: float) -> float:
    """The helix of radius D/2 reaches 45°, the limit of many strands."""
    del strings, string_mm
    return zone_mm / (np.pi * diameter_mm)


def contact_leaves_axis(
    strings: int, zone_mm: float, diameter_mm: float, string_mm: float
) -> float:
    """The outermost strands' centre lines, at a = (D - d)/2, reach 45°: p = 2π a."""
    del strings
    return zone_mm / (np.pi * (diameter_mm - string_mm))


def zero_twist_strands(strings: int, zone_mm: float, diameter_mm: float, string_mm: float) -> float:
    """A ring of N strands of diameter d is at its zero-twist pitch (strict strand geometry)."""
    del diameter_mm
    slope = float(np.tan(zero_twist_angle_rad(strings)))
    return zone_mm / (2 * np.pi * centre_radius(slope, strings) * string_mm * slope)


RULES: dict[str, Callable[[int, float, float, float], float]] = {
    "zero_twist_outer": zero_twist_outer,
    "right_angle_outer": right_angle_outer,
    "contact_leaves_axis": contact_leaves_axis,
    "zero_twist_strands": zero_twist_strands,
}


def rule_errors(rule: str) -> dict[int, float]:
    """N -> relative error (predicted / observed - 1) on the paper's four onsets."""
    shape = table("dimensions").set_index("strings")
    string = float(table("diameter").set_index("strings")["diameter_mm"][1])
    return {
        int(line.strings): float(
            RULES[rule](
                int(line.strings),
                float(shape["twisting_zone_mm"][line.strings]),
                float(line.bundle_diameter_mm),
                string,
            )
        )
        / line.onset_turns
        - 1
        for line in table("overtwist").itertuples()
    }


@lru_cache
def scatter(rule: str = "zero_twist_outer") -> tuple[float, float]:
    """Rms of log(predicted / observed) over the paper's systems, and Student's t for it.

    The onsets were read by eye, on whole turns: their own scatter is part of it.
    """
    logs = np.log1p(np.array(list(rule_errors(rule).values())))
    return float(np.sqrt(np.mean(logs**2))), float(stats.t.ppf(0.5 + LEVEL / 2, logs.size))


def predict_onset(
    strings: int, zone_mm: float, diameter_mm: float, diameter_sd_mm: float = 0.0
) -> PredictedOnset:
    """Overtwist onset for N strings in a zone L with bundle diameter D, with its interval.

    The interval holds the rule's own scatter on the paper's four systems and, where given, the
    uncertainty of D. A single string cannot overtwist on another: `strings` >= 2.
    """
    turns = float(zero_twist_outer(strings, zone_mm, diameter_mm, float("nan")))
    rms, factor = scatter()
    spread = float(np.exp(factor * np.hypot(rms, diameter_sd_mm / diameter_mm)))
    angle = np.pi / 2 - zero_twist_angle_rad(strings)
    return PredictedOnset(turns, turns / spread, turns * spread, float(angle))
