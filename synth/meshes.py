"""The scene as triangles: strands, separator, connector, scale bar. No graphics library needed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from synth.hardware import Hardware, make_hardware
from synth.settings import Settings
from synth.state import State
from synth.strands import StrandPath, strand_paths
from synth.tubes import thin_out

SIDES = 24
PX_PER_MM = 60.0  # fineness of the strands' tubes
BAR_MM = 5.0


@dataclass(frozen=True)
class Mesh:
    """A named triangle mesh: `points` (P, 3) mm, `normals` (P, 3), `triangles` (T, 3)."""

    name: str
    points: np.ndarray
    normals: np.ndarray
    triangles: np.ndarray
    rgb: tuple[float, float, float]
    metallic: float = 0.0


def scene_meshes(settings: Settings, state: State) -> list[Mesh]:
    """Everything in the rig's frame, mm: x separator to connector, y the holes' plane."""
    colours = settings.look.strand_rgb
    strands = [
        strand_mesh(path, colours[path.number % len(colours)])
        for path in strand_paths(settings, state)
    ]
    return [*strands, *hardware_meshes(settings), scale_bar(make_hardware(settings))]


def strand_mesh(path: StrandPath, rgb: tuple[float, float, float], sides: int = SIDES) -> Mesh:
    """A tube along the strand; its frame is carried along without turning about the tangent."""
    keep = thin_out(path.points_mm, PX_PER_MM)
    points, outward = path.points_mm[keep], path.offset_mm[keep]
    tangent = np.gradient(points, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    radial = _carried(tangent)
    flat = abs(path.half_out_mm - path.half_side_mm) > 1e-9
    if flat:
        own = outward - (outward * tangent).sum(axis=1, keepdims=True) * tangent
        size = np.linalg.norm(own, axis=1, keepdims=True)
        radial = np.where(size > 1e-9, own / np.maximum(size, 1e-9), radial)
    side = np.cross(tangent, radial)
    angle = 2.0 * np.pi * np.arange(sides) / sides
    cos, sin = np.cos(angle)[None, :, None], np.sin(angle)[None, :, None]
    b, c = path.half_out_mm, path.half_side_mm
    ring = b * cos * radial[:, None] + c * sin * side[:, None]
    normal = cos / b * radial[:, None] + sin / c * side[:, None]
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    return Mesh(
        f"strand {path.number + 1}",
        (points[:, None] + ring).reshape(-1, 3),
        normal.reshape(-1, 3),
        _grid_triangles(len(points), sides),
        rgb,
    )


def _carried(tangent: np.ndarray) -> np.ndarray:
    """A normal at each point, turned by the smallest rotation from one tangent to the next."""
    first = np.cross(tangent[0], [0.12, 0.3, 0.95])
    radial = np.empty_like(tangent)
    radial[0] = first / np.linalg.norm(first)
    for i in range(1, len(tangent)):
        free = radial[i - 1] - (radial[i - 1] @ tangent[i]) * tangent[i]
        radial[i] = free / np.linalg.norm(free)
    return radial


def _grid_triangles(rings: int, sides: int) -> np.ndarray:
    ring, side = np.meshgrid(np.arange(rings - 1), np.arange(sides), indexing="ij")
    a = ring * sides + side
    b = ring * sides + (side + 1) % sides
    below = np.stack([a, b, a + sides], axis=-1).reshape(-1, 3)
    above = np.stack([b, b + sides, a + sides], axis=-1).reshape(-1, 3)
    return np.vstack([below, above])


def hardware_meshes(settings: Settings) -> list[Mesh]:
    """Plate, dark discs for its holes, spigot and body of the connector."""
    hardware, look = make_hardware(settings), settings.look
    plate = _box(
        "separator",
        (-hardware.thick_mm, -hardware.half_y_mm, -hardware.half_z_mm),
        (0.0, hardware.half_y_mm, hardware.half_z_mm),
        look.plate_rgb,
    )
    holes = [
        _cylinder(f"hole {i + 1}", 0.0, 0.005, hardware.hole_radius_mm, tuple(hole), (0.01,) * 3)
        for i, hole in enumerate(hardware.holes_mm)
    ]
    start, stop = hardware.zone_mm, hardware.zone_mm + hardware.spigot_mm
    spigot = _cylinder(
        "spigot", start, stop, hardware.spigot_radius_mm, (0.0, 0.0), look.metal_rgb, 0.8
    )
    body = _cylinder(
        "connector", stop, stop + hardware.body_mm, hardware.body_radius_mm, (0.0, 0.0),
        look.metal_rgb, 0.8,
    )  # fmt: skip
    return [plate, *holes, spigot, body]


def scale_bar(hardware: Hardware) -> Mesh:
    """A bar of BAR_MM below the bundle, in the axis's plane."""
    y = -hardware.half_y_mm - 0.8
    middle = 0.5 * hardware.zone_mm
    low = (middle - 0.5 * BAR_MM, y - 0.1, -0.1)
    return _box(
        f"scale bar {BAR_MM:g} mm", low, (middle + 0.5 * BAR_MM, y + 0.1, 0.1), (0.9, 0.9, 0.9)
    )


def _box(
    name: str,
    low: tuple[float, float, float],
    high: tuple[float, float, float],
    rgb: tuple[float, float, float],
) -> Mesh:
    points: list[np.ndarray] = []
    normals: list[np.ndarray] = []
    triangles: list[np.ndarray] = []
    for axis in range(3):
        for end in (0, 1):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            corners = np.empty((4, 3))
            corners[:, axis] = (low, high)[end][axis]
            corners[:, u] = np.array([low[u], high[u], high[u], low[u]])
            corners[:, v] = np.array([low[v], low[v], high[v], high[v]])
            normal = np.zeros(3)
            normal[axis] = 2.0 * end - 1.0
            first = 4 * len(points)
            order = [[0, 1, 2], [0, 2, 3]] if end else [[0, 2, 1], [0, 3, 2]]
            triangles.append(first + np.array(order))
            points.append(corners)
            normals.append(np.tile(normal, (4, 1)))
    return Mesh(name, np.vstack(points), np.vstack(normals), np.vstack(triangles), rgb)


def _cylinder(
    name: str,
    start: float,
    stop: float,
    radius: float,
    centre: tuple[float, ...],
    rgb: tuple[float, ...],
    metallic: float = 0.0,
    sides: int = 64,
) -> Mesh:
    angle = 2.0 * np.pi * np.arange(sides) / sides
    flat = np.stack([np.zeros(sides), np.cos(angle), np.sin(angle)], axis=1)
    middle = np.array([0.0, *centre])
    along = np.array([1.0, 0.0, 0.0])
    rims = [middle + start * along + radius * flat, middle + stop * along + radius * flat]
    side = _grid_triangles(2, sides)
    points = [*rims, *rims, (middle + start * along)[None], (middle + stop * along)[None]]
    normals = [flat, flat, np.tile(-along, (sides, 1)), np.tile(along, (sides, 1)),
               -along[None], along[None]]  # fmt: skip
    i = np.arange(sides)
    after = (i + 1) % sides
    left = np.stack([np.full(sides, 4 * sides), 2 * sides + after, 2 * sides + i], axis=1)
    right = np.stack([np.full(sides, 4 * sides + 1), 3 * sides + i, 3 * sides + after], axis=1)
    return Mesh(
        name,
        np.vstack(points),
        np.vstack(normals),
        np.vstack([side, left, right]),
        (rgb[0], rgb[1], rgb[2]),
        metallic,
    )
