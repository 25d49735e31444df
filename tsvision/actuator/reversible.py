"""The largest contraction that still unwinds: how much string the zone holds without a knot.

Past the onset string is stored by coiling. The zone holds most when it is coiled evenly from
end to end; a coil wider than the separator's hole cannot pass on the way back. So:

    x_max = L (c(R) / cos β_N - 1)

with 1/cos β_N the string per length of locked bundle (β_N as in `onset`), c(R) = √(P² + (2πR)²)/P
the bundle per length of zone in a coil of radius R at its smallest pitch P(R), and R = (h - D)/2
for a hole of diameter h. Where the hole is unknown, or wider than 2 D, R = D/2: the coil that
closes on its own axis, two bundles wide; anything wider is a knot of several loops.

How good: on the paper's four largest contractions (its holes are not published) 4 to 17 % too
little at N = 4, 6, 8 and 57 % too much at N = 2, whose coils grow uneven long before they fill
the zone; as a share of the string's length all four lie within 8 points.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from tsvision.data import table
from tsvision.models.constant_radius import turns_for_displacement
from tsvision.models.rope_geometry import coil_pitch, zero_twist_angle_rad

WIDEST_COIL = 0.5  # coil radius in units of D: envelope 2 D


@dataclass(frozen=True)
class ReversibleLimit:
    """Largest reversible contraction by geometry with its interval (95 %, from the paper's four
    systems), the turns at which the base law reaches it, the envelope of the coils there, and
    whether the hole or the coil itself sets the limit."""

    displacement_mm: float
    low_mm: float
    high_mm: float
    turns: float
    envelope_mm: float
    limited_by: str  # hole | coil


def coil_ratio(radius: ArrayLike) -> np.ndarray:
    """Bundle length per zone length of the densest even coil of radius R (in units of D)."""
    wide = np.maximum(np.asarray(radius, dtype=float), 0.0)
    pitch = np.where(wide > 0, coil_pitch(wide), 1.0)
    return np.hypot(pitch, 2 * np.pi * wide) / pitch


def reversible_limit(
    strings: int,
    zone_mm: float,
    diameter_mm: float,
    hole_distance_mm: float = 0.0,
    hole_diameter_mm: float = math.nan,
) -> ReversibleLimit:
    """Largest contraction that unwinds by itself, mm, for a hole of the given diameter.

    A hole narrower than the bundle passes no coil at all (R = 0).
    """
    radius, narrow = _coil_radius(diameter_mm, hole_diameter_mm)
    x = _stored_mm(strings, zone_mm, radius)
    spread = scatter_factor()
    turns = turns_for_displacement(
        x,
        twisting_zone_mm=zone_mm,
        hole_distance_mm=hole_distance_mm,
        radius_mm=diameter_mm / 2,
    )
    return ReversibleLimit(
        displacement_mm=x,
        low_mm=(zone_mm + x) / spread - zone_mm,
        high_mm=(zone_mm + x) * spread - zone_mm,
        turns=float(turns),
        envelope_mm=diameter_mm * (1 + 2 * radius),
        limited_by="hole" if narrow else "coil",
    )


def _coil_radius(diameter_mm: float, hole_diameter_mm: float) -> tuple[float, bool]:
    by_hole = (hole_diameter_mm - diameter_mm) / 2 / diameter_mm
    narrow = by_hole < WIDEST_COIL  # False when the hole is unknown
    return (max(by_hole, 0.0) if narrow else WIDEST_COIL), narrow


def _stored_mm(strings: int, zone_mm: float, radius: float) -> float:
    locked = 1 / math.sin(zero_twist_angle_rad(strings))
    # c(R) first rises; a wider hole never allows less than a narrower one.
    ratio = float(coil_ratio(np.linspace(0.0, radius, 51)).max())
    return zone_mm * (locked * ratio - 1)


@lru_cache
def scatter_factor() -> float:
    """Factor on the string length L + x that spans 95 %, from the paper's four systems."""
    zone = table("contraction").set_index("strings")["twisting_zone_mm"]
    logs = [
        math.log((zone[n] + predicted) / (zone[n] + published))
        for n, (predicted, published) in limit_errors().items()
    ]
    return math.exp(float(stats.t.ppf(0.975, len(logs)) * np.sqrt(np.mean(np.square(logs)))))


def limit_errors() -> dict[int, tuple[float, float]]:
    """N -> (predicted, published) largest contraction, mm, on the paper's four systems."""
    return {
        int(line.strings): (
            _stored_mm(int(line.strings), float(line.twisting_zone_mm), WIDEST_COIL),
            float(line.contraction_mm),
        )
        for line in table("contraction").itertuples()
    }
