"""From the rig's frame to pixels: rotation, telecentric or pinhole, radial distortion.

Camera frame: x right, y up, z towards the viewer, origin at the point looked at. Pixel centres
are at integer coordinates, v down.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from synth.settings import Camera

CLOSEUP_MM = 10.0  # length of zone that a close-up shows
FULL_SHARE = 0.78  # of the picture's long side that the twisting zone takes in the full view
_SIDE_DEG = {"left": 0.0, "right": 180.0, "top": 90.0, "bottom": -90.0}


@dataclass(frozen=True)
class View:
    """A placed camera. `rotation` (3, 3) takes rig to camera; `look_mm` is the origin."""

    rotation: np.ndarray
    look_mm: np.ndarray
    px_per_mm: float
    distance_mm: float  # 0: telecentric
    centre_px: np.ndarray
    half_diagonal_px: float
    k1: float
    k2: float
    width: int
    height: int


def place(camera: Camera, zone_mm: float) -> View:
    """Aim at mid zone (full) or at the separator region (closeup)."""
    long_px = camera.width_px if camera.side in ("left", "right") else camera.height_px
    if camera.view == "closeup":
        scale = camera.px_per_mm or long_px / CLOSEUP_MM
        look = np.array([0.43 * long_px / scale, 0.0, 0.0])
    else:
        scale = camera.px_per_mm or FULL_SHARE * long_px / zone_mm
        look = np.array([0.5 * zone_mm, 0.0, 0.0])
    turn = np.deg2rad(_SIDE_DEG[camera.side] + camera.roll_deg)
    rotation = _rz(-turn) @ _rx(np.deg2rad(camera.tilt_deg)) @ _ry(np.deg2rad(camera.yaw_deg))
    size = np.array([camera.width_px, camera.height_px], float)
    shift = np.array([camera.shift_x_px, camera.shift_y_px])
    return View(
        rotation=rotation,
        look_mm=look,
        px_per_mm=float(scale),
        distance_mm=camera.distance_mm,
        centre_px=(size - 1.0) / 2.0 + shift,
        half_diagonal_px=float(np.hypot(*size) / 2.0),
        k1=camera.k1,
        k2=camera.k2,
        width=camera.width_px,
        height=camera.height_px,
    )


def _rx(a: float) -> np.ndarray:
    c, s = np.cos(a), np.sin(a)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def _ry(a: float) -> np.ndarray:
    c, s = np.cos(a), np.sin(a)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def _rz(a: float) -> np.ndarray:
    c, s = np.cos(a), np.sin(a)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])


def to_camera(view: View, points_mm: np.ndarray) -> np.ndarray:
    """Rig points (..., 3) to the camera frame (..., 3), mm."""
    return (points_mm - view.look_mm) @ view.rotation.T


def towards_viewer(view: View, seen: np.ndarray) -> np.ndarray:
    """Unit vectors (..., 3) from camera-frame points to the viewer."""
    if view.distance_mm <= 0:
        return np.broadcast_to(np.array([0.0, 0.0, 1.0]), seen.shape)
    ray = np.array([0.0, 0.0, view.distance_mm]) - seen
    return ray / np.linalg.norm(ray, axis=-1, keepdims=True)


def project(view: View, seen: np.ndarray) -> np.ndarray:
    """Camera-frame points (..., 3) to pixels (..., 2)."""
    return _distort(view, _ideal(view, seen))


def _ideal(view: View, seen: np.ndarray) -> np.ndarray:
    """Undistorted offsets from the principal point in px, y down."""
    scale: float | np.ndarray = view.px_per_mm
    if view.distance_mm > 0:
        scale = scale * view.distance_mm / (view.distance_mm - seen[..., 2:3])
    return seen[..., :2] * np.array([1.0, -1.0]) * scale


def _distort(view: View, ideal: np.ndarray) -> np.ndarray:
    square = (ideal**2).sum(axis=-1, keepdims=True) / view.half_diagonal_px**2
    return ideal * (1.0 + view.k1 * square + view.k2 * square**2) + view.centre_px


def undistort(view: View, pixels: np.ndarray) -> np.ndarray:
    """Pixels (..., 2) to undistorted offsets (px, y down), by Newton's method on the radius."""
    bent = pixels - view.centre_px
    if not (view.k1 or view.k2):
        return bent
    far = np.linalg.norm(bent, axis=-1, keepdims=True) / view.half_diagonal_px
    radius = far.copy()
    for _ in range(25):
        square = radius**2
        excess = radius * (1.0 + view.k1 * square + view.k2 * square**2) - far
        slope = 1.0 + 3.0 * view.k1 * square + 5.0 * view.k2 * square**2
        radius = radius - np.clip(excess / np.maximum(slope, 0.1), -0.2, 0.2)
    return bent * np.where(far > 0.0, radius / np.maximum(far, 1e-12), 1.0)


def distortion_folds(k1: float, k2: float) -> bool:
    """Whether r (1 + k1 r^2 + k2 r^4) stops growing within the picture."""
    square = np.linspace(0.0, 1.3, 200) ** 2
    return bool((1.0 + 3.0 * k1 * square + 5.0 * k2 * square**2).min() < 0.1)


def projection_jacobian(view: View, seen: np.ndarray) -> np.ndarray:
    """d(pixel)/d(camera frame) at points (M, 3) -> (M, 2, 3), distortion included."""
    count = len(seen)
    flat = np.zeros((count, 2, 3))
    if view.distance_mm > 0:
        gap = view.distance_mm - seen[:, 2]
        f = view.px_per_mm * view.distance_mm
        flat[:, 0, 0] = f / gap
        flat[:, 1, 1] = -f / gap
        flat[:, 0, 2] = f * seen[:, 0] / gap**2
        flat[:, 1, 2] = -f * seen[:, 1] / gap**2
    else:
        flat[:, 0, 0] = view.px_per_mm
        flat[:, 1, 1] = -view.px_per_mm
    if not (view.k1 or view.k2):
        return flat
    ideal = _ideal(view, seen)
    half = view.half_diagonal_px**2
    square = (ideal**2).sum(axis=1) / half
    bend = (1.0 + view.k1 * square + view.k2 * square**2)[:, None, None] * np.eye(2)
    bend = bend + ((2.0 * view.k1 + 4.0 * view.k2 * square) / half)[:, None, None] * (
        ideal[:, :, None] * ideal[:, None, :]
    )
    return bend @ flat
