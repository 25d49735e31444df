"""48 seeded pictures of straight twisted bundles with exactly known D, pitch, angle and sense.

Drawn by the renderer's tubes alone: no separator, no connector, the bundle crosses the picture.
One length unit is one pixel, so the truth needs no camera. Two sets share the same list of cases:
`draw` paints with the analytic renderer, `draw_mesh` with pyvista's tubes where OpenGL is there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np

from synth.camera import place
from synth.paint import Front, crop_box, paint
from synth.sections import make_section
from synth.settings import Camera, Look, Settings, Strings
from synth.tubes import Tube, make_pieces
from tests.bench.pictures48_looks import look_of

WIDTH, HEIGHT = 960, 540
LENGTH_PX = 1400.0  # longer than any line across the picture
GAMMA = 2.2


@dataclass(frozen=True)
class Case:
    """One picture to draw. tilt_deg turns the axis in the picture; noise is the sd of the stored
    grey values as a share of full scale."""

    strings: int
    diameter_px: float
    beta_deg: float
    tilt_deg: float
    phase_rad: float
    handedness: str
    dark_on_bright: bool
    noise: float
    light_deg: float
    seed: int

    @property
    def pitch_px(self) -> float:
        """tan(beta) = pi D / p."""
        return float(np.pi * self.diameter_px / np.tan(np.deg2rad(self.beta_deg)))


def cases(strings: int, seed: int = 48) -> list[Case]:
    """48 cases: 3 angles x 2 grounds x 2 noise levels x 4 diameters from 31 to 62 px."""
    random = np.random.default_rng([seed, strings])
    found = []
    for beta in (15.0, 25.0, 35.0):
        for dark in (False, True):
            for noise in (0.02, 0.05):
                for quarter in range(4):
                    found.append(
                        Case(
                            strings=strings,
                            diameter_px=float(31.0 + 31.0 * (quarter + random.random()) / 4.0),
                            beta_deg=beta,
                            tilt_deg=float(random.uniform(-27.0, 27.0)),
                            phase_rad=float(random.uniform(0.0, 2.0 * np.pi)),
                            handedness="Z" if random.random() < 0.5 else "S",
                            dark_on_bright=dark,
                            noise=noise,
                            light_deg=float(random.uniform(-45.0, 45.0)),
                            seed=int(random.integers(2**31)),
                        )
                    )
    return found


def centre_lines(case: Case) -> tuple[list[np.ndarray], list[np.ndarray], float]:
    """Strand centre lines (M, 3) in px along x, their offsets from the axis, and strand radius."""
    sites = make_section("pair_core", case.strings).sites
    reach = float(np.hypot(*sites.T).max())
    size = case.diameter_px / (1.0 + 2.0 * reach)
    x = np.arange(-0.5 * LENGTH_PX, 0.5 * LENGTH_PX, 0.25)
    sign = 1.0 if case.handedness == "Z" else -1.0
    angle = sign * 2.0 * np.pi * x / case.pitch_px + case.phase_rad
    lines, offsets = [], []
    for y, z in sites * size:
        cos, sin = np.cos(angle), np.sin(angle)
        offset = np.stack([np.zeros_like(x), y * cos - z * sin, y * sin + z * cos], axis=1)
        offsets.append(offset)
        lines.append(offset + np.stack([x, 0 * x, 0 * x], axis=1))
    return lines, offsets, 0.5 * size


def draw(case: Case, blur_px: float = 1.0, look: Look | None = None) -> np.ndarray:
    """The case as a grey picture (540, 960) uint8, by the analytic renderer, in the case's own
    light or in `look`."""
    camera = Camera(width_px=WIDTH, height_px=HEIGHT, px_per_mm=1.0, roll_deg=case.tilt_deg)
    view = place(camera, 0.0)
    look = look or look_of(case.dark_on_bright, case.light_deg)
    settings = Settings(strings=Strings(count=case.strings), camera=camera, look=look)
    lines, offsets, radius = centre_lines(case)
    inside = np.ones(len(lines[0]), bool)
    tubes = [
        Tube(line, offset, inside, radius, radius, number)
        for number, (line, offset) in enumerate(zip(lines, offsets, strict=True))
    ]
    pieces = make_pieces(view, tubes)
    level = float(np.dot(look.ground_rgb, (0.2126, 0.7152, 0.0722)))
    ground = np.full((HEIGHT, WIDTH, 1), level, np.float32)
    empty = np.zeros((HEIGHT, WIDTH), np.float32)
    front = Front(np.zeros_like(ground), empty, empty - 1e9)
    box = crop_box(settings, view, pieces, 3.0)
    painted, _, _ = paint(settings, view, pieces, ground, front, box, 0.5 * case.diameter_px)
    left, top, right, bottom = box
    ground[top:bottom, left:right] = painted
    return stored(ground[..., 0], case, blur_px)


def stored(linear: np.ndarray, case: Case, blur_px: float) -> np.ndarray:
    """Linear light (H, W) as a camera stores it: blurred, gamma-encoded, noisy, 8 bit."""
    soft = cv2.GaussianBlur(linear, (0, 0), blur_px) if blur_px > 0 else linear
    grey = np.clip(soft, 0.0, 1.0) ** (1.0 / GAMMA)
    random = np.random.default_rng(case.seed)
    noisy = grey + case.noise * random.standard_normal(grey.shape)
    return (255.0 * np.clip(noisy, 0.0, 1.0) + 0.5).astype(np.uint8)


def mesh_plotter() -> Any:
    """What `draw_mesh` draws with, four times as fine as a picture; raises where there is no
    OpenGL."""
    import pyvista

    from synth.view3d import require_opengl

    require_opengl()
    return pyvista.Plotter(off_screen=True, window_size=[4 * WIDTH, 4 * HEIGHT])


def draw_mesh(case: Case, plotter: Any, blur_px: float = 1.0, headlight: bool = True) -> np.ndarray:
    """The same case by pyvista's tubes and headlight, four times finer and averaged; without
    `headlight` strands are as bright at their limbs as in their middles.

    Nothing of the analytic renderer's coverage or shading is in it. The tubes have 48 sides, so
    that they lie at most 0.2 % of the strand's radius inside the round ones.
    """
    import pyvista

    plotter.clear_actors()
    lines, _, radius = centre_lines(case)
    dark = case.dark_on_bright
    background = 0.80 if dark else 0.05
    plotter.set_background((background,) * 3)
    for line in lines:
        tube = pyvista.lines_from_points(line[::6]).tube(radius=radius, n_sides=48)
        plotter.add_mesh(
            tube,
            color=(0.16,) * 3 if dark else (0.80,) * 3,
            smooth_shading=True,
            ambient=0.2,
            diffuse=0.8,
            specular=0.05,
            lighting=headlight,
            render=False,
        )
    turn = np.deg2rad(case.tilt_deg)
    plotter.camera.position = (0.0, 0.0, 500.0)
    plotter.camera.focal_point = (0.0, 0.0, 0.0)
    plotter.camera.up = (np.sin(turn), np.cos(turn), 0.0)
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = HEIGHT / 2.0
    plotter.camera.clipping_range = (1.0, 1000.0)
    plotter.render()  # without it the screenshot is the one before
    shot = np.asarray(plotter.screenshot(return_img=True))[..., 0].astype(np.float32) / 255.0
    factor = shot.shape[0] // HEIGHT
    linear = shot.reshape(HEIGHT, factor, WIDTH, factor).mean(axis=(1, 3))
    return stored(linear, case, blur_px)


def without_noise(case: Case) -> Case:
    """The same picture, clean."""
    return replace(case, noise=0.0)
