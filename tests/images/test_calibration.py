"""Calibrations against pictures drawn from exact geometry, with their stated uncertainty."""

from __future__ import annotations

import json
import math
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.interpolate import RectBivariateSpline
from scipy.ndimage import gaussian_filter

from cli.main import run
from tests.srgb import encode
from tsvision.errors import InputError
from tsvision.images.calibration import from_points, moved_in_depth
from tsvision.images.calibration_charuco import (
    Board,
    calibrate_charuco,
    parse_board,
    see_board,
    undistort_maps,
)
from tsvision.images.calibration_gauge import calibrate_gauge
from tsvision.images.calibration_ruler import from_ruler
from tsvision.images.frames import iter_frames, open_recording
from tsvision.records import Camera, Rig
from tsvision.rig import load_rig

SPEC = "7x5 square=5 marker=3.7 dict=DICT_4X4_50"
BOARD = Board(7, 5, 5.0, 3.7, "DICT_4X4_50")
SIZE_PX = (960, 720)


# ------------------------------------------------------------------ points and depth


def test_two_points_by_hand() -> None:
    found = from_points((100, 100), (400, 500), 10.0, length_mm_sd=0.01, point_sd_px=0.5)
    assert found.mm_per_px == pytest.approx(10 / 500)
    relative = math.hypot(math.sqrt(2) * 0.5 / 500, 0.001)
    assert found.mm_per_px_sd == pytest.approx(found.mm_per_px * relative)
    for bad in ({"length_mm": 0.0}, {"length_mm": -1.0}):
        with pytest.raises(InputError, match="length"):
            from_points((0, 0), (1, 0), **bad)
    with pytest.raises(InputError, match="differ"):
        from_points((1, 1), (1, 1), 5.0)


def test_depth_changes_the_scale_by_its_share_of_the_distance() -> None:
    flat = from_points((0, 0), (1000, 0), 20.0, point_sd_px=0.0)
    near = moved_in_depth(flat, 2.0, 0.5, 200.0)
    assert near.mm_per_px == pytest.approx(0.02 * 198 / 200)
    assert near.mm_per_px_sd / 0.02 == pytest.approx(0.0025)  # 0.5 mm at 200 mm: 0.25 %
    assert moved_in_depth(flat, 0.0, 0.0, float("nan")) is flat
    for distance_mm in (float("nan"), 0.0, 1.5):
        with pytest.raises(InputError, match="distance"):
            moved_in_depth(flat, 2.0, 0.0, distance_mm)


# ------------------------------------------------------------------ ChArUco


def view_of_board(
    turns_deg: tuple[float, float, float],
    shift_mm: tuple[float, float, float],
    matrix: np.ndarray,
    distortion: np.ndarray,
) -> np.ndarray:
    """The board through a pinhole with distortion, by following each pixel back to the board."""
    per_mm = 40
    margin_mm = 3.0
    face = BOARD.made().generateImage((35 * per_mm, 25 * per_mm), marginSize=0)
    step = 8  # distortion is smooth: rays on a coarse grid, the rest by interpolation
    height_px, width_px = SIZE_PX[1] * 2, SIZE_PX[0] * 2
    gx, gy = np.meshgrid(
        np.arange(-step, width_px + 2 * step, step), np.arange(-step, height_px + 2 * step, step)
    )
    coarse = np.stack([gx.ravel() / 2 - 0.25, gy.ravel() / 2 - 0.25], axis=-1)
    found = cv2.undistortPoints(
        coarse.reshape(-1, 1, 2).astype(np.float64),
        matrix,
        distortion,
        criteria=(cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-12),
    ).reshape(*gx.shape, 2)
    # not cv2.remap: it rounds places to 1/32 of a step
    splines = [RectBivariateSpline(gy[:, 0], gx[0], found[..., i]) for i in (0, 1)]
    rays = np.stack(
        [spline(np.arange(height_px), np.arange(width_px)).ravel() for spline in splines], axis=-1
    )
    shape = (height_px, width_px)
    rotation = cv2.Rodrigues(np.radians(np.array(turns_deg)))[0]
    centre = np.array([17.5, 12.5, 0.0])
    shift = np.array(shift_mm) - rotation @ centre
    plane = np.column_stack([rotation[:, 0], rotation[:, 1], shift])
    on_board = np.column_stack([rays, np.ones(len(rays))]) @ np.linalg.inv(plane).T
    mm = on_board[:, :2] / on_board[:, 2:]
    map_x = (mm[:, 0] * per_mm - 0.5).reshape(shape).astype(np.float32)
    map_y = (mm[:, 1] * per_mm - 0.5).reshape(shape).astype(np.float32)
    drawn = cv2.remap(face, map_x, map_y, cv2.INTER_AREA, borderValue=255).astype(float)
    outside = (mm < -margin_mm).any(1) | (mm > np.array([35, 25]) + margin_mm).any(1)
    drawn[outside.reshape(shape)] = 128
    drawn = gaussian_filter(drawn, 1.6)
    small = drawn.reshape(SIZE_PX[1], 2, SIZE_PX[0], 2).mean(axis=(1, 3))
    noise = np.random.default_rng(1).normal(0, 2, small.shape)
    return np.clip(np.rint(small * 0.8 + 20 + noise), 0, 255).astype(np.uint8)


