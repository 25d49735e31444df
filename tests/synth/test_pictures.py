"""What the pictures must show: handedness, who lies in front, contact, light, noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numba import njit

from synth.actuator import state_at
from synth.build import make_settings
from synth.camera import place, project, to_camera, undistort
from synth.contact import closest_mm
from synth.render import Drawing, draw, make_scene, shoot
from synth.sensor import expose
from synth.settings import PAPER_ONSET_TURNS, Actuator, Camera, Sensor, Settings, Strings
from synth.strands import strand_paths
from synth.truth import axis_px

SMALL: dict[str, object] = {"camera.width_px": 640, "camera.height_px": 360}


def picture(settings: Settings) -> Drawing:
    return draw(settings, make_scene(settings), state_at(settings, len(settings.turns) - 1))


@pytest.mark.parametrize("turns", [7.0, 35.0, 66.0])
def test_s_is_z_seen_in_a_mirror(turns: float) -> None:
    """S is Z mirrored in depth: the same outline, and where strands cross the other in front."""
    z = picture(make_settings((0.0, turns), strings=Strings(handedness="Z"), changes=dict(SMALL)))
    s = picture(make_settings((0.0, turns), strings=Strings(handedness="S"), changes=dict(SMALL)))
    # pixels in the notch between two partly covering strands depend on which is drawn first
    assert (np.abs(z.covered - s.covered) > 0.03).mean() < 3e-4
    assert z.covered.sum() == pytest.approx(s.covered.sum(), rel=1e-3)
    assert ((z.ids > 0) == (s.ids > 0)).mean() > 0.9999
    assert (z.ids != s.ids).mean() > 0.002


def test_flipping_a_straight_bundle_changes_its_hand() -> None:
    """Upside down, Z is S with the two strands exchanged."""
    z = picture(make_settings((0.0, 7.0), strings=Strings(handedness="Z"), changes=dict(SMALL)))
    s = picture(make_settings((0.0, 7.0), strings=Strings(handedness="S"), changes=dict(SMALL)))
    swapped = np.array([0, 2, 1])[s.ids]
    assert (z.ids[::-1] != swapped).mean() < 2e-4


def test_front_strands_of_z_run_like_the_letter() -> None:
    """Axis upright, separator up: the visible strands of Z rise to the right, of S to the left."""
    for hand, rises in (("Z", 1.0), ("S", -1.0)):
        settings = make_settings((0.0, 9.0), strings=Strings(handedness=hand))
        state = state_at(settings, 1)
        path = strand_paths(settings, state)[0]
        x, y, z = path.points_mm[path.in_bundle].T
        front = z[1:-1] > 0.1
        slope = np.gradient(y, x)[1:-1][front]
        # turned so that the axis stands upright with x pointing down: right is +y, up is -x
        assert (rises * -slope > 0).all()


def test_turning_back_past_zero_winds_the_other_hand() -> None:
    plus = picture(make_settings((0.0, 8.0), changes=dict(SMALL)))
    minus = picture(
        make_settings((0.0, -8.0), strings=Strings(handedness="S"), changes=dict(SMALL))
    )
    assert np.array_equal(plus.ids, minus.ids)


@njit(cache=True)
def _balls(x, y, z, radius_px, radius, number, depth, owner):
    for k in range(len(x)):
        for row in range(int(y[k] - radius_px), int(y[k] + radius_px) + 2):
            for col in range(int(x[k] - radius_px), int(x[k] + radius_px) + 2):
                if 0 <= row < depth.shape[0] and 0 <= col < depth.shape[1]:
                    far = ((row - y[k]) ** 2 + (col - x[k]) ** 2) / radius_px**2
                    if far < 1.0:
                        height = z[k] + radius * np.sqrt(1.0 - far)
                        if height > depth[row, col]:
                            depth[row, col], owner[row, col] = height, number


@pytest.mark.parametrize(("count", "turns"), [(2, 12.0), (2, 50.0), (4, 20.0), (8, 12.0)])
def test_the_nearest_strand_is_the_one_seen(count: int, turns: float) -> None:
    """Against a brute-force depth buffer of balls along every strand."""
    settings = make_settings((0.0, turns), strings=Strings(count=count), changes=dict(SMALL))
    scene = make_scene(settings)
    state = state_at(settings, 1)
    drawing = draw(settings, scene, state)
    depth = np.full(drawing.ids.shape, -np.inf)
    owner = np.zeros(drawing.ids.shape, np.int64)
    for path in strand_paths(settings, state):
        seen = to_camera(scene.view, path.points_mm[path.first : path.last])
        at = project(scene.view, seen)
        radius_px = 0.12 * scene.view.px_per_mm
        _balls(at[:, 0], at[:, 1], seen[:, 2], radius_px, 0.12, path.number + 1, depth, owner)
    solid = (drawing.covered > 0.999) & (owner > 0)
    assert solid.sum() > 1000
    assert (drawing.ids[solid] == owner[solid]).mean() > 0.985  # rest: pixels on inner outlines


@pytest.mark.parametrize("count", [2, 4, 6, 8])
@pytest.mark.parametrize("holes", [2, 6])
def test_strands_do_not_pass_through_each_other(count: int, holes: int) -> None:
    onset = PAPER_ONSET_TURNS[count]
    for share in (0.05, 0.5, 1.0, 1.5, 2.4, 3.2):
        settings = make_settings(
            (0.0, share * onset),
            seed=3,
            strings=Strings(count=count),
            actuator=Actuator(holes=holes),
        )
        paths = strand_paths(settings, state_at(settings, 1))
        zone = [path.points_mm[path.first : path.last + 1] for path in paths]
        assert closest_mm(zone, 0.24) > 0.95 * 0.24 - 1e-3


@pytest.mark.parametrize(
    ("side", "toward"), [("left", (1, 0)), ("right", (-1, 0)), ("top", (0, 1)), ("bottom", (0, -1))]
)
def test_the_separator_lies_on_the_side_that_was_asked_for(
    side: str, toward: tuple[int, int]
) -> None:
    """The axis runs away from that side, and the legs' wide end lies there."""
    changes: dict[str, object] = {
        "camera.side": side,
        "camera.width_px": 400,
        "camera.height_px": 400,
    }
    settings = make_settings((0.0, 9.0), changes=changes)
    view = place(settings.camera, 23.2)
    start, stop = axis_px(view, 23.2)
    assert np.allclose((stop - start) / np.linalg.norm(stop - start), toward, atol=1e-9)
    covered = picture(settings).covered > 0.5
    lines = covered.T if toward[0] else covered
    wide = [np.ptp(np.flatnonzero(line)) for line in lines if line.any()]
    near_start = wide[60:140] if sum(toward) > 0 else wide[-140:-60]
    near_stop = wide[-140:-60] if sum(toward) > 0 else wide[60:140]
    assert np.mean(near_start) > 3 * np.mean(near_stop)


