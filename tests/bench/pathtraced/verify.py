"""Checks a recording's truth by brute force, by ways that share nothing with truth.py.

- silhouette: rays are shot at the meshes on a fine grid across the axis; outermost hits are edges.
- D: largest distance of any bundle vertex from the centre line (nearest point).
- pitch: the strands' turning about the centre line, (1/2π) ∮ (v × v')·t, with v read off strands.
- linking number: that twist plus the writhe by the Gauss double integral.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numba import njit
from scipy.ndimage import map_coordinates
from scipy.spatial import cKDTree

from .mesh import tube
from .recording import Spec, state_at
from .rope import Rope, build
from .scene import load_mitsuba, strings_only
from .truth import axis_px, silhouette


def verify(spec: Spec) -> None:
    """Prints one line a frame; edges in px, D in mm, pitch in %, turns in turns."""
    mi = load_mitsuba()
    for i, turns in enumerate(spec.turns):
        rope = build(state_at(spec, turns))
        if turns == 0:
            continue
        error = edge_errors(mi, rope, spec)
        twist, diameter = strand_twist(rope), vertex_diameter(rope)
        writhe = writhe_gauss(rope.centre[:: max(1, len(rope.centre) // 2500)])
        pitch = rope.s[-1] / abs(twist)
        gain = 100 * (pitch * rope.rate / 2 / np.pi - 1)
        print(
            f"{spec.name} {i:2} {turns:5g} turns: edge mean {error.mean():+.3f} rms "
            f"{np.sqrt((error**2).mean()):.3f} worst {np.abs(error).max():.2f} px; D "
            f"{diameter:.4f} against {rope.state.diameter_mm:.4f} mm; pitch "
            f"{gain:+.3f} %; linking {abs(twist + writhe):.3f} "
            f"against {turns - 0.25:.3f} turns"
        )


def edge_errors(mi: Any, rope: Rope, spec: Spec, step_px: float = 0.02) -> np.ndarray:
    """Truth's half-widths minus the cast ones, at 60 places along the bundle, in px."""
    camera = spec.camera
    edges = silhouette(rope, camera)
    start, end = axis_px(rope, camera)
    u = (end - start) / np.linalg.norm(end - start)
    n = np.array([-u[1], u[0]])
    rows = np.flatnonzero(np.isfinite(edges[:, 0]))
    rows = rows[np.linspace(5, len(rows) - 6, 60).astype(int)]
    reach = np.nanmax(np.abs(edges)) + 4
    across = np.arange(-reach, reach, step_px)
    px = start + (rows[:, None, None] + 0.5) * u + across[None, :, None] * n
    hit = cast(mi, strings_only(mi, rope), camera.eye, camera.rays(px.reshape(-1, 2)))
    hit = hit.reshape(len(rows), len(across))
    low = across[hit.argmax(axis=1)] - step_px / 2
    high = across[hit.shape[1] - 1 - hit[:, ::-1].argmax(axis=1)] + step_px / 2
    return np.concatenate([low - edges[rows, 0], edges[rows, 1] - high])


def cast(mi: Any, scene: Any, eye: np.ndarray, directions: np.ndarray) -> np.ndarray:
    d = mi.Vector3f(*[mi.Float(c.astype(np.float32)) for c in directions.T])
    ray = mi.Ray3f(mi.Point3f(*[float(c) for c in eye]), d)
    return np.array(scene.ray_test(ray))


def vertex_diameter(rope: Rope) -> float:
    tree = cKDTree(rope.centre)
    middle = rope.centre[:, 0].min() + 0.5, rope.centre[:, 0].max() - 0.5
    largest = 0.0
    for points in rope.strands:
        vertex = tube(points, rope.state.strand_d_mm / 2)[0]
        vertex = vertex[(vertex[:, 0] > middle[0]) & (vertex[:, 0] < middle[1])]
        largest = max(largest, float(tree.query(vertex)[0].max()))
    return 2 * largest


