"""The strands' centre lines in the rig's frame: x separator -> connector, y the holes' plane, z.

Strategy: in the bundle each strand sits at its site, turned by the strand angle on the centre
line's frame. Before the apex the middle of those that share a hole runs on the straight tangent,
each beside it as it will lie in the bundle. Behind the plate they run straight back.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from synth.centre_line import smallest_rotation_frame
from synth.contact import relax
from synth.laying import hole_of_strands, leg_ends_mm
from synth.sections import section_diameter_mm
from synth.settings import Settings
from synth.state import State

FEED_MM = 9.0  # drawn behind the plate
TAIL_MM = 0.4  # drawn into the connector
LEG_STEP_MM = 0.01
HOLE_D = 3.4  # default hole diameter over the bundle's


@dataclass(frozen=True)
class StrandPath:
    """One strand's centre line: `points_mm` (M, 3), `x_bundle` False outside apex..connector.

    `offset_mm` (M, 3) points from the bundle's centre line to the strand's centre (outside the
    bundle only its direction counts);
    `diameter_mm` is this strand's own; `half_out_mm`, `half_side_mm` the half axes of its section
    towards the outside and across (unequal when flattened); `first`, `last` bound the twisting
    zone (x in 0..L).
    """

    number: int
    points_mm: np.ndarray
    offset_mm: np.ndarray
    in_bundle: np.ndarray
    diameter_mm: float
    half_out_mm: float
    half_side_mm: float
    first: int
    last: int


def hole_centres_mm(settings: Settings, distance_mm: float) -> np.ndarray:
    """(H, 2) y, z of the holes: on a circle of diameter S, the first at +y."""
    angle = 2.0 * np.pi * np.arange(settings.actuator.holes) / settings.actuator.holes
    return 0.5 * distance_mm * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def needed_hole_mm(settings: Settings, diameter_mm: float) -> float:
    """Smallest hole that lets its share of the strands pass side by side."""
    share = -(-settings.strings.count // settings.actuator.holes)
    return diameter_mm * (1.0 if share == 1 else 1.0 + 1.0 / np.sin(np.pi / share))


def hole_diameter_mm(settings: Settings) -> float:
    """As stated, or HOLE_D bundle diameters where the holes leave room for it.

    A young knot still passes such a hole and an old one does not (the paper: untwisting was no
    longer reversible from about 70 turns on, 10 after the first knots).
    """
    given = settings.actuator.hole_diameter_mm
    if given is not None:
        return given
    strings, actuator = settings.strings, settings.actuator
    outer = section_diameter_mm(strings.section, strings.count, strings.diameter_mm)
    gap = actuator.hole_distance_mm * np.sin(np.pi / actuator.holes)
    least = 1.5 * needed_hole_mm(settings, strings.diameter_mm)
    return float(round(max(min(HOLE_D * outer, 0.7 * gap), least), 2))


def strand_diameters_mm(settings: Settings, state: State) -> np.ndarray:
    """(N,) diameters, unequal when that effect is planted (zero mean)."""
    count = settings.strings.count
    spread = settings.hidden.unequal_diameters
    wave = np.cos(2.0 * np.pi * np.arange(count) / count + 0.7)
    return state.real.diameter_mm * (1.0 + spread * (wave - wave.mean()))


@dataclass(frozen=True)
class _Entry:
    """Of the strands: `start_mm` (N, 2) in their holes, `phase_rad` (N,) and `radius_mm` (N,) of
    their sites at the apex, and `hole` (N,), which of the holes they share."""

    start_mm: np.ndarray
    phase_rad: np.ndarray
    radius_mm: np.ndarray
    hole: np.ndarray


def _assign(settings: Settings, state: State) -> _Entry:
    sites = state.sites_mm
    holes = settings.actuator.holes
    centres = hole_centres_mm(settings, state.real.hole_distance_mm)
    hole_of = hole_of_strands(sites, holes)
    used, ends = leg_ends_mm(sites, holes)
    ahead = np.arctan2(ends[:, 1], ends[:, 0]) - 2.0 * np.pi * used / holes
    turned = state.leg_turns * 2.0 * np.pi - float(np.angle(np.exp(1j * ahead).mean()))
    angle = np.arctan2(sites[:, 1], sites[:, 0])
    start = centres[hole_of].copy()
    entry = np.hypot(*sites.T)[:, None] * np.stack(
        [np.cos(angle + turned), np.sin(angle + turned)], axis=1
    )
    # legs leave at a slant, which brings neighbours closer by its cosine
    slope = 0.5 * state.real.hole_distance_mm / state.apex_mm
    apart = 1.02 * state.real.diameter_mm * float(np.hypot(1.0, slope))
    widest = 0.5 * (hole_diameter_mm(settings) - state.real.diameter_mm)
    for hole in range(holes):
        inside = np.flatnonzero(hole_of == hole)
        if len(inside) > 1:
            start[inside] += _side_by_side(entry[inside], apart, widest)
    return _Entry(start, angle + turned, np.hypot(*sites.T), hole_of)


def _side_by_side(entry: np.ndarray, apart_mm: float, widest_mm: float) -> np.ndarray:
    """Places (n, 2) in a hole, arranged as the strands will lie at the apex, so none cross."""
    away = entry - entry.mean(axis=0)
    direction = np.arctan2(away[:, 1], away[:, 0])
    order = np.argsort(direction)
    count = len(entry)
    angle = np.empty(count)
    spread = 2.0 * np.pi * np.arange(count) / count
    # the common rotation that brings the even spread closest to where the strands will lie
    lead = np.angle(np.exp(1j * (direction[order] - spread)).mean())
    angle[order] = spread + lead
    radius = min(0.5 * apart_mm / np.sin(np.pi / count), max(widest_mm, 0.0))
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def strand_paths(settings: Settings, state: State) -> list[StrandPath]:
    """All strands of a state, contact resolved; S is the mirror image in z of Z."""
    entry = _assign(settings, state)
    diameters = strand_diameters_mm(settings, state)
    loose = [_path(settings, state, entry, i, diameters[i]) for i in range(len(diameters))]
    flat = 1.0 - settings.hidden.flattening
    zone = [path.points_mm[path.first : path.last + 1] for path in loose]
    return [
        _moved(path, shift)
        for path, shift in zip(loose, relax(zone, flat * diameters), strict=True)
    ]


def _moved(path: StrandPath, shift: np.ndarray) -> StrandPath:
    if not shift.any():
        return path
    points, offset = path.points_mm.copy(), path.offset_mm.copy()
    zone = slice(path.first, path.last + 1)
    points[zone] += shift
    offset[zone] += np.where(path.in_bundle[zone, None], shift, 0.0)
    return replace(path, points_mm=points, offset_mm=offset)


def site_scale(settings: Settings, state: State, number: int, x: np.ndarray) -> np.ndarray:
    """Planted changes of a strand's radius along x: taper of the section, a slack pair."""
    hidden = settings.hidden
    share = x / state.zone_mm
    scale = 1.0 + hidden.taper * (share - 0.5)
    if hidden.slack_pair and number // 2 == settings.strings.count // 2 - 1:
        scale = scale * (1.0 + hidden.slack_pair * 0.5 * (1.0 - np.cos(6.0 * np.pi * share)))
    return scale


