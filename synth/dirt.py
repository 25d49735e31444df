"""What a real picture holds besides the strands: loose fibres, dust, another cable.

None of it is in the truth. Everything is drawn from the recording's seed; fibres grow from fixed
places of the string, so they travel and turn with it.
"""

from __future__ import annotations

import cv2
import numpy as np

from synth.settings import Settings
from synth.strands import StrandPath
from synth.tubes import Tube

FIBRE_ID = 100  # tube numbers from here on are not strands
STRING_MM = 140.0  # length of string, from the connector back, that fibres may sit on


def fibres(settings: Settings, paths: list[StrandPath]) -> list[Tube]:
    """Thin curved hairs on the strands that are in the zone now."""
    density = settings.look.fibres_per_mm / max(len(paths), 1)
    tubes: list[Tube] = []
    if density <= 0.0:
        return tubes
    for path in paths:
        random = np.random.default_rng([settings.seed, 23, path.number])
        count = random.poisson(density * STRING_MM)
        places = random.uniform(0.0, STRING_MM, count)
        shapes = random.uniform(-1.0, 1.0, (count, 6))
        points = path.points_mm[path.first : path.last]
        step = np.linalg.norm(np.diff(points, axis=0), axis=1)
        from_end = np.concatenate([np.cumsum(step[::-1])[::-1], [0.0]])
        for place, shape in zip(places, shapes, strict=True):
            if place < from_end[0]:
                at = len(from_end) - 1 - int(np.searchsorted(from_end[::-1], place))
                tubes.append(_fibre(path, path.first + max(at, 1), shape))
    return tubes


def _fibre(path: StrandPath, at: int, shape: np.ndarray) -> Tube:
    point = path.points_mm[at]
    tangent = path.points_mm[at + 1] - path.points_mm[at - 1]
    tangent = tangent / np.linalg.norm(tangent)
    outward = path.offset_mm[at] if path.in_bundle[at] else np.array([0.2, 0.4, 0.9])
    radial = outward - (outward @ tangent) * tangent
    radial /= max(float(np.linalg.norm(radial)), 1e-9)
    side = np.cross(tangent, radial)
    angle = 1.4 * shape[0]
    away = np.cos(angle) * radial + np.sin(angle) * side
    bend = np.cross(away, tangent) * shape[1] + tangent * shape[2]
    length = 0.55 + 0.45 * shape[3]
    t = np.linspace(0.0, 1.0, 14)[:, None]
    reach = length * t
    curve = (
        point
        + 0.42 * path.diameter_mm * away
        + reach * (0.8 * away + 0.5 * shape[4] * tangent)
        + 0.45 * length * t**2 * bend
    )
    radius = 0.005 + 0.002 * (1.0 + shape[5])
    none = np.zeros(len(curve), bool)
    return Tube(curve, np.zeros_like(curve), none, radius, radius, FIBRE_ID + path.number)


def cable(settings: Settings, zone_mm: float) -> list[Tube]:
    """One thick cable that runs behind the rig beside the bundle."""
    if not settings.look.cable:
        return []
    random = np.random.default_rng([settings.seed, 29])
    side = -1.0 if random.random() < 0.5 else 1.0
    x = np.linspace(-0.4 * zone_mm, 1.5 * zone_mm, 160)
    start, slope, sway = random.uniform(3.6, 4.6), random.uniform(0.02, 0.07), random.uniform(0, 6)
    y = side * (start + slope * x + 0.4 * np.sin(x / 7.0 + sway))
    curve = np.column_stack([x, y, np.full_like(x, -4.5)])
    none = np.zeros(len(x), bool)
    return [Tube(curve, np.zeros_like(curve), none, 0.55, 0.55, FIBRE_ID + 50)]


def add_dust(settings: Settings, ground: np.ndarray) -> np.ndarray:
    """Specks lighter or darker than the ground, some of them short threads."""
    if settings.look.dust <= 0:
        return ground
    random = np.random.default_rng([settings.seed, 31])
    height, width = ground.shape[:2]
    mask = np.zeros((height, width), np.float32)
    for _ in range(settings.look.dust):
        x, y = random.uniform(0, width), random.uniform(0, height)
        strength = float(random.choice([-0.5, 0.5, 0.9]))
        spot = np.zeros((height, width), np.uint8)
        if random.random() < 0.3:
            turn = random.uniform(0, np.pi)
            far = random.uniform(4, 16)
            stop = (int(x + far * np.cos(turn)), int(y + far * np.sin(turn)))
            cv2.line(spot, (int(x), int(y)), stop, 255, 1, cv2.LINE_AA)
        else:
            centre = (int(16 * x), int(16 * y))
            cv2.circle(spot, centre, int(16 * random.uniform(0.5, 2.2)), 255, -1, cv2.LINE_AA, 4)
        mask += strength * spot.astype(np.float32) / 255.0
    level = ground.mean(axis=(0, 1))
    light = np.maximum(mask, 0.0)[..., None] * (0.35 + 0.3 * level)
    return np.clip(ground * (1.0 + np.minimum(mask, 0.0)[..., None]) + light, 0.0, 4.0)
