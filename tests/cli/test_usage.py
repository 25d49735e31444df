"""Bad usage of any verb is one line on stderr and exit code 2; help is none of it."""

from __future__ import annotations

import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from cli.main import BROKEN, TRACEBACK, VERBS, app, run


@pytest.mark.parametrize("verb", VERBS)
def test_an_unknown_option_is_one_line(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([verb, "--no-such-option"]) == 2
    captured = capsys.readouterr()
    assert captured.out == "" and captured.err.count("\n") == 1
    assert captured.err.startswith(f"tsvision {verb}: ") and "--help" in captured.err


@pytest.mark.parametrize("verb", VERBS)
def test_help_goes_to_stdout(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([verb, "--help"]) == 0
    captured = capsys.readouterr()
    assert "Usage: tsvision " + verb in captured.out and captured.err == ""


@pytest.mark.parametrize("arguments", [["predict"], ["predict", "--turns"], ["rig"]])
def test_what_is_missing_is_one_line(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(arguments) == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize("verb", ["compare", "life", "validate --measured", "riglog"])
def test_a_file_that_is_missing_is_told_in_words(
    verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run([*verb.split(), str(tmp_path / "gone.csv")]) == 2
    told = capsys.readouterr().err
    assert "gone.csv" in told and "no such file" in told and "Errno" not in told


@pytest.mark.parametrize("value", ["-1", "nan", "inf"])
@pytest.mark.parametrize("option", ["--length-mm-sd", "--point-sd-px", "--nearer-mm-sd"])
def test_an_uncertainty_is_a_finite_number_of_zero_or_more(
    option: str, value: str, capsys: pytest.CaptureFixture[str]
) -> None:
    line = ["calibrate", "points", "--points", "0,0 9,0", "--length-mm", "3", "--distance-mm", "99"]
    assert run([*line, option, value]) == 2
    told = capsys.readouterr()
    assert f"{option} {value}: must be a finite number of 0 or more" in told.err
    assert told.out == ""


@pytest.mark.parametrize("option", ["--length-mm", "--nearer-mm"])
@pytest.mark.parametrize("value", ["nan", "inf"])
def test_a_length_is_finite(option: str, value: str, capsys: pytest.CaptureFixture[str]) -> None:
    line = ["calibrate", "points", "--points", "0,0 9,0", "--length-mm", "3", "--distance-mm", "99"]
    assert run([*line, option, value]) == 2
    assert f"{option} {value}: must be a finite number" in capsys.readouterr().err


@pytest.mark.parametrize("value", ["0", "-1", "nan", "inf"])
@pytest.mark.parametrize("option", ["--distance-mm", "--gamma"])
def test_what_is_0_or_not_finite_is_no_distance_and_no_gamma(
    option: str, value: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "pin.png"
    cv2.imwrite(str(picture), np.zeros((40, 40), np.uint8))
    assert run(["calibrate", "gauge", str(picture), "--diameter-mm", "3", option, value]) == 2
    told = capsys.readouterr().err
    assert f"{option} {value}: must be a finite number greater than 0" in told


@pytest.mark.parametrize("option", ["--axial-stiffness", "--motor-rpm", "--motor-torque"])
def test_no_stiffness_or_motor_below_zero(option: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["predict", "--paper", "2", "--turns", "10", "--load", "9", option, "-1"]) == 2
    assert f"{option} -1: must be" in capsys.readouterr().err


def test_an_exit_code_of_a_verb_comes_through(monkeypatch: pytest.MonkeyPatch) -> None:
    from tsvision.validation import cells

    monkeypatch.setattr(cells, "FAILURES", ("input",))
    assert run(["validate", "--table", "dimensions", "--json"]) == 1


def end_of(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], fault: Exception
) -> tuple[object, str]:
    """How the program ends, and what it says, when a verb raises."""

    def verb(arguments: list[str]) -> int:
        raise fault

    monkeypatch.setattr("cli.main.run", verb)
    monkeypatch.setattr("sys.argv", ["tsvision", "measure"])
    with pytest.raises(SystemExit) as stop:
        app()
    return stop.value.code, capsys.readouterr().err


def test_a_fault_of_the_program_is_one_line_that_says_where(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv(TRACEBACK, raising=False)
    code, said = end_of(monkeypatch, capsys, ValueError("not finite\nin two lines"))
    assert code == BROKEN and said.count("\n") == 1
    assert "ValueError: not finite in two lines" in said and "test_usage.py, line" in said
    code, said = end_of(monkeypatch, capsys, PermissionError(13, "Permission denied", "a/b"))
    assert code == 2 and said.startswith("tsvision measure: a/b: Permission denied")
    monkeypatch.setenv(TRACEBACK, "1")
    with pytest.raises(ValueError, match="seen"):
        end_of(monkeypatch, capsys, ValueError("seen"))


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash on this machine")
def test_a_reader_that_leaves_early_meets_silence() -> None:
    tool = f"{shlex.quote(sys.executable)} -m cli.main predict --paper 2 --turns 0:9000:0.1"
    done = subprocess.run(
        ["bash", "-c", f"{tool} | head -1"],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
    )
    assert done.stdout.startswith("turns,displacement_mm") and done.stderr == ""
