"""The recordings, one entry each. The first letter is the kind of difficulty."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .camera import Camera
from .film import Film
from .recording import Spec
from .rope import Knot
from .scene import RGB, Look

WHOLE = (13.2, 0.0, 0.0)  # mm, what the middle of a full view looks at
RED, GREEN, BLUE = (0.42, 0.03, 0.03), (0.03, 0.26, 0.06), (0.03, 0.07, 0.40)
GREY, BLACK = (0.3, 0.3, 0.3), (0.018, 0.018, 0.02)


def knot(n: int, centre: float, length: float, turn: float, size: float = 1.0) -> Knot:
    """A knot for a bundle of `n` strings: radius 0.9 D and coil pitch 1.4 D, times `size`."""
    d = {2: 0.48, 4: 0.66, 6: 0.88, 8: 0.88}[n]
    return Knot(centre, 0.9 * d * size, length, 1.4 * d, turn)


def ground(level: float, tint: RGB = (1, 1, 1)) -> RGB:
    return (level * tint[0], level * tint[1], level * tint[2])


ALL = (
    Spec(
        "f_closeup_n4", "close-up of the separator, apex in view, grey, S twist",
        count=4, hand=-1, turns=(7, 8.5, 10, 13, 16, 20, 24, 29),
        camera=Camera(118, (4.2, 0.1, 0), axis_deg=1.5, yaw_deg=-2, pitch_deg=2, distance_mm=150),
        look=Look(ground=ground(0.035), plate=GREY, fibres=16, bump_mm=0.015),
        film=Film(mono=True, jpeg_quality=None, full_well_e=6000),
        coil_from=18, coil_per_root_turn_d=0.1, swell=0.03, seed=11,
    ),
    Spec(
        "a_white_n2", "white line on brown, lit from the front, whole zone, Z twist, knots",
        count=2, hand=1, turns=(0, 5, 10, 15, 20, 25, 30, 34, 38, 42, 46, 50, 56, 62),
        camera=Camera(43.2, WHOLE, axis_deg=-2, yaw_deg=-2.5, pitch_deg=3, distance_mm=130),
        coil_from=28, swell=0.04, seed=12,
        knots=(knot(2, 11.2, 2.0, 41), knot(2, 16.9, 1.7, 52, 0.9)),
    ),
    Spec(
        "b_backlit_n4", "dark strings before a bright diffuser, grey, S twist, knots",
        count=4, hand=-1, turns=(0, 4, 8, 12, 16, 20, 24, 28, 32, 36, 41, 46),
        camera=Camera(41.5, WHOLE, axis_deg=1.2, yaw_deg=2, pitch_deg=-2, distance_mm=140),
        look=Look(strings=(BLACK,), ground=ground(0.5), backlight=0.62, light=2.5, ambient=0.06,
                  ground_texture=0.03, plate=(0.05, 0.05, 0.05), fibres=8),
        film=Film(mono=True, jpeg_quality=None, full_well_e=5000),
        coil_from=18, coil_per_root_turn_d=0.075, seed=13,
        knots=(knot(4, 14.3, 2.4, 31), knot(4, 8.8, 2.2, 38)),
    ),
    Spec(
        "d_right_n2", "separator on the right, cream line on green-grey, S twist, knot",
        count=2, hand=-1, turns=(3, 8, 13, 18, 23, 28, 33, 38, 43, 47, 52, 58),
        camera=Camera(42.6, WHOLE, axis_deg=182.5, yaw_deg=3, pitch_deg=2, distance_mm=115),
        look=Look(strings=((0.70, 0.62, 0.45),), ground=ground(0.09, (0.8, 1.1, 0.9)),
                  plate=(0.4, 0.4, 0.42), light_from=(0.7, 0.5, 1.0)),
        coil_from=27, swell=0.02, seed=14, knots=(knot(2, 9.4, 1.9, 42),),
    ),
    Spec(
        "c_red_n2", "red line on a beige ground of equal luma, Z twist, knot",
        count=2, hand=1, turns=(4, 10, 16, 22, 27, 32, 37, 42, 47, 53),
        camera=Camera(46, (12.6, 0, 0), axis_deg=-1, yaw_deg=1.5, pitch_deg=-3),
        look=Look(strings=(RED,), ground=ground(0.1, (1.15, 1.0, 0.75)), plate=GREY),
        coil_from=28, equal_luma=True, seed=15, knots=(knot(2, 13.1, 2.1, 41),),
    ),
    Spec(
        "c_rgb_n6", "red, green and blue strings on grey of equal luma, S twist, knot",
        count=6, hand=-1, turns=(3, 6, 9, 12, 15, 18, 22, 26, 30),
        camera=Camera(42, WHOLE, axis_deg=2, yaw_deg=-2, pitch_deg=2),
        look=Look(strings=(RED, RED, GREEN, GREEN, BLUE, BLUE), ground=ground(0.1), plate=GREY),
        coil_from=12, coil_per_root_turn_d=0.07, equal_luma=True, seed=16,
        knots=(knot(6, 12.2, 2.6, 23),),
    ),
    Spec(
        "m_bright_n6", "bright strings on black, steep side light, Z twist, knots",
        count=6, hand=1, turns=(2, 5, 8, 11, 14, 17, 20, 23, 27, 31),
        camera=Camera(41, WHOLE, axis_deg=-3, yaw_deg=-3, pitch_deg=-2, distance_mm=110),
        look=Look(ground=ground(0.004), plate=(0.02, 0.02, 0.02), light_from=(-0.3, 1.0, 0.45),
                  light=14, ambient=0.08, fibres=14),
        film=Film(jpeg_quality=92),
        coil_from=12, coil_per_root_turn_d=0.075, swell=0.03, seed=17,
        knots=(knot(6, 15.2, 2.6, 21), knot(6, 8.6, 2.4, 26)),
    ),
    Spec(
        "e_top_n6", "separator on top, axis vertical, straw line on blue-grey, S twist, knot",
        count=6, hand=-1, turns=(2, 5, 8, 11, 14, 17, 20, 24, 28),
        camera=Camera(27.5, (11.4, 0, 0), axis_deg=91.5, yaw_deg=2, pitch_deg=2, distance_mm=160),
        look=Look(strings=((0.62, 0.5, 0.28),), ground=ground(0.08, (0.8, 0.95, 1.3)),
                  plate=(0.35, 0.1, 0.08)),
        film=Film(gauss_blur_px=0.7, jpeg_quality=None),
        coil_from=12, coil_per_root_turn_d=0.07, seed=18, knots=(knot(6, 13.6, 2.6, 23),),
    ),
    Spec(
        "g_noapex_n4", "close-up of mid-span: neither apex nor separator in view, Z twist",
        count=4, hand=1, turns=(9, 11, 13, 15, 17, 20, 23, 26),
        camera=Camera(86, (13.6, 0.15, 0), axis_deg=2.2, yaw_deg=1.5, pitch_deg=-1.5),
        look=Look(ground=ground(0.07, (0.9, 1.0, 1.1)), fibres=14),
        film=Film(jpeg_quality=88),
        coil_from=18, coil_per_root_turn_d=0.085, swell=0.02, seed=19,
    ),
    Spec(
        "h_motion_n2", "camera shake of 2 to 8 px in turning directions, Z twist, knot",
        count=2, hand=1, turns=(5, 12, 19, 25, 31, 36, 41, 46, 52),
        camera=Camera(44, WHOLE, axis_deg=1, yaw_deg=2, pitch_deg=2),
        film=Film(motion_px=2.0), motion_step_px=0.75,
        coil_from=28, seed=20, knots=(knot(2, 14.8, 2.0, 40),),
    ),
    Spec(
        "i_noise_n4", "400 electrons full well: strong photon noise, grey, S twist, knot",
        count=4, hand=-1, turns=(4, 8, 12, 16, 20, 24, 29, 34, 40),
        camera=Camera(43, WHOLE, axis_deg=-1.5, yaw_deg=-2, pitch_deg=2),
        look=Look(ground=ground(0.06), plate=GREY),
        film=Film(full_well_e=400, read_noise_e=4, mono=True, jpeg_quality=None),
        coil_from=18, coil_per_root_turn_d=0.07, seed=21, knots=(knot(4, 10.9, 2.3, 30),),
    ),
    Spec(
        "j_defocus_n2", "defocused by a disc of 2.5 px radius, S twist, knot",
        count=2, hand=-1, turns=(5, 12, 19, 25, 31, 36, 41, 46, 52),
        camera=Camera(43.5, WHOLE, axis_deg=2, yaw_deg=-1, pitch_deg=3),
        look=Look(ground=ground(0.05, (1.2, 1.0, 0.8))),
        film=Film(defocus_px=2.5),
        coil_from=28, swell=0.03, seed=22, knots=(knot(2, 12.0, 2.0, 40),),
    ),
    Spec(
        "k_jpeg_n4", "JPEG at quality 60, tan line on slate, Z twist, uneven coil, knot",
        count=4, hand=1, turns=(4, 8, 12, 16, 20, 24, 28, 33, 38, 44),
        camera=Camera(43, WHOLE, axis_deg=-2, yaw_deg=3, pitch_deg=-2),
        look=Look(strings=((0.55, 0.42, 0.26),), ground=ground(0.06, (0.9, 1.0, 1.15))),
        film=Film(jpeg_quality=60),
        coil_from=18, coil_per_root_turn_d=0.065, unevenness=0.45, seed=23,
        knots=(knot(4, 15.0, 2.3, 35),),
    ),
    Spec(
        "l_hard_n8", "N = 8, 800 electrons, 3 px shake, many fibres, S twist, knot",
        count=8, hand=-1, turns=(3, 6, 9, 12, 15, 18, 21, 25),
        camera=Camera(43, WHOLE, axis_deg=1.5, yaw_deg=2, pitch_deg=3),
        look=Look(ground=ground(0.1, (1.1, 1.0, 0.9)), fibres=40, ground_texture=0.12),
        film=Film(full_well_e=800, read_noise_e=6, motion_px=3.0, jpeg_quality=85),
        coil_from=12, coil_per_root_turn_d=0.06, seed=24, knots=(knot(8, 12.5, 2.6, 20),),
    ),
    Spec(
        "b_dark_n6", "dark strings on bright paper lit from the front, Z twist, knots",
        count=6, hand=1, turns=(2, 5, 8, 11, 14, 17, 20, 23, 26, 30),
        camera=Camera(33, (12.2, 0, 0), axis_deg=2.4, yaw_deg=-2, pitch_deg=-3, distance_mm=125),
        look=Look(strings=((0.03, 0.03, 0.04),), ground=ground(0.6, (1, 0.97, 0.9)), light=8,
                  plate=(0.12, 0.12, 0.12), ground_texture=0.03, ambient=0.15),
        coil_from=12, coil_per_root_turn_d=0.07, seed=25,
        knots=(knot(6, 14.0, 2.6, 22), knot(6, 8.4, 2.4, 25)),
    ),
    Spec(
        "c_hard_n4", "red, green, blue and straw strings on beige, defocus, many fibres, JPEG 72",
        count=4, hand=1, turns=(4, 8, 12, 16, 20, 25, 30, 36),
        camera=Camera(56, (10.6, 0, 0), axis_deg=-2.5, yaw_deg=2.5, pitch_deg=2),
        look=Look(strings=(RED, GREEN, BLUE, (0.5, 0.38, 0.1)), fibres=45,
                  ground=ground(0.28, (1.2, 1.0, 0.75)), plate=GREY),
        film=Film(defocus_px=1.6, jpeg_quality=72, full_well_e=2500),
        coil_from=18, coil_per_root_turn_d=0.07, swell=0.03, seed=26,
        knots=(knot(4, 11.8, 2.3, 28),),
    ),
)  # fmt: skip


def vary(spec: Spec, number: int) -> Spec:
    """The same kind of recording with view, light, hand, turns and scale drawn anew."""
    rng = np.random.default_rng([spec.seed, number])
    camera, look = spec.camera, spec.look
    shift = rng.uniform(-0.4, 0.4)
    return replace(
        spec,
        name=f"{spec.name}_v{number}",
        hand=int(rng.choice([-1, 1])),
        turns=tuple(round(t + shift, 2) if t else t for t in spec.turns),
        camera=replace(
            camera,
            px_per_mm=camera.px_per_mm * rng.uniform(0.94, 1.02),
            axis_deg=90 * round(camera.axis_deg / 90) + rng.uniform(-4, 4),
            yaw_deg=rng.uniform(-3.5, 3.5),
            pitch_deg=rng.uniform(-3.5, 3.5),
            distance_mm=rng.uniform(100, 170),
        ),
        look=replace(look, light_from=(rng.uniform(-0.8, 0.8), rng.uniform(0.3, 1.0), 0.9)),
        knots=tuple(replace(k, centre_mm=k.centre_mm + rng.uniform(-1, 1)) for k in spec.knots),
        swell=rng.uniform(0, 0.05),
        seed=spec.seed + 1000 * number,
    )


SPECS = {spec.name: spec for spec in ALL}
