"""Separator plate with its holes and the motor connector, ray cast once a recording."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from synth.camera import View, undistort
from synth.effects import stated_zone_mm
from synth.sections import section_diameter_mm
from synth.settings import Settings
from synth.strands import hole_centres_mm, hole_diameter_mm

PLATE_THICK_MM = 2.2
SUBSAMPLES = 4


@dataclass(frozen=True)
class Hardware:
    """Sizes in mm, rig frame: the plate spans x -thick..0; the spigot begins at the zone's end."""

    zone_mm: float
    thick_mm: float
    half_y_mm: float
    half_z_mm: float
    holes_mm: np.ndarray  # (H, 2) y, z
    hole_radius_mm: float
    spigot_radius_mm: float
    spigot_mm: float
    body_radius_mm: float
    body_mm: float


def make_hardware(settings: Settings) -> Hardware:
    """Plate and connector for these strings (true S and L, planted errors included)."""
    hidden, strings = settings.hidden, settings.strings
    distance = settings.actuator.hole_distance_mm + hidden.hole_distance_error_mm
    zone = stated_zone_mm(settings) + hidden.zone_length_error_mm
    hole = hole_diameter_mm(settings)
    outer = section_diameter_mm(strings.section, strings.count, strings.diameter_mm)
    return Hardware(
        zone_mm=zone,
        thick_mm=PLATE_THICK_MM,
        half_y_mm=0.5 * distance + 0.5 * hole + 2.3,
        half_z_mm=1.4 if settings.actuator.holes == 2 else 0.5 * distance + 0.5 * hole + 0.8,
        holes_mm=hole_centres_mm(settings, distance),
        hole_radius_mm=0.5 * hole,
        spigot_radius_mm=max(0.6, 0.62 * outer),
        spigot_mm=1.1,
        body_radius_mm=1.9,
        body_mm=9.0,
    )


def ray_grid(view: View) -> tuple[np.ndarray, np.ndarray]:
    """Origins and unit directions in the rig frame, (h + 1, w + 1, 3), through pixel corners."""
    cols = np.arange(view.width + 1) - 0.5
    rows = np.arange(view.height + 1) - 0.5
    ideal = undistort(view, np.stack(np.meshgrid(cols, rows), axis=-1))
    plane = np.zeros((*ideal.shape[:2], 3))
    plane[..., 0] = ideal[..., 0] / view.px_per_mm
    plane[..., 1] = -ideal[..., 1] / view.px_per_mm
    if view.distance_mm > 0:
        eye = np.array([0.0, 0.0, view.distance_mm])
        direction = plane - eye
        direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
        origin = np.broadcast_to(eye, plane.shape)
    else:
        direction = np.broadcast_to(np.array([0.0, 0.0, -1.0]), plane.shape)
        origin = plane + np.array([0.0, 0.0, 50.0])
    back = view.rotation
    return (
        np.ascontiguousarray(origin @ back + view.look_mm),
        np.ascontiguousarray(direction @ back),
    )