MATRIX = np.array([[4000.0, 0, 470], [0, 4000.0, 365], [0, 0, 1]])
NO_DISTORTION = np.zeros(5)


def test_scale_from_one_flat_board() -> None:
    picture = view_of_board((0, 0, 8), (0.5, -0.3, 200), MATRIX, NO_DISTORTION)
    view = see_board(picture, BOARD)
    assert view is not None and len(view.corners_px) == 24
    found = calibrate_charuco([view])
    truth = 200 / 4000
    assert found.mm_per_px == pytest.approx(truth, rel=5e-4)
    assert abs(found.mm_per_px - truth) < 3 * found.mm_per_px_sd
    assert found.mm_per_px_sd < 3e-4 * truth
    assert found.found["residual_px"] < 0.15
    assert found.lens == ()
    assert "3 views" in found.notes[0]


def test_tilted_board_tells_its_tilt_and_the_local_scale() -> None:
    picture = view_of_board((0, 25, 0), (0, 0, 200), MATRIX, NO_DISTORTION)
    view = see_board(picture, BOARD)
    assert view is not None
    found = calibrate_charuco([view])
    assert found.found["tilt_deg"] == pytest.approx(25, abs=1.5)
    assert found.found["mm_per_px_y"] == pytest.approx(0.05, rel=3e-3)
    assert found.found["mm_per_px_x"] == pytest.approx(0.05 / math.cos(math.radians(25)), rel=6e-3)


def test_a_board_tilted_about_its_diagonal_tells_its_tilt() -> None:
    # x and y are foreshortened alike: along neither of them is the tilt seen.
    about = 25.0 / math.sqrt(2.0)
    view = see_board(view_of_board((about, about, 0), (0, 0, 200), MATRIX, NO_DISTORTION), BOARD)
    assert view is not None
    found = calibrate_charuco([view])
    assert found.found["tilt_deg"] == pytest.approx(25, abs=1.5)
    assert found.found["mm_per_px_x"] == pytest.approx(found.found["mm_per_px_y"], rel=6e-3)


