"""Unwinding, cycles, and what may go wrong with a recording as a whole."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from tests.timeline.series import KNOT_COLUMNS, Plan, cycles, simulate, unmeasure
from tsvision.records import Actuator, Rig, Strings
from tsvision.timeline.account import Account, account

RIG = Rig(actuator=Actuator(twisting_zone_mm=23.2, hole_diameter_mm=0.9))
CALM = Plan(nan=0.0, false=0.0, noise=0.02)


def back(told: Account, phase: str) -> dict[str, Any]:
    entries: Any = told.extras["unwinding"]
    return next(e for e in entries if e["phase"] == phase)


def test_unwinding_tells_where_knots_dissolve_and_the_hysteresis() -> None:
    plan = replace(CALM, lag_turns=8.0, knot_turns=(47.5,))
    series = simulate(plan, cycles(60.0, 1.0, 1))
    told = account(series.frames, series.knots, RIG)
    assert told.onsets["knot_onset"].turns == pytest.approx(48, abs=1)
    knot = back(told, "knot")
    assert knot["status"] == "dissolved"
    assert knot["turns"] == pytest.approx(39.8, abs=1.5)
    assert knot["hysteresis_low"] <= 8.0 <= knot["hysteresis_high"]
    coil = back(told, "overtwist")
    assert coil["turns"] == pytest.approx(12.0, abs=1.5)


def test_a_knot_that_stays_is_told_as_staying() -> None:
    plan = replace(CALM, lag_turns=60.0, knot_turns=(47.5,))
    series = simulate(plan, cycles(60.0, 1.0, 1)[:-3])
    assert back(account(series.frames, series.knots, RIG), "knot")["status"] == "stays"


def test_cycles_that_repeat_have_little_spread_and_no_drift() -> None:
    plan = replace(CALM, lag_turns=5.0, knot_turns=(46.5,))
    series = simulate(plan, cycles(60.0, 2.0, 4))
    told: Any = account(series.frames, series.knots, RIG).extras["cycles"]
    assert told["cycles"] == 4 and told["observed"] == 4
    assert told["mean_turns"] == pytest.approx(48, abs=1.5)
    assert told["spread_turns"] <= 1.5
    assert told["drift_turns_per_cycle"]["low"] <= 0 <= told["drift_turns_per_cycle"]["high"]


def test_an_onset_that_comes_earlier_each_cycle_drifts() -> None:
    parts, knots, first = [], [], 0
    for number in range(5):
        plan = replace(CALM, knot_turns=(50.0 - 3 * number,), seed=number)
        series = simulate(plan, cycles(60.0, 1.0, 1)[:-1])
        parts.append(series.frames.assign(frame=series.frames["frame"] + first, cycle=number + 1))
        knots.append(series.knots.assign(frame=series.knots["frame"] + first))
        first += len(series.frames)
    told: Any = account(
        pd.concat(parts, ignore_index=True), pd.concat(knots, ignore_index=True), RIG
    ).extras["cycles"]
    drift = told["drift_turns_per_cycle"]
    assert drift["value"] == pytest.approx(-3.0, abs=0.5)
    assert drift["high"] < 0


def test_frames_reversed_with_their_turns_give_the_same_and_say_so() -> None:
    series = simulate(CALM)
    frames = series.frames.iloc[::-1].reset_index(drop=True)
    told = account(frames, series.knots, RIG)
    assert told.onsets["knot_onset"].turns == pytest.approx(series.knot_turns, abs=2)
    assert any("read backward" in note for note in told.notes)


def test_reversed_frames_with_their_times_are_put_right() -> None:
    series = simulate(CALM)
    timed = series.frames.assign(time_s=np.arange(len(series.frames)) * 0.5)
    told = account(timed.iloc[::-1].reset_index(drop=True), series.knots, RIG)
    assert told.onsets["knot_onset"].turns == series.knot_turns
    assert any("time_s" in note for note in told.notes)


@pytest.mark.parametrize("how", ["reversed", "shuffled"])
def test_turns_that_belong_to_other_frames_give_no_number(how: str) -> None:
    series = simulate(CALM)
    turns = series.frames["turns"].to_numpy()
    wrong = turns[::-1] if how == "reversed" else np.random.default_rng(2).permutation(turns)
    told = account(series.frames.assign(turns=wrong), series.knots, RIG)
    assert told.onsets["knot_onset"].status == "undetermined"
    assert "disagree" in told.reasons["knot_onset"]


def test_turns_counted_on_over_missing_frames_are_noticed() -> None:
    """Every other frame is gone, and the turns were counted by frames: half of what is seen."""
    frames = simulate(CALM).frames
    seen = frames["turns"] * (1 + 0.01 * np.random.default_rng(1).standard_normal(len(frames)))
    sound = frames.assign(turns_seen=seen)
    half = sound.iloc[::2].assign(turns=0.5 * sound["turns"].iloc[::2])
    no_knots = simulate(CALM).knots.iloc[:0]
    assert any("frames missing" in note for note in account(half, no_knots, RIG).notes)
    assert not any("frames missing" in note for note in account(sound, no_knots, RIG).notes)


def test_missing_frames_are_no_trouble() -> None:
    series = simulate(CALM)
    gone = np.random.default_rng(4).random(len(series.frames)) < 0.3
    frames = series.frames[~gone].reset_index(drop=True)
    onset = account(frames, series.knots[~series.knots["frame"].isin(np.flatnonzero(gone))], RIG)
    assert abs(onset.onsets["knot_onset"].turns - series.knot_turns) <= 2


def test_one_flash_frame_is_no_onset() -> None:
    series = simulate(replace(CALM, knot_turns=()))
    frames = series.frames.copy()
    for column, factor in (("max_envelope_mm", 2.5), ("coil_amplitude_mm", 9), ("unevenness", 9)):
        frames.loc[10, column] *= factor
    row = (10, 10.0, 9.0, 1.2, 1.1, 500.0, 270.0, 0.98, 1.0)
    told = account(frames, pd.DataFrame([row], columns=KNOT_COLUMNS), RIG)
    assert told.onsets["knot_onset"].status == "not_observed"
    assert told.onsets["overtwist_onset"].turns == pytest.approx(20, abs=1)
    assert told.frames["phase"][10] == "twist"
    assert len(told.knots) == 0 and len(told.rejected) == 1


def test_a_camera_bump_keeps_tracks_and_onset() -> None:
    series = simulate(CALM)
    moved = series.knots["frame"] >= 58
    knots = series.knots.copy()
    knots.loc[moved, ["centre_mm"]] += 1.6
    knots.loc[moved, ["centre_x_px"]] += 70.0
    frames = series.frames.copy()
    frames.loc[58, "flags"] = "CAMERA_MOVED"
    told = account(frames, knots, RIG)
    assert told.onsets["knot_onset"].turns == pytest.approx(series.knot_turns, abs=1)
    assert told.knots["track"].nunique() == 2


def test_a_motor_that_counts_downward_gives_signed_answers() -> None:
    series = simulate(CALM)
    frames = series.frames.assign(turns=-series.frames["turns"])
    onset = account(frames, series.knots, RIG).onsets["knot_onset"]
    assert onset.turns == -series.knot_turns
    assert onset.low <= onset.turns <= onset.high < 0
    assert onset.last_turns == -70


def test_without_turns_nothing_is_told() -> None:
    series = simulate(CALM)
    told = account(series.frames.assign(turns=np.nan), series.knots, RIG)
    for onset in told.onsets.values():
        assert onset.status == "undetermined" and onset.turns is None


def test_safe_turns_and_contraction_lie_before_the_first_knot_too_large() -> None:
    series = simulate(CALM)
    told = account(series.frames, series.knots, RIG)
    safe: Any = told.extras["safe"]
    irreversible = told.onsets["irreversible_onset"]
    assert irreversible.status == "observed"
    assert safe["turns"] == irreversible.low and safe["basis"] == "irreversible_knot"
    x = 1.2 * safe["turns"]
    assert safe["contraction_percent"] == pytest.approx(100 * x / (23.2 + 1.2 * 70), abs=0.1)
    near: Any = told.extras["near_misses"]
    assert {n["passes"] for n in near} == {False}


@pytest.mark.parametrize(
    ("of_hole", "status"), [(0.8, "not_observed"), (0.96, "undetermined"), (1.3, "observed")]
)
def test_a_knot_nearly_as_large_as_the_hole_is_not_told_from_a_larger_one(
    of_hole: float, status: str
) -> None:
    series = simulate(CALM)
    seen: Any = account(series.frames, series.knots, RIG).extras["near_misses"]
    largest = max(n["max_diameter_mm"] for n in seen)
    told = account(
        series.frames,
        series.knots,
        replace(RIG, actuator=replace(RIG.actuator, hole_diameter_mm=largest / of_hole)),
    )
    assert told.onsets["knot_onset"].status == "observed"
    assert told.onsets["irreversible_onset"].status == status
    safe: Any = told.extras["safe"]
    if status == "undetermined":
        assert "96 % of the hole" in told.reasons["irreversible_onset"]
        assert safe["basis"] == "knot"


def test_frames_all_unmeasured_are_undetermined_and_have_no_phase() -> None:
    series = simulate(CALM)
    frames, knots = unmeasure(series.frames, series.knots, np.ones(len(series.frames), dtype=bool))
    told = account(frames, knots, RIG)
    assert told.onsets["knot_onset"].status == "undetermined"
    assert set(told.frames["phase"]) == {""}


@pytest.mark.parametrize("count", [0, 1, 2])
def test_very_short_recordings_do_not_fall_over(count: int) -> None:
    series = simulate(CALM)
    told = account(series.frames.head(count), series.knots.head(0), RIG)
    assert len(told.frames) == count
    assert told.onsets["knot_onset"].status in ("undetermined", "not_observed")


def test_knots_that_show_and_go_again_while_winding_are_no_onset_but_are_told() -> None:
    plan = replace(CALM, knot_turns=(30.0,), vanish_turns={0: 37.0})
    series = simulate(plan)
    told = account(series.frames, series.knots, RIG)
    assert told.onsets["knot_onset"].status == "not_observed"
    assert any("gone again" in note for note in told.notes)


def test_a_thing_without_twist_is_not_called_free_of_knots() -> None:
    series = simulate(replace(CALM, knot_turns=()))
    frames = series.frames.assign(turns_seen=np.nan, pitch_px=np.nan)
    told = account(frames, series.knots, RIG)
    assert told.onsets["knot_onset"].status == "undetermined"
    assert "recognised in only 0 of" in told.reasons["knot_onset"]
    assert told.frames["knot_count"].isna().all() and (told.frames["phase"] == "").all()


def test_what_stands_out_of_a_thing_without_twist_is_no_knot() -> None:
    series = simulate(CALM)
    frames = series.frames.assign(turns_seen=np.nan, pitch_px=np.nan)
    assert len(account(series.frames, series.knots, RIG).knots)
    told = account(frames, series.knots, RIG)
    assert not len(told.knots) and len(told.rejected) >= len(series.knots)
    assert not told.tracks["confirmed"].any()


@pytest.mark.parametrize(("blur_px", "status"), [(2.5, "observed"), (4.0, "undetermined")])
def test_a_shadow_is_not_taken_for_the_bundle(blur_px: float, status: str) -> None:
    series = simulate(CALM)
    frames = series.frames.assign(blur_px=blur_px, mm_per_px=0.03)  # strings of 8 px
    told = account(frames, series.knots, Rig(strings=Strings(count=2, diameter_mm=0.24)))
    assert told.onsets["knot_onset"].status == status
    assert ("shadow" in told.reasons["knot_onset"]) == (status == "undetermined")
    assert bool(len(told.knots)) == (status == "observed")


@pytest.mark.parametrize(("string_mm", "status"), [(0.24, "observed"), (0.06, "undetermined")])
def test_a_thing_too_thick_for_its_strings_is_not_believed(string_mm: float, status: str) -> None:
    series = simulate(CALM)  # D = 0.48 mm: two strings of 0.24, never of 0.06
    rig = Rig(strings=Strings(count=2, diameter_mm=string_mm))
    told = account(series.frames, series.knots, rig)
    assert told.onsets["knot_onset"].status == status
    assert ("cannot make" in told.reasons["knot_onset"]) == (status == "undetermined")


def test_an_envelope_too_noisy_to_show_a_knot_tells_of_none() -> None:
    series = simulate(Plan(knot_turns=(), seed=2))
    assert account(series.frames, series.knots, RIG).onsets["knot_onset"].status == "not_observed"
    jump = np.random.default_rng(5).uniform(1.0, 3.0, len(series.frames))
    noisy = series.frames.assign(max_envelope_mm=series.frames["max_envelope_mm"] * jump)
    told = account(noisy, series.knots.iloc[:0], RIG)
    assert told.onsets["knot_onset"].status == "undetermined"
    assert "would not stand out" in told.reasons["knot_onset"]
