"""Strands in the light, drawn by brute force, surface point by surface point, with light that is
cut off behind the limb as light is: nothing of it is shared with the drawing that is tested."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter

from tsvision.measures.helix.section import pair_core
from tsvision.measures.helix.silhouette import KC, PHI, PHIC, RC, RHO, K

HALF, COLUMNS, BLUR_PX = 30, 161, 0.8


def lit(
    p: np.ndarray,
    strings: int,
    light: tuple[float, float, float],
    side: int,
    blur_px: float = BLUR_PX,
    paint: tuple[float, ...] | None = None,
) -> np.ndarray:
    """(R, M) the strands' surface points, the foremost of each pixel, lit from `light`; paint: how
    much of it each strand sends back."""
    section = pair_core(strings)
    z = np.arange(-0.5 * COLUMNS - 30.0, 0.5 * COLUMNS + 30.0, 0.12)
    theta = p[KC] * z + p[PHIC]
    line = np.stack([z, p[RC] * np.cos(theta), p[RC] * np.sin(theta)], 1)
    tangent = np.gradient(line, z, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    normal = np.stack([0.0 * z, -np.cos(theta), -np.sin(theta)], 1)
    binormal = np.cross(tangent, normal)
    points, normals, sent = [], [], []
    sites = zip(section.radius_d, section.angle_rad, paint or (1.0,) * strings, strict=True)
    for radius, angle, share in sites:
        psi = (p[K] * z + p[PHI] + angle)[:, None]
        centre = line + 2.0 * p[RHO] * radius * (np.cos(psi) * normal + np.sin(psi) * binormal)
        along = np.gradient(centre, z, axis=0)
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        first = np.cross(along, [0.13, 0.42, 0.9])
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        second = np.cross(along, first)
        for turn in np.linspace(0.0, 2.0 * np.pi, 120, endpoint=False):
            outward = np.cos(turn) * first + np.sin(turn) * second
            points.append(centre + p[RHO] * outward)
            normals.append(outward)
            sent.append(np.full(len(z), share))
    xyz, n = np.concatenate(points), np.concatenate(normals)
    xyz[:, 2] *= side
    n[:, 2] *= side
    row = np.round(xyz[:, 1] + HALF).astype(int)
    column = np.round(xyz[:, 0] + 0.5 * (COLUMNS - 1)).astype(int)
    inside = (row >= 0) & (row <= 2 * HALF) & (column >= 0) & (column < COLUMNS)
    order = np.argsort(xyz[inside, 2])
    direction = np.array(light) / np.linalg.norm(light)
    shade = np.concatenate(sent) * (0.2 + 0.8 * np.clip(n @ direction, 0.0, None))
    picture = np.zeros((2 * HALF + 1, COLUMNS), dtype=np.float32)
    picture[row[inside][order], column[inside][order]] = shade[inside][order]
    return gaussian_filter(picture, blur_px)