def _path(
    settings: Settings, state: State, entry: _Entry, number: int, diameter: float
) -> StrandPath:
    line = state.line
    phase, radius = entry.phase_rad[number], entry.radius_mm[number]
    if state.has_bundle:
        n1, n2 = smallest_rotation_frame(line.tangent)
        angle = line.chi_rad + phase
        reach = radius * site_scale(settings, state, number, line.x_mm)
        offset = reach[:, None] * (np.cos(angle)[:, None] * n1 + np.sin(angle)[:, None] * n2)
        centre = np.stack([line.x_mm, line.y_mm, line.z_mm], axis=1)
        bundle = centre + offset
        leg = _leg(entry, number, float(bundle[0, 0]), reach[0] / radius, state.pitch_mm)
    else:
        end = radius * np.array([np.cos(phase), np.sin(phase)])
        leg = _straight(entry.start_mm[number], end, state.zone_mm)
        bundle, offset = np.empty((0, 3)), np.empty((0, 3))
    steps = np.arange(-FEED_MM, -1e-9, 0.25)
    feed = np.column_stack([steps, *np.outer(entry.start_mm[number], np.ones_like(steps))])
    last = bundle[-1] if len(bundle) else np.array([state.zone_mm, *end])
    tail = last + np.array([[TAIL_MM * 0.5, 0.0, 0.0], [TAIL_MM, 0.0, 0.0]])
    points = np.vstack([feed, leg, bundle[1:] if len(bundle) else bundle, tail])
    inside = np.zeros(len(points), bool)
    outward = np.zeros_like(points)
    if len(bundle):
        # row of the leg's last point = first bundle point
        at = len(feed) + len(leg) - 1
        inside[at : at + len(bundle)] = True
        outward[at : at + len(bundle)] = offset
        # a flattened string keeps its flat side's direction on either side of the bundle
        outward[:at], outward[at + len(bundle) :] = offset[0], offset[-1]
    if state.sign < 0:
        points[:, 2] *= -1.0
        outward[:, 2] *= -1.0
    flat = 1.0 - settings.hidden.flattening
    return StrandPath(
        number=number,
        points_mm=points,
        offset_mm=outward,
        in_bundle=inside,
        diameter_mm=float(diameter),
        half_out_mm=0.5 * float(diameter) * flat,
        half_side_mm=0.5 * float(diameter) / flat,
        first=len(feed),
        last=len(points) - len(tail) - 1,
    )


