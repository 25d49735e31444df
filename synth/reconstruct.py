"""The renderer's best reconstruction of a photographed piece of bundle.

Strategy. A straight bundle of round strands is drawn in the photograph's own strip (separator on
the left) under four lights, each alone. A picture is linear in its lights, so their strengths and
the ground follow by non-negative least squares; what is left to search are the phase, the pitch,
the diameter and where the axis lies. What the photograph holds and the drawing does not is then
tried as a taper, flattened strands and a loose section, one at a time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import cv2
import numpy as np
from scipy.optimize import minimize, nnls

from synth.camera import View
from synth.paint import Front, paint
from synth.sections import make_section
from synth.settings import Look, Settings
from synth.tubes import Tube, make_pieces

LIGHTS = (
    Look(strand_rgb=((1.0, 1.0, 1.0),), ambient=1.0, light_strength=0.0, specular=0.0),
    *(
        Look(
            strand_rgb=((1.0, 1.0, 1.0),),
            ambient=0.0,
            light_strength=1.0,
            specular=0.0,
            light=direction,
        )
        for direction in ((0.0, 0.0, 1.0), (0.0, 0.92, 0.39), (0.0, -0.92, 0.39))
    ),
)
PHASES = 12
PITCH_TIMES = (1.0, 2.0 / 3.0, 1.5)
MOST_EXTRA = 0.5
MOST_TRIES = 140  # of the straight bundle, and for each extra
MARGIN_D = 1.5  # the bundle is drawn so far beyond both ends, in units of D
EXTRAS = {"taper": 0.04, "flattening": 0.06, "looseness": 0.06}  # first steps tried, either way
# first steps of phase, log pitch, offset / D, log D, tilt over the length / D, log blur
STEPS = np.array([0.15, 0.02, 0.03, 0.03, 0.03, 0.15])


@dataclass(frozen=True)
class Rope:
    """A straight bundle in a strip; px, phase in the middle, x right, y down.

    `taper` is the relative change of the section along the strip, `flattening` the share by which
    the strands' outward axis is shorter, `looseness` that by which neighbours lie apart.
    """

    count: int
    diameter_px: float
    pitch_px: float
    handedness: str
    phase_rad: float = 0.0
    offset_px: float = 0.0
    tilt_px: float = 0.0
    blur_px: float = 1.0
    taper: float = 0.0
    flattening: float = 0.0
    looseness: float = 0.0


@dataclass(frozen=True)
class Extra:
    """One departure from the straight round bundle: its value, what is left with it, and the
    diameter and axis that come with it."""

    value: float
    rms: float
    rope: Rope


@dataclass(frozen=True)
class Reconstruction:
    """`picture` (h, w) beside the photograph, both linear light; `rms` of their difference over
    the bundle, `contrast` of strand against ground; `extras` by name."""

    rope: Rope
    picture: np.ndarray
    covered: np.ndarray
    rms: float
    contrast: float
    extras: dict[str, Extra]


def reconstruct(photo: np.ndarray, start: Rope) -> Reconstruction:
    """The best drawing of `photo` (h, w), linear light, the axis along its middle row."""
    cost = _cost(photo, start)
    first = sorted(_phases(start), key=cost)[:2]
    rope = min((_settled(r, cost) for r in first), key=cost)
    best = cost(rope)
    extras = {name: _with_extra(rope, cost, name) for name in EXTRAS}
    picture, covered = drawn(rope, photo)
    inside, outside = photo[covered > 0.95], photo[covered < 0.01]
    contrast = abs(float(np.median(inside)) - float(np.median(outside)))
    return Reconstruction(rope, picture, covered, best, contrast, extras)


def likeness(photo: np.ndarray, start: Rope) -> float:
    """How much of the strip's own variation the best phase of `start` leaves: small on a bundle,
    near 1 on legs or hardware."""
    cost = _cost(photo, start)
    return min(map(cost, _phases(start))) / max(float(photo.std()), 1e-9)


def _phases(start: Rope) -> list[Rope]:
    """All phases, at the pitch given and at those that it is easily mistaken for."""
    turn = 2.0 * np.pi / (2 if start.count % 2 == 0 else start.count)
    return [
        replace(start, phase_rad=phase, pitch_px=times * start.pitch_px)
        for times in PITCH_TIMES
        for phase in np.arange(PHASES) / PHASES * turn
    ]


def _cost(photo: np.ndarray, start: Rope) -> Callable[[Rope], float]:
    """The rms difference within 0.75 D of the axis."""
    half = 0.75 * start.diameter_px
    near = np.abs(np.arange(photo.shape[0]) - (photo.shape[0] - 1) / 2) < half

    def cost(rope: Rope) -> float:
        picture, _ = drawn(rope, photo)
        return float(np.sqrt(np.mean((picture - photo)[near] ** 2)))

    return cost


def _settled(rope: Rope, cost: Callable[[Rope], float], names: tuple[str, ...] = ()) -> Rope:
    """Nelder-Mead over the six numbers of a straight bundle, and those of `names`."""
    d = rope.diameter_px

    def at(u: np.ndarray) -> Rope:
        more = {
            name: float(np.clip(getattr(rope, name) + u[6 + i], -MOST_EXTRA, MOST_EXTRA))
            for i, name in enumerate(names)
        }
        return replace(
            rope,
            phase_rad=rope.phase_rad + u[0],
            pitch_px=rope.pitch_px * float(np.exp(u[1])),
            offset_px=rope.offset_px + d * u[2],
            diameter_px=d * float(np.exp(np.clip(u[3], -0.5, 0.5))),
            tilt_px=rope.tilt_px + d * u[4],
            blur_px=rope.blur_px * float(np.exp(np.clip(u[5], -0.7, 0.7))),
            **more,  # type: ignore[arg-type]
        )

    steps = np.concatenate([STEPS, [EXTRAS[name] for name in names]])
    simplex = np.vstack([np.zeros(len(steps)), np.diag(steps)])
    options = {
        "initial_simplex": simplex,
        "maxfev": MOST_TRIES,
        "xatol": 1e-3,
        "fatol": 1e-6,
    }
    found = minimize(lambda u: cost(at(u)), simplex[0], method="Nelder-Mead", options=options)
    return at(found.x)


def _with_extra(rope: Rope, cost: Callable[[Rope], float], name: str) -> Extra:
    better = _settled(rope, cost, (name,))
    return Extra(float(getattr(better, name)), cost(better), better)


def drawn(rope: Rope, photo: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The drawing under the lights and over the ground that come closest to `photo`, and its
    coverage, both (h, w)."""
    lit, covered = under_each_light(rope, photo.shape)
    height, width = photo.shape
    down, along = np.mgrid[0:height, 0:width]
    bare = 1.0 - covered
    slope = [(down / height - 0.5) * bare, (along / width - 0.5) * bare]
    columns = [*lit, bare, *slope, *(-s for s in slope)]
    matrix = np.stack([c.ravel() for c in columns], axis=1).astype(float)
    strengths = nnls(matrix.T @ matrix, matrix.T @ photo.ravel().astype(float))[0]
    return (matrix @ strengths).reshape(photo.shape), covered


