"""The written criterion on envelopes drawn by hand, then on the whole sequence."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from synth.actuator import state_at
from synth.build import make_settings, parse_turns
from synth.camera import place
from synth.exposure import _moved
from synth.phases import find_knots, onset, phase_of
from synth.recording import onsets
from synth.settings import Settings
from synth.state import State
from synth.truth import envelope_of, frame_truth

S_MM = np.arange(0.0, 20.0, 0.02)


def bumped(height: float, length: float, base: float = 0.6) -> np.ndarray:
    return np.where(np.abs(S_MM - 10.0) < length / 2.0, height, base)


def test_a_bump_is_a_knot_only_when_long_and_high_enough() -> None:
    diameter = 0.48
    assert len(find_knots(S_MM, bumped(0.75, 1.0), diameter).knots) == 1
    assert not find_knots(S_MM, bumped(0.75, 0.40), diameter).knots  # shorter than D
    assert not find_knots(S_MM, bumped(0.68, 1.0), diameter).knots  # below 1.15 E0
    assert not find_knots(S_MM, bumped(0.66, 1.0, base=0.5), diameter).knots  # below 1.40 D
    knot = find_knots(S_MM, bumped(0.75, 1.0), diameter).knots[0]
    assert knot.centre_mm == pytest.approx(10.0, abs=0.02)
    assert knot.stop_mm - knot.start_mm == pytest.approx(1.0, abs=0.05)
    assert knot.max_diameter_mm == 0.75


def test_phases_by_the_criterion() -> None:
    even = find_knots(S_MM, np.full_like(S_MM, 0.6), 0.48)
    uneven = find_knots(S_MM, 0.6 + 0.075 * np.sign(np.sin(S_MM)), 0.62)
    assert phase_of(even, 0.023, 0.48) == "twist"
    assert phase_of(even, 0.025, 0.48) == "overtwist"
    assert uneven.unevenness == pytest.approx(0.125, abs=0.005)
    assert phase_of(uneven, 0.1, 0.62) == "local overtwist"
    assert phase_of(find_knots(S_MM, bumped(0.75, 1.0), 0.48), 0.1, 0.48) == "knotted"


def test_an_onset_must_persist() -> None:
    turns = np.arange(6.0)
    seen = onset(turns, np.array([0, 1, 0, 0, 1, 1], bool))
    assert (seen["status"], seen["turns"], seen["after_turns"]) == ("observed", 4.0, 3.0)
    assert onset(turns, np.array([0, 0, 1, 1, 1, 0], bool))["status"] == "not_observed"
    assert onset(turns, np.zeros(6, bool)) == {
        "status": "not_observed",
        "turns": None,
        "last_turns": 5.0,
    }


def rows(settings: Settings) -> pd.DataFrame:
    view = place(settings.camera, 23.2)
    states = [state_at(settings, i) for i in range(len(settings.turns))]
    return pd.DataFrame(
        [frame_truth(settings, view, state, i).row for i, state in enumerate(states)]
    )


def test_two_strings_pass_the_papers_phases_in_the_papers_order() -> None:
    settings = make_settings(parse_turns("0:70:5"))
    table = rows(settings)
    phases = dict(zip(table["turns"], table["phase"], strict=True))
    assert phases[15.0] == "twist"
    assert phases[30.0] == "overtwist"
    assert phases[50.0] == "local overtwist"
    assert phases[65.0] == "knotted"
    assert phases[70.0] == "irreversible"
    found = onsets(settings, table)
    assert found["overtwist_onset"]["exact_turns"] == pytest.approx(20.5, abs=0.5)
    assert found["knot_onset"]["turns"] == 65.0
    assert found["knot_onset"]["exact_turns"] == pytest.approx(60.3, abs=0.3)


def test_a_knot_too_thick_for_the_hole_is_irreversible() -> None:
    """The same scene with a wide and a narrow hole: only the verdict changes."""
    for hole, phase in ((2.0, "knotted"), (0.6, "irreversible")):
        settings = make_settings((0.0, 64.0), changes={"actuator.hole_diameter_mm": hole})
        row = rows(settings).iloc[-1]
        assert row["phase"] == phase
        assert row["irreversible"] == (phase == "irreversible")
        assert 0.6 < row["max_envelope_mm"] < 2.0


def test_without_knots_none_is_true() -> None:
    table = rows(make_settings(parse_turns("0:70:10"), changes={"law.knots": False}))
    assert not table["knot_count"].any()
    assert "knotted" not in set(table["phase"])


def largest_step_mm(one: State, two: State) -> float:
    """How far the centre line moves, at equal x."""
    x = np.linspace(max(one.apex_mm, two.apex_mm), one.zone_mm, 400)
    moved = [
        np.interp(x, one.line.x_mm, getattr(one.line, name))
        - np.interp(x, two.line.x_mm, getattr(two.line, name))
        for name in ("y_mm", "z_mm")
    ]
    return float(np.hypot(*moved).max())


def test_the_scene_moves_without_jumps() -> None:
    """Halving the step of turns about halves the motion, also where phases begin."""
    for turns in (19.9, 20.0, 40.0, 59.95, 60.0, 66.0):
        steps = [0.1, 0.05]
        moved = []
        for step in steps:
            settings = make_settings((0.0, turns, turns + step))
            one, two = state_at(settings, 1), state_at(settings, 2)
            moved.append(largest_step_mm(one, two))
        assert moved[0] < 0.3
        assert moved[1] < 0.8 * moved[0] + 1e-3


def test_knots_stay_when_unwinding_and_remember_the_peak() -> None:
    settings = make_settings(parse_turns("0:66:6,60:20:-10"))
    turned_back = {t: i for i, t in enumerate(settings.turns) if i > settings.turns.index(66.0)}
    fresh = make_settings((0.0, 50.0))
    assert not state_at(fresh, 1).knots
    kept = state_at(settings, turned_back[50.0])
    assert len(kept.knots) == 2
    envelope = envelope_of(settings, kept)
    assert envelope is not None
    assert envelope.knots
    assert kept.leg_turns + kept.line.turns == pytest.approx(50.0, abs=1e-4)


def test_neighbours_merge_when_they_meet() -> None:
    """Many knots in one zone run together: fewer intervals stand out than knots were laid."""
    settings = make_settings(
        (0.0, 95.0), changes={"law.knot_count": 7, "law.knot_interval_turns": 2.0}
    )
    state = state_at(settings, 1)
    envelope = envelope_of(settings, state)
    assert envelope is not None
    assert len(state.knots) == 7
    assert 1 <= len(envelope.knots) < 7
    assert state.leg_turns + state.line.turns == pytest.approx(95.0, abs=1e-4)


def test_a_blurred_frame_on_the_way_back_keeps_its_knots() -> None:
    """The moments of one exposure share the frame's past."""
    settings = make_settings(parse_turns("0:66:66,40"), changes={"camera.turning_blur_turns": 0.1})
    state = state_at(settings, 2)
    assert len(state.knots) == len(_moved(settings, state, 0.05).knots) == 2