@pytest.mark.slow
def test_lens_distortion_is_found_and_undone() -> None:
    matrix = np.array([[1500.0, 0, 480], [0, 1500.0, 360], [0, 0, 1]])
    distortion = np.array([-0.25, 0.1, 0.0, 0.0, 0.0])
    poses = [
        ((0, 0, 0), (0, 0, 75)),
        ((25, 0, 5), (-4, 1, 80)),
        ((-25, 8, 0), (4, -2, 82)),
        ((5, 28, -5), (2, 2, 78)),
        ((0, -28, 10), (-3, -3, 84)),
        ((20, 20, 0), (5, 3, 90)),
    ]
    views = []
    for turns, shift in poses:
        view = see_board(view_of_board(turns, shift, matrix, distortion), BOARD)
        assert view is not None
        views.append(view)
    found = calibrate_charuco(views)
    assert found.found["reprojection_rms_px"] < 0.2
    assert found.lens[0] == pytest.approx(1500, rel=0.02)
    assert found.lens[4] == pytest.approx(-0.25, abs=0.03)
    assert found.found["distance_mm"] == pytest.approx(75, rel=0.02)
    truth = 75 / 1500
    assert found.mm_per_px == pytest.approx(truth, rel=2e-3)
    without = calibrate_charuco(views[:1], at_px=(480, 360))
    assert without.found["residual_px"] > 1.5 * _plane_rms(found, views[0])
    # a picture of a straight line is straight again
    map_x, map_y = undistort_maps(found.lens, *SIZE_PX)
    shown = cv2.remap(view_of_board((0, 0, 0), (0, 0, 75), matrix, distortion), map_x, map_y, 1)
    flat = see_board(shown, BOARD)
    assert flat is not None
    row = flat.corners_px[flat.corners_mm[:, 1] == 5.0]
    bend = np.polyval(np.polyfit(row[:, 0], row[:, 1], 1), row[:, 0]) - row[:, 1]
    assert np.abs(bend).max() < 0.3


def _plane_rms(found, view) -> float:
    return found.found["residual_px"]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "7x5",
        "7x5 square=5 marker=6 dict=DICT_4X4_50",
        "7x5 square=5 marker=3 dict=DICT_9X9",
        "1x5 square=5 marker=3 dict=DICT_4X4_50",
        "7x5 square=5.. marker=3 dict=DICT_4X4_50",
        "7x5 square=5 marker=0 dict=4X4_50",
        "7x5 square=5 marker=3 dict=__class__",
    ],
)
def test_bad_boards_are_named(text: str) -> None:
    with pytest.raises(InputError, match=r"camera\.board"):
        parse_board(text)


def test_board_words() -> None:
    assert parse_board(SPEC) == BOARD
    assert parse_board("7x5, square=5, marker=3.7, dict=4X4_50") == BOARD
    assert parse_board(SPEC + " legacy").legacy


def test_no_board_in_view() -> None:
    assert see_board(np.full((200, 300, 3), 90, np.uint8), BOARD) is None
    with pytest.raises(InputError, match="no board"):
        calibrate_charuco([])


# ------------------------------------------------------------------ ruler


def ruler(
    period_px: float, angle_deg: float, stretch: float = 0.0, noise: float = 2.0
) -> np.ndarray:
    """Ticks across a line through (320, 200); every fifth longer; `stretch` per px along it."""
    y, x = np.mgrid[0:400, 0:640].astype(float)
    c, s = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    along = (x - 320) * c + (y - 200) * s
    across = -(x - 320) * s + (y - 200) * c
    count = along / period_px + 0.5 * stretch * along**2 / period_px
    dark = np.clip(0.5 + (0.14 - np.abs(count - np.rint(count))) * period_px, 0, 1)
    long_ones = np.rint(count) % 5 == 0
    dark *= (np.abs(across) < 12) | ((np.abs(across) < 30) & long_ones)
    light = gaussian_filter(0.7 - 0.6 * dark, 1.2)
    noisy = encode(light) + np.random.default_rng(2).normal(0, noise, light.shape)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def line(angle_deg: float, half_px: float) -> tuple[tuple[float, float], tuple[float, float]]:
    c, s = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    return (320 - half_px * c, 200 - half_px * s), (320 + half_px * c, 200 + half_px * s)


@pytest.mark.parametrize("period_px", [7.3, 18.37, 41.9])
@pytest.mark.parametrize("angle_deg", [0.0, 14.0, -90.0])
def test_ruler_at_any_angle(period_px: float, angle_deg: float) -> None:
    half_px = 190.0 if angle_deg == -90.0 else 260.0
    found = from_ruler(ruler(period_px, angle_deg), *line(angle_deg, half_px), division_mm=1.0)
    truth = 1 / period_px
    assert found.mm_per_px == pytest.approx(truth, rel=1e-3)
    assert abs(found.mm_per_px - truth) < 4 * found.mm_per_px_sd + 1e-4 * truth
    assert found.found["division_px"] == pytest.approx(period_px, rel=1e-3)


