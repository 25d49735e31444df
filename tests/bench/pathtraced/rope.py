"""The actuator's strings in 3-D: a pair-core section carried along a coiling centre line.

Frame: x from the separator's face (0) to the connector's face (L), y through the two holes,
z to the camera; mm, rad. Right-handed ("Z") is `hand = +1`.

1. The bundle's centre line is a coil of radius R(x) about the x axis; knots are bumps of R and of
   the coil's rate. R vanishes at both ends, so the tangent there is the axis.
2. Strands turn uniformly about the centre line, measured against its parallel-transport frame;
   the rate follows from linking number = twist + writhe (Călugăreanu–White–Fuller).
3. Each leg is the straight tangent of its half-section's centroid at the apex, which fixes the
   apex: S/2 = c Ω x_a. The legs hold a quarter turn.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numba import njit

ROOT3 = np.sqrt(3.0)
PAIR_CORE = np.array(
    [(1, 0), (-1, 0), (0, ROOT3), (0, -ROOT3), (2, ROOT3), (-2, -ROOT3), (2, -ROOT3), (-2, ROOT3)]
)  # in units of d / 2


@dataclass(frozen=True)
class Knot:
    """A stretch of tight coiling: full radius over `length_mm`, sides of half that length."""

    centre_mm: float
    radius_mm: float
    length_mm: float
    coil_pitch_mm: float
    nucleated_at_turn: float


@dataclass(frozen=True)
class State:
    """The actuator at one turn count. `unevenness` modulates the coil radius along the zone."""

    count: int
    hand: int
    turns: float
    strand_d_mm: float = 0.24
    zone_mm: float = 23.2
    hole_gap_mm: float = 5.0
    spacing: float = 1.0  # lattice spacing over d: loose packing or swelling by the lay
    coil_radius_mm: float = 0.0
    coil_pitch_mm: float = 1.3
    coil_phase: float = 0.0
    unevenness: float = 0.0
    knots: tuple[Knot, ...] = ()

    @property
    def section_mm(self) -> np.ndarray:
        """(N, 2) strand centres about the bundle's centre."""
        return PAIR_CORE[: self.count] * self.strand_d_mm / 2 * self.spacing

    @property
    def diameter_mm(self) -> float:
        """D about the bundle's own centre line."""
        return float(2 * np.hypot(*self.section_mm.T).max() + self.strand_d_mm)


@dataclass(frozen=True)
class Rope:
    """`strands`: N arrays (M, 3); `centre` (K, 3) from apex to connector with arc length `s`,
    coil radius `radius` and tangent `tangent` at the same points."""

    state: State
    strands: list[np.ndarray]
    apex_mm: float
    rate: float = 0.0  # Ω, rad per mm of arc, unsigned
    writhe: float = 0.0
    first_angle: float = 0.0
    centre: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    tangent: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    s: np.ndarray = field(default_factory=lambda: np.zeros(0))
    radius: np.ndarray = field(default_factory=lambda: np.zeros(0))


def smooth(u: np.ndarray) -> np.ndarray:
    """Quintic step from 0 to 1, two derivatives continuous."""
    u = np.clip(u, 0, 1)
    return u**3 * (u * (6 * u - 15) + 10)


def coil_radius(state: State, x: np.ndarray, apex: float) -> np.ndarray:
    """R(x): taper at both ends, slow modulation, knots on top."""
    taper_mm = 2.4 * state.diameter_mm
    ends = smooth((x - apex) / taper_mm) * smooth((state.zone_mm - x) / taper_mm)
    wave = 1 + state.unevenness * np.sin(2 * np.pi * x / 7.3 + 1.7 * state.coil_phase)
    radius = state.coil_radius_mm * wave
    for knot in state.knots:
        radius = radius + weight(knot, x) * (knot.radius_mm - radius)
    return radius * ends


