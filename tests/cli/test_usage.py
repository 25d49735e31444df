"""Bad usage of any verb is one line on stderr and exit code 2; help is none of it."""

from __future__ import annotations

import pytest

from cli.main import VERBS, run


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


def test_an_exit_code_of_a_verb_comes_through(monkeypatch: pytest.MonkeyPatch) -> None:
    from tsvision.validation import cells

    monkeypatch.setattr(cells, "FAILURES", ("input",))
    assert run(["validate", "--table", "dimensions", "--json"]) == 1
