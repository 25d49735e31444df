"""One frame: strands rasterised over the ground and hardware, blurred and exposed.

Strategy: everything that stands still (ground, hardware, vignetting) is drawn and blurred once a
recording; a frame redraws only the rectangle around the strands.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from synth.actuator import State
from synth.camera import View, place
from synth.effects import stated_zone_mm
from synth.hardware import draw_hardware, make_hardware
from synth.sensor import expose
from synth.settings import Settings
from synth.shading import composite
from synth.strands import StrandPath, strand_paths
from synth.tubes import LAYERS, Pieces, Tube, make_pieces, rasterise

LUMA = np.array([0.2126, 0.7152, 0.0722], np.float32)


@dataclass(frozen=True)
class Scene:
    """What stands still: all arrays linear light, (h, w, C), C = 1 for a grey camera."""

    view: View
    ground: np.ndarray
    front: np.ndarray
    front_cover: np.ndarray
    front_near: np.ndarray
    gain: np.ndarray | None
    still: np.ndarray  # ground + hardware, blurred and vignetted


@dataclass(frozen=True)
class Drawing:
    """A frame before the sensor: `linear` (h, w, C); `ids` (h, w) 1 + strand, 0 none;
    `covered` (h, w) the strands' exact coverage, hardware not counted."""

    linear: np.ndarray
    ids: np.ndarray
    covered: np.ndarray


def make_scene(settings: Settings) -> Scene:
    """Draw ground and hardware once."""
    true_zone = stated_zone_mm(settings) + settings.hidden.zone_length_error_mm
    view = place(settings.camera, true_zone)
    front, cover, near = draw_hardware(settings, view, make_hardware(settings))
    ground = _ground(settings, view)
    if settings.sensor.grey:
        front, ground = _grey(front), _grey(ground)
    gain = _vignette(settings, view)
    still = ground * (1.0 - cover[..., None]) + front * cover[..., None]
    still = _blur(still, settings.camera.blur_px)
    if gain is not None:
        still = still * gain[..., None]
    return Scene(view, ground, front, cover, near, gain, still)