def weight(knot: Knot, x: np.ndarray) -> np.ndarray:
    side = knot.length_mm / 2
    return smooth((side + knot.length_mm / 2 - np.abs(x - knot.centre_mm)) / side)


def centre_line(state: State, apex: float, step_mm: float = 0.004) -> tuple[np.ndarray, np.ndarray]:
    """(K, 3) points and (K,) coil radius."""
    x = np.linspace(apex, state.zone_mm, int((state.zone_mm - apex) / step_mm) + 8)
    rate = np.full_like(x, 2 * np.pi / state.coil_pitch_mm)
    for knot in state.knots:
        rate += weight(knot, x) * (2 * np.pi / knot.coil_pitch_mm - rate)
    steps = (rate[1:] + rate[:-1]) / 2 * np.diff(x)
    angle = state.coil_phase + state.hand * np.concatenate([[0], np.cumsum(steps)])
    radius = coil_radius(state, x, apex)
    return np.column_stack([x, radius * np.cos(angle), radius * np.sin(angle)]), radius


def arc_length(points: np.ndarray) -> np.ndarray:
    return np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def tangents(points: np.ndarray) -> np.ndarray:
    t = np.gradient(points, axis=0)
    return t / np.linalg.norm(t, axis=1, keepdims=True)


def writhe_fuller(tangent: np.ndarray) -> float:
    """Writhe against the straight x axis: signed area on the tangent sphere over 2π."""
    mid = (tangent[1:] + tangent[:-1]) / 2
    step = np.diff(tangent, axis=0)
    cross = mid[:, 1] * step[:, 2] - mid[:, 2] * step[:, 1]  # x̂ · (t × dt)
    return float((cross / (1 + mid[:, 0])).sum() / (2 * np.pi))


@njit(cache=True)
def parallel_frame(points, tangent, first):  # type: ignore[no-untyped-def]
    """Rotation-minimising normals (M, 3) by double reflection (Wang et al. 2008)."""
    out = np.empty_like(points)
    out[0] = first
    for i in range(len(points) - 1):
        v = points[i + 1] - points[i]
        c = (v * v).sum()
        left = out[i] - 2 / c * (v * out[i]).sum() * v
        turned = tangent[i] - 2 / c * (v * tangent[i]).sum() * v
        w = tangent[i + 1] - turned
        ww = (w * w).sum()
        out[i + 1] = left if ww < 1e-30 else left - 2 / ww * (w * left).sum() * w
    return out


