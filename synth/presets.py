"""Three ready looks: clean (a measuring microscope's), bench (a camera beside the rig), hard."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from synth.settings import Camera, Look, Sensor
from tsvision.errors import InputError

PRESETS = ("clean", "bench", "hard")

# name -> what differs from the default look; equal-luma pairs have the same Rec. 709 luminance
LOOKS: dict[str, Look] = {
    "bright_on_dark": Look(),
    "dark_on_bright": Look(
        strand_rgb=((0.05, 0.05, 0.06),), ground_rgb=(0.72, 0.70, 0.66), ambient=0.35
    ),
    "backlit": Look(
        strand_rgb=((0.5, 0.5, 0.5),), ground_rgb=(0.85, 0.85, 0.85), backlight=True, specular=0.0
    ),
    "front_lit": Look(light=(0.0, 0.1, 1.0), ambient=0.2, light_strength=0.85),
    "side_lit": Look(light=(0.15, 0.93, 0.33), ambient=0.10, light_strength=0.95),
    "side_lit_below": Look(light=(-0.2, -0.9, 0.38), ambient=0.10, light_strength=0.95),
    "glossy": Look(specular=0.55, gloss=60.0, strand_rgb=((0.45, 0.47, 0.5),)),
    "equal_luma": Look(
        strand_rgb=((0.62, 0.10, 0.10),), ground_rgb=(0.17, 0.22, 0.19), ambient=0.4,
        light_strength=0.75, light=(0.1, 0.35, 1.0),
    ),
    "two_coloured": Look(
        strand_rgb=((0.70, 0.62, 0.20), (0.10, 0.25, 0.55)), ground_rgb=(0.20, 0.19, 0.18)
    ),
}  # fmt: skip


def look_named(name: str) -> Look:
    """A look by name; an unknown one raises with the list."""
    if name not in LOOKS:
        raise InputError(f"look '{name}' is unknown; choose one of {', '.join(LOOKS)}")
    return LOOKS[name]


def preset(name: str, seed: int, look: str | None = None) -> tuple[Camera, Look, Sensor]:
    """Camera, look and sensor of a preset; `bench` and `hard` draw their details from the seed."""
    if name not in PRESETS:
        raise InputError(f"preset '{name}' is unknown; choose one of {', '.join(PRESETS)}")
    random = np.random.default_rng([seed, 3])
    if name == "clean":
        return Camera(), look_named(look or "bright_on_dark"), Sensor(grey=True)
    if name == "bench":
        return _bench(random, look)
    return _hard(random, look)


def _bench(random: np.random.Generator, look: str | None) -> tuple[Camera, Look, Sensor]:
    names = ("bright_on_dark", "side_lit", "dark_on_bright", "two_coloured", "side_lit_below")
    chosen = look_named(look or str(random.choice(names)))
    camera = Camera(
        distance_mm=float(random.uniform(180, 320)),
        roll_deg=float(random.uniform(-6, 6)),
        yaw_deg=float(random.uniform(-4, 4)),
        tilt_deg=float(random.uniform(-4, 4)),
        k1=float(random.uniform(-0.01, 0.01)),
        blur_px=float(random.uniform(0.7, 1.1)),
    )
    full = replace(
        chosen,
        ground_gradient=(float(random.uniform(-0.4, 0.4)), float(random.uniform(-0.3, 0.3))),
        light_gradient=(float(random.uniform(-0.3, 0.3)), float(random.uniform(-0.2, 0.2))),
        ground_texture=0.06,
        shadow=0.35,
        vignetting=0.15,
        braid=0.25,
        fibres_per_mm=0.25,
    )
    if chosen.backlight:  # a lit screen has neither grain nor shadows
        full = replace(full, ground_texture=0.0, shadow=0.0)
    return camera, full, Sensor(full_well_e=8000.0, read_noise_e=10.0)


def _hard(random: np.random.Generator, look: str | None) -> tuple[Camera, Look, Sensor]:
    names = ("equal_luma", "side_lit", "glossy", "dark_on_bright", "two_coloured")
    chosen = look_named(look or str(random.choice(names)))
    camera = Camera(
        distance_mm=float(random.uniform(120, 220)),
        roll_deg=float(random.uniform(-20, 20)),
        yaw_deg=float(random.uniform(-6, 6)),
        tilt_deg=float(random.uniform(-6, 6)),
        k1=float(random.uniform(-0.04, 0.04)),
        blur_px=float(random.uniform(1.2, 1.9)),
        turning_blur_turns=0.04,
        defocus_px_per_mm=0.5,
    )
    full = replace(
        chosen,
        ground_gradient=(float(random.uniform(-0.9, 0.9)), float(random.uniform(-0.6, 0.6))),
        light_gradient=(float(random.uniform(-0.6, 0.6)), float(random.uniform(-0.4, 0.4))),
        ground_texture=0.12,
        shadow=0.55,
        vignetting=0.35,
        braid=0.4,
        fibres_per_mm=0.8,
        dust=25,
        cable=True,
    )
    if chosen.backlight:
        full = replace(full, ground_texture=0.0, shadow=0.0)
    return camera, full, Sensor(full_well_e=2000.0, read_noise_e=12.0, format="jpg", quality=72)
