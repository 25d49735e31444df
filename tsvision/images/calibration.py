"""What a calibration gives, and the plainest one: two points and the length between them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from tsvision.errors import InputError

NAN = float("nan")


@dataclass(frozen=True)
class Calibration:
    """A scale with its standard uncertainty, and where that comes from.

    `parts` holds each source's standard uncertainty of mm_per_px (mm/px); their squares add up.
    `lens` is fx, fy, cx, cy, k1, k2, p1, p2, k3, or empty. `found` holds what else was measured,
    its unit in each name. `notes` are for people.
    """

    mm_per_px: float
    parts: Mapping[str, float]
    source: str
    lens: tuple[float, ...] = ()
    found: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def mm_per_px_sd(self) -> float:
        """All parts together; they are independent."""
        return math.sqrt(sum(part * part for part in self.parts.values()))


def from_points(
    first_px: tuple[float, float],
    second_px: tuple[float, float],
    length_mm: float,
    length_mm_sd: float = 0.0,
    point_sd_px: float = 0.5,
) -> Calibration:
    """Scale from two points and the length between them; each point is known to `point_sd_px`
    along the line. Raises InputError when they coincide."""
    distance_px = math.dist(first_px, second_px)
    if not distance_px > 0 or not length_mm > 0:
        raise InputError("two points and a length: the points must differ and the length be > 0")
    scale = length_mm / distance_px
    parts = {
        "points": scale * math.sqrt(2.0) * point_sd_px / distance_px,
        "length": scale * length_mm_sd / length_mm,
    }
    return Calibration(scale, parts, "length", found={"distance_px": distance_px})


def moved_in_depth(
    calibration: Calibration, nearer_mm: float, nearer_mm_sd: float, distance_mm: float
) -> Calibration:
    """The scale in a plane that lies `nearer_mm` closer to the camera than the calibrated one.

    `distance_mm` is camera (entrance pupil) to calibrated plane; a depth error dz changes the
    scale by dz / distance (pinhole). Raises InputError on impossible depths.
    """
    if nearer_mm == 0 and nearer_mm_sd == 0:
        return calibration
    if not math.isfinite(distance_mm):
        raise InputError("a depth between board and bundle needs the camera's distance; give it")
    if not distance_mm > max(0.0, nearer_mm):
        raise InputError(
            f"camera distance {distance_mm:g} mm: must be greater than 0 and than the depth between"
        )
    factor = (distance_mm - nearer_mm) / distance_mm
    scale = calibration.mm_per_px * factor
    parts = {name: part * factor for name, part in calibration.parts.items()}
    parts["depth"] = calibration.mm_per_px * nearer_mm_sd / distance_mm
    return replace(calibration, mm_per_px=scale, parts=parts)