def _grey(rgb: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray((rgb @ LUMA)[..., None].astype(np.float32))


def _ground(settings: Settings, view: View) -> np.ndarray:
    look = settings.look
    u = np.linspace(-0.5, 0.5, view.width, dtype=np.float32)[None, :]
    v = np.linspace(-0.5, 0.5, view.height, dtype=np.float32)[:, None]
    level: np.ndarray = np.maximum(
        1.0 + look.ground_gradient[0] * u + look.ground_gradient[1] * v, 0.05
    )
    if look.ground_texture > 0.0:
        random = np.random.default_rng([settings.seed, 11])
        grain: np.ndarray = np.zeros((view.height, view.width), np.float32)
        for sigma, weight in ((1.2, 0.5), (5.0, 0.6), (60.0, 1.2)):
            white = random.standard_normal((view.height, view.width), dtype=np.float32)
            noise = cv2.GaussianBlur(white, (0, 0), sigma)
            grain = grain + weight * noise / max(float(noise.std()), 1e-9)
        level = level * np.clip(1.0 + look.ground_texture * grain, 0.1, 3.0)
    return (level[..., None] * np.array(look.ground_rgb, np.float32)).astype(np.float32)


def _vignette(settings: Settings, view: View) -> np.ndarray | None:
    if settings.look.vignetting <= 0.0:
        return None
    x = (np.arange(view.width) - view.centre_px[0]) / view.half_diagonal_px
    y = (np.arange(view.height) - view.centre_px[1]) / view.half_diagonal_px
    square = x[None, :] ** 2 + y[:, None] ** 2
    return (1.0 - settings.look.vignetting * square).astype(np.float32)


def _blur(image: np.ndarray, sigma: float) -> np.ndarray:
    if sigma <= 0.05:
        return image
    size = 2 * int(np.ceil(3.5 * sigma)) + 1
    soft = cv2.GaussianBlur(image, (size, size), sigma, borderType=cv2.BORDER_REPLICATE)
    return soft.reshape(image.shape)


def tubes_of(settings: Settings, paths: list[StrandPath]) -> list[Tube]:
    """The strands as tubes; flattening thins the radial axis and widens the other."""
    flat = settings.hidden.flattening
    return [
        Tube(
            path.points_mm,
            path.offset_mm,
            path.in_bundle,
            0.5 * path.diameter_mm * (1.0 - flat),
            0.5 * path.diameter_mm / (1.0 - flat),
            path.number,
        )
        for path in paths
    ]


def draw(settings: Settings, scene: Scene, state: State) -> Drawing:
    """The frame in linear light, sharp pixels blurred by the camera's PSF."""
    paths = strand_paths(settings, state)
    pieces = make_pieces(scene.view, tubes_of(settings, paths))
    return _paint(settings, scene, state, pieces)


def _crop(settings: Settings, view: View, pieces: Pieces, margin: float) -> tuple[int, ...]:
    reach = np.sqrt(pieces.section[:, 0].max()) * view.px_per_mm * 1.1 + margin
    left, top = np.floor(pieces.mid_px.min(axis=0) - reach).astype(int)
    right, bottom = np.ceil(pieces.mid_px.max(axis=0) + reach).astype(int) + 1
    return (
        int(np.clip(left, 0, view.width - 1)),
        int(np.clip(top, 0, view.height - 1)),
        int(np.clip(right, 1, view.width)),
        int(np.clip(bottom, 1, view.height)),
    )


def _paint(settings: Settings, scene: Scene, state: State, pieces: Pieces) -> Drawing:
    look, view = settings.look, scene.view
    margin = 4.0 * settings.camera.blur_px + 3.0
    if look.shadow > 0.0:
        margin += view.px_per_mm * (max(map(abs, look.shadow_offset_mm)) + 1.2)
    left, top, right, bottom = _crop(settings, view, pieces, margin)
    window = (slice(top, bottom), slice(left, right))
    shape = (bottom - top, right - left)
    depth = np.full((*shape, LAYERS), -1e9, np.float32)
    alpha = np.zeros((*shape, LAYERS), np.float32)
    piece = np.full((*shape, LAYERS), -1, np.int32)
    rasterise(
        pieces.mid_px, pieces.inverse, pieces.half_mm, pieces.lean, pieces.near_mm,
        pieces.section, pieces.axes, pieces.bend, pieces.strand, left, top, depth, alpha, piece,
    )  # fmt: skip
    image = scene.ground[window].copy()
    if look.shadow > 0.0:
        image *= _shadow(settings, view, alpha)[..., None]
    covered = np.zeros(shape, np.float32)
    ids = np.zeros(shape, np.uint8)
    colours = np.array(look.strand_rgb, np.float64)
    if settings.sensor.grey:
        colours = (colours @ LUMA.astype(float))[:, None]
    key = np.array(look.light, float)
    key /= np.linalg.norm(key)
    dim = 0.06 if look.backlight else 1.0
    composite(
        depth, alpha, piece, pieces.mid_px, pieces.inverse, pieces.half_mm, pieces.lean,
        pieces.section, pieces.axes, pieces.strand, pieces.arc_mm, pieces.outward_mm,
        pieces.inside, left, top,
        0.5 * state.diameter_mm if state.has_bundle else 0.0,
        colours, key, look.light_strength * dim, look.ambient * dim, look.specular * dim,
        look.gloss, look.occlusion, look.braid, 0.35 if look.backlight else 0.0,
        look.light_gradient[0], look.light_gradient[1], float(view.width), float(view.height),
        scene.front[window], scene.front_cover[window], scene.front_near[window],
        image, covered, ids,
    )  # fmt: skip
    image = _blur(image, settings.camera.blur_px)
    if scene.gain is not None:
        image = image * scene.gain[window][..., None]
    return _paste(settings, scene, image, covered, ids, (left, top, right, bottom))


def _shadow(settings: Settings, view: View, alpha: np.ndarray) -> np.ndarray:
    look = settings.look
    mask = alpha.max(axis=2)
    dx, dy = np.array(look.shadow_offset_mm) * view.px_per_mm
    move = np.array([[1.0, 0.0, dx], [0.0, 1.0, -dy]])
    moved = cv2.warpAffine(mask, move, (mask.shape[1], mask.shape[0]))
    soft = cv2.GaussianBlur(moved, (0, 0), max(0.12 * view.px_per_mm, 1.0))
    return 1.0 - look.shadow * soft


def _paste(
    settings: Settings,
    scene: Scene,
    image: np.ndarray,
    covered: np.ndarray,
    ids: np.ndarray,
    box: tuple[int, int, int, int],
) -> Drawing:
    left, top, right, bottom = box
    view = scene.view
    linear = scene.still.copy()
    # Rows and columns within the blur's reach of the rectangle's border come from the still.
    keep = int(np.ceil(3.5 * settings.camera.blur_px)) + 1
    inner = [
        0 if top == 0 else keep,
        image.shape[0] - (0 if bottom == view.height else keep),
        0 if left == 0 else keep,
        image.shape[1] - (0 if right == view.width else keep),
    ]
    linear[top + inner[0] : top + inner[1], left + inner[2] : left + inner[3]] = image[
        inner[0] : inner[1], inner[2] : inner[3]
    ]
    full_ids = np.zeros((view.height, view.width), np.uint8)
    full_cover = np.zeros((view.height, view.width), np.float32)
    full_ids[top:bottom, left:right] = ids
    full_cover[top:bottom, left:right] = covered
    return Drawing(linear, full_ids, full_cover)


def shoot(settings: Settings, scene: Scene, drawing: Drawing, index: int) -> np.ndarray:
    """The stored picture: (h, w) grey or (h, w, 3) BGR, noise seeded by recording and frame."""
    seed = settings.seed * 1_000_003 + index * 7919 + 13
    stored = expose(drawing.linear, settings.sensor, seed)
    if stored.shape[2] == 1:
        return stored[..., 0]
    return np.ascontiguousarray(stored[..., ::-1])