def halves(section: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which strands go through the first hole, and that half's centroid."""
    best, chosen = -1.0, np.zeros(len(section), bool)
    for angle in np.deg2rad(np.arange(7, 187, 5)):
        side = section @ [np.cos(angle), np.sin(angle)] > 0
        reach = float(np.hypot(*section[side].mean(axis=0)))
        if side.sum() * 2 == len(section) and reach > best + 1e-9:
            best, chosen = reach, side
    return chosen, section[chosen].mean(axis=0)


def build(state: State) -> Rope:
    """Geometry at `state.turns` (0, or more than a quarter turn)."""
    if state.turns < 0.3:
        return replace(untwisted(state), apex_mm=state.zone_mm)
    _, centroid = halves(state.section_mm)
    reach = float(np.hypot(*centroid))
    linking = state.turns - 0.25
    rate = (2 * np.pi * linking + state.hole_gap_mm / 2 / reach) / state.zone_mm
    for _ in range(60):  # the apex moves with the rate, the rate with the arc length
        apex = state.hole_gap_mm / 2 / (reach * rate)
        centre, radius = centre_line(state, apex)
        s = arc_length(centre)
        tangent = tangents(centre)
        writhe = writhe_fuller(tangent)
        new = 2 * np.pi * (linking - state.hand * writhe) / s[-1]
        if abs(new - rate) < 1e-12:
            break
        rate = (rate + new) / 2
    first = state.hand * np.pi / 2 - float(np.arctan2(centroid[1], centroid[0]))
    rope = Rope(state, [], apex, rate, writhe, first, centre, tangent, s, radius)
    return replace(rope, strands=carry(rope))


def carry(rope: Rope) -> list[np.ndarray]:
    """Strand centre lines from behind the plate into the connector."""
    state = rope.state
    e1 = parallel_frame(rope.centre, rope.tangent, np.array([0.0, 1.0, 0.0]))
    e2 = np.cross(rope.tangent, e1)
    angle = rope.first_angle + state.hand * rope.rate * rope.s
    first, _ = halves(state.section_mm)
    strands = []
    for site, is_first in zip(state.section_mm, first, strict=True):
        a = angle + np.arctan2(site[1], site[0])
        r = np.hypot(*site)
        twisted = rope.centre + r * (np.cos(a)[:, None] * e1 + np.sin(a)[:, None] * e2)
        ahead = (twisted[-1] - twisted[-2]) / np.linalg.norm(twisted[-1] - twisted[-2])
        tail = twisted[-1] + np.outer(np.linspace(0, 0.6, 40)[1:], ahead)  # inside the spigot
        strands.append(resample(np.vstack([leg(rope, site, is_first), twisted[1:], tail])))
    return strands


def leg(rope: Rope, site: np.ndarray, is_first: bool) -> np.ndarray:
    """One strand from behind the plate to the apex, inside its half-section's leg."""
    state, side = rope.state, 1 if is_first else -1
    _, centroid = halves(state.section_mm)
    x = np.linspace(0, rope.apex_mm, 1500)
    u = x / rope.apex_mm
    half_gap = state.hole_gap_mm / 2
    z = state.hand * np.hypot(*centroid) * u * (2 - u)
    middle = side * np.column_stack([side * x, half_gap * (1 - u), z])
    offset = site - side * centroid
    ahead = rope.apex_mm - x
    ease = 0.5  # mm over which the leg stops turning with the bundle
    turned = rope.first_angle - state.hand * rope.rate * ease * (1 - np.exp(-ahead / ease))
    a = turned + np.arctan2(offset[1], offset[0])
    # Near the apex the half-section lies across the bundle's axis, further out across the leg.
    tilt = side * np.arctan2(half_gap, rope.apex_mm) * (1 - np.exp(-ahead / ease))
    e1 = np.column_stack([np.sin(tilt), np.cos(tilt), 0 * x])
    r = np.hypot(*offset)
    path = middle + r * (np.cos(a)[:, None] * e1 + np.sin(a)[:, None] * [0.0, 0.0, 1.0])
    behind = path[0] + np.outer(np.linspace(-16, 0, 400)[:-1], [1.0, 0, 0])
    return np.vstack([behind, path])


def untwisted(state: State) -> Rope:
    """Zero turns: both legs run to the connector, half-section beside half-section."""
    first, centroid = halves(state.section_mm)
    angle = -np.arctan2(centroid[1], centroid[0])
    spin = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    x = np.linspace(0, state.zone_mm, 1500)
    strands = []
    for site, is_first in zip(state.section_mm @ spin.T, first, strict=True):
        start = (1 if is_first else -1) * (state.hole_gap_mm / 2 - np.hypot(*centroid))
        y = site[0] + start * (1 - x / state.zone_mm)
        path = np.column_stack([x, y, np.full_like(x, site[1])])
        back, ahead = np.linspace(-16, 0, 400)[:-1], np.linspace(0, 0.6, 40)[1:]
        behind = path[0] + np.outer(back, [1.0, 0, 0])
        tail = path[-1] + np.outer(ahead, [1.0, 0, 0])
        strands.append(resample(np.vstack([behind, path, tail])))
    return Rope(state, strands, state.zone_mm)


def resample(points: np.ndarray, step_mm: float = 0.02) -> np.ndarray:
    s = arc_length(points)
    at = np.linspace(0, s[-1], int(s[-1] / step_mm))
    return np.column_stack([np.interp(at, s, points[:, i]) for i in range(3)])
