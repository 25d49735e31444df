"""Exact truth of one frame, in the fields that its README lists."""

from __future__ import annotations

from typing import Any

import numpy as np

from .camera import Camera
from .rope import Rope, tangents

WINDOW_MM = (0.4, 3.4)  # the near-separator window, from the apex
VISIBLE = 1.15  # a knot stands out by this ratio …
KNOT_D = 1.40  # … and reaches this many D
BUNDLE_FIELDS = (
    "bundle_d_mm",
    "envelope_d_near_sep_mm",
    "silhouette_w_near_sep_mean_mm",
    "silhouette_w_near_sep_max_mm",
    "silhouette_w_near_sep_p95_mm",
    "pitch_mm",
    "pitch_along_bundle_mm",
    "helix_angle_outer_deg",
    "helix_angle_strand_centre_deg",
    "phase_deg",
    "phase_ref_mm",
    "near_sep_window_mm",
)


def axis_px(rope: Rope, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Projected ends of the axis: separator's face and connector's face."""
    ends = camera.project(np.array([[0.0, 0, 0], [rope.state.zone_mm, 0, 0]]))
    return ends[0], ends[1]


def to_axis(px: np.ndarray, camera: Camera, rope: Rope) -> np.ndarray:
    """(…, 2): distance along the projected axis and across it, along n = (-u_y, u_x)."""
    start, end = axis_px(rope, camera)
    u = (end - start) / np.linalg.norm(end - start)
    rel = px - start
    return np.stack([rel @ u, rel @ np.array([-u[1], u[0]])], axis=-1)


def outline(rope: Rope, camera: Camera) -> list[np.ndarray]:
    """Contour curves (M, 2) px: where rays graze the tubes, two per strand.

    On a tube of constant radius the grazing points are C ± r n with n across both the tube's
    tangent and the ray; the ray to the surface point differs from that to C, hence the passes.
    Where a tube points at the camera n swings round between two samples; there the outline is
    that of the sphere about C, which is added.
    """
    r = rope.state.strand_d_mm / 2
    curves = []
    for points in rope.strands:
        t = tangents(points)
        for side in (1.0, -1.0):
            surface = points
            for _ in range(3):
                n = np.cross(t, surface - camera.eye)
                n *= side / np.linalg.norm(n, axis=1, keepdims=True)
                surface = points + r * n
            curves.append(camera.project(surface))
        swings = np.flatnonzero((n[1:] * n[:-1]).sum(axis=1) < np.cos(np.deg2rad(6)))
        curves += [camera.project(sphere_outline(points[i], r, camera.eye)) for i in swings]
    return curves


def sphere_outline(centre: np.ndarray, r: float, eye: np.ndarray) -> np.ndarray:
    """Points (61, 3) where rays graze a sphere."""
    view = (centre - eye) / np.linalg.norm(centre - eye)
    one = np.cross(view, [0.0, 1.0, 0.0])
    one /= np.linalg.norm(one)
    a = np.linspace(0, 2 * np.pi, 61)
    return centre + r * (np.outer(np.cos(a), one) + np.outer(np.sin(a), np.cross(view, one)))


def silhouette(rope: Rope, camera: Camera) -> np.ndarray:
    """(M, 2) px float32: lower and upper edge at (i + 0.5) px from the separator's face."""
    start, end = axis_px(rope, camera)
    rows = int(np.ceil(np.linalg.norm(end - start)))
    low, high = np.full(rows, np.inf), np.full(rows, -np.inf)
    for curve in outline(rope, camera):
        along, across = to_axis(curve, camera, rope).T
        extremes(along, across, low, high)
    at = np.arange(rows) + 0.5
    apex = to_axis(camera.project(np.array([rope.apex_mm, 0, 0])), camera, rope)[0]
    outside = (at < apex) | ~np.isfinite(low) | (rope.state.turns == 0)
    edges = np.column_stack([low, high]).astype(np.float32)
    edges[outside] = np.nan
    return edges


def extremes(along: np.ndarray, across: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
    """Fold a polyline into the least and largest `across` at each half-integer `along`."""
    for i in range(int(np.ceil(np.abs(np.diff(along)).max())) + 1):
        first = np.ceil(np.minimum(along[1:], along[:-1]) - 0.5).astype(int) + i
        inside = (
            (first >= 0) & (first < len(low)) & (first + 0.5 <= np.maximum(along[1:], along[:-1]))
        )
        step = np.diff(along)
        ok = inside & (np.abs(step) > 1e-12)
        share = (first[ok] + 0.5 - along[:-1][ok]) / step[ok]
        value = across[:-1][ok] + share * np.diff(across)[ok]
        np.minimum.at(low, first[ok], value)
        np.maximum.at(high, first[ok], value)


def knots(rope: Rope, camera: Camera) -> list[dict[str, Any]]:
    """Intervals of the envelope about the straight axis, E = 2 R + D, by the defined criterion."""
    if not len(rope.centre):
        return []
    x, envelope = rope.centre[:, 0], 2 * rope.radius + rope.state.diameter_mm
    base = float(np.percentile(envelope, 25))
    found = []
    for number, knot in enumerate(rope.state.knots):
        near = np.abs(x - knot.centre_mm) <= knot.length_mm
        top = float(envelope[near].max())
        out = near & (envelope >= VISIBLE * base)
        half = near & (envelope >= (top + base) / 2)
        length = float(np.ptp(x[out])) if out.any() else 0.0
        seen = length >= rope.state.diameter_mm and top >= KNOT_D * rope.state.diameter_mm
        found.append(
            {
                "id": number,
                "nucleated_at_turn": knot.nucleated_at_turn,
                "centre_mm": knot.centre_mm,
                "length_mm": length,
                "fwhm_mm": float(np.ptp(x[half])),
                "max_diameter_mm": top,
                "coil_radius_mm": knot.radius_mm,
                "coil_pitch_mm": knot.coil_pitch_mm,
                "baseline_envelope_d_mm": base,
                "excess_ratio": top / base,
                "visible": bool(out.any() and seen),
                "centre_px": camera.project(np.array([knot.centre_mm, 0, 0])).tolist(),
            }
        )
    return found


def bundle(rope: Rope, camera: Camera, edges: np.ndarray) -> dict[str, Any]:
    """What needs a twisted part; all None at zero turns."""
    state = rope.state
    if not len(rope.centre):
        return dict.fromkeys(BUNDLE_FIELDS)
    window = rope.apex_mm + WINDOW_MM[0], min(rope.apex_mm + WINDOW_MM[1], state.zone_mm)
    x = rope.centre[:, 0]
    inside = (x >= window[0]) & (x <= window[1])
    strands = np.vstack(rope.strands)
    near = strands[(strands[:, 0] >= window[0]) & (strands[:, 0] <= window[1])]
    place = to_axis(camera.project(np.outer(window, [1.0, 0, 0])), camera, rope)[:, 0]
    at = np.arange(len(edges)) + 0.5
    width = np.ptp(edges, axis=1)[(at >= place[0]) & (at <= place[1])]
    width = width[np.isfinite(width)] / camera.scale_at(sum(window) / 2)
    pitch = 2 * np.pi / rope.rate
    arc = float(np.interp(rope.apex_mm + 2, x, rope.s))
    values = (
        state.diameter_mm,
        float(2 * np.hypot(near[:, 1], near[:, 2]).max() + state.strand_d_mm),
        float(width.mean()),
        float(width.max()),
        float(np.percentile(width, 95)),
        float(pitch * np.ptp(x[inside]) / np.ptp(rope.s[inside])),
        pitch,
        float(np.degrees(np.arctan(np.pi * state.diameter_mm / pitch))),
        float(np.degrees(np.arctan(np.pi * (state.diameter_mm - state.strand_d_mm) / pitch))),
        float(np.degrees(rope.first_angle + state.hand * rope.rate * arc) % 360),
        rope.apex_mm + 2,
        list(window),
    )
    return dict(zip(BUNDLE_FIELDS, values, strict=True))


def frame_truth(rope: Rope, camera: Camera, edges: np.ndarray) -> dict[str, Any]:
    """All fields of one frame but its file name and degradation."""
    state = rope.state
    start, end = axis_px(rope, camera)
    half, length = state.hole_gap_mm / 2, state.zone_mm
    holes = np.array([[0, half, 0], [0, -half, 0]])
    found = knots(rope, camera)
    hand = {1: "right", -1: "left"}[state.hand] if state.turns else "none"
    swing = float(np.sqrt(np.mean(rope.radius**2))) if len(rope.radius) else 0.0
    return {
        "width": camera.width,
        "height": camera.height,
        "turns": state.turns,
        "n_strings": state.count,
        "handedness": hand,
        "px_per_mm": camera.scale_at(length / 2),
        "px_per_mm_separator": camera.scale_at(0.0),
        "px_per_mm_connector": camera.scale_at(length),
        "px_per_mm_along_axis": float(np.linalg.norm(end - start) / length),
        "axis_x0_px": start[0],
        "axis_y0_px": start[1],
        "axis_x1_px": end[0],
        "axis_y1_px": end[1],
        "separator_face_on_axis_px": start.tolist(),
        "separator_edge_visible_px": camera.project(np.array([0, 0, 2.2])).tolist(),
        "connector_face_on_axis_px": end.tolist(),
        "hole_exit_px": camera.project(holes).tolist(),
        "merge_apex_mm": rope.apex_mm,
        "merge_apex_px": camera.project(np.array([rope.apex_mm, 0, 0])).tolist(),
        "v_half_angle_deg": float(np.degrees(np.arctan(half / rope.apex_mm))),
        "strand_d_mm": state.strand_d_mm,
        "view_yaw_deg": camera.yaw_deg,
        "view_pitch_deg": camera.pitch_deg,
        "view_axis_deg": camera.axis_deg,
        **bundle(rope, camera, edges),
        "turns_in_twisted_part": max(state.turns - 0.25, 0.0),
        "overtwist_coil_radius_mm": state.coil_radius_mm,
        "overtwist_coil_pitch_mm": state.coil_pitch_mm if state.coil_radius_mm else None,
        "coil_amplitude_mm": swing,
        "writhe_turns": rope.writhe * state.hand,
        "bundle_arc_length_mm": float(rope.s[-1]) if len(rope.s) else 0.0,
        "knots": found,
        "n_knots_visible": sum(k["visible"] for k in found),
    }