def test_distortion_is_undone_exactly() -> None:
    camera = Camera(k1=-0.12, k2=0.03, distance_mm=80.0)
    view = place(camera, 23.2)
    points = np.random.default_rng(0).uniform(-4, 24, (500, 3)) * [1.0, 0.2, 0.1]
    seen = to_camera(view, points)
    pixels = project(view, seen)
    ideal = seen[:, :2] * [1.0, -1.0] * view.px_per_mm * 80.0 / (80.0 - seen[:, 2:])
    inside = (np.abs(pixels - view.centre_px) < [700, 420]).all(axis=1)
    assert np.abs(undistort(view, pixels) - ideal)[inside].max() < 1e-6


def test_flattened_strings_have_no_step_at_the_apex() -> None:
    """The outline's width changes smoothly from leg to bundle."""
    settings = make_settings(
        (0.0, 8.0), changes={**SMALL, "camera.view": "closeup", "hidden.flattening": 0.3}
    )
    drawing = picture(settings)
    first = drawing.ids == 1
    width = first.sum(axis=0)[60:-5].astype(float)
    assert np.abs(np.diff(width)).max() < 0.25 * width.max()


def test_lit_side_follows_the_light() -> None:
    """Light from above makes the upper flank the brighter, light from below the lower."""
    for look, sign in (("side_lit", 1.0), ("side_lit_below", -1.0)):
        settings = make_settings((0.0, 0.0), look=look, changes=dict(SMALL))
        drawing = picture(settings)
        column = 200  # a leg, nearly horizontal
        rows = np.flatnonzero(drawing.covered[:170, column] > 0.99)
        light = drawing.linear[rows, column, 0]
        half = len(rows) // 2
        assert sign * (light[:half].mean() - light[-half:].mean()) > 0.1


