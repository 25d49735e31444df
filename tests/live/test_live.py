"""Live: the decision equals the recording's, in time; folders that grow, commands that run."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterable
from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace
from typing import ClassVar

import cv2
import numpy as np
import pytest

from cli.main import run
from tests.timeline.series import Plan, Series, simulate, with_px, without_scale
from tsvision.errors import InputError
from tsvision.images.frames import iter_frames, open_recording
from tsvision.images.turns import read_turns
from tsvision.live.believing import Live
from tsvision.live.learning import Learner
from tsvision.live.sources import (
    Arrival,
    growing_folder,
    turns_from_file,
    turns_from_name,
    turns_per_frame,
)
from tsvision.live.watching import watch
from tsvision.records import Actuator, Frame, FrameResult, FrameRow, KnotSighting, Rig
from tsvision.rig import load_rig
from tsvision.timeline.account import account

RIG = Rig(actuator=Actuator(twisting_zone_mm=23.2, hole_diameter_mm=0.9))


def results_of(series: Series) -> list[FrameResult]:
    """The simulated tables as the frame results that a measuring core would hand over."""
    known = {f.name for f in fields(FrameRow)}
    knot_fields = [f.name for f in fields(KnotSighting) if f.name in series.knots]
    results = []
    for row in series.frames.to_dict("records"):
        sightings = series.knots[series.knots["frame"] == row["frame"]]
        knots = tuple(KnotSighting(**k) for k in sightings[knot_fields].to_dict("records"))
        kept = {str(k): v for k, v in row.items() if k in known}
        results.append(FrameResult(FrameRow(**kept), None, knots))
    return results


def test_a_source_that_is_missing_is_what_is_wrong(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["watch", str(tmp_path / "gone")]) == 2
    assert "gone: no such folder or file" in capsys.readouterr().err


@pytest.mark.parametrize("step", [0.25, 1.0, 2.5])
def test_the_live_decision_is_the_recordings_within_two_frames(step: float) -> None:
    for seed in range(4):
        series = simulate(Plan(step_turns=step, knot_turns=(40.3 + seed, 48.0), seed=seed))
        live = Live(RIG)
        decided_at = None
        for number, result in enumerate(results_of(series)):
            state = live.push(result)
            if state.onset is not None and decided_at is None:
                decided_at = number
        afterwards = account(series.frames, series.knots, RIG).onsets["knot_onset"]
        assert live.onset is not None and decided_at is not None
        assert abs(live.onset.turns - afterwards.turns) <= 2 * step + 1e-9
        late = series.frames["turns"][decided_at] - afterwards.turns
        assert -1e-9 <= late <= max(4 * step, 2.0)


def test_without_a_scale_the_same_is_believed() -> None:
    plan = Plan(knot_turns=(40.3, 48.0), noise=0.05, false=0.1)
    series = simulate(plan)
    told = []
    for change in (with_px, without_scale):
        frames, knots = (change(t, plan.mm_per_px) for t in (series.frames, series.knots))
        live = Live(Rig())
        results = results_of(replace(series, frames=frames, knots=knots))
        told.append([live.push(result) for result in results])
    for with_mm, in_px in zip(*told, strict=True):
        assert in_px.there == pytest.approx(with_mm.there)
        assert in_px.onset == with_mm.onset
    assert told[0][-1].onset is not None


def test_the_largest_knot_is_told_in_mm_only_with_a_scale() -> None:
    knot = KnotSighting(*[float("nan")] * 3, 100.0, 50.0, max_diameter_px=61.0)
    measured = FrameResult(FrameRow(0, "a.png", turns=1.0), None, (knot,))
    still = SimpleNamespace(measure=lambda frame, turns: measured)
    (row,) = watch([Arrival(Frame(0, "a.png", None), 1.0)], still, Live(RIG))
    assert row["largest_knot_mm"] is None and row["largest_knot_px"] == 61.0


def test_no_decision_without_knots() -> None:
    for seed in range(6):
        live = Live(RIG)
        for result in results_of(simulate(Plan(knot_turns=(), seed=seed))):
            live.push(result)
        assert live.onset is None


def test_believing_costs_a_few_milliseconds_a_frame() -> None:
    live = Live(RIG)
    results = results_of(simulate(Plan(step_turns=0.5, knot_turns=())))
    began = time.process_time()
    for result in results:
        live.push(result)
    assert (time.process_time() - began) / len(results) < 0.015


def write_picture(path: Path, value: int = 90) -> None:
    assert cv2.imwrite(str(path), np.full((12, 16), value, np.uint8))


def test_a_growing_folder_yields_in_order_and_waits_for_half_written_pictures(
    tmp_path: Path,
) -> None:
    write_picture(tmp_path / "f2.png")
    whole = (tmp_path / "f2.png").read_bytes()

    def grow() -> None:
        time.sleep(0.1)
        (tmp_path / "f10.png").write_bytes(whole[: len(whole) // 2])
        time.sleep(0.15)
        (tmp_path / "f10.png").write_bytes(whole)

    writer = threading.Thread(target=grow)
    writer.start()
    came = list(growing_folder(tmp_path, turns_per_frame(0.5), idle_s=0.6))
    writer.join()
    assert [a.frame.file for a in came] == ["f2.png", "f10.png"]
    assert [a.turns for a in came] == [0.0, 0.5]
    assert came[1].frame.pixels is not None


def test_turns_come_from_a_growing_table_or_a_lone_number(tmp_path: Path) -> None:
    table = tmp_path / "turns.csv"
    read = turns_from_file(table)
    assert np.isnan(read(0, "f0.png", 0.0))
    table.write_text("file,turns\nf0.png,1.5\n")
    assert read(0, "f0.png", 0.0) == 1.5
    table.write_text("file,turns\nf0.png,1.5\nf1.png,2.5\n")
    assert read(1, "f1.png", 0.0) == 2.5
    number = tmp_path / "now.txt"
    number.write_text("17.25\n")
    assert turns_from_file(number)(9, "x", 0.0) == 17.25


@pytest.mark.parametrize(
    "table",
    [
        "file;turns\na.png;1.5\nb.png;2\n",
        "frame, turns\n0, 1.5\n1, 2\n",
        "file\tturns\nrun 3/a.png\t1.5\nrun 3\\b.png\t2\n",
        "turns,load_N\n1.5,3\n\n2,3\n",
    ],
)
def test_a_growing_table_reads_as_a_finished_one_does(tmp_path: Path, table: str) -> None:
    path = tmp_path / "turns.csv"
    path.write_text(table)
    read = turns_from_file(path)
    files = ("a.png", "b.png")
    growing = [read(i, name, 0.0) for i, name in enumerate(files)]
    assert growing == read_turns(path, files).turns.tolist() == [1.5, 2.0]


def test_what_no_finished_table_may_hold_is_refused_once_its_line_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "turns.csv"
    read = turns_from_file(path)
    for text, wrong in (
        ("file,turn\na.png,1.5", "no column 'turns'; rename 'turn'"),
        ("file,turns\na.png,one", "is no number"),
        ("file,turns\na.png,1,5", "3 values under 2 columns"),
        ("frame,turns\n0.5,1.5", "no whole number"),
    ):
        path.write_text(text)
        assert np.isnan(read(0, "a.png", 0.0))
        path.write_text(text + "\n")
        with pytest.raises(InputError, match=wrong):
            read(0, "a.png", 0.0)


def test_a_half_written_last_line_is_waited_for(tmp_path: Path) -> None:
    path = tmp_path / "turns.csv"
    read = turns_from_file(path)
    whole = "file,turns\na.png,1.5\ngrün.png,12.5\n".encode()
    for end in range(len(whole) + 1):
        path.write_bytes(whole[:end])
        first, second = read(0, "a.png", 0.0), read(1, "grün.png", 0.0)
        assert first in (1.0, 1.5) or (np.isnan(first) and end < whole.index(b"1.5") + 1)
    assert (first, second) == (1.5, 12.5)
    path.write_text("frame,turns\n1,2.5\n1")  # the beginning of frame 10 or more
    assert read(1, "x", 0.0) == 2.5


def test_turns_in_file_names_are_read_by_the_rules_of_a_finished_recording() -> None:
    read = turns_from_name("t([0-9.a-z]+)_")
    assert read(0, "t12.5_x.png", 0.0) == 12.5
    assert np.isnan(read(0, "x.png", 0.0))
    with pytest.raises(InputError, match="is not a number"):
        read(0, "tx_.png", 0.0)


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


class Pupil:
    """Sees the twist only when it has learnt from a picture with enough turns in it."""

    made = 0

    def __init__(self) -> None:
        Pupil.made += 1
        self.best = 0.0

    def prime(self, pictures: list[np.ndarray], turns: Iterable[float] = ()) -> None:
        self.best = max(float(p.max()) for p in pictures)

    def measure(self, frame: Frame, turns: float) -> FrameResult:
        pitch = 20.0 if self.best >= 2.0 else float("nan")
        return FrameResult(FrameRow(frame.index, frame.file, turns=turns, pitch_px=pitch))


def test_the_view_is_learnt_anew_until_the_twist_is_seen_and_then_stands() -> None:
    Pupil.made = 0
    learner = Learner(Pupil)
    seen = []
    for i in range(12):
        frame = Frame(i, f"f{i}", np.full((4, 4), float(i)))
        seen.append(np.isfinite(learner.measure(frame, float(i)).row.pitch_px))
    assert seen == [False] * 3 + [True] * 9
    assert learner.settled
    assert Pupil.made == 4  # at first, and with 1, 2 and 4 pictures; not again once it is known
    again = learner.review()
    assert [r.row.frame for r in again] == [0, 1, 2, 3, 4, 5, 6]
    assert all(np.isfinite(r.row.pitch_px) for r in again)
    assert learner.review() == []


def test_a_bumped_camera_is_flagged_and_learnt_anew() -> None:
    scene = np.random.default_rng(3).integers(0, 255, (90, 160)).astype(np.uint8)
    scene = cv2.resize(cv2.GaussianBlur(scene, (0, 0), 2.0), (640, 360))
    learner = Learner(Pupil)
    flags = []
    for i in range(14):
        shown = scene if i < 9 else np.roll(scene, (6, 9), axis=(0, 1))
        shown = np.maximum(shown, np.uint8(i))
        flags.append(learner.measure(Frame(i, f"f{i}", shown), float(i)).row.flags)
    assert flags == ["CAMERA_MOVED" if i == 9 else "" for i in range(14)]
    assert next(r.row.frame for r in learner.review()) == 9


def test_revised_frames_take_the_place_of_what_was_believed() -> None:
    series = simulate(Plan(knot_turns=(20.0,), last_turns=30.0, nan=0.0, false=0.0))
    wrong = results_of(simulate(Plan(knot_turns=(3.0,), last_turns=30.0, nan=0.0, false=0.0)))
    right = results_of(series)
    live = Live(RIG)
    for result in wrong[:12]:
        assert live.push(result, may_decide=False).onset is None
    live.restart(right[2:12:2])
    assert [r.row.frame for r in live.results] == list(range(12))
    assert np.isnan(live.results[3].row.knot_count) and live.results[1].row == wrong[1].row
    for result in right[12:]:
        live.push(result)
    assert live.onset is not None and live.onset.turns == pytest.approx(20.0, abs=2.0)