def test_tilted_ruler_is_told_and_its_middle_is_right() -> None:
    found = from_ruler(ruler(15.0, 0.0, stretch=1e-4), *line(0.0, 260), division_mm=0.5)
    assert found.mm_per_px == pytest.approx(0.5 / 15, rel=2e-3)
    assert found.found["change_along_percent"] == pytest.approx(5.2, abs=0.5)
    assert "tilted" in found.notes[0]


def test_no_ruler_is_said() -> None:
    grey = np.random.default_rng(0).integers(100, 120, (400, 640)).astype(np.uint8)
    with pytest.raises(InputError, match="no steady ticks"):
        from_ruler(grey, *line(0.0, 250), division_mm=1.0)
    with pytest.raises(InputError, match="leaves the picture"):
        from_ruler(ruler(18, 0), (-50, 200), (500, 200), division_mm=1.0)
    with pytest.raises(InputError, match="20 px"):
        from_ruler(ruler(18, 0), (50, 200), (55, 200), division_mm=1.0)
    with pytest.raises(InputError, match="ticks"):
        from_ruler(ruler(60, 0), (100, 200), (300, 200), division_mm=1.0)


# ------------------------------------------------------------------ gauge pin

LIGHTS = {  # brightness of a cylinder's surface over x = -1..1 across; not the model's own words
    "back-lit": lambda x: np.zeros_like(x),
    "from the camera": lambda x: 0.05 + 0.6 * np.sqrt(np.clip(1 - x * x, 0, 1)),
    "from the side": lambda x: (
        0.05 + 0.6 * np.clip(0.8 * np.sqrt(np.clip(1 - x * x, 0, 1)) + 0.6 * x, 0, None)
    ),
    "specular": lambda x: (
        0.1
        + 0.35 * np.sqrt(np.clip(1 - x * x, 0, 1))
        + 0.3 * np.clip(np.sqrt(np.clip(1 - x * x, 0, 1)), 0, 1) ** 40
    ),
}


def lit_pin(light: str, ground: float, diameter_px: float, blur_px: float, angle_deg: float):
    """A cylinder through (200, 150), by supersampling; linear light."""
    fine = 4
    y, x = np.mgrid[0 : 300 * fine, 0 : 400 * fine].astype(float)
    x, y = (x + 0.5) / fine - 0.5, (y + 0.5) / fine - 0.5
    c, s = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    along = (x - 200) * c + (y - 150) * s
    across_px = -(x - 200) * s + (y - 150) * c
    across = np.clip(across_px / (diameter_px / 2), -1, 1)
    inside = np.clip((diameter_px / 2 - np.abs(across_px)) * fine + 0.5, 0, 1)
    inside *= np.abs(along) < 150
    shown = ground + inside * (LIGHTS[light](across) - ground)
    shown = gaussian_filter(shown, blur_px * fine)
    return shown.reshape(300, fine, 400, fine).mean(axis=(1, 3))


def pin(*of: object):
    """The same as a camera stores it."""
    small = lit_pin(*of)
    noisy = encode(small) + np.random.default_rng(3).normal(0, 2.0, small.shape)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


@pytest.mark.parametrize(
    ("light", "ground", "worst_px"),
    [
        # measured: 0.02, 0.11, 0.02, 0.07 px; half-level edges are 0, 8, 19, 24 px off here
        ("back-lit", 0.7, 0.06),
        ("from the camera", 0.02, 0.2),
        ("from the side", 0.02, 0.06),
        ("specular", 0.02, 0.15),
    ],
)
def test_gauge_pin(light: str, ground: float, worst_px: float) -> None:
    errors = []
    for diameter_px, blur_px, angle_deg in ((40.0, 1.0, 3.0), (61.7, 1.6, -20.0)):
        picture = pin(light, ground, diameter_px, blur_px, angle_deg)
        found = calibrate_gauge(picture, 1.0)
        errors.append(found.found["diameter_px"] - diameter_px)
        allowed = 3 * found.mm_per_px_sd / found.mm_per_px * diameter_px
        print(light, diameter_px, errors[-1], allowed, dict(found.found))
        assert abs(errors[-1]) < allowed
        assert found.found["blur_px"] == pytest.approx(blur_px, abs=0.35)
    assert np.abs(errors).max() < worst_px


