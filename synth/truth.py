"""All measurands of a state, exactly: from the geometry, never from pixels."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.ndimage import maximum_filter1d

from synth.actuator import elapsed_s
from synth.camera import View, project, projection_jacobian, to_camera, towards_viewer
from synth.displacement import recorded_displacement
from synth.hardware import PLATE_THICK_MM, make_hardware
from synth.phases import Envelope, find_knots, phase_of
from synth.render import tubes_of
from synth.settings import Settings
from synth.silhouette import edges_along, fold_curves
from synth.state import State
from synth.strands import (
    StrandPath,
    arc_length_mm,
    hole_centres_mm,
    site_scale,
    strand_diameters_mm,
    strand_paths,
)
from synth.tubes import Tube

NAN = float("nan")
BIN_MM = 0.02


@dataclass(frozen=True)
class FrameTruth:
    """One frame: `row` scalars, `knots` dicts, silhouette arrays at s = 0, 1, 2 … px."""

    row: dict[str, Any]
    knots: list[dict[str, float]]
    s_px: np.ndarray
    s_mm: np.ndarray
    upper_px: np.ndarray
    lower_px: np.ndarray
    envelope_mm: np.ndarray


def axis_px(view: View, zone_mm: float) -> tuple[np.ndarray, np.ndarray]:
    """The zone's straight axis, separator face to connector face, in px."""
    ends = project(view, to_camera(view, np.array([[0.0, 0.0, 0.0], [zone_mm, 0.0, 0.0]])))
    return ends[0], ends[1]


def scale_at(view: View, x_mm: float) -> tuple[float, float]:
    """mm per px along the axis and across it (square to axis and ray) at x on the axis."""
    seen = to_camera(view, np.array([[x_mm, 0.0, 0.0]]))
    forward = projection_jacobian(view, seen)[0]
    along = view.rotation @ np.array([1.0, 0.0, 0.0])
    across = np.cross(towards_viewer(view, seen)[0], along)
    across /= np.linalg.norm(across)
    return float(1.0 / np.linalg.norm(forward @ along)), float(
        1.0 / np.linalg.norm(forward @ across)
    )


def envelope_of(settings: Settings, state: State) -> Envelope | None:
    """E(s) = the bundle's own cylinder carried round the zone's axis: D + 2 R(s).

    R(s) is the centre line's distance from the axis, the largest within one silhouette period.
    This is what the silhouette's envelope tends to over many periods, whatever the phases.
    """
    line = state.line
    if not state.has_bundle or state.zone_mm - state.apex_mm < 4 * BIN_MM:
        return None
    count = int((state.zone_mm - state.apex_mm) / BIN_MM)
    s = state.apex_mm + (np.arange(count) + 0.5) * BIN_MM
    lay = (state.zone_mm - state.apex_mm) / max(float(line.arc_mm[-1]), 1e-9)
    period = state.pitch_mm * lay / (2 if settings.strings.count % 2 == 0 else 3)
    width = max(round(period / BIN_MM), 1)
    reach = maximum_filter1d(np.interp(s, line.x_mm, line.radius_mm), width, mode="nearest")
    return find_knots(s, local_diameter_mm(settings, state, s) + 2.0 * reach, state.diameter_mm)


def cylinder_mm(state: State, paths: list[StrandPath], start_mm: float, stop_mm: float) -> float:
    """Diameter of the smallest cylinder about the bundle's own centre line, start to stop in arc
    length along that line from the apex."""
    reach = 0.0
    arc = state.line.arc_mm
    for path in paths:
        first = int(np.argmax(path.in_bundle))
        offset = path.offset_mm[first : first + len(arc)]
        here = (arc >= start_mm) & (arc <= stop_mm)
        if here.any():
            size = float(np.linalg.norm(offset[here], axis=1).max())
            reach = max(reach, size + path.half_out_mm)
    return 2.0 * reach if reach else NAN


def local_diameter_mm(settings: Settings, state: State, s_mm: np.ndarray) -> np.ndarray:
    """The bundle's own diameter along the axis: constant but for planted tapers and slack."""
    radius = np.hypot(*state.sites_mm.T)
    diameters = strand_diameters_mm(settings, state) * (1.0 - settings.hidden.flattening)
    reach = [
        r * site_scale(settings, state, i, s_mm) + 0.5 * diameters[i] for i, r in enumerate(radius)
    ]
    return 2.0 * np.max(reach, axis=0)


