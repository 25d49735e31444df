"""A pinhole camera. Pixels are continuous: the centre of the top-left pixel is (0.5, 0.5)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Camera:
    """Looks at `target_mm` from `distance_mm`; the actuator's x axis lies at `axis_deg` in the
    picture (0 right, 90 down, 180 left), yaw and pitch tip the view about it."""

    px_per_mm: float
    target_mm: tuple[float, float, float]
    axis_deg: float = 0.0
    yaw_deg: float = 0.0
    pitch_deg: float = 0.0
    distance_mm: float = 120.0
    width: int = 1280
    height: int = 720

    @property
    def focal_px(self) -> float:
        return self.px_per_mm * self.distance_mm

    @property
    def basis(self) -> np.ndarray:
        """(3, 3): rows right, up, towards the camera."""
        yaw, pitch, roll = np.deg2rad([self.yaw_deg, self.pitch_deg, self.axis_deg])
        back = np.array([np.sin(yaw) * np.cos(pitch), np.sin(pitch), np.cos(yaw) * np.cos(pitch)])
        right = np.cross([0.0, 1.0, 0.0], back)
        right /= np.linalg.norm(right)
        up = np.cross(back, right)
        c, s = np.cos(roll), np.sin(roll)
        return np.array([c * right + s * up, c * up - s * right, back])

    @property
    def eye(self) -> np.ndarray:
        return np.asarray(self.target_mm) + self.distance_mm * self.basis[2]

    def depth_mm(self, points: np.ndarray) -> np.ndarray:
        return -(np.asarray(points) - self.eye) @ self.basis[2]

    def project(self, points: np.ndarray) -> np.ndarray:
        """(…, 3) mm to (…, 2) px."""
        local = (np.asarray(points, float) - self.eye) @ self.basis.T
        flat = self.focal_px * local[..., :2] / -local[..., 2:]
        return flat * [1, -1] + [self.width / 2, self.height / 2]

    def scale_at(self, x_mm: float) -> float:
        """px per mm across the view at a point of the axis."""
        return float(self.focal_px / self.depth_mm(np.array([x_mm, 0, 0])))

    def rays(self, px: np.ndarray) -> np.ndarray:
        """Unit directions (M, 3) through pixels (M, 2)."""
        flat = (px - [self.width / 2, self.height / 2]) * [1, -1] / self.focal_px
        d = np.column_stack([flat, -np.ones(len(flat))]) @ self.basis
        return d / np.linalg.norm(d, axis=1, keepdims=True)
