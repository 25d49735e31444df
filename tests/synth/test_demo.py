"""The demo's own words; the chain it runs is tested where its links live."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cli import demo
from cli.main import run


def written(folder: Path, onset: dict[str, object]) -> tuple[Path, Path]:
    recording, measured = folder / "recording", folder / "measured"
    recording.mkdir()
    measured.mkdir()
    truth = {"onsets": {"knot_onset": {"turns": 61.0, "exact_turns": 60.37}}}
    (recording / "truth.json").write_text(json.dumps(truth))
    (measured / "summary.json").write_text(json.dumps({"knot_onset": onset}))
    return recording, measured


def test_it_sets_the_onset_beside_the_truth(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    onset = {"status": "observed", "turns": 60.5, "low": 60.0, "high": 61.0, "level": 0.95}
    demo._tell(*written(tmp_path, onset))
    said = capsys.readouterr().out
    assert "knots begin at 60.5 turns (95% interval 60 to 61)" in said
    assert "first frame with a knot at 61 turns (exactly at 60.37)" in said


def test_it_never_prints_a_number_for_no_onset(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    onset: dict[str, object] = {"status": "not_observed", "turns": None, "last_turns": 68.0}
    demo._tell(*written(tmp_path, onset))
    assert "not_observed up to 68 turns" in capsys.readouterr().out


def test_it_keeps_what_is_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "demo").mkdir()
    (tmp_path / "demo" / "mine.txt").write_text("keep")
    assert run(["demo", "--out", str(tmp_path / "demo")]) == 2
    assert "--overwrite" in capsys.readouterr().err
    assert (tmp_path / "demo" / "mine.txt").exists()


@pytest.mark.parametrize("name", ["recording", "measured"])
def test_overwrite_leaves_folders_alone_that_no_demo_wrote(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    name: str,
) -> None:
    def never(*anything: object) -> None:
        raise AssertionError("rendered although the demo cannot be written")

    monkeypatch.setattr(demo, "_render", never)
    mine = tmp_path / name / "thesis.txt"
    mine.parent.mkdir()
    mine.write_text("years of work")
    assert run(["demo", "--out", str(tmp_path), "--overwrite"]) == 2
    assert f"{name}: holds files but no" in capsys.readouterr().err
    assert mine.read_text() == "years of work"
