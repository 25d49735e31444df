"""Recordings in which everything is drawn at once: view, strings, ground, light, film.

The catalogue's films each have one difficulty; what a stranger sends has several. `wild(number)` is
the number-th of an endless list that nothing is tuned to: strings and ground of any colour that the
eye tells apart, the separator on any side, whole zone or close-up, lamp anywhere before the plane,
sharp or not, noisy or not, any coding.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .camera import Camera
from .catalogue import WHOLE, knot
from .film import Film
from .recording import Spec
from .scene import RGB, Look

COLOURS: dict[str, RGB] = {
    "white": (0.75, 0.73, 0.68), "cream": (0.70, 0.62, 0.45), "black": (0.02, 0.02, 0.022),
    "grey": (0.28, 0.28, 0.29), "red": (0.45, 0.04, 0.04), "green": (0.05, 0.28, 0.08),
    "blue": (0.04, 0.09, 0.42), "orange": (0.62, 0.25, 0.04), "pink": (0.6, 0.2, 0.3),
}  # fmt: skip
TINTS: tuple[RGB, ...] = ((1, 1, 1), (1.2, 1.0, 0.75), (0.8, 1.0, 1.2), (0.85, 1.1, 0.9))
LUMA = np.array([0.2126, 0.7152, 0.0722])
APART = 3.0  # times that strings and ground differ in light, or ...
HUES_APART = 0.35  # ... how far in hue
# By N: turns of a whole recording, where overtwist begins, and how fast the coil grows.
TURNS = {2: 60.0, 4: 42.0, 6: 30.0, 8: 26.0}
COILS = {2: (28.0, 0.066), 4: (18.0, 0.07), 6: (12.0, 0.07), 8: (12.0, 0.06)}
FRAMES = 8
BRIGHTEST = 0.8  # of full well, that a film is exposed to


def wild(number: int) -> Spec:
    """One recording; equal numbers give equal ones."""
    rng = np.random.default_rng([4711, number])
    count = int(rng.choice([2, 2, 4, 6, 8]))
    close = bool(rng.random() < 0.3)
    camera = _camera(rng, close)
    film = _film(rng)
    look, named = _look(rng, count, film.mono)
    most, (coil_from, grows) = TURNS[count], COILS[count]
    turns = np.sort(rng.uniform(0.06, 0.5 if close else 1.0, FRAMES)) * most
    centre, size = rng.uniform(9.0, 16.5), rng.uniform(0.8, 1.1)
    begins = rng.uniform(0.62, 0.8) * most
    knots = (knot(count, centre, rng.uniform(1.8, 2.6), begins, size),)
    return Spec(
        f"wild_{number}",
        f"{named}, {'close-up' if close else 'whole zone'}, side at {camera.axis_deg:.0f} deg",
        count=count,
        hand=int(rng.choice([-1, 1])),
        turns=tuple(round(float(t), 2) for t in turns),
        camera=camera,
        look=look,
        film=film,
        coil_from=coil_from,
        coil_per_root_turn_d=grows,
        unevenness=float(rng.choice([0.0, 0.0, 0.3])),
        swell=float(rng.uniform(0.0, 0.05)),
        knots=() if close or rng.random() < 0.25 else knots,
        exposed_to=BRIGHTEST,
        seed=50_000 + number,
    )


def _camera(rng: np.random.Generator, close: bool) -> Camera:
    side = float(rng.choice([0.0, 0.0, 90.0, 180.0, 270.0]))
    tall = side in (90.0, 270.0)
    whole = Camera(
        px_per_mm=rng.uniform(24.5, 27.5) if tall else rng.uniform(36.0, 46.0),
        target_mm=(11.5, 0.0, 0.0) if tall else WHOLE,
        axis_deg=side + rng.uniform(-6.0, 6.0),
        yaw_deg=rng.uniform(-4.0, 4.0),
        pitch_deg=rng.uniform(-4.0, 4.0),
        distance_mm=rng.uniform(90.0, 180.0),
    )
    if not close:
        return whole
    return replace(
        whole, px_per_mm=rng.uniform(60.0, 120.0), target_mm=(rng.uniform(3.5, 5.0), 0.0, 0.0)
    )


def _look(rng: np.random.Generator, count: int, mono: bool) -> tuple[Look, str]:
    """Strings and a ground that the film tells apart, under a lamp anywhere before their plane."""
    while True:
        several = bool(rng.random() < 0.2)
        names = [str(n) for n in rng.choice(list(COLOURS), 2 if several else 1, replace=False)]
        level = float(np.exp(rng.uniform(np.log(0.01), np.log(0.6))))
        tint = np.array(TINTS[int(rng.integers(len(TINTS)))])
        ground = np.clip(level * tint, 0.003, 0.9)
        if all(_apart(np.array(COLOURS[n]), ground, mono) for n in names):
            break
    strings = tuple(COLOURS[names[i % len(names)]] for i in range(count))
    look = Look(
        strings=strings,
        ground=(float(ground[0]), float(ground[1]), float(ground[2])),
        plate=tuple(float(v) for v in rng.uniform(0.02, 0.5, 3)),  # type: ignore[arg-type]
        braid=rng.uniform(0.0, 0.4),
        bump_mm=rng.uniform(0.0, 0.03),
        gloss=rng.uniform(0.1, 0.7),
        fibres=int(rng.integers(0, 45)),
        light_from=(rng.uniform(-0.9, 0.9), rng.choice([-1, 1]) * rng.uniform(0.2, 1.0), 0.9),
        lamp_size_mm=rng.uniform(15.0, 80.0),
        ambient=rng.uniform(0.08, 0.5),
        ground_gap_mm=rng.uniform(6.0, 25.0),
        ground_texture=rng.uniform(0.02, 0.14),
    )
    return look, f"{' and '.join(names)} on {level:.3f}"


def _apart(strings: np.ndarray, ground: np.ndarray, mono: bool) -> bool:
    ratio = float(LUMA @ strings) / float(LUMA @ ground)
    hues = [c / np.linalg.norm(c) for c in (strings, ground)]
    other_hue = not mono and float(np.linalg.norm(hues[0] - hues[1])) > HUES_APART
    return other_hue or max(ratio, 1.0 / ratio) > APART


def _film(rng: np.random.Generator) -> Film:
    blurred = str(rng.choice(["no", "no", "defocus", "motion"]))
    return Film(
        gauss_blur_px=rng.uniform(0.5, 1.2),
        defocus_px=rng.uniform(1.0, 2.5) if blurred == "defocus" else 0.0,
        motion_px=rng.uniform(2.0, 5.0) if blurred == "motion" else 0.0,
        motion_deg=rng.uniform(0.0, 180.0),
        full_well_e=float(np.exp(rng.uniform(np.log(400.0), np.log(10_000.0)))),
        read_noise_e=rng.uniform(2.0, 10.0),
        mono=bool(rng.random() < 0.3),
        jpeg_quality=[None, 60, 75, 85, 92][int(rng.integers(5))],
    )