def test_gauge_pin_in_linear_light() -> None:
    """As a machine vision camera stores it, before grey cards whose noise tells."""
    shown = lit_pin("from the camera", 0.02, 40.0, 1.6, 0.0)
    shown[:75] = shown[225:] = np.geomspace(0.02, 0.7, 400)
    electrons = np.random.default_rng(5).poisson(1000.0 * shown)
    picture = np.clip(np.rint(electrons * 0.255), 0, 255).astype(np.uint8)
    place = (30, 90, 340, 120)
    found = calibrate_gauge(picture, 1.0, roi_px=place)
    assert "gamma of 1" in found.notes[0]
    given = calibrate_gauge(picture, 1.0, roi_px=place, gamma=1.0)
    assert given.notes == ()
    assert found.found == given.found
    assert found.found["diameter_px"] == pytest.approx(40.0, abs=0.3)
    eye = calibrate_gauge(picture, 1.0, roi_px=place, gamma=2.2)
    assert abs(eye.found["diameter_px"] - 40.0) > 0.3


def test_gauge_pin_with_its_place_given() -> None:
    picture = pin("from the camera", 0.02, 40.0, 1.0, 0.0)
    picture[:60] = 255  # something large and bright beside it
    roi = calibrate_gauge(picture, 1.0, roi_px=(30, 90, 340, 120))
    ends = calibrate_gauge(picture, 1.0, ends_px=((80, 150), (320, 150)))
    assert roi.found["diameter_px"] == pytest.approx(40, abs=0.15)
    assert ends.found["diameter_px"] == pytest.approx(40, abs=0.15)


def test_no_gauge_is_said() -> None:
    noise = np.random.default_rng(0).integers(90, 110, (200, 300)).astype(np.uint8)
    with pytest.raises(InputError, match="gauge"):
        calibrate_gauge(noise, 1.0)
    with pytest.raises(InputError, match="40 px"):
        calibrate_gauge(noise, 1.0, ends_px=((0, 0), (10, 0)))
    with pytest.raises(InputError, match="region"):
        calibrate_gauge(noise, 1.0, roi_px=(290, 190, 500, 500))


def test_pictures_stay_as_they_are() -> None:
    picture = pin("back-lit", 0.7, 40.0, 1.0, 0.0)
    before = picture.copy()
    calibrate_gauge(picture, 1.0)
    assert np.array_equal(picture, before)


# ------------------------------------------------------------------ inside a recording


def test_scale_from_a_ruler_in_the_frames(tmp_path: Path) -> None:
    write_png(tmp_path / "f0.png", np.full((400, 640), 90, np.uint8))
    write_png(tmp_path / "f1.png", ruler(18.37, 0.0))
    (first, second) = line(0.0, 260)
    camera = Camera(scale_from="ruler", length_mm=1.0, points_px=(first, second))
    recording = open_recording(tmp_path, Rig(camera=camera))
    assert recording.rig.camera.mm_per_px == pytest.approx(1 / 18.37, rel=1e-3)
    assert recording.rig.camera.mm_per_px_sd > 0
    assert recording.rig.source["camera.mm_per_px"] == "ruler in frame 1"
    assert any("ruler in frame 1" in note for note in recording.notes)
    with pytest.raises(InputError, match="no board was seen"):
        board = Camera(scale_from="charuco", board=SPEC)
        open_recording(str(tmp_path / "f*.png"), Rig(camera=board))


