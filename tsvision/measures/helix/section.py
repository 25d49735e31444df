"""Where the strands sit in the bundle's cross-section, in units of the strand diameter."""

from __future__ import annotations

import numba
import numpy as np

from tsvision.measures.helix.silhouette import Section

_H = np.sqrt(3.0) / 2.0
# The hexagonal lattice around the midpoint of a core pair, in the order in which it fills.
_PAIR_SITES = np.array(
    [
        (0.5, 0.0), (-0.5, 0.0), (0.0, _H), (0.0, -_H),
        (1.0, _H), (-1.0, -_H), (1.0, -_H), (-1.0, _H),
    ]
)  # fmt: skip

ALONG = 67  # places along the axis where two strands' distance is looked at


def pair_core(count: int) -> Section:
    """The paper's section of 1 to 8 strands; N = 1 is one strand, N = 3 the triangle.

    Odd N of 5 and 7 leave one site of the next pair empty; the outline is then lopsided, and the
    bundle turns about the midpoint of the core pair.
    """
    if count == 1:
        sites = np.zeros((1, 2))
    elif count == 3:
        return ring(3)
    else:
        sites = _PAIR_SITES[:count]
    radius = np.hypot(sites[:, 0], sites[:, 1])
    angle = np.arctan2(sites[:, 1], sites[:, 0])
    return Section("pair_core", radius, angle)


def room_needed(section: Section, twist_rad_per_d: float) -> float:
    """Share by which the section has to open so that strands laid as helices, so many rad a strand
    diameter, find room beside each other; 0 where they touch as they lie.

    Two helices that are z apart along the axis lie g^2 c(z) + z^2 apart, squared, where the section
    is g times as large: none may come nearer than d.
    """
    return float(_room_needed(section.radius_d, section.angle_rad, twist_rad_per_d))


@numba.njit(cache=True)
def _room_needed(radius, angle, twist):  # pragma: no cover - compiled
    most = 1.0
    for i in range(radius.size):
        for j in range(i):
            for z in np.linspace(-0.99, 0.99, ALONG):
                beside = radius[i] ** 2 + radius[j] ** 2
                beside -= 2.0 * radius[i] * radius[j] * np.cos(angle[i] - angle[j] + twist * z)
                most = max(most, (1.0 - z * z) / max(beside, 1e-9))
    return np.sqrt(most) - 1.0


def ring(count: int) -> Section:
    """N strands in one ring, each touching its neighbours."""
    if count == 1:
        return Section("ring", np.zeros(1), np.zeros(1))
    radius = np.full(count, 0.5 / np.sin(np.pi / count))
    return Section("ring", radius, 2.0 * np.pi * np.arange(count) / count)