def frame_truth(
    settings: Settings,
    view: View,
    state: State,
    index: int,
    paths: list[StrandPath] | None = None,
) -> FrameTruth:
    """All truth of one frame. NaN where the quantity does not exist (no bundle yet)."""
    paths = paths or strand_paths(settings, state)
    envelope = envelope_of(settings, state)
    zone = state.zone_mm
    start, stop = axis_px(view, zone)
    along = (stop - start) / np.linalg.norm(stop - start)
    length_px = int(np.floor(np.linalg.norm(stop - start))) + 1
    curves = [c for tube in tubes_of(paths) for c in fold_curves(view, _zone(tube))]
    lower, upper = edges_along(start, along, length_px, curves)
    s_px = np.arange(length_px, dtype=float)
    s_mm = _mm_of_px(view, zone, start, along, s_px)
    outside = (s_mm < state.apex_mm) if state.has_bundle else np.ones(length_px, bool)
    upper, lower = np.where(outside, NAN, upper), np.where(outside, NAN, lower)
    local = np.full(length_px, NAN)
    if envelope is not None:
        local = np.interp(s_mm, envelope.s_mm, envelope.envelope_mm)
        local[outside] = NAN
    knots = [] if envelope is None else _knots_px(view, envelope)
    row = _row(settings, view, state, index, paths, envelope, start, stop)
    return FrameTruth(row, knots, s_px, s_mm, upper, lower, local)


def _zone(tube: Tube) -> Tube:
    """The tube without what lies behind the plate."""
    x = tube.points_mm[:, 0]
    keep = slice(int(np.argmax(x >= 0.0)), len(x))
    return replace(
        tube,
        points_mm=tube.points_mm[keep],
        outward_mm=tube.outward_mm[keep],
        in_bundle=tube.in_bundle[keep],
    )


def _mm_of_px(
    view: View, zone: float, start: np.ndarray, along: np.ndarray, s_px: np.ndarray
) -> np.ndarray:
    """Axis coordinate whose picture lies s px along the line: perspective included."""
    x = np.linspace(-0.5, zone + 0.5, 2001)
    points = np.zeros((len(x), 3))
    points[:, 0] = x
    return np.interp(s_px, (project(view, to_camera(view, points)) - start) @ along, x)


def _knots_px(view: View, envelope: Envelope) -> list[dict[str, float]]:
    found = []
    for knot in envelope.knots:
        at = project(view, to_camera(view, np.array([[knot.centre_mm, 0.0, 0.0]])))[0]
        found.append(
            {
                "centre_mm": knot.centre_mm,
                "length_mm": knot.stop_mm - knot.start_mm,
                "max_diameter_mm": knot.max_diameter_mm,
                "centre_x_px": float(at[0]),
                "centre_y_px": float(at[1]),
            }
        )
    return found


