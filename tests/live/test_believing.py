"""The live decision equals the recording's, in time."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from tests.live.made import RIG, results_of
from tests.timeline.series import Plan, simulate, with_px, without_scale
from tsvision.live.believing import Live
from tsvision.records import Rig
from tsvision.timeline.account import account


@pytest.mark.parametrize("step", [pytest.param(0.25, marks=pytest.mark.slow), 1.0, 2.5])
def test_the_live_decision_is_the_recordings_within_two_frames(step: float) -> None:
    for seed in range(4):
        series = simulate(Plan(step_turns=step, knot_turns=(40.3 + seed, 48.0), seed=seed))
        live = Live(RIG)
        decided_at = None
        for number, result in enumerate(results_of(series)):
            state = live.push(result)
            if state.onset is not None and decided_at is None:
                decided_at = number
        afterwards = account(series.frames, series.knots, RIG).onsets["knot_onset"]
        assert live.onset is not None and decided_at is not None
        assert abs(live.onset.turns - afterwards.turns) <= 2 * step + 1e-9
        late = series.frames["turns"][decided_at] - afterwards.turns
        assert -1e-9 <= late <= max(4 * step, 2.0)


def test_without_a_scale_the_same_is_believed() -> None:
    plan = Plan(knot_turns=(40.3, 48.0), noise=0.05, false=0.1)
    series = simulate(plan)
    told = []
    for change in (with_px, without_scale):
        frames, knots = (change(t, plan.mm_per_px) for t in (series.frames, series.knots))
        live = Live(Rig())
        results = results_of(replace(series, frames=frames, knots=knots))
        told.append([live.push(result) for result in results])
    for with_mm, in_px in zip(*told, strict=True):
        assert in_px.there == pytest.approx(with_mm.there)
        assert in_px.onset == with_mm.onset
    assert told[0][-1].onset is not None


def test_no_decision_without_knots() -> None:
    for seed in range(6):
        live = Live(RIG)
        for result in results_of(simulate(Plan(knot_turns=(), seed=seed))):
            live.push(result)
        assert live.onset is None


def test_believing_costs_a_few_milliseconds_a_frame() -> None:
    live = Live(RIG)
    results = results_of(simulate(Plan(step_turns=0.5, knot_turns=())))
    began = time.process_time()
    for result in results:
        live.push(result)
    assert (time.process_time() - began) / len(results) < 0.015


def test_revised_frames_take_the_place_of_what_was_believed() -> None:
    series = simulate(Plan(knot_turns=(20.0,), last_turns=30.0, nan=0.0, false=0.0))
    wrong = results_of(simulate(Plan(knot_turns=(3.0,), last_turns=30.0, nan=0.0, false=0.0)))
    right = results_of(series)
    live = Live(RIG)
    for result in wrong[:12]:
        assert live.push(result, may_decide=False).onset is None
    live.restart(right[2:12:2])
    assert [r.row.frame for r in live.results] == list(range(12))
    assert np.isnan(live.results[3].row.knot_count) and live.results[1].row == wrong[1].row
    for result in right[12:]:
        live.push(result)
    assert live.onset is not None and live.onset.turns == pytest.approx(20.0, abs=2.0)
