"""Bounds of every parameter; a value outside raises one line that names it and its bound."""

from __future__ import annotations

import numpy as np

from synth.camera import distortion_folds
from synth.effects import stated_zone_mm
from synth.laws import LAWS
from synth.sections import make_section, section_diameter_mm
from synth.settings import Settings
from synth.strands import hole_centres_mm, hole_diameter_mm, needed_hole_mm
from tsvision.errors import InputError


def _within(name: str, value: float, low: float, high: float, unit: str = "") -> None:
    if not (np.isfinite(value) and low <= value <= high):
        raise InputError(
            f"{name} = {value:g}{unit} is out of bounds; give {low:g} to {high:g}{unit}"
        )


def _one_of(name: str, value: object, choices: tuple[object, ...]) -> None:
    if value not in choices:
        raise InputError(f"{name} = {value!r} is unknown; choose {', '.join(map(str, choices))}")


def check_seed(seed: int) -> None:
    """Raise InputError on a seed that no generator takes; presets draw from it before the rest can
    be checked."""
    if seed < 0:
        raise InputError(f"seed = {seed}: must be 0 or more")


def check(settings: Settings) -> None:
    """Raise InputError on the first parameter out of bounds."""
    check_seed(settings.seed)
    strings, actuator, camera = settings.strings, settings.actuator, settings.camera
    sensor = settings.sensor
    if not settings.turns:
        raise InputError("turns is empty; give at least one turn count, such as 0:30:0.5")
    if not np.isfinite(settings.turns).all():
        raise InputError("turns holds a value that is not a number; give finite turn counts")
    _within("strings.count", strings.count, 2, 10)
    make_section(strings.section, strings.count)
    _within("strings.diameter_mm", strings.diameter_mm, 0.01, 5.0, " mm")
    _one_of("strings.handedness", strings.handedness, ("Z", "S"))
    _one_of("actuator.holes", actuator.holes, (2, 4, 6))
    _within("actuator.twisting_zone_mm", stated_zone_mm(settings), 2.0, 500.0, " mm")
    _within("actuator.hole_distance_mm", actuator.hole_distance_mm, 0.1, 100.0, " mm")
    _within("actuator.load_N", actuator.load_N, 0.01, 1e4, " N")
    outer = section_diameter_mm(strings.section, strings.count, strings.diameter_mm)
    if outer >= 0.9 * actuator.hole_distance_mm:
        raise InputError(
            f"actuator.hole_distance_mm = {actuator.hole_distance_mm:g} mm leaves no legs for a "
            f"bundle of {outer:.3g} mm; give more than {outer / 0.9:.3g} mm"
        )
    _check_holes(settings)
    _one_of("camera.side", camera.side, ("left", "right", "top", "bottom"))
    _one_of("camera.view", camera.view, ("full", "closeup"))
    _within("camera.width_px", camera.width_px, 64, 8192, " px")
    _within("camera.height_px", camera.height_px, 64, 8192, " px")
    _within("camera.roll_deg", camera.roll_deg, -180, 180, " deg")
    _within("camera.yaw_deg", camera.yaw_deg, -40, 40, " deg")
    _within("camera.tilt_deg", camera.tilt_deg, -40, 40, " deg")
    _within("camera.blur_px", camera.blur_px, 0.0, 50.0, " px")
    _within("camera.k1", camera.k1, -0.3, 0.3)
    if distortion_folds(camera.k1, camera.k2):
        raise InputError(
            f"camera.k1 = {camera.k1:g}, k2 = {camera.k2:g} fold the picture's corners; "
            "keep 1 + 3 k1 r^2 + 5 k2 r^4 above 0.1 up to r = 1.3"
        )
    if camera.distance_mm != 0:
        _within("camera.distance_mm", camera.distance_mm, 30.0, 1e6, " mm")
    if camera.px_per_mm is not None:
        _within("camera.px_per_mm", camera.px_per_mm, 1.0, 2000.0, " px/mm")
    _one_of("sensor.format", sensor.format, ("png", "jpg", "tif", "mp4"))
    _one_of("sensor.bits", sensor.bits, (8, 16))
    _within("sensor.gamma", sensor.gamma, 0.3, 4.0)
    _within("sensor.quality", sensor.quality, 0, 100)
    if sensor.bits == 16 and sensor.format not in ("png", "tif"):
        raise InputError("sensor.bits = 16 needs sensor.format png or tif")
    if sensor.format == "mp4" and (camera.width_px % 2 or camera.height_px % 2):
        raise InputError("camera.width_px and height_px must be even for an mp4")
    _one_of("law.displacement", settings.law.displacement, LAWS)
    _one_of("law.follow", settings.law.follow, ("geometry", "law"))
    _check_hidden(settings)


def _check_holes(settings: Settings) -> None:
    hole = hole_diameter_mm(settings)
    needed = needed_hole_mm(settings, settings.strings.diameter_mm)
    _within("actuator.hole_diameter_mm", hole, 0.01, 50.0, " mm")
    if hole < needed:
        raise InputError(
            f"actuator.hole_diameter_mm = {hole:g} mm is too small for its strands; "
            f"at least {needed:.3g} mm"
        )
    centres = hole_centres_mm(settings, settings.actuator.hole_distance_mm)
    gap = np.linalg.norm(centres[0] - centres[1])
    if hole >= gap:
        raise InputError(
            f"actuator.hole_diameter_mm = {hole:g} mm makes the {settings.actuator.holes} holes "
            f"overlap; less than {gap:.3g} mm, or a larger hole_distance_mm"
        )


def _check_hidden(settings: Settings) -> None:
    hidden = settings.hidden
    for name, low, high in (
        ("slip", 0.0, 0.9),
        ("lost_turns", 0.0, 50.0),
        ("backlash_turns", 0.0, 20.0),
        ("stretch_per_N", 0.0, 0.05),
        ("compression_exponent", 0.0, 0.5),
        ("creep_mm_per_decade", -5.0, 5.0),
        ("radius_step", -0.5, 0.5),
        ("knot_absorption", 0.0, 1.0),
        ("camera_scale_error", -0.5, 0.5),
        ("unequal_diameters", 0.0, 0.3),
        ("flattening", 0.0, 0.35),
        ("slack_pair", 0.0, 2.0),
        ("taper", -0.5, 0.5),
        ("diameter_drift", -0.5, 0.5),
    ):
        _within(f"hidden.{name}", getattr(hidden, name), low, high)