def _leg(entry: _Entry, number: int, length: float, opened: float, pitch_mm: float) -> np.ndarray:
    """Points (K, 3) from a strand's hole to the apex. The middle of those that share the hole runs
    on a cubic (straight where that is the helix's tangent); beside it a strand lies as it will lie
    in the bundle, and turns into its helix over the last eighth of a pitch."""
    ends = (
        opened * entry.radius_mm * np.stack([np.cos(entry.phase_rad), np.sin(entry.phase_rad)])
    ).T
    slopes = 2.0 * np.pi / pitch_mm * np.stack([-ends[:, 1], ends[:, 0]], axis=1)
    share = entry.hole == entry.hole[number]
    start, end, slope = (each[share].mean(axis=0) for each in (entry.start_mm, ends, slopes))
    middle = _cubic(start, end, slope, length)
    first, last = entry.start_mm[number] - start, ends[number] - end
    beside = _straight(first, last, length)[:, 1:]
    over = min(pitch_mm / 8.0, length)
    t = np.maximum((middle[:, :1] - length) / over + 1.0, 0.0)
    turning = slopes[number] - slope - (last - first) / length
    return np.hstack([middle[:, :1], middle[:, 1:] + beside + (t**3 - t**2) * over * turning])


def _straight(start: np.ndarray, end: np.ndarray, length: float) -> np.ndarray:
    """(K, 3) from `start` to `end` (2,) over a length of x."""
    x = np.linspace(0.0, length, _points(length))[:, None]
    return np.hstack([x, start + (end - start) / length * x])


def _points(length: float) -> int:
    return max(int(np.ceil(length / LEG_STEP_MM)), 2) + 1


def _cubic(start: np.ndarray, end: np.ndarray, slope: np.ndarray, length: float) -> np.ndarray:
    """(K, 3) from `start` (zero curvature) to `end` with `slope` = d(y, z)/dx there."""
    t = np.linspace(0.0, 1.0, _points(length))[:, None]
    first = 1.5 * (end - start) - 0.5 * slope * length
    last = slope * length
    across = (
        (2 * t**3 - 3 * t**2 + 1) * start
        + (t**3 - 2 * t**2 + t) * first
        + (-2 * t**3 + 3 * t**2) * end
        + (t**3 - t**2) * last
    )
    return np.hstack([t * length, across])


def arc_length_mm(path: StrandPath) -> float:
    """String inside the zone, hole to connector; chords extrapolated to zero step (Richardson)."""
    points = path.points_mm[path.first : path.last + 1]
    return _richardson(points)


def _richardson(points: np.ndarray) -> float:
    fine = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    even = len(points) - (len(points) - 1) % 2
    head = points[:even]
    coarse = float(np.linalg.norm(np.diff(head[::2], axis=0), axis=1).sum())
    head_fine = float(np.linalg.norm(np.diff(head, axis=0), axis=1).sum())
    return fine + (head_fine - coarse) / 3.0
