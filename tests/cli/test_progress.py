"""Progress tells the rate of what is still to come."""

from __future__ import annotations

import pytest

from cli import progress


def test_the_first_frame_s_preparations_are_left_out_of_the_rate(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    clock_s = [0.0]
    monkeypatch.setattr("time.monotonic", lambda: clock_s[0])
    with progress.frame_progress("film") as tell:
        for done, at_s in ((1, 20.0), (2, 22.0), (11, 40.0)):
            clock_s[0] = at_s
            tell(done, 71)
    told = capsys.readouterr().err.splitlines()
    assert told == ["film: 1/71 frames", "film: 11/71 frames, 0.5/s, 120 s left"]


def test_quiet_is_quiet(capsys: pytest.CaptureFixture[str]) -> None:
    with progress.frame_progress("film", quiet=True) as tell:
        tell(1, 2)
    assert capsys.readouterr().err == ""
