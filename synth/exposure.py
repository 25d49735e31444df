"""One exposure: the state may move while the shutter is open, or from row to row."""

from __future__ import annotations

import itertools

import numpy as np

from synth.actuator import State, solve_state
from synth.render import Drawing, Scene, draw
from synth.settings import Settings
from synth.strands import StrandPath

SUB_EXPOSURES = 5
ROW_BANDS = 12


def _moved(settings: Settings, state: State, by_turns: float) -> State:
    """The state a moment earlier or later, at the same history."""
    turns = state.motor_turns + by_turns
    wound = state.wound_turns + by_turns
    return solve_state(settings, turns, wound, max(state.peak_turns, abs(turns)))


def take(
    settings: Settings, scene: Scene, state: State, paths: list[StrandPath] | None = None
) -> Drawing:
    """The frame in linear light with turning blur and rolling shutter where asked for.

    The id map and coverage are those of the exposure's middle.
    """
    camera = settings.camera
    still = draw(settings, scene, state, paths)
    if camera.turning_blur_turns <= 0.0 and camera.rolling_turns == 0.0:
        return still
    linear = still.linear
    if camera.turning_blur_turns > 0.0:
        steps = np.linspace(-0.5, 0.5, SUB_EXPOSURES) * camera.turning_blur_turns
        total = np.zeros_like(linear)
        for step in steps:
            moved = still if step == 0 else draw(settings, scene, _moved(settings, state, step))
            total += moved.linear
        linear = total / SUB_EXPOSURES
    if camera.rolling_turns != 0.0:
        linear = _rolled(settings, scene, state, linear)
    return Drawing(linear, still.ids, still.covered)


def _rolled(settings: Settings, scene: Scene, state: State, linear: np.ndarray) -> np.ndarray:
    height = scene.view.height
    edges = np.linspace(0, height, ROW_BANDS + 1).astype(int)
    out = linear.copy()
    for top, bottom in itertools.pairwise(edges):
        share = (0.5 * (top + bottom) / height) - 0.5
        moved = draw(
            settings, scene, _moved(settings, state, share * settings.camera.rolling_turns)
        )
        out[top:bottom] = moved.linear[top:bottom]
    return out
