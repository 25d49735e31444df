"""`tsvision watch`: the rows, the command that runs, the exit codes; frames as a recording's."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from types import SimpleNamespace
from typing import ClassVar

import cv2
import numpy as np
import pytest

from cli.main import run
from tests.live.made import RIG, results_of, write_picture
from tests.timeline.series import Plan, simulate
from tsvision.images.frames import iter_frames, open_recording
from tsvision.live.believing import Live
from tsvision.live.sources import Arrival
from tsvision.live.watching import watch
from tsvision.records import Frame, FrameResult, FrameRow, KnotSighting, Rig
from tsvision.rig import load_rig


def test_the_largest_knot_is_told_in_mm_only_with_a_scale() -> None:
    knot = KnotSighting(*[float("nan")] * 3, 100.0, 50.0, max_diameter_px=61.0)
    measured = FrameResult(FrameRow(0, "a.png", turns=1.0), None, (knot,))
    still = SimpleNamespace(measure=lambda frame, turns: measured)
    (row,) = watch([Arrival(Frame(0, "a.png", None), 1.0)], still, Live(RIG))
    assert row["largest_knot_mm"] is None and row["largest_knot_px"] == 61.0


def test_a_source_that_is_missing_is_what_is_wrong(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["watch", str(tmp_path / "gone")]) == 2
    assert "gone: no such folder or file" in capsys.readouterr().err


class Replay:
    """Stands in for the measuring core: hands over simulated results, frame by frame."""

    series = simulate(Plan(knot_turns=(20.0,), last_turns=40.0, nan=0.0, false=0.0))

    def __init__(self, rig: Rig) -> None:
        self.results = results_of(self.series)

    def prime(self, pictures: list[np.ndarray], turns: Iterable[float] = ()) -> None:
        assert pictures

    def measure(self, frame: Frame, turns: float) -> FrameResult:
        assert turns == self.results[frame.index].row.turns
        return self.results[frame.index]


def test_the_command_stops_runs_what_it_was_told_and_exits_with_0(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("tsvision.measures.recording.Measurer", Replay)
    for number in range(41):
        write_picture(tmp_path / f"f{number}.png")
    done = tmp_path / "done.txt"
    words = ["watch", str(tmp_path), "--turns-per-frame", "1", "--stop-on", "knot"]
    code = run([*words, "--idle", "0.2", "--exec", f'echo "$TSVISION_ONSET_TURNS" > {done}'])
    said = capsys.readouterr()
    rows = [json.loads(line) for line in said.out.splitlines()]
    assert code == 0
    assert rows[-1]["decided"] and not any(row["decided"] for row in rows[:-1])
    assert float(done.read_text()) == rows[-1]["onset"]["turns"] == pytest.approx(20, abs=2)
    assert len(rows) < 27
    assert said.err.startswith("knot onset: ")


def test_the_command_ends_with_3_when_no_knot_came(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("tsvision.measures.recording.Measurer", Replay)
    for number in range(15):
        write_picture(tmp_path / f"f{number}.png")
    assert run(["watch", str(tmp_path), "--turns-per-frame", "1", "--idle", "0.2"]) == 3
    assert len(capsys.readouterr().out.splitlines()) == 15


def test_a_stream_that_does_not_answer_and_unknown_turns_are_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["watch", "0"]) == 2
    assert "turns are not known" in capsys.readouterr().err
    assert run(["watch", str(tmp_path), "--exec", "true"]) == 2
    assert "--stop-on" in capsys.readouterr().err


class Witness:
    """Stands in for the measuring core: keeps what it is given and measures nothing."""

    rigs: ClassVar[list[Rig]] = []
    seen: ClassVar[list[np.ndarray]] = []

    def __init__(self, rig: Rig) -> None:
        self.rigs.append(rig)

    def prime(self, pictures: list[np.ndarray], turns: Iterable[float] = ()) -> None:
        pass

    def measure(self, frame: Frame, turns: float) -> FrameResult:
        assert frame.pixels is not None
        self.seen.append(frame.pixels)
        return FrameResult(FrameRow(frame.index, frame.file, turns=turns))


def test_live_frames_come_undistorted_as_a_recordings_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tsvision.measures.recording.Measurer", Witness)
    Witness.seen.clear()
    random = np.random.default_rng(2)
    for number in range(3):
        picture = cv2.resize(random.integers(0, 255, (6, 8)).astype(np.uint8), (160, 120))
        assert cv2.imwrite(str(tmp_path / f"f{number}.png"), picture)
    (tmp_path / "rig.toml").write_text(
        "[camera]\nlens = [150.0, 150.0, 80.0, 60.0, -0.3, 0.0, 0.0, 0.0, 0.0]\n"
    )
    run(["watch", str(tmp_path), "--turns-per-frame", "1", "--idle", "0.1"])
    rig = load_rig(tmp_path / "rig.toml")
    wanted = [frame.pixels for frame in iter_frames(open_recording(tmp_path, rig))]
    assert len(Witness.seen) == 3
    for live, recorded in zip(Witness.seen, wanted, strict=True):
        np.testing.assert_array_equal(live, recorded)


def test_a_scale_found_in_the_recording_of_the_same_view_holds_live(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tsvision.measures.recording.Measurer", Witness)
    Witness.rigs.clear()
    like, now = tmp_path / "like", tmp_path / "now"
    like.mkdir()
    now.mkdir()
    write_picture(now / "f0.png")
    across_px = np.arange(400.0) % 20.0  # a ruler with a tick every 20 px
    ruler = np.where(np.abs(across_px - 10.0) < 2.0, 30, 220).astype(np.uint8)
    assert cv2.imwrite(str(like / "f0.png"), np.tile(ruler, (60, 1)))
    (now / "rig.toml").write_text(
        '[camera]\nscale_from = "ruler"\nlength_mm = 1.0\npoints_px = [[10, 30], [390, 30]]\n'
    )
    words = ["watch", str(now), "--turns-per-frame", "1", "--idle", "0.1", "--like", str(like)]
    run(words)
    assert Witness.rigs[-1].camera.mm_per_px == pytest.approx(1.0 / 20.0, rel=1e-3)
