"""One frame: strands rasterised over the ground and hardware, blurred and exposed.

Strategy: everything that stands still (ground, hardware, vignetting) is drawn and blurred once a
recording; a frame redraws only the rectangle around the strands.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from synth.camera import View, place
from synth.dirt import cable, fibres
from synth.effects import stated_zone_mm
from synth.focus import focus_blur, ground_sigma, reach_px, soften
from synth.ground import ground_of, vignette_of
from synth.hardware import draw_hardware, make_hardware
from synth.paint import LUMA, Box, Front, crop_box, paint
from synth.sensor import expose
from synth.settings import Settings
from synth.state import State
from synth.strands import StrandPath, strand_paths
from synth.tubes import Tube, make_pieces

CABLE_RGB = (0.03, 0.03, 0.035)


@dataclass(frozen=True)
class Scene:
    """What stands still: all arrays linear light, (h, w, C), C = 1 for a grey camera."""

    view: View
    ground: np.ndarray
    front: Front
    gain: np.ndarray | None
    still: np.ndarray  # ground + hardware, blurred and vignetted
    reach_px: float  # how far the blur carries


@dataclass(frozen=True)
class Drawing:
    """A frame before the sensor: `linear` (h, w, C); `ids` (h, w) 1 + strand, 0 none;
    `covered` (h, w) the strands' exact coverage, hardware not counted."""

    linear: np.ndarray
    ids: np.ndarray
    covered: np.ndarray


def make_scene(settings: Settings) -> Scene:
    """Draw ground and hardware once."""
    zone_mm = stated_zone_mm(settings)
    view = place(settings.camera, zone_mm)
    rgb, cover, near = draw_hardware(settings, view, make_hardware(settings))
    ground = ground_of(settings, view)
    if settings.sensor.grey:
        rgb, ground = _grey(rgb), _grey(ground)
    ground = soften(ground, ground_sigma(settings))
    ground = _with_cable(settings, view, ground, zone_mm)
    gain = vignette_of(settings, view)
    box = (0, 0, view.width, view.height)
    still = ground * (1.0 - cover[..., None]) + rgb * cover[..., None]
    still = focus_blur(settings, view, still, box)
    if gain is not None:
        still = still * gain[..., None]
    return Scene(view, ground, Front(rgb, cover, near), gain, still, reach_px(settings, view))


def _grey(rgb: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray((rgb @ LUMA)[..., None].astype(np.float32))


def _with_cable(settings: Settings, view: View, ground: np.ndarray, zone_mm: float) -> np.ndarray:
    tubes = cable(settings, zone_mm)
    if not tubes:
        return ground
    height, width = ground.shape[:2]
    nothing = Front(
        np.zeros_like(ground),
        np.zeros((height, width), np.float32),
        np.full((height, width), -1e9, np.float32),
    )
    plain = replace(settings, look=replace(settings.look, braid=0.0, fibres_per_mm=0.0))
    pieces = make_pieces(view, tubes)
    image, _, _ = paint(plain, view, pieces, ground, nothing, (0, 0, width, height), 0.0,
                        (CABLE_RGB,))  # fmt: skip
    return soften(image, ground_sigma(settings))


def tubes_of(paths: list[StrandPath]) -> list[Tube]:
    """The strands as tubes."""
    return [
        Tube(p.points_mm, p.offset_mm, p.in_bundle, p.half_out_mm, p.half_side_mm, p.number)
        for p in paths
    ]


def draw(
    settings: Settings, scene: Scene, state: State, paths: list[StrandPath] | None = None
) -> Drawing:
    """The frame in linear light, blurred by the lens; `paths` saves laying the strands again."""
    paths = paths or strand_paths(settings, state)
    pieces = make_pieces(scene.view, tubes_of(paths) + fibres(settings, paths))
    box = crop_box(settings, scene.view, pieces, scene.reach_px + 3.0)
    outer_mm = 0.5 * state.diameter_mm if state.has_bundle else 0.0
    image, covered, ids = paint(
        settings, scene.view, pieces, scene.ground, scene.front, box, outer_mm
    )
    image = focus_blur(settings, scene.view, image, box)
    if scene.gain is not None:
        left, top, right, bottom = box
        image = image * scene.gain[top:bottom, left:right, None]
    return _paste(scene, image, covered, ids, box)


def _paste(
    scene: Scene, image: np.ndarray, covered: np.ndarray, ids: np.ndarray, box: Box
) -> Drawing:
    left, top, right, bottom = box
    view = scene.view
    linear = scene.still.copy()
    # Rows and columns within the blur's reach of the rectangle's border come from the still.
    keep = int(np.ceil(scene.reach_px))
    rows = slice(0 if top == 0 else keep, image.shape[0] - (0 if bottom == view.height else keep))
    cols = slice(0 if left == 0 else keep, image.shape[1] - (0 if right == view.width else keep))
    linear[top:bottom, left:right][rows, cols] = image[rows, cols]
    full_ids = np.zeros((view.height, view.width), np.uint8)
    full_cover = np.zeros((view.height, view.width), np.float32)
    full_ids[top:bottom, left:right] = ids
    full_cover[top:bottom, left:right] = covered
    return Drawing(linear, full_ids, full_cover)


def shoot(settings: Settings, drawing: Drawing, index: int) -> np.ndarray:
    """The stored picture: (h, w) grey or (h, w, 3) BGR, noise seeded by recording and frame."""
    seed = settings.seed * 1_000_003 + index * 7919 + 13
    stored = expose(drawing.linear, settings.sensor, seed)
    if stored.shape[2] == 1:
        return stored[..., 0]
    return np.ascontiguousarray(stored[..., ::-1])