def _row(
    settings: Settings,
    view: View,
    state: State,
    index: int,
    paths: list[StrandPath],
    envelope: Envelope | None,
    start: np.ndarray,
    stop: np.ndarray,
) -> dict[str, Any]:
    zone, pitch = state.zone_mm, state.pitch_mm
    total = float(state.line.arc_mm[-1])
    outer = middle = widest = NAN
    if state.has_bundle:
        # the near-separator D is read over the first pitch, mid-span D over one pitch there
        outer = cylinder_mm(state, paths, 0.0, max(pitch, 0.1))
        middle = cylinder_mm(state, paths, 0.5 * (total - pitch), 0.5 * (total + pitch))
        widest = cylinder_mm(state, paths, 0.0, max(2.0 * pitch, 4.0 * outer))
    d = state.real.diameter_mm
    lengths = np.array([arc_length_mm(path) for path in paths])
    drawn = float(lengths.mean())
    line = state.line
    amplitude = float(np.sqrt(np.mean(line.radius_mm**2))) if state.has_bundle else 0.0
    coils = _coils(state)
    mid_mm = 0.5 * (state.apex_mm + zone)
    near_mm = state.apex_mm + 0.5 * max(2 * pitch, 4 * outer) if state.has_bundle else 0.0
    along_mm, across_mm = scale_at(view, near_mm)
    apex = project(view, to_camera(view, np.array([[state.apex_mm, 0.0, 0.0]])))[0]
    law = recorded_displacement(settings, state, drawn - zone, elapsed_s(settings, index))
    phase = "twist" if envelope is None else phase_of(envelope, amplitude, outer)
    hole = 2.0 * make_hardware(settings).hole_radius_mm
    stuck = envelope is not None and any(k.max_diameter_mm > hole for k in envelope.knots)
    if stuck:
        phase = "irreversible"
    return {
        "frame": index,
        "turns": state.motor_turns,
        "has_bundle": state.has_bundle,
        "diameter_mm": outer,
        "diameter_px": outer / across_mm,
        "pitch_mm": pitch,
        "pitch_px": pitch / along_mm,
        "strand_repeat_px": pitch / along_mm / settings.strings.count,
        "helix_angle_rad": float(np.arctan2(np.pi * outer, pitch)),
        "lay_angle_rad": float(np.arctan2(np.pi * (outer - d), pitch)),
        "handedness": ("Z" if state.sign > 0 else "S") if state.has_bundle else "",
        "strand_count": settings.strings.count,
        "strand_diameter_mm": d,
        "diameter_laid_mm": state.diameter_mm,
        "diameter_near_largest_mm": widest,
        "midspan_diameter_mm": middle,
        "midspan_helix_angle_rad": float(np.arctan2(np.pi * middle, pitch)),
        "midspan_mm": mid_mm if state.has_bundle else NAN,
        "coil_amplitude_mm": amplitude,
        "coil_base_radius_mm": state.coil_radius_mm,
        "coil_pitch_mm": (zone - state.apex_mm) / coils if coils else NAN,
        "unevenness": envelope.unevenness if envelope else NAN,
        "baseline_envelope_mm": envelope.baseline_mm if envelope else NAN,
        "max_envelope_mm": float(envelope.envelope_mm.max()) if envelope else NAN,
        "knot_count": len(envelope.knots) if envelope else 0,
        "knots_laid": len(state.knots),
        "phase": phase,
        "irreversible": stuck,
        "turns_lost": state.lost_turns,
        "turns_linked": state.leg_turns + line.turns,
        "turns_in_legs": state.leg_turns,
        "turns_of_strands": line.turns - line.writhe_turns,
        "turns_of_centre_line": line.writhe_turns,
        "turn_budget_error": abs(state.motor_turns) - state.lost_turns - state.leg_turns
        - line.turns,
        "string_length_mm": drawn,
        "string_length_spread_mm": float(np.ptp(lengths)),
        **law,
        "string_tension_N": state.real.tension_N,
        "mm_per_px": across_mm,
        "mm_per_px_along": along_mm,
        "mm_per_px_separator": scale_at(view, 0.0)[1],
        "mm_per_px_connector": scale_at(view, zone)[1],
        "axis_x0_px": float(start[0]),
        "axis_y0_px": float(start[1]),
        "axis_x1_px": float(stop[0]),
        "axis_y1_px": float(stop[1]),
        "separator_x_px": float(start[0]),
        "separator_y_px": float(start[1]),
        "apex_mm": state.apex_mm,
        "apex_x_px": float(apex[0]),
        "apex_y_px": float(apex[1]),
        # where each may be compared with a measurement
        "mask_diameter": state.has_bundle and zone - state.apex_mm > max(2 * pitch, 4 * outer),
        "mask_pitch": state.has_bundle and zone - state.apex_mm > 1.0 * pitch,
        "mask_apex": state.has_bundle and _in_view(view, apex),
        "mask_full_zone": _in_view(view, start) and _in_view(view, stop),
    }  # fmt: skip


def _in_view(view: View, point: np.ndarray) -> bool:
    return bool(0 <= point[0] <= view.width - 1 and 0 <= point[1] <= view.height - 1)


def _coils(state: State) -> float:
    """Turns of the coil's phase where the coil stands."""
    line = state.line
    if not line.radius_mm.any():
        return 0.0
    psi = np.unwrap(np.arctan2(line.z_mm, line.y_mm)[line.radius_mm > 1e-9])
    return float(abs(psi[-1] - psi[0]) / (2.0 * np.pi)) if len(psi) > 1 else 0.0


def hardware_truth(settings: Settings, view: View) -> dict[str, object]:
    """Where the separator's face, its visible edges and its holes appear, in px."""
    hardware = make_hardware(settings)
    holes = hole_centres_mm(
        settings, settings.actuator.hole_distance_mm + settings.hidden.hole_distance_error_mm
    )
    exits = np.column_stack([np.zeros(len(holes)), holes])
    face = np.array(
        [
            [0.0, y, z]
            for y in (-hardware.half_y_mm, hardware.half_y_mm)
            for z in (-hardware.half_z_mm, hardware.half_z_mm)
        ]
    )
    return {
        "hole_exits_px": project(view, to_camera(view, exits)).tolist(),
        "face_corners_px": project(view, to_camera(view, face)).tolist(),
        "hole_diameter_mm": 2.0 * hardware.hole_radius_mm,
        "plate_thickness_mm": PLATE_THICK_MM,
        "spigot_radius_mm": hardware.spigot_radius_mm,
    }
