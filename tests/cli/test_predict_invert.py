"""predict and invert undo each other, and say what they lack."""

from __future__ import annotations

import csv
import io
import json

import pytest

from cli.main import run


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def test_predict_the_papers_pair(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["predict", "--paper", "2", "--turns", "0:40:20"]) == 0
    found = rows(capsys.readouterr().out)
    assert [float(r["turns"]) for r in found] == [0, 20, 40]
    assert float(found[1]["displacement_mm"]) == pytest.approx(16.3503, abs=1e-4)


def test_invert_undoes_predict(capsys: pytest.CaptureFixture[str]) -> None:
    given = ["--zone", "30", "--hole-distance", "4", "-N", "4", "--string-diameter", "0.3"]
    assert run(["predict", *given, "--turns", "17", "--json"]) == 0
    x = json.loads(capsys.readouterr().out)["rows"][0]["displacement_mm"]
    assert run(["invert", *given, "--displacement", repr(x), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["rows"][0]["turns"] == pytest.approx(17)


def test_other_strings_drop_the_papers_caliper_diameter(capsys: pytest.CaptureFixture[str]) -> None:
    run(["predict", "--paper", "2", "--string-diameter", "0.5", "--turns", "1", "--json"])
    geometry = json.loads(capsys.readouterr().out)["geometry"]
    assert geometry["bundle_diameter_mm"] == pytest.approx(1.0)


@pytest.mark.parametrize(
    "arguments",
    [
        ["predict", "--turns", "3"],
        ["predict", "--paper", "2", "--turns", "x"],
        ["predict", "--paper", "3", "--turns", "1"],
        ["predict", "--paper", "2", "--turns", "1", "--zone", "-1"],
        ["predict", "--paper", "2", "--turns", "1", "--zone", "nan"],
        ["predict", "--paper", "2", "--turns", "1", "--model", "magic"],
        ["predict", "--zone", "20", "-N", "0", "--string-diameter", "1", "--turns", "1"],
        ["invert", "--displacement", "3"],
    ],
)
def test_bad_input_is_one_line_and_exit_2(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1


@pytest.mark.parametrize(
    "arguments",
    [
        ["predict", "--paper", "2", "--turns", "0:1e9:1e-3"],
        ["predict", "--paper", "4", "--turns", "5", "--model", "helix_then_coil"],
        ["invert", "--paper", "4", "--displacement", "5", "--model", "helix_then_coil"],
        ["predict", "--paper", "2", "--turns", "5", "--load", "3", "--friction", "-1"],
        ["predict", "--paper", "2", "--turns", "5", "--model", "locked_pitch"],
    ],
)
def test_senseless_requests_are_one_line(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(arguments) == 2
    assert capsys.readouterr().err.count("\n") == 1


def refuse(constant: str) -> None:
    raise AssertionError(f"{constant} is not JSON")


def test_what_has_no_finite_value_is_null_in_json(capsys: pytest.CaptureFixture[str]) -> None:
    # At rest and without S the string gives no stroke for an angle: its ratio is infinite.
    given = ["--zone", "30", "--hole-distance", "0", "-N", "2", "--string-diameter", "0.3"]
    assert run(["predict", *given, "--load", "10", "--turns", "0", "--json"]) == 0
    row = json.loads(capsys.readouterr().out, parse_constant=refuse)["rows"][0]
    assert row["transmission_rad_per_mm"] is None
    assert run(["invert", *given, "--displacement=-1", "--json"]) == 0
    row = json.loads(capsys.readouterr().out, parse_constant=refuse)["rows"][0]
    assert row == {"displacement_mm": -1.0, "turns": None}