def strand_twist(rope: Rope) -> float:
    """Turns of the first strand's offset about the centre line, end to end."""
    strand = rope.strands[0]
    tree = cKDTree(strand)
    offset = strand[tree.query(rope.centre)[1]] - rope.centre
    # The nearest strand point need not lie in the normal plane: project, then count.
    offset -= (offset * rope.tangent).sum(axis=1, keepdims=True) * rope.tangent
    v = offset / np.linalg.norm(offset, axis=1, keepdims=True)
    turn = (np.cross(v[:-1], v[1:]) * (rope.tangent[:-1] + rope.tangent[1:]) / 2).sum(axis=1)
    step = np.arctan2(turn, (v[:-1] * v[1:]).sum(axis=1))
    return float(step.sum() / (2 * np.pi))


@njit(cache=True)
def gauss_sum(mid, step):  # type: ignore[no-untyped-def]
    total = 0.0
    for i in range(len(mid)):
        for j in range(i):
            r = mid[i] - mid[j]
            d = (r * r).sum() ** 1.5
            if d > 0:
                total += (
                    (step[i, 1] * step[j, 2] - step[i, 2] * step[j, 1]) * r[0]
                    + (step[i, 2] * step[j, 0] - step[i, 0] * step[j, 2]) * r[1]
                    + (step[i, 0] * step[j, 1] - step[i, 1] * step[j, 0]) * r[2]
                ) / d
    return total / (2 * np.pi)


def writhe_gauss(points: np.ndarray) -> float:
    """Writhe of the line, closed by the straight continuation far to both sides."""
    far = np.linspace(0, 1, 200)[1:, None] ** 3 * np.array([400.0, 0, 0])
    points = np.vstack([(points[0] - far)[::-1], points, points[-1] + far])
    return float(gauss_sum((points[1:] + points[:-1]) / 2, np.diff(points, axis=0)))


def picture_offsets(folder: Path) -> None:
    """Half-level edges of a finished, backlit recording against its truth: median shift of both
    edges and of the half-width, px. Means something only where contrast does not depend on side.
    """
    truth = json.loads((folder / "truth.json").read_text())
    profiles = np.load(folder / "profiles.npz")
    across = np.arange(-50, 50, 0.1)
    for frame in truth["frames"]:
        key = f"f{frame['frame']:03d}"
        if key not in profiles:
            continue
        edges = profiles[key]
        rows = np.flatnonzero(np.isfinite(edges[:, 0]))[20:-20]
        picture = np.asarray(cv2.imread(str(folder / frame["file"]), cv2.IMREAD_GRAYSCALE))
        lines = light_across(picture, frame, rows, across)
        ground = np.median(lines[:, np.abs(across) > 40], axis=1)
        depth = lines[np.arange(len(rows)), np.searchsorted(across, edges[rows].mean(axis=1))]
        inside = (lines < ((ground + depth) / 2)[:, None]) == (depth < ground)[:, None]
        inside &= np.abs(across) < 40
        low = across[inside.argmax(axis=1)] - 0.05 - edges[rows, 0]
        high = across[len(across) - 1 - inside[:, ::-1].argmax(axis=1)] + 0.05 - edges[rows, 1]
        low, high = np.median(low), np.median(high)
        shift, wider = (low + high) / 2, (high - low) / 2
        print(f"{frame['file']}: shift {shift:+.3f} px, half-width {wider:+.3f} px")


def light_across(
    picture: np.ndarray, frame: dict[str, Any], rows: np.ndarray, across: np.ndarray
) -> np.ndarray:
    """(rows, across) linear light on lines across the projected axis."""
    start = np.array([frame["axis_x0_px"], frame["axis_y0_px"]])
    end = np.array([frame["axis_x1_px"], frame["axis_y1_px"]])
    u = (end - start) / np.linalg.norm(end - start)
    n = np.array([-u[1], u[0]])
    px = start + (rows[:, None, None] + 0.5) * u + across[None, :, None] * n - 0.5
    coded = map_coordinates(picture / 255.0, [px[..., 1], px[..., 0]], order=3, mode="nearest")
    return np.where(coded < 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4)