def test_frames_come_undistorted_where_the_lens_is_known(tmp_path: Path) -> None:
    y, x = np.mgrid[0:360, 0:480].astype(float)
    lens = (900.0, 900.0, 240.0, 180.0, -0.3, 0.0, 0.0, 0.0, 0.0)
    nx, ny = (x - 240) / 900, (y - 180) / 900  # a bar that is straight at y = 40 without the lens
    straight_y = 180 + 900 * ny / (1 - 0.3 * (nx**2 + ny**2))
    write_png(tmp_path / "f.png", (255 * np.exp(-((straight_y - 40) ** 2) / 8)).astype(np.uint8))

    def bend(rig: Rig) -> float:
        (frame,) = iter_frames(open_recording(tmp_path, rig))
        assert frame.pixels is not None
        columns = frame.pixels[:120, 20:460].astype(float)
        centre = (columns * np.arange(120)[:, None]).sum(0) / columns.sum(0)
        return float(np.ptp(centre))

    assert bend(Rig()) > 2.0
    assert bend(Rig(camera=Camera(lens=lens))) < 0.25


def write_png(path: Path, pixels: np.ndarray) -> None:
    assert cv2.imwrite(str(path), pixels)


# ------------------------------------------------------------------ the command


def test_the_command_writes_into_a_rig_and_keeps_the_rest(tmp_path: Path, capsys) -> None:
    write_png(tmp_path / "p.png", pin("back-lit", 0.7, 40.0, 1.0, 0.0))
    rig = tmp_path / "rig.toml"
    rig.write_text(
        "# mine\n[actuator]\nhole_distance_mm = 5 # measured\n[camera]\n"
        'scale_from = "hole_distance"\n# gamma = 2.2\n[view]\nseparator_side = "left"\n'
    )
    command = ["calibrate", "gauge", str(tmp_path / "p.png"), "--diameter-mm", "2"]
    assert run([*command, "--json", "--write", str(rig)]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["mm_per_px"] == pytest.approx(2 / 40, rel=2e-3)
    assert set(told["parts"]) == {"noise", "edge model", "gauge"}
    read = load_rig(rig)
    assert read.camera.mm_per_px == pytest.approx(told["mm_per_px"], rel=1e-6)
    assert read.camera.scale_from is None
    assert read.view.separator_side == "left"
    for kept in ("# mine", "hole_distance_mm = 5 # measured", "# gamma = 2.2"):
        assert kept in rig.read_text()
    assert run([*command, "--write", str(tmp_path / "new.toml")]) == 0
    assert load_rig(tmp_path / "new.toml").camera.mm_per_px == pytest.approx(0.05, rel=2e-3)


def test_a_broken_rig_is_not_overwritten(tmp_path: Path, capsys) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text("[camera\n")
    command = ["calibrate", "points", "--points", "0,0 3,4", "--length-mm", "1"]
    assert run([*command, "--write", str(rig)]) == 2
    assert "no valid TOML" in capsys.readouterr().err
    assert rig.read_text() == "[camera\n"
    assert [p.name for p in tmp_path.iterdir()] == ["rig.toml"]


@pytest.mark.parametrize(
    "arguments",
    [
        ["points", "--points", "1,2 3", "--length-mm", "1"],
        ["points", "--points", "1,2 1,2", "--length-mm", "1"],
        ["points", "--points", "1,2 nan,2", "--length-mm", "1"],
        ["points", "--points", "1,2 3,2", "--length-mm", "0"],
        ["points", "--points", "1,2 3,2", "--length-mm", "1", "--nearer-mm", "1"],
        ["ruler", "gone.png", "--points", "1,2 3,2"],
        ["ruler", "gone.png", "--points", "1,2 300,2", "--division-mm", "0"],
        ["gauge", "gone.png", "--diameter-mm", "1"],
        ["gauge", "gone.png", "--diameter-mm", "-1"],
        ["gauge", "gone.png", "--diameter-mm", "1", "--diameter-mm-sd", "inf"],
        ["charuco", "gone.png", "--board", SPEC],
        ["charuco", "gone.png", "--board", "nonsense"],
    ],
)
def test_bad_words_end_in_one_line(arguments: list[str], capsys) -> None:
    assert run(["calibrate", *arguments]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.startswith("tsvision calibrate: ") and told.err.count("\n") == 1