def under_each_light(rope: Rope, shape: tuple[int, ...]) -> tuple[list[np.ndarray], np.ndarray]:
    """The strands (1: white) under each of LIGHTS, over black, and their coverage."""
    height, width = shape
    view = View(
        rotation=np.eye(3),
        look_mm=np.zeros(3),
        px_per_mm=1.0,
        distance_mm=0.0,
        centre_px=np.array([0.0, (height - 1) / 2.0]),
        half_diagonal_px=float(np.hypot(height, width)),
        k1=0.0,
        k2=0.0,
        width=width,
        height=height,
    )
    pieces = make_pieces(view, _tubes(rope, width))
    nothing = np.zeros((height, width), np.float32)
    dark = np.zeros((height, width, 1), np.float32)
    front = Front(dark, nothing, np.full((height, width), -1e9, np.float32))
    lit = []
    for look in LIGHTS:
        image, covered, _ = paint(
            Settings(look=look), view, pieces, dark, front, (0, 0, width, height),
            0.5 * rope.diameter_px,
        )  # fmt: skip
        lit.append(_soft(image[..., 0], rope.blur_px))
    return lit, _soft(covered, rope.blur_px)


def _soft(image: np.ndarray, blur_px: float) -> np.ndarray:
    return cv2.GaussianBlur(image, (0, 0), blur_px, borderType=cv2.BORDER_REPLICATE)


def _tubes(rope: Rope, width: int) -> list[Tube]:
    """The strands as helices about the axis; 1 px stands for 1 mm."""
    section = make_section("pair_core" if rope.count <= 10 else "ring", rope.count)
    apart = 1.0 + rope.looseness
    d = rope.diameter_px / (1.0 + 2.0 * section.radius * apart)
    beyond = MARGIN_D * rope.diameter_px
    x = np.arange(-beyond, width + beyond, max(rope.pitch_px / 180.0, 0.25))
    grown = 1.0 + rope.taper * (x / width - 0.5)
    sign = 1.0 if rope.handedness != "S" else -1.0
    turned = rope.phase_rad + sign * 2.0 * np.pi * (x - 0.5 * width) / rope.pitch_px
    middle = -(rope.offset_px + rope.tilt_px * (x / width - 0.5))
    tubes = []
    for number, (a, b) in enumerate(section.sites * d * apart):
        radius, angle = np.hypot(a, b) * grown, np.arctan2(b, a) + turned
        outward = np.stack([0.0 * x, radius * np.cos(angle), radius * np.sin(angle)], axis=1)
        points = outward + np.stack([x, middle, 0.0 * x], axis=1)
        half = 0.5 * d
        tubes.append(
            Tube(
                points_mm=points,
                outward_mm=outward,
                in_bundle=np.ones(len(x), bool),
                half_out_mm=half * (1.0 - rope.flattening),
                half_side_mm=half * (1.0 + rope.flattening),
                strand=number,
            )
        )
    return tubes
