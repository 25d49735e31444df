"""`tsvision onset` on a measured folder: the line, the JSON, the exit codes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cli.main import run
from tests.timeline.series import Plan, Series, simulate
from tsvision.records import Actuator, Rig
from tsvision.timeline.account import account
from tsvision.timeline.told import summary

RIG = Rig(actuator=Actuator(twisting_zone_mm=23.2, hole_diameter_mm=0.9))


def measured_folder(folder: Path, series: Series) -> Path:
    told = account(series.frames, series.knots, RIG)
    told.frames.to_csv(folder / "frames.csv", index=False)
    told.knots.to_csv(folder / "knots.csv", index=False)
    (folder / "summary.json").write_text(json.dumps(summary(told), allow_nan=False))
    return folder


def test_observed_line_names_interval_way_back_and_safe_contraction(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = measured_folder(tmp_path, simulate(Plan(nan=0.0)))
    assert run(["onset", str(folder)]) == 0
    line = capsys.readouterr().out
    assert line.startswith("knot onset: 48.0 turns (95 % 4")
    assert "; irreversible from " in line and "largest safe contraction " in line
    assert line.count("\n") == 1


def test_json_is_the_object_alone_and_censoring_exits_with_3(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = measured_folder(tmp_path, simulate(Plan(knot_turns=(), nan=0.0)))
    assert run(["onset", str(folder), "--json"]) == 3
    onset = json.loads(capsys.readouterr().out)
    assert onset["status"] == "not_observed" and onset["turns"] is None
    assert onset["last_turns"] == 70 and onset["level"] == 0.95


def test_undetermined_exits_with_4_and_says_why(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = measured_folder(tmp_path, simulate(Plan(nan=0.97)))
    assert run(["onset", str(folder)]) == 4
    assert "undetermined, " in capsys.readouterr().out


def test_another_phase_on_request(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = measured_folder(tmp_path, simulate(Plan(nan=0.0)))
    assert run(["onset", str(folder), "--phase", "overtwist", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["turns"] == pytest.approx(20, abs=2)


def test_a_folder_that_is_not_there_is_one_line_and_exit_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["onset", str(tmp_path / "nowhere")]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "nowhere" in said
