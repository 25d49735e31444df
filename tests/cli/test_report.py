"""`tsvision report` as a person calls it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from cli import report
from cli.main import run
from tests.report.fake_measurement import write_fake

TURNS = np.linspace(0, 60, 5)


def test_one_folder_finds_its_frames_beside_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = write_fake(tmp_path, TURNS)
    assert run(["report", str(made.measure_dir), "--sheet"]) == 0
    told = capsys.readouterr()
    assert told.out.split() == [
        str(made.measure_dir / "report.html"),
        str(made.measure_dir / "sheet.jpg"),
    ]
    assert told.err == ""
    assert "data:image/jpeg" in (made.measure_dir / "report.html").read_text("utf-8")


def test_a_folder_that_is_missing_is_no_batch(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["report", str(tmp_path / "gone")]) == 2
    assert "no such folder; name one that `tsvision measure`" in capsys.readouterr().err


def test_the_sheet_shows_frames_as_they_were_measured(tmp_path: Path) -> None:
    """Without the lens's distortion: the axis was found on such pictures."""
    made = write_fake(tmp_path, TURNS)
    lens = [700.0, 700.0, 320.0, 180.0, -0.6, 0.0, 0.0, 0.0, 0.0]
    summary = json.loads((made.measure_dir / "summary.json").read_text())
    summary["rig"]["camera.lens"] = lens
    found = report._recording(made.measure_dir, None, several=False)
    assert found.rig.camera.lens == ()
    (made.measure_dir / "summary.json").write_text(json.dumps(summary))
    found = report._recording(made.measure_dir, None, several=False)
    assert found.rig.camera.lens == tuple(lens)


@pytest.mark.parametrize("table", ["frame,turns\n0,0\n99,1\n", "frame,turn\n0,0\n", ""])
def test_a_table_that_the_measurement_did_not_use_is_not_asked(table: str, tmp_path: Path) -> None:
    """Turns of --turns-per-frame or another file: the one beside the frames was refused."""
    made = write_fake(tmp_path, TURNS)
    (made.recording_dir / "turns.csv").write_text(table)
    assert run(["report", str(made.measure_dir), "--sheet"]) == 0
    assert "data:image/jpeg" in (made.measure_dir / "report.html").read_text("utf-8")


def test_of_frames_in_several_formats_those_that_were_measured_are_shown(tmp_path: Path) -> None:
    made = write_fake(tmp_path, TURNS)
    for file in made.recording_dir.glob("*.png"):
        file.with_suffix(".bmp").write_bytes(b"")
    found = report._recording(made.measure_dir, None, several=False)
    assert found.files == tuple(row.file for row in made.rows)


def test_frames_that_are_gone_are_said_to_be(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = write_fake(tmp_path, TURNS)
    made.recording_dir.rename(tmp_path / "elsewhere")
    assert run(["report", str(made.measure_dir)]) == 0
    assert "--recording" in capsys.readouterr().err
    assert run(["report", str(made.measure_dir), "--video"]) == 2
    there = str(tmp_path / "elsewhere")
    assert run(["report", str(made.measure_dir), "--recording", there]) == 0


def test_a_batch_s_folder_gives_a_page_each_and_one_over_all(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shelf = tmp_path / "out" / "recordings"
    for name in ("a", "b"):
        made = write_fake(tmp_path / name, TURNS)
        shelf.mkdir(parents=True, exist_ok=True)
        made.measure_dir.rename(shelf / name)
        made.recording_dir.rename(tmp_path / name / "film")
    assert run(["report", str(tmp_path / "out")]) == 0
    assert capsys.readouterr().out.split()[-1] == str(tmp_path / "out" / "overview.html")
    assert 'href="recordings/b/report.html"' in (tmp_path / "out/overview.html").read_text("utf-8")


def test_a_batch_finds_its_frames_in_the_folder_named(tmp_path: Path) -> None:
    films, shelf = tmp_path / "films", tmp_path / "out" / "recordings"
    for name in ("a", "b"):
        made = write_fake(tmp_path / name, TURNS)
        for old, new in ((made.measure_dir, shelf / name), (made.recording_dir, films / name)):
            new.parent.mkdir(parents=True, exist_ok=True)
            old.rename(new)
        path = shelf / name / "summary.json"
        path.write_text(path.read_text().replace('"name": "recording"', f'"name": "{name}"'))
    assert run(["report", str(tmp_path / "out"), "--recording", str(films)]) == 0
    for name in ("a", "b"):
        assert "data:image/jpeg" in (shelf / name / "report.html").read_text("utf-8")
    assert run(["report", str(tmp_path / "out"), "--recording", str(films / "a.mp4")]) == 2


def test_one_bad_folder_stops_no_other(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    good = write_fake(tmp_path / "good", TURNS).measure_dir
    bad = write_fake(tmp_path / "bad", TURNS).measure_dir
    (bad / "profiles.parquet").write_bytes(b"PAR1")
    out = tmp_path / "over.html"
    assert run(["report", str(bad), str(good), "--out", str(out)]) == 2
    told = capsys.readouterr()
    assert "1 of 2 failed" in told.err
    assert "profiles.parquet" in told.err
    assert (good / "report.html").is_file()
    assert out.is_file()


@pytest.mark.parametrize("text", ["", "[1]", "{", "null", '"x"'])
def test_a_verdict_that_is_none_is_refused(
    text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = write_fake(tmp_path, TURNS)
    verdict = tmp_path / "v.json"
    verdict.write_text(text)
    assert run(["report", str(made.measure_dir), "--verdict", str(verdict)]) == 2
    assert "v.json" in capsys.readouterr().err


def test_a_verdict_beside_the_tables_is_shown(tmp_path: Path) -> None:
    made = write_fake(tmp_path, TURNS)
    verdict = {"status": "no_discrepancy", "causes": [], "evidence": None, "gain": None}
    (made.measure_dir / "verdict.json").write_text(json.dumps(verdict))
    assert run(["report", str(made.measure_dir)]) == 0
    assert "no discrepancy" in (made.measure_dir / "report.html").read_text("utf-8")


def test_what_is_made_from_a_measurement_goes_when_it_is_replaced() -> None:
    from tsvision.report.page import PAGE_NAME
    from tsvision.report.sheet import SHEET_NAME
    from tsvision.report.video import VIDEO_NAME
    from tsvision.report.viewer import VIEWER_NAME
    from tsvision.results.files import OWN_FILES

    assert {PAGE_NAME, SHEET_NAME, VIDEO_NAME, VIEWER_NAME} <= OWN_FILES
