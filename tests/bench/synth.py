"""Speed and edge accuracy of the analytic renderer, beside pyvista on the same scene.

Run `python -m tests.bench.synth`. One core; seconds are CPU seconds of this process, so another
job on the machine hardly matters. Edges are compared with a brute-force mask of swept discs.
"""

# ruff: noqa: E402 - the thread counts must be set before numpy and numba are imported
from __future__ import annotations

import os

for _name in ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import time
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
from numba import njit

from synth.actuator import state_at
from synth.build import make_settings
from synth.camera import place, project, to_camera
from synth.effects import stated_zone_mm
from synth.render import draw, make_scene, shoot
from synth.settings import PAPER_ONSET_TURNS, Settings, Strings
from synth.strands import strand_paths

FRAMES = 24
FACTOR = 16


def settings_for(count: int, width: int, height: int) -> Settings:
    """Clean preset over every phase: 0.3 to 3.5 times the onset."""
    onset = PAPER_ONSET_TURNS[count]
    turns = tuple(float(t) for t in np.linspace(0.3 * onset, 3.5 * onset, FRAMES))
    changes: dict[str, object] = {"camera.width_px": width, "camera.height_px": height}
    return make_settings(turns, strings=Strings(count=count), changes=changes)


def cpu_frames_per_s(one: Callable[[int], object]) -> float:
    """Frames a CPU second, after one warm-up frame."""
    one(0)
    start = time.process_time()
    for index in range(FRAMES):
        one(index)
    return FRAMES / (time.process_time() - start)


def analytic(settings: Settings) -> float:
    """State, strands, contact, picture, lens, sensor: everything but the file."""
    scene = make_scene(settings)

    def one(index: int) -> np.ndarray:
        state = state_at(settings, index)
        return shoot(settings, draw(settings, scene, state), index)

    return cpu_frames_per_s(one)


def with_pyvista(settings: Settings) -> float:
    """The same states with new tubes a frame, SSAA."""
    from synth.view3d import add_scene, make_plotter

    plotter: Any = make_plotter(settings, state_at(settings, 0), off_screen=True)

    def one(index: int) -> np.ndarray:
        add_scene(plotter, settings, state_at(settings, index))
        plotter.render()
        return np.asarray(plotter.screenshot(return_img=True))

    rate = cpu_frames_per_s(one)
    plotter.close()
    return rate


@njit(cache=True)
def _discs(x, y, radius, mask):
    for k in range(len(x)):
        for row in range(max(int(y[k] - radius), 0), min(int(y[k] + radius) + 2, mask.shape[0])):
            half = radius * radius - (row - y[k]) ** 2
            if half > 0.0:
                reach = np.sqrt(half)
                first = max(int(np.ceil(x[k] - reach)), 0)
                last = min(int(np.floor(x[k] + reach)), mask.shape[1] - 1)
                if last >= first:
                    mask[row, first : last + 1] = True


def exact_coverage(settings: Settings, index: int, box: tuple[int, int, int, int]) -> np.ndarray:
    """Share of each pixel of the box (left, top, width, height) that strands cover."""
    left, top, width, height = box
    state = state_at(settings, index)
    view = place(settings.camera, stated_zone_mm(settings))
    mask = np.zeros((height * FACTOR, width * FACTOR), bool)
    for path in strand_paths(settings, state):
        centre = project(view, to_camera(view, path.points_mm))
        arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(centre, axis=0).T))])
        marks = np.arange(0.0, arc[-1], 0.05)
        x = (np.interp(marks, arc, centre[:, 0]) + 0.5 - left) * FACTOR - 0.5
        y = (np.interp(marks, arc, centre[:, 1]) + 0.5 - top) * FACTOR - 0.5
        near = (x > -40 * FACTOR) & (x < (width + 40) * FACTOR)
        radius = 0.5 * path.diameter_mm * view.px_per_mm * FACTOR
        _discs(x[near], y[near], radius, mask)
    return mask.reshape(height, FACTOR, width, FACTOR).mean(axis=(1, 3))


def outer_errors(exact: np.ndarray, drawn: np.ndarray) -> np.ndarray:
    """px by which the drawn outline lies outside the exact one, per column and side."""
    errors = []
    for column in range(exact.shape[1]):
        solid = np.flatnonzero((exact[:, column] > 0.999) & (drawn[:, column] > 0.999))
        if len(solid):
            for part in (slice(0, solid[0]), slice(solid[-1] + 1, None)):
                errors.append(drawn[part, column].sum() - exact[part, column].sum())
    return np.array(errors)


def edge_errors(settings: Settings) -> tuple[float, float]:
    """Mean and rms over a straight, a coiled and a knotted frame."""
    width, height = settings.camera.width_px, settings.camera.height_px
    box = (int(0.35 * width), int(0.36 * height), int(0.3 * width), int(0.28 * height))
    scene = make_scene(settings)
    left, top, wide, high = box
    found = []
    for index in (3, FRAMES // 2, FRAMES - 2):
        drawn = draw(settings, scene, state_at(settings, index)).covered
        part = drawn[top : top + high, left : left + wide]
        found.append(outer_errors(exact_coverage(settings, index, box), part))
    errors = np.concatenate(found)
    return float(errors.mean()), float(np.sqrt((errors**2).mean()))


def main() -> None:
    """Print the table."""
    cv2.setNumThreads(1)
    from synth.view3d import ADVICE, opengl_works

    vtk = opengl_works()
    print(
        f"{'strings':>7} {'size':>10} {'frames/s':>9} {'pyvista':>8} "
        f"{'edge mean px':>12} {'rms px':>7}"
    )
    for width, height in ((960, 540), (1920, 1080)):
        for count in (2, 4, 6, 8):
            settings = settings_for(count, width, height)
            rate = analytic(settings)
            other = f"{with_pyvista(settings):8.1f}" if vtk else f"{'-':>8}"
            mean, rms = edge_errors(settings)
            print(
                f"{count:>7} {width:>5}x{height:<4} {rate:>9.1f} {other} "
                f"{mean:>+12.4f} {rms:>7.3f}",
                flush=True,
            )
    if not vtk:
        print(ADVICE)


if __name__ == "__main__":
    main()
