"""Many recordings together: table, survival with censoring, dependence, the paper beside it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from cli.main import run
from tsvision.timeline import many


def onset(turns: float | None, last: float, status: str = "") -> dict[str, object]:
    status = status or ("observed" if turns is not None else "not_observed")
    low = None if turns is None else turns - 1
    return {"status": status, "turns": turns, "low": low, "high": turns, "last_turns": last}


def write(folder: Path, strings: int, turns: float | None, last: float, status: str = "") -> None:
    folder.mkdir(parents=True)
    told = {
        "knot_onset": onset(turns, last, status),
        "overtwist_onset": onset(40.0 / strings, last),
        "diameter_mm": {"value": 0.33 * strings**0.5, "sd": 0.01},
        "rig": {"strings.count": strings, "strings.diameter_mm": 0.24, "actuator.load_N": 19.6},
    }
    (folder / "summary.json").write_text(json.dumps(told))


def test_survival_by_hand_with_one_censored_recording(tmp_path: Path) -> None:
    for name, turns, last in (("a", 40.0, 70), ("b", None, 45), ("c", 50.0, 70), ("d", 60.0, 70)):
        write(tmp_path / name, 2, turns, last)
    table = many.onset_table(many.measured_folders([tmp_path]), "knot")
    curve = many.survival(table).set_index("turns")["without"]
    # 3/4 after 40; b leaves the risk set at 45; then 1/2 of the two left, then none.
    assert curve[40.0] == pytest.approx(0.75)
    assert curve[50.0] == pytest.approx(0.375)
    assert curve[60.0] == pytest.approx(0.0)
    assert many.medians(table)["median_turns"].iloc[0] == 50.0


def test_undetermined_recordings_are_in_no_curve_but_in_the_table(tmp_path: Path) -> None:
    write(tmp_path / "a", 2, 40.0, 70)
    write(tmp_path / "b", 2, None, 70, "undetermined")
    table = many.onset_table(many.measured_folders([tmp_path]), "knot")
    assert len(table) == 2 and len(many.usable(table)) == 1


def test_a_planted_power_law_in_n_is_found_with_censoring() -> None:
    random = np.random.default_rng(3)
    strings = np.repeat([2.0, 4.0, 6.0, 8.0], 12)
    onsets = 60.0 * (strings / 2) ** -0.6 * np.exp(0.05 * random.standard_normal(48))
    ends = np.where(random.random(48) < 0.3, onsets * 0.9, onsets + 10)
    seen = ends >= onsets
    table = pd.DataFrame(
        {
            "recording": "r",
            "strings": strings,
            "diameter_mm": np.nan,
            "load_N": 19.6,
            "status": np.where(seen, "observed", "not_observed"),
            "turns": np.where(seen, onsets, np.nan),
            "low": onsets - 1,
            "high": onsets,
            "last_turns": ends,
        }
    )
    found = many.dependence(table).set_index("x")
    assert list(found.index) == ["strings"]
    assert found.loc["strings", "exponent"] == pytest.approx(-0.6, abs=0.05)
    difference = many.group_difference(table)
    assert difference is not None and difference["p"] < 1e-6


def test_the_paper_stands_beside_the_measured_overtwist_onsets(tmp_path: Path) -> None:
    for strings in (2, 4, 6):
        write(tmp_path / str(strings), strings, None, 70)
    table = many.onset_table(many.measured_folders([tmp_path]), "overtwist")
    paper = many.against_paper(table).set_index("strings")
    assert paper["paper_turns"].to_dict() == {2: 20, 4: 11, 6: 10, 8: 8}
    assert bool(paper.loc[2, "agrees"]) and not bool(paper.loc[6, "agrees"])
    assert np.isnan(paper.loc[8, "recordings"])


def test_command_prints_writes_and_answers_in_json(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for number, strings in enumerate((2, 2, 4, 4)):
        write(tmp_path / "in" / str(number), strings, 90.0 / strings + number, 70)
    assert run(["onsets", str(tmp_path / "in"), "--out", str(tmp_path / "out")]) == 0
    assert "Kaplan" in capsys.readouterr().out
    assert "Plotly" in (tmp_path / "out" / "survival.html").read_text()
    assert len(pd.read_csv(tmp_path / "out" / "onsets.csv")) == 4
    assert run(["onsets", str(tmp_path / "in"), "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["onsets"]) == 4


def test_a_folder_that_was_not_measured_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["onsets", str(tmp_path)]) == 2
    assert "tsvision measure" in capsys.readouterr().err