def draw_hardware(
    settings: Settings, view: View, hardware: Hardware
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Linear RGB (h, w, 3), coverage (h, w) and nearness (h, w, camera z) of the hardware.

    One ray a pixel; SUBSAMPLES squared where a pixel's corners see different things.
    """
    look = settings.look
    key = np.array(look.light, float)
    key = (key / np.linalg.norm(key)) @ view.rotation  # camera frame -> rig frame
    rgb = np.zeros((view.height, view.width, 3), np.float32)
    cover = np.zeros((view.height, view.width), np.float32)
    near = np.full((view.height, view.width), -1e9, np.float32)
    dim = 0.03 if look.backlight else 1.0
    sizes = np.array(
        [
            hardware.zone_mm,
            hardware.thick_mm,
            hardware.half_y_mm,
            hardware.half_z_mm,
            hardware.hole_radius_mm,
            hardware.spigot_radius_mm,
            hardware.spigot_mm,
            hardware.body_radius_mm,
            hardware.body_mm,
        ]
    )
    origin, direction = ray_grid(view)
    _cast(
        origin, direction, SUBSAMPLES, sizes, hardware.holes_mm, key,
        np.array(look.plate_rgb) * dim, np.array(look.metal_rgb) * dim,
        look.light_strength, look.ambient, view.rotation[2].astype(float),
        view.look_mm.astype(float), rgb, cover, near,
    )  # fmt: skip
    return rgb, cover, near


@njit(cache=True, error_model="numpy")
def _hit(o, w, sizes, holes, normal):
    """Nearest surface along a ray: (kind, distance); kind 0 none, 1 plate, 2 metal, 3 hole."""
    zone, thick, hy, hz, hole_r = sizes[0], sizes[1], sizes[2], sizes[3], sizes[4]
    best = 1e9
    kind = 0
    enter, leave, axis = -1e9, 1e9, 0
    for i in range(3):
        low = -thick if i == 0 else (-hy if i == 1 else -hz)
        high = 0.0 if i == 0 else (hy if i == 1 else hz)
        if abs(w[i]) < 1e-12:
            if o[i] < low or o[i] > high:
                leave = -1e9
            continue
        t0, t1 = (low - o[i]) / w[i], (high - o[i]) / w[i]
        if t0 > t1:
            t0, t1 = t1, t0
        if t0 > enter:
            enter, axis = t0, i
        leave = min(leave, t1)
    if enter < leave and enter > 0.0:
        best, kind = enter, 1
        normal[:] = 0.0
        normal[axis] = -1.0 if w[axis] > 0 else 1.0
        if axis == 0:
            for h in range(holes.shape[0]):
                y = o[1] + enter * w[1] - holes[h, 0]
                z = o[2] + enter * w[2] - holes[h, 1]
                if y * y + z * z < hole_r * hole_r:
                    kind = 3
    for part in range(2):
        r = sizes[5] if part == 0 else sizes[7]
        x0 = zone if part == 0 else zone + sizes[6]
        x1 = x0 + (sizes[6] if part == 0 else sizes[8])
        a = w[1] * w[1] + w[2] * w[2]
        b = o[1] * w[1] + o[2] * w[2]
        c = o[1] * o[1] + o[2] * o[2] - r * r
        disc = b * b - a * c
        if a > 1e-12 and disc > 0:
            t = (-b - np.sqrt(disc)) / a
            x = o[0] + t * w[0]
            if 0 < t < best and x0 <= x <= x1:
                best, kind = t, 2
                normal[0] = 0.0
                normal[1] = (o[1] + t * w[1]) / r
                normal[2] = (o[2] + t * w[2]) / r
        if abs(w[0]) > 1e-9:
            for end in range(2):
                xe = x0 if end == 0 else x1
                t = (xe - o[0]) / w[0]
                y, z = o[1] + t * w[1], o[2] + t * w[2]
                if 0 < t < best and y * y + z * z < r * r:
                    best, kind = t, 2
                    normal[:] = 0.0
                    normal[0] = -1.0 if end == 0 else 1.0
    code = kind
    if kind > 0:
        # corners that see other faces of one body must not be taken for a flat pixel
        code = kind * 8 + int(abs(normal[0]) > 0.9) * 4 + int(abs(normal[2]) > 0.9) * 2
        if kind == 2:
            code = kind * 8 + int(abs(normal[0]) > 0.9) * 4
    return kind, best, code


@njit(cache=True, error_model="numpy")
def _cast(
    origin, direction, s, sizes, holes, key, plate, metal, strength, ambient, zaxis, look, rgb,
    cover, near,
):  # fmt: skip
    height, width = cover.shape
    normal = np.empty(3)
    o, w, point = np.empty(3), np.empty(3), np.empty(3)
    codes = np.empty((height + 1, width + 1), np.int64)
    for row in range(height + 1):
        for col in range(width + 1):
            codes[row, col] = _hit(origin[row, col], direction[row, col], sizes, holes, normal)[2]
    for row in range(height):
        for col in range(width):
            first = codes[row, col]
            flat = (
                first == codes[row, col + 1]
                and first == codes[row + 1, col]
                and first == codes[row + 1, col + 1]
            )
            if flat and first == 0:
                continue
            n = 1 if flat else s
            share = 1.0 / (n * n)
            for sub in range(n * n):
                fy, fx = (sub // n + 0.5) / n, (sub % n + 0.5) / n
                for i in range(3):
                    o[i] = (1 - fy) * (
                        (1 - fx) * origin[row, col, i] + fx * origin[row, col + 1, i]
                    ) + fy * ((1 - fx) * origin[row + 1, col, i] + fx * origin[row + 1, col + 1, i])
                    w[i] = (1 - fy) * (
                        (1 - fx) * direction[row, col, i] + fx * direction[row, col + 1, i]
                    ) + fy * (
                        (1 - fx) * direction[row + 1, col, i] + fx * direction[row + 1, col + 1, i]
                    )
                kind, best, _ = _hit(o, w, sizes, holes, normal)
                if kind == 0:
                    continue
                for i in range(3):
                    point[i] = o[i] + best * w[i]
                diffuse, facing, shine, size, z = 0.0, 0.0, 0.0, 0.0, 0.0
                for i in range(3):
                    diffuse += normal[i] * key[i]
                    facing -= normal[i] * w[i]
                    shine += normal[i] * (key[i] - w[i])
                    size += (key[i] - w[i]) ** 2
                    z += (point[i] - look[i]) * zaxis[i]
                shine = max(shine / np.sqrt(size), 0.0)
                diffuse = max(diffuse, 0.0)
                light = strength * diffuse + ambient * (0.6 + 0.4 * facing)
                cover[row, col] += share
                near[row, col] = max(near[row, col], z)
                for ch in range(3):
                    if kind == 1:
                        value = plate[ch] * light
                    elif kind == 2:
                        value = metal[ch] * (0.55 * light + 1.6 * strength * shine**40)
                        value += metal[ch] * 0.3 * ambient * (1.0 - facing)
                    else:
                        value = 0.06 * plate[ch] * light
                    rgb[row, col, ch] += share * value
            if cover[row, col] > 0:
                for ch in range(3):
                    rgb[row, col, ch] /= cover[row, col]
