"""The 3-D scene: meshes without OpenGL, and the same outline as the analytic renderer with it."""

from __future__ import annotations

import json
import struct
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cli.main import run
from synth import view3d
from synth.actuator import state_at
from synth.build import make_settings
from synth.gltf import write_glb
from synth.hardware import make_hardware
from synth.meshes import hardware_meshes, scene_meshes, strand_mesh
from synth.render import draw, make_scene
from synth.strands import strand_paths

SMALL: dict[str, object] = {"camera.width_px": 640, "camera.height_px": 360}


def read_glb(path: Path) -> tuple[dict, bytes]:
    data = path.read_bytes()
    magic, version, total = struct.unpack("<4sII", data[:12])
    assert (magic, version, total) == (b"glTF", 2, len(data))
    length = struct.unpack("<I", data[12:16])[0]
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def test_gltf_holds_the_scene_in_metres(tmp_path: Path) -> None:
    settings = make_settings((0.0, 5.0))
    story, data = read_glb(
        write_glb(tmp_path / "s.glb", scene_meshes(settings, state_at(settings, 1)))
    )
    names = [node["name"] for node in story["nodes"]]
    assert names[:3] == ["strand 1", "strand 2", "separator"]
    assert "scale bar 5 mm" in names
    bar = story["meshes"][names.index("scale bar 5 mm")]["primitives"][0]["attributes"]["POSITION"]
    span = np.subtract(story["accessors"][bar]["max"], story["accessors"][bar]["min"])
    assert span[0] == pytest.approx(5e-3, rel=1e-5)
    for accessor in story["accessors"]:
        view = story["bufferViews"][accessor["bufferView"]]
        width = {"VEC3": 12, "SCALAR": 4}[accessor["type"]]
        assert view["byteLength"] == accessor["count"] * width
        assert view["byteOffset"] + view["byteLength"] <= len(data)


def test_meshes_are_closed_and_face_outwards() -> None:
    """Signed volume of each solid against its formula: a flipped face would change it."""
    settings = make_settings((0.0, 5.0))
    hardware = make_hardware(settings)
    volumes = {}
    for mesh in hardware_meshes(settings):
        a, b, c = (mesh.points[mesh.triangles[:, k]] for k in range(3))
        volumes[mesh.name] = float((a * np.cross(b, c)).sum() / 6.0)
    plate = hardware.thick_mm * 4.0 * hardware.half_y_mm * hardware.half_z_mm
    assert volumes["separator"] == pytest.approx(plate, rel=1e-9)
    body = np.pi * hardware.body_radius_mm**2 * hardware.body_mm
    assert volumes["connector"] == pytest.approx(body, rel=2e-3)


def test_strand_tube_has_the_strings_radius() -> None:
    settings = make_settings((0.0, 30.0))
    path = strand_paths(settings, state_at(settings, 1))[0]
    mesh = strand_mesh(path, (1.0, 1.0, 1.0), sides=12)
    rings = mesh.points.reshape(-1, 12, 3)
    centre = rings.mean(axis=1, keepdims=True)
    assert np.linalg.norm(rings - centre, axis=2) == pytest.approx(0.12, abs=1e-9)
    a, b, c = (mesh.points[mesh.triangles[:, k]] for k in range(3))
    facing = np.cross(b - a, c - a)
    assert ((facing * mesh.normals[mesh.triangles[:, 0]]).sum(axis=1) > 0).mean() > 0.999


def test_without_opengl_one_line_names_the_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(view3d, "opengl_works", lambda: False)
    assert run(["synth", "view", "--turns", "3", "--png", str(tmp_path / "a.png")]) == 2
    message = capsys.readouterr().err.strip()
    assert "libegl1 libgl1-mesa-dri" in message
    assert "\n" not in message
    assert run(["synth", "view", "--turns", "3", "--gltf", str(tmp_path / "a.glb")]) == 0


def test_without_display_the_window_is_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    if sys.platform in ("darwin", "win32"):
        pytest.skip("this system always has a display")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert run(["synth", "view", "--turns", "3"]) == 2
    assert "--png" in capsys.readouterr().err


@pytest.mark.parametrize("distance_mm", [0.0, 120.0])
def test_pyvista_and_the_analytic_renderer_agree_on_the_outline(distance_mm: float) -> None:
    """Within half a pixel, column by column, telecentric and pinhole."""
    if not view3d.opengl_works():
        pytest.skip(view3d.ADVICE)
    changes: dict[str, object] = {
        **SMALL,
        "camera.distance_mm": distance_mm,
        "camera.yaw_deg": 4.0,
        "camera.roll_deg": 2.0,
        "camera.blur_px": 0.0,
    }
    settings = make_settings((0.0, 30.0), changes=changes)
    state = state_at(settings, 1)
    drawn = draw(settings, make_scene(settings), state).covered
    picture = pyvista_mask(settings, state)
    columns = range(130, 480)
    top = [first_edge(drawn[:, c]) - first_edge(picture[:, c]) for c in columns]
    bottom = [first_edge(drawn[::-1, c]) - first_edge(picture[::-1, c]) for c in columns]
    worst = np.percentile(np.abs(top + bottom), 98)
    assert worst < 0.5
    assert abs(np.mean(top) - np.mean(bottom)) < 0.1


def pyvista_mask(settings, state) -> np.ndarray:  # type: ignore[no-untyped-def]
    """Coverage 0..1 of the strands as VTK draws them, all else removed."""
    import pyvista

    from synth.camera import place

    view = place(settings.camera, 23.2)
    plotter: Any = pyvista.Plotter(off_screen=True, window_size=[view.width, view.height])
    plotter.set_background("black")
    for path in strand_paths(settings, state):
        data = view3d.poly_data(strand_mesh(path, (1.0, 1.0, 1.0), sides=48))
        plotter.add_mesh(data, color="white", lighting=False)
    view3d.aim(plotter, view)
    plotter.enable_anti_aliasing("ssaa")
    plotter.render()
    picture = np.asarray(plotter.screenshot(return_img=True))[..., 0] / 255.0
    plotter.close()
    return picture


def first_edge(column: np.ndarray) -> float:
    """Where coverage first rises through one half, between rows."""
    row = int(np.argmax(column >= 0.5))
    if row == 0:
        return 0.0
    low, high = column[row - 1], column[row]
    return row - 1 + (0.5 - low) / (high - low)
