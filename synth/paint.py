"""Pieces of tube painted over a ground and under the hardware, in linear light."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from synth.camera import View
from synth.dirt import FIBRE_ID
from synth.settings import Settings
from synth.shading import composite
from synth.tubes import LAYERS, Pieces, rasterise

LUMA = np.array([0.2126, 0.7152, 0.0722], np.float32)
Box = tuple[int, int, int, int]  # left, top, right, bottom


@dataclass(frozen=True)
class Front:
    """Hardware over the whole picture: colour (h, w, C), coverage (h, w), nearness (h, w)."""

    rgb: np.ndarray
    cover: np.ndarray
    near: np.ndarray


def crop_box(settings: Settings, view: View, pieces: Pieces, margin: float) -> Box:
    """The rectangle that the pieces, their shadow and their blur can change."""
    look = settings.look
    if look.shadow > 0.0:
        margin += view.px_per_mm * (max(map(abs, look.shadow_offset_mm)) + 1.2)
    reach = np.sqrt(pieces.section[:, 0].max()) * view.px_per_mm * 1.1 + margin
    left, top = np.floor(pieces.mid_px.min(axis=0) - reach).astype(int)
    right, bottom = np.ceil(pieces.mid_px.max(axis=0) + reach).astype(int) + 1
    return (
        int(np.clip(left, 0, view.width - 1)),
        int(np.clip(top, 0, view.height - 1)),
        int(np.clip(right, 1, view.width)),
        int(np.clip(bottom, 1, view.height)),
    )


def paint(
    settings: Settings,
    view: View,
    pieces: Pieces,
    ground: np.ndarray,
    front: Front,
    box: Box,
    outer_mm: float,
    rgb: tuple[tuple[float, float, float], ...] | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(image (h, w, C), covered (h, w), ids (h, w)) of the crop; nothing is changed in place.

    `outer_mm` is the bundle's radius for the darkening of grooves, 0 for none.
    """
    look = settings.look
    left, top, right, bottom = box
    window = (slice(top, bottom), slice(left, right))
    shape = (bottom - top, right - left)
    depth = np.full((*shape, LAYERS), -1e9, np.float32)
    alpha = np.zeros((*shape, LAYERS), np.float32)
    piece = np.full((*shape, LAYERS), -1, np.int32)
    rasterise(
        pieces.mid_px, pieces.inverse, pieces.half_mm, pieces.lean, pieces.near_mm,
        pieces.section, pieces.axes, pieces.mitre, pieces.steep, pieces.strand,
        left, top, depth, alpha, piece,
    )  # fmt: skip
    image = ground[window].copy()
    if look.shadow > 0.0:
        image *= _shadow(settings, view, alpha)[..., None]
    covered = np.zeros(shape, np.float32)
    ids = np.zeros(shape, np.uint8)
    colours = np.array(rgb or look.strand_rgb, np.float64)
    if image.shape[2] == 1:
        colours = (colours @ LUMA.astype(float))[:, None]
    key = np.array(look.light, float)
    key /= np.linalg.norm(key)
    dim = 0.06 if look.backlight else 1.0
    composite(
        depth, alpha, piece, pieces.mid_px, pieces.inverse, pieces.lean,
        pieces.section, pieces.axes, pieces.strand, pieces.arc_mm, pieces.outward_mm,
        pieces.inside, left, top, outer_mm, FIBRE_ID,
        colours, key, look.light_strength * dim, look.ambient * dim, look.specular * dim,
        look.gloss, look.occlusion, look.braid, 0.35 if look.backlight else 0.0,
        look.light_gradient[0], look.light_gradient[1], float(view.width), float(view.height),
        front.rgb[window], front.cover[window], front.near[window],
        image, covered, ids,
    )  # fmt: skip
    return image, covered, ids


def _shadow(settings: Settings, view: View, alpha: np.ndarray) -> np.ndarray:
    look = settings.look
    mask = alpha.max(axis=2)
    dx, dy = np.array(look.shadow_offset_mm) * view.px_per_mm
    move = np.array([[1.0, 0.0, dx], [0.0, 1.0, -dy]])
    moved = cv2.warpAffine(mask, move, (mask.shape[1], mask.shape[0]))
    soft = cv2.GaussianBlur(moved, (0, 0), max(0.12 * view.px_per_mm, 1.0))
    return 1.0 - look.shadow * soft
