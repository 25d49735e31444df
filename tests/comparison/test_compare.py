"""The comparison finds the model that made the data, and keeps the paper's yardstick."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from cli.main import run
from tsvision.comparison.compare import compare, evaluate
from tsvision.comparison.measured import locked_pitch_mm, rig_of_summary
from tsvision.comparison.sample import paper_sample, read_sample
from tsvision.errors import InputError
from tsvision.models import MODELS
from tsvision.records import Actuator, Rig, Strings

RIG = Rig(strings=Strings(2, 0.4), actuator=Actuator(twisting_zone_mm=24.0, hole_distance_mm=4.0))
RODS = Path(__file__).resolve().parents[2] / ".." / "shared" / "rods"


def made_by(model: str, folder: Path, loads: tuple[float, ...] = (10.0, 20.0)) -> Path:
    """A table of displacements by one model with its string 5 % thicker, 0.02 mm noise."""
    rng = np.random.default_rng(5)
    turns = np.tile(np.arange(2.0, 50.0, 3.0), len(loads))
    law = MODELS[model]
    geometry = {
        "twisting_zone_mm": 24.0,
        "hole_distance_mm": 4.0,
        "radius_mm": 0.42,
        "string_diameter_mm": 0.42,
    }
    x = law.displacement_mm(turns, **law.geometry(geometry)) + rng.normal(0, 0.02, turns.size)
    data = pd.DataFrame({"turns": turns, "displacement_mm": x})
    data["load_N"] = np.repeat(loads, turns.size // len(loads))
    data.to_csv(folder / f"{model}.csv", index=False)
    return folder / f"{model}.csv"


@pytest.mark.parametrize("model", ["constant_radius", "helix_then_coil", "variable_radius"])
def test_the_model_that_made_the_data_wins(model: str, tmp_path: Path) -> None:
    sample = read_sample([made_by(model, tmp_path)], RIG)
    comparison = compare(sample)
    found = {r.model: r for r in comparison.results}
    # 0.02 mm of noise, and a held-out fold costs little more.
    assert found[model].held_out_mm < 0.03
    assert comparison.best_mm <= found[model].held_out_mm
    assert found[model].refit_mm < found[model].as_given_mm
    thicker = next(iter(found[model].fitted.values()))
    assert thicker == pytest.approx(0.42, rel=0.002)


def test_the_papers_table_keeps_its_yardstick() -> None:
    result = evaluate(MODELS["constant_radius"], paper_sample())
    assert result.as_given_mm == pytest.approx(4.53, abs=0.005)
    assert result.held_out_mm == pytest.approx(2.08, abs=0.05)
    assert set(result.fold_mm) == {"19.61 N", "29.42 N", "49.03 N"}


def test_one_run_is_split_by_turns(tmp_path: Path) -> None:
    sample = read_sample([made_by("constant_radius", tmp_path, (10.0,))], RIG)
    assert sample.scheme == "leave-one-fifth-of-the-turns-out"
    assert len(sample.folds) == 5
    assert np.all(np.diff(sample.fold[np.argsort(sample.turns)]) >= 0)


def test_two_files_under_one_load_are_two_runs(tmp_path: Path) -> None:
    first = made_by("constant_radius", tmp_path, (10.0,))
    second = first.rename(tmp_path / "second.csv")
    first = made_by("constant_radius", tmp_path, (10.0,))
    sample = read_sample([first, second], RIG)
    assert sample.scheme == "leave-one-run-out" and len(sample.folds) == 2


def test_unwinding_rows_are_left_out_and_said(tmp_path: Path) -> None:
    path = made_by("constant_radius", tmp_path)
    data = pd.read_csv(path)
    data["branch"] = ["unwind" if i % 4 == 0 else "wind" for i in range(len(data))]
    data.to_csv(path, index=False)
    sample = read_sample([path], RIG)
    assert sample.turns.size == (data["branch"] == "wind").sum()
    assert any("unwinding" in note for note in sample.notes)


def test_models_for_a_pair_stay_silent_on_four_strings(tmp_path: Path) -> None:
    four = Rig(strings=Strings(4, 0.3), actuator=RIG.actuator)
    sample = read_sample([made_by("constant_radius", tmp_path)], four)
    result = evaluate(MODELS["helix_then_coil"], sample)
    assert math.isnan(result.held_out_mm) and "N = 2" in result.note


def test_pitch_is_taken_past_the_twist_phase_only() -> None:
    frames = pd.DataFrame(
        {"phase": ["twist", "twist", "overtwist", "knotted"], "pitch_mm": [5.0, 3.0, 1.5, 1.7]}
    )
    assert locked_pitch_mm(frames) == pytest.approx(1.6)
    assert math.isnan(locked_pitch_mm(frames[:2]))


def test_a_given_rig_wins_over_the_recorded_one() -> None:
    recorded = {
        "strings.count": 6,
        "strings.diameter_mm": 0.2,
        "actuator.twisting_zone_mm": 9.0,
        "actuator.load_N": None,
    }
    rig = rig_of_summary({"rig": recorded}, Rig(strings=Strings(count=2)))
    assert rig.strings.count == 2
    assert rig.strings.diameter_mm == 0.2 and rig.actuator.twisting_zone_mm == 9.0


def test_a_measured_folder_is_compared_with_its_own_diameter_and_pitch(tmp_path: Path) -> None:
    turns = np.arange(0.0, 60.0, 3.0)
    x = MODELS["constant_radius"].displacement_mm(
        turns, twisting_zone_mm=24.0, hole_distance_mm=4.0, radius_mm=0.3
    )
    frames = pd.DataFrame(
        {
            "frame": np.arange(turns.size),
            "turns": turns,
            "time_s": turns,
            "displacement_mm": x,
            "load_N": 20.0,
            "diameter_mm": 0.6,
            "pitch_mm": np.maximum(24.0 / np.maximum(turns, 1.0), 1.3),
            "phase": np.where(turns < 20, "twist", "overtwist"),
        }
    )
    frames.to_parquet(tmp_path / "frames.parquet")
    for name in ("profiles", "knots"):
        pd.DataFrame({"frame": [0]}).to_parquet(tmp_path / f"{name}.parquet")
    rig = {"strings.count": 2, "strings.diameter_mm": 0.3, "actuator.twisting_zone_mm": 24.0}
    rig["actuator.hole_distance_mm"] = 4.0
    nothing = {"value": None, "sd": None}
    summary = {
        **dict.fromkeys(("format", "frames_total", "frames_measured", "frames_flagged"), 1),
        **dict.fromkeys(("diameter_mm", "diameter_px", "helix_angle_deg"), nothing),
        "rig": rig,
        "input": {},
        "flags": {},
    }
    (tmp_path / "summary.json").write_text(json.dumps(summary))
    sample = read_sample([tmp_path], Rig())
    assert sample.known["radius_mm"][0] == pytest.approx(0.3)
    assert sample.known["pitch_mm"][0] == pytest.approx(1.3)
    assert evaluate(MODELS["constant_radius"], sample).as_given_mm < 1e-9
    assert math.isfinite(evaluate(MODELS["locked_pitch"], sample).as_given_mm)


def test_command_on_the_papers_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["compare", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert {m["model"] for m in answer["models"]} == set(MODELS)
    held = [m["held_out_mm"] for m in answer["models"] if m["held_out_mm"] is not None]
    assert held == sorted(held) and answer["held_out_best_mm"] == held[0]


def test_unknown_geometry_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = made_by("constant_radius", tmp_path)
    assert run(["compare", str(path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    path.write_text("no table at all\nfree, text, with: commas\n")
    assert run(["compare", str(path), "-N", "2"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    with pytest.raises(InputError, match="no displacement"):
        pd.DataFrame({"turns": range(5), "torque_Nmm": range(5)}).to_csv(path, index=False)
        read_sample([path], RIG)


@pytest.mark.skipif(
    not RODS.is_dir(), reason="the rod simulation's data are not beside the project"
)
def test_rods_prefer_the_strand_centre_radius() -> None:
    """Other physics: with nothing fitted the coiling model is far nearer than D/2."""
    rig = Rig(strings=Strings(2, 0.38), actuator=Actuator(23.2, 5.0))
    files = [RODS / f"{name}_kgf.csv" for name in ("two", "three", "five")]
    sample = read_sample(files, rig)
    coil = evaluate(MODELS["helix_then_coil"], sample)
    base = evaluate(MODELS["constant_radius"], sample)
    assert coil.as_given_mm < base.as_given_mm / 5
    assert coil.held_out_mm < base.held_out_mm