def test_equal_luma_look_hides_in_luma_and_shows_in_colour() -> None:
    drawing = picture(
        make_settings(
            (0.0, 10.0), "clean", 1, "equal_luma", changes={**SMALL, "sensor.grey": False}
        )
    )
    strand, ground = drawing.covered > 0.99, drawing.covered < 0.01
    ground[:, :90] = ground[:, 550:] = False
    luma = drawing.linear @ np.array([0.2126, 0.7152, 0.0722], np.float32)
    assert abs(luma[strand].mean() / luma[ground].mean() - 1.0) < 0.2
    red = drawing.linear[..., 0] / drawing.linear.sum(axis=2)
    assert red[strand].mean() > red[ground].mean() + 0.2


def test_noise_has_the_variance_of_its_photons_and_is_seeded() -> None:
    sensor = Sensor(full_well_e=1000.0, read_noise_e=10.0, gamma=1.0, bits=16)
    grey = np.full((300, 300, 1), 0.25, np.float32)
    shot = expose(grey, sensor, 5).astype(float) / 65535.0
    assert shot.mean() == pytest.approx(0.25, abs=3e-4)
    wanted = np.sqrt(0.25 / 1000.0 + (10.0 / 1000.0) ** 2)
    assert shot.std() == pytest.approx(wanted, rel=0.02)
    assert np.array_equal(expose(grey, sensor, 5), expose(grey, sensor, 5))
    assert not np.array_equal(expose(grey, sensor, 5), expose(grey, sensor, 6))


def test_gamma_encodes_light() -> None:
    sensor = Sensor(full_well_e=0.0, gamma=2.2)
    ramp = np.linspace(0.0, 1.2, 500, dtype=np.float32).reshape(1, -1, 1)
    stored = expose(ramp, sensor, 0)[0, :, 0]
    exact = 255.0 * np.clip(ramp[0, :, 0], 0.0, 1.0) ** (1 / 2.2)
    assert np.abs(stored - exact).max() < 0.56


def test_a_fibre_changes_the_picture_and_not_the_truth() -> None:
    bare = make_settings((0.0, 10.0), changes=dict(SMALL))
    hairy = replace(bare, look=replace(bare.look, fibres_per_mm=1.0))
    one, two = picture(bare), picture(hairy)
    assert np.abs(one.linear - two.linear).max() > 0.02
    assert np.abs(one.covered - two.covered).max() < 1e-6


def test_blur_and_frame_do_not_depend_on_the_cropped_rectangle() -> None:
    """Far from the strands the frame is the still scene; near them nothing is cut off."""
    settings = make_settings((0.0, 30.0), changes={**SMALL, "camera.blur_px": 2.0})
    scene = make_scene(settings)
    drawing = draw(settings, scene, state_at(settings, 1))
    touched = np.abs(drawing.linear - scene.still).max(axis=2) > 1e-4
    rows = np.flatnonzero(touched.any(axis=1))
    covered = np.flatnonzero((drawing.covered > 0).any(axis=1))
    assert rows[0] <= covered[0] - 3
    assert rows[-1] >= covered[-1] + 3
    assert not touched[0].any()


def test_shadow_side_can_vanish_into_the_ground() -> None:
    """The hard case for edge finders: a flank as dark as the ground behind it."""
    settings = make_settings((0.0, 0.0), look="side_lit", changes=dict(SMALL))
    scene = make_scene(settings)
    drawing = draw(settings, scene, state_at(settings, 1))
    column = 200
    rows = np.flatnonzero(drawing.covered[:170, column] > 0.99)
    ground = float(scene.ground[5, column, 0])
    light = drawing.linear[rows, column, 0]
    assert light.max() > 6 * ground
    assert light.min() < 2.5 * ground
    assert shoot(settings, drawing, 0).dtype == np.uint8
