"""Cords drawn for tests: shaded discs along helices about a curve, nearest in front. Its geometry
is its own: nothing of the measuring code is used."""

from __future__ import annotations

import cv2
import numpy as np

WHITE = (230, 235, 235)
RED, BLUE = (40, 40, 230), (230, 60, 40)
CLOTH, TABLE = (20, 20, 20), (120, 150, 165)
_SS = 3  # subsamples a px and side


def bow(height: int, depth_px: float, middle_x: float) -> np.ndarray:
    """A hanging curve (K, 2), in px: half a sine from above the picture to below it."""
    y = np.linspace(-20.0, height + 20.0, 300)
    return np.stack([middle_x + depth_px * np.sin(np.pi * y / height), y], axis=1)


def linear(colour: tuple[int, int, int]) -> np.ndarray:
    return (np.array(colour) / 255.0) ** 2.2


def draw_cord(
    curve: np.ndarray,
    plies: int,
    diameter_px: float,
    repeat_px: float,
    hand: str = "Z",
    colours: tuple[tuple[int, int, int], ...] = (WHITE,),
    ground: tuple[int, int, int] = CLOTH,
    shape: tuple[int, int] = (620, 360),
    hairs: int = 0,
    shadow: bool = False,
    seed: int = 1,
) -> np.ndarray:
    """(H, W, 3) uint8 BGR. `plies` touching strands in a ring of outer diameter `diameter_px`;
    neighbouring strands cross the axis `repeat_px` apart. `shadow` darkens the ground beside."""
    rng = np.random.default_rng(seed)
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    s = np.arange(0.0, arc[-1], 0.4)
    centre = np.stack([np.interp(s, arc, curve[:, i]) for i in (0, 1)], axis=1)
    along = np.gradient(centre, s, axis=0)
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    height, width = shape
    light = np.tile(linear(ground), (height * _SS, width * _SS, 1))
    if shadow:
        points = np.round((centre + 0.9 * diameter_px * across) * _SS).astype(np.int32)
        dark = np.zeros(light.shape[:2], np.uint8)
        cv2.polylines(dark, [points], False, 1, int(1.2 * diameter_px * _SS))
        light[dark > 0] *= 0.35
    depth = np.full(light.shape[:2], -1e9)
    strand = diameter_px / (1.0 + 1.0 / np.sin(np.pi / plies))
    reach = 0.5 * (diameter_px - strand)
    turn = 2.0 * np.pi * s / (repeat_px * plies)
    for k in range(plies):
        phase = turn + 2.0 * np.pi * k / plies
        # In front, where z > 0, a right-handed strand goes to the right as it comes down the page
        # turned on its side: its distance along `across` grows with s.
        offset = reach * np.sin(phase) * (1.0 if hand == "Z" else -1.0)
        place = centre + offset[:, None] * across
        colour = linear(colours[k % len(colours)])
        for (x, y), z in zip(place, reach * np.cos(phase), strict=True):
            _disc(light, depth, x, y, z, 0.5 * strand, colour)
    picture = cv2.resize(light, (width, height), interpolation=cv2.INTER_AREA)
    for _ in range(hairs):
        _hair(picture, rng, centre, across, diameter_px, linear(colours[0]))
    picture = 255.0 * cv2.GaussianBlur(picture, (0, 0), 0.9) ** (1.0 / 2.2)
    return np.clip(picture + rng.normal(0.0, 2.0, picture.shape), 0, 255).astype(np.uint8)


def _disc(light, depth, x: float, y: float, z: float, radius: float, colour) -> None:
    cx, cy, r = (x + 0.5) * _SS - 0.5, (y + 0.5) * _SS - 0.5, radius * _SS
    x0, x1 = max(int(cx - r), 0), min(int(cx + r) + 2, light.shape[1])
    y0, y1 = max(int(cy - r), 0), min(int(cy + r) + 2, light.shape[0])
    if x0 >= x1 or y0 >= y1:
        return
    ys, xs = np.mgrid[y0:y1, x0:x1]
    inside = 1.0 - ((xs - cx) ** 2 + (ys - cy) ** 2) / r**2
    height = np.sqrt(np.maximum(inside, 0.0))
    over = (inside > 0.0) & (z + radius * height > depth[y0:y1, x0:x1])
    depth[y0:y1, x0:x1][over] = (z + radius * height)[over]
    light[y0:y1, x0:x1][over] = colour * (0.25 + 0.75 * height[over])[:, None]


def _hair(picture, rng, centre, across, diameter: float, colour) -> None:
    """One fibre of about a px that leaves the cord on either side and wanders."""
    i = int(rng.integers(centre.shape[0]))
    out = across[i] * rng.choice([-1.0, 1.0])
    steps = rng.normal(0.0, 2.0, (12, 2)) + 1.5 * out
    points = centre[i] + 0.42 * diameter * out + np.cumsum(steps, axis=0)
    cv2.polylines(
        picture,
        [np.round(points * 8).astype(np.int32)],
        False,
        [float(v) * 0.5 for v in colour],
        1,
        cv2.LINE_AA,
        3,
    )
