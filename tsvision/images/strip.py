"""The straightened strip: the picture resampled along the bundle's axis.

Rows run across (n, from -half to +half), columns along (s). The strip is turned, never mirrored,
since a mirror would swap S and Z.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from tsvision.images.turned import turned


@dataclass(frozen=True)
class Axis:
    """The line, or curve, that s runs along.

    points_px: (K, 2) x, y at arc lengths `arc_px` (K,), increasing from the separator's end.
    A straight axis has K = 2.
    """

    points_px: np.ndarray
    arc_px: np.ndarray

    @property
    def is_straight(self) -> bool:
        return len(self.arc_px) == 2

    @property
    def length_px(self) -> float:
        return float(self.arc_px[-1] - self.arc_px[0])

    @cached_property
    def _along(self) -> np.ndarray:
        """Unit vector from the first of the two points of a straight axis to the second."""
        return np.asarray((self.points_px[1] - self.points_px[0]) / self.length_px)

    def at(self, s_px: np.ndarray) -> np.ndarray:
        """x, y (..., 2) at arc length s, continued straight beyond both ends."""
        s = np.asarray(s_px, dtype=float)
        if self.is_straight:
            place: np.ndarray = self.points_px[0] + (s[..., None] - self.arc_px[0]) * self._along
            return place
        return self._inner(s) + self._beyond(s)

    def tangent(self, s_px: np.ndarray) -> np.ndarray:
        """Unit tangent (..., 2) at arc length s."""
        if self.is_straight:
            out = np.empty((*np.shape(s_px), 2))
            out[...] = self._along
            return out
        s = np.clip(np.asarray(s_px, dtype=float), self.arc_px[0], self.arc_px[-1])
        slope = np.gradient(self.points_px, self.arc_px, axis=0)
        t = np.stack([np.interp(s, self.arc_px, slope[:, i]) for i in (0, 1)], axis=-1)
        return t / np.linalg.norm(t, axis=-1, keepdims=True)

    def _inner(self, s: np.ndarray) -> np.ndarray:
        s = np.clip(s, self.arc_px[0], self.arc_px[-1])
        columns = [np.interp(s, self.arc_px, self.points_px[:, i]) for i in (0, 1)]
        return np.stack(columns, axis=-1)

    def _beyond(self, s: np.ndarray) -> np.ndarray:
        over = s - np.clip(s, self.arc_px[0], self.arc_px[-1])
        return over[..., None] * self.tangent(s)

    def reversed(self) -> Axis:
        """The same curve walked from the other end."""
        arc = self.arc_px[-1] - self.arc_px[::-1] + self.arc_px[0]
        return Axis(self.points_px[::-1].copy(), arc)


def straight_axis(start_px: np.ndarray, end_px: np.ndarray) -> Axis:
    """The axis from one point to another; s = 0 at the first."""
    points = np.array([start_px, end_px], dtype=float)
    return Axis(points, np.array([0.0, float(np.hypot(*(points[1] - points[0])))]))


@dataclass(frozen=True)
class Strip:
    """`values` (2 half + 1, M) float32 at s = s0_px + column and n = row - half_px."""

    values: np.ndarray
    s0_px: float
    half_px: int

    @property
    def s_px(self) -> np.ndarray:
        return self.s0_px + np.arange(self.values.shape[1])


def cut_strip(
    picture: np.ndarray,
    axis: Axis,
    s_range_px: tuple[float, float],
    half_px: int,
    light: np.ndarray | None = None,
) -> Strip:
    """Cubic-interpolated strip of a float32 picture, (H, W) or (H, W, C), 1 px a sample; or of a
    grey one of codes, uint8, that stand for `light` (256,).

    n is measured along (-u_y, u_x) with u the axis direction. Points outside the picture are NaN.
    """
    s0 = float(np.ceil(s_range_px[0]))
    count = max(int(np.floor(s_range_px[1] - s0)) + 1, 1)
    s = s0 + np.arange(count)
    origin, u = axis.at(np.array(s0)), axis.tangent(np.array(s0))
    if axis.is_straight and picture.ndim == 2:
        level = turned(picture, origin, u, count, half_px, light)
        if level is not None:
            return Strip(level, s0, half_px)
    if light is not None:
        picture = cv2.LUT(np.ascontiguousarray(picture), light)
    if axis.is_straight:
        normal = np.array([-u[1], u[0]])
        corner = origin - half_px * normal
        matrix = np.array([[u[0], normal[0], corner[0]], [u[1], normal[1], corner[1]]])
        values = cv2.warpAffine(
            picture,
            matrix,
            (count, 2 * half_px + 1),
            flags=cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=(np.nan,) * 4,
        )
        return Strip(values, s0, half_px)
    centre, tangent = axis.at(s), axis.tangent(s)
    n = np.arange(-half_px, half_px + 1, dtype=float)[:, None]
    map_x = (centre[:, 0] - n * tangent[:, 1]).astype(np.float32)
    map_y = (centre[:, 1] + n * tangent[:, 0]).astype(np.float32)
    values = cv2.remap(
        picture,
        map_x,
        map_y,
        cv2.INTER_CUBIC,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=(np.nan,) * 4,
    )
    return Strip(values, s0, half_px)


def averaged(values: np.ndarray, side: int) -> np.ndarray:
    """Values (R, M) or (R, M, C), each the mean of a square of this side, px, about it; NaN where
    any there is."""
    return values if side < 2 else np.asarray(cv2.blur(values, (side, side)))
