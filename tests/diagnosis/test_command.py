"""`tsvision diagnose`: JSON of the interface note, words for people, folders, refusals."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

from cli.main import run
from tests.hidden import planted

KEYS = {
    "status",
    "causes",
    "equivalent",
    "base",
    "extended",
    "gain",
    "evidence",
    "next_experiment",
    "residual",
}


def write(path: Path, rows: list[dict]) -> Path:
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    return path


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    setting = planted.Setting(count=4, levels=9)
    rows = planted.plain_case("lost_turns", 950_001, setting).rows
    return write(tmp_path_factory.mktemp("data") / "data.csv", rows)


@pytest.mark.parametrize("option", ["--out", "--page"])
def test_a_place_that_cannot_be_written_is_refused_before_the_work(
    option: str,
    data: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def never(*anything: object) -> None:
        raise AssertionError("diagnosed although the answer cannot be written")

    monkeypatch.setattr("tsvision.diagnosis.sources.diagnose_sources", never)
    for place in (tmp_path / "gone" / "a.json", tmp_path):
        assert run(["diagnose", str(data), option, str(place)]) == 2
        assert f"{place}: cannot be written (it" in capsys.readouterr().err


def test_json_has_the_promised_keys(data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["diagnose", str(data), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert set(answer) >= KEYS
    assert answer["causes"][0]["name"] == "lost_turns"
    for value in answer["causes"][0]["parameters"].values():
        assert set(value) == {"value", "low", "high", "unit"}
        assert value["low"] <= value["value"] <= value["high"]
    assert answer["equivalent"][0] == ["lost_turns"]
    assert {
        "held_out_rmse_base_mm",
        "held_out_rmse_extended_mm",
        "ratio",
        "low",
        "high",
        "scheme",
    } <= set(answer["gain"])
    assert answer["gain"]["ratio"] > 2
    assert set(answer["evidence"][0]) == {"causes", "log_evidence_gain"}
    assert answer["extended"]["rmse_mm"] < answer["base"]["rmse_mm"]


def test_words_for_people(data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["diagnose", str(data)]) == 0
    said = capsys.readouterr().out
    assert "lost turns" in said and "mm" in said and "not seen" in said


def test_bad_input_is_one_line_and_exit_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = write(tmp_path / "bad.csv", [{"turns": 1, "observable": "speed", "value": 3}])
    assert run(["diagnose", str(bad)]) == 2
    caught = capsys.readouterr()
    assert caught.out == "" and caught.err.count("\n") == 1
    assert run(["diagnose", str(tmp_path)]) == 2
    assert "measure" in capsys.readouterr().err


def folder(path: Path, rows: list[dict], run_name: str, load: float) -> Path:
    """A measured folder as `tsvision measure` leaves it, from the rows of one planted run."""
    path.mkdir()
    seen: dict[tuple, dict] = {}
    for row in (r for r in rows if r["run"] == run_name):
        key = (row["turns"], row["branch"])
        frame = seen.setdefault(key, {"turns": row["turns"], "phase": "twist", "flags": ""})
        if row["observable"] == "helix_angle_deg":
            frame["helix_angle_rad"] = row["value"] * 0.017453292519943295
            frame["helix_angle_rad_sd"] = 0.005
        else:
            frame[row["observable"]] = row["value"]
        frame["diameter_mm_sd"] = 0.008
        frame["mm_per_px"], frame["mm_per_px_sd"] = 0.02, 0.0001
    write(path / "frames.csv", [{"frame": i, **frame} for i, frame in enumerate(seen.values())])
    rig = {
        "strings.count": 4,
        "strings.diameter_mm": 0.2562,  # D = 0.70 by the section model
        "actuator.twisting_zone_mm": 23.2,
        "actuator.hole_distance_mm": 5.0,
        "actuator.load_N": load,
    }
    (path / "summary.json").write_text(json.dumps({"rig": rig}))
    return path


def test_measured_folders_are_data(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Three runs under three loads, each a folder; the first turns of the motor are lost."""
    setting = planted.Setting(count=4, levels=11, tolerance_times=0.0)
    rows = planted.plain_case("lost_turns", 950_011, setting).rows
    loads = {f"run{i}": kgf * planted.G for i, kgf in enumerate(setting.loads_kgf)}
    made = [folder(tmp_path / name, rows, name, load) for name, load in loads.items()]
    assert run(["diagnose", *map(str, made), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["data"]["runs"] == ["run0", "run1", "run2"]
    assert set(answer["data"]["observables"]) == {
        "displacement_mm",
        "diameter_mm",
        "helix_angle_deg",
    }
    assert answer["data"]["loads_N"] == pytest.approx(list(loads.values()), abs=1e-3)
    assert ["lost_turns"] in answer["equivalent"]
