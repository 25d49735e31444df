"""The same scene in pyvista: a window, a PNG, a GIF or MP4.

Off-screen OpenGL that is missing kills the process rather than raising, so it is probed in a
subprocess first.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from synth.actuator import state_at
from synth.camera import View, place, project, to_camera
from synth.effects import stated_zone_mm
from synth.meshes import BAR_MM, Mesh, scene_meshes
from synth.settings import Settings
from synth.state import State
from tsvision.errors import InputError

_PROBE = """
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(64, 64))
plotter.add_mesh(pyvista.Sphere())
plotter.render()
raise SystemExit(0 if plotter.screenshot(return_img=True).std() > 1 else 3)
"""
ADVICE = (
    "no OpenGL for pictures without a display was found; on Debian or Ubuntu "
    "`apt-get install libegl1 libgl1-mesa-dri` brings it (a .glb needs none)"
)


@lru_cache(maxsize=1)
def opengl_works() -> bool:
    """Draw one sphere off screen in another process and see whether it survives."""
    result = subprocess.run(
        [sys.executable, "-c", _PROBE], capture_output=True, timeout=120, check=False
    )
    return result.returncode == 0


def require_opengl() -> None:
    """InputError that names the missing package."""
    if not opengl_works():
        raise InputError(ADVICE)


def has_display() -> bool:
    """Whether a window can open."""
    return sys.platform in ("darwin", "win32") or any(
        os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY")
    )


def poly_data(mesh: Mesh) -> Any:
    """A mesh as pyvista's PolyData with its normals."""
    import pyvista

    faces = np.column_stack([np.full(len(mesh.triangles), 3), mesh.triangles]).ravel()
    data = pyvista.PolyData(mesh.points, faces)
    data.point_data["Normals"] = mesh.normals
    data.point_data.active_normals_name = "Normals"
    return data


def make_plotter(settings: Settings, state: State, off_screen: bool) -> Any:
    """A plotter with the scene in it, seen by the recording's camera."""
    import pyvista

    view = place(settings.camera, stated_zone_mm(settings))
    plotter: Any = pyvista.Plotter(
        off_screen=off_screen, window_size=[view.width, view.height], lighting="none"
    )
    plotter.set_background(_stored(settings.look.ground_rgb))
    key = np.array(settings.look.light) @ view.rotation
    plotter.add_light(pyvista.Light(position=tuple(100.0 * key), intensity=0.8))
    plotter.add_light(pyvista.Light(light_type="headlight", intensity=0.35))
    add_scene(plotter, settings, state)
    aim(plotter, view)
    plotter.enable_anti_aliasing("ssaa")
    return plotter


def add_scene(plotter: Any, settings: Settings, state: State) -> None:
    """Meshes under fixed names, so that adding again replaces them."""
    for mesh in scene_meshes(settings, state):
        plotter.add_mesh(
            poly_data(mesh), color=_stored(mesh.rgb), name=mesh.name, smooth_shading=True,
            specular=0.3, specular_power=20, render=False, reset_camera=False,
        )  # fmt: skip
        if mesh.name.startswith("scale bar"):
            view = place(settings.camera, stated_zone_mm(settings))
            at = project(view, to_camera(view, mesh.points.mean(axis=0)[None]))[0]
            plotter.add_text(
                f"{BAR_MM:g} mm", position=(at[0] - 24.0, view.height - 1.0 - at[1] - 34.0),
                font_size=12, color="white", name="scale label", render=False,
            )  # fmt: skip


def _stored(rgb: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(float(np.clip(value, 0.0, 1.0) ** (1.0 / 2.2)) for value in rgb)


def aim(plotter: Any, view: View) -> None:
    """Exact scale: telecentric views as a parallel projection, pinholes by their angle."""
    far = view.distance_mm if view.distance_mm > 0 else 200.0
    shift = view.centre_px - np.array([view.width - 1.0, view.height - 1.0]) / 2.0
    right, up, back = view.rotation
    focus = view.look_mm - shift[0] / view.px_per_mm * right + shift[1] / view.px_per_mm * up
    camera = plotter.camera
    camera.focal_point = tuple(focus)
    camera.position = tuple(focus + far * back)
    camera.up = tuple(up)
    if view.distance_mm > 0:
        camera.parallel_projection = False
        half = 0.5 * view.height / view.px_per_mm / view.distance_mm
        camera.view_angle = float(np.rad2deg(2.0 * np.arctan(half)))
    else:
        camera.parallel_projection = True
        camera.parallel_scale = 0.5 * view.height / view.px_per_mm
    camera.clipping_range = (0.3 * far, 3.0 * far)


def save_png(path: Path, settings: Settings, index: int = -1) -> Path:
    """A picture of one state, without a display."""
    require_opengl()
    plotter = make_plotter(settings, _state(settings, index), off_screen=True)
    try:
        # without render() a second screenshot would show the first picture again
        plotter.render()
        plotter.screenshot(str(path))
    finally:
        plotter.close()
    return path


def save_movie(path: Path, settings: Settings, frames_per_second: int = 12) -> Path:
    """All turns of the settings as .gif or .mp4."""
    require_opengl()
    if path.suffix == ".mp4":
        _write_mp4(path, _pictures(settings), frames_per_second)
    elif path.suffix == ".gif":
        _write_gif(path, _pictures(settings), frames_per_second)
    else:
        raise InputError(f"{path.name}: a movie's name must end in .gif or .mp4")
    return path


def _pictures(settings: Settings) -> Iterator[np.ndarray]:
    plotter = make_plotter(settings, _state(settings, 0), off_screen=True)
    try:
        for index in range(len(settings.turns)):
            add_scene(plotter, settings, _state(settings, index))
            plotter.render()
            yield np.asarray(plotter.screenshot(return_img=True))
    finally:
        plotter.close()


def _write_mp4(path: Path, pictures: Iterator[np.ndarray], rate: int) -> None:
    import av

    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=rate)
        stream.pix_fmt = "yuv420p"
        for number, picture in enumerate(pictures):
            even = np.ascontiguousarray(
                picture[: picture.shape[0] // 2 * 2, : picture.shape[1] // 2 * 2]
            )
            if number == 0:
                stream.width, stream.height = even.shape[1], even.shape[0]
            container.mux(stream.encode(av.VideoFrame.from_ndarray(even, format="rgb24")))
        container.mux(stream.encode())


def _write_gif(path: Path, pictures: Iterator[np.ndarray], rate: int) -> None:
    from PIL import Image

    frames = [Image.fromarray(picture).quantize(128) for picture in pictures]
    frames[0].save(
        path, save_all=True, append_images=frames[1:], duration=round(1000 / rate), loop=0
    )


def show(settings: Settings) -> None:
    """A window to turn the last state about in."""
    if not has_display():
        raise InputError("no display to open a window on; give --png, --movie or --gltf FILE")
    make_plotter(settings, _state(settings, -1), off_screen=False).show()


def _state(settings: Settings, index: int) -> State:
    return state_at(settings, index % len(settings.turns))
