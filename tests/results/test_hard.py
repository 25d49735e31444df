"""Full disks, interrupts and strange places: nothing half-written, one clear line, no traceback."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tsvision.records import Recording

ROOT = str(Path(__file__).parents[2])
BATCH_TESTS = str(Path(__file__).parents[1] / "batch")
# stands in for the measuring of frames, so that no test waits for it
MEASURE = """
import signal, sys, tsvision.run, tsvision.batch, functools, stand_in
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it
tsvision.run.measuring = lambda: stand_in.{measure}
tsvision.batch.run_batch = functools.partial(
    tsvision.batch.run_batch, measure="stand_in:{measure}")
"""
CALL = """
import cli.main
if __name__ == "__main__":
    raise SystemExit(cli.main.run(sys.argv[1:]))
"""


def start(
    tmp_path: Path, arguments: list[str], measure: str = "measure", before: str = ""
) -> subprocess.Popen[str]:
    script = tmp_path / "start.py"
    script.write_text(MEASURE.format(measure=measure) + before + CALL)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([BATCH_TESTS, ROOT])}
    return subprocess.Popen(
        [sys.executable, str(script), *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
        cwd=tmp_path,
    )


def interrupt_when(process: subprocess.Popen[str], ready: Callable[[], bool]) -> None:
    """Ctrl-C once `ready`; the process is ended in any case."""
    end_s = time.monotonic() + 60
    while not ready():
        if time.monotonic() > end_s or process.poll() is not None:
            process.kill()
            out, err = process.communicate()
            pytest.fail(f"never came so far: {out} {err}")
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)


def left_behind(folder: Path, known: set[str]) -> set[str]:
    return {p.name for p in folder.iterdir()} - known - {"start.py"}


@pytest.mark.slow
@pytest.mark.parametrize("limit_bytes", [300, 6_000])
def test_no_room_to_write(film: Path, tmp_path: Path, limit_bytes: int) -> None:
    """No file may grow beyond a limit, which for a program is a disk that gets full."""
    limit = (
        "import resource, signal\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        f"resource.setrlimit(resource.RLIMIT_FSIZE, ({limit_bytes}, {limit_bytes}))\n"
    )
    process = start(tmp_path, ["measure", str(film), "--out", "out"], before=limit)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 2
    assert out == ""
    assert "cannot be written" in err and "Traceback" not in err
    assert left_behind(tmp_path, {"film"}) == set()


@pytest.mark.slow
def test_a_full_disk_in_a_batch_is_told_and_mended_by_a_second_run(
    film: Path, tmp_path: Path
) -> None:
    film.rename(tmp_path / "shelf_film")
    (tmp_path / "shelf").mkdir()
    (tmp_path / "shelf_film").rename(tmp_path / "shelf" / "film")
    limit = (
        "import resource, signal\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (3000, 3000))\n"
    )
    command = ["batch", "shelf", "--out", "out", "--engine", "here", "-q"]
    process = start(tmp_path, command, before=limit)
    _, err = process.communicate(timeout=60)
    assert process.returncode in (1, 2)
    assert "Traceback" not in err
    assert not list((tmp_path / "out").glob("recordings/*/summary.json"))
    process = start(tmp_path, command)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    assert "1 recordings: 1 measured" in out


@pytest.mark.slow
def test_interrupt_leaves_nothing_half_written(film: Path, tmp_path: Path) -> None:
    process = start(tmp_path, ["measure", str(film), "--out", "out"], "measure_forever")
    interrupt_when(process, lambda: bool(list(tmp_path.glob(".out.part-*/profiles.parquet"))))
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "stopped" in err and "Traceback" not in err
    assert out == ""
    assert left_behind(tmp_path, {"film"}) == set()


@pytest.mark.slow
def test_interrupted_batch_keeps_what_is_finished(film: Path, tmp_path: Path) -> None:
    for name in ("a", "b"):
        place = tmp_path / "shelf" / name
        place.mkdir(parents=True)
        for picture in film.glob("*.png"):
            os.link(picture, place / picture.name)
    command = ["batch", "shelf", "--out", "out", "--workers", "2", "-q"]
    process = start(tmp_path, command, "measure_b_forever")
    interrupt_when(process, lambda: (tmp_path / "out/recordings/a/summary.json").exists())
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "finished work was kept" in err and "Traceback" not in err
    process = start(tmp_path, command)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    assert "1 measured, 1 already done" in out


def test_killed_remains_are_cleared_by_the_next_run(film: Path, tmp_path: Path, measure) -> None:
    from tsvision.run import measure_to_folder

    dead = tmp_path / ".out.part-dead"
    dead.mkdir()
    (dead / "profiles.parquet").write_bytes(b"half")
    measure_to_folder(film, tmp_path / "out", measure=measure)
    assert left_behind(tmp_path, {"film"}) == {"out"}


def test_a_kill_between_two_renames_loses_nothing(film: Path, tmp_path: Path, measure) -> None:
    from tsvision.run import measure_to_folder

    out = measure_to_folder(film, tmp_path / "out", measure=measure)
    (out / "notes.txt").write_text("mine")
    aside = tmp_path / ".out.part-aside"
    aside.mkdir()
    out.rename(aside / "old")  # what a kill at that moment leaves
    measure_to_folder(film, tmp_path / "out", overwrite=True, measure=measure)
    assert (tmp_path / "out" / "notes.txt").read_text() == "mine"
    assert left_behind(tmp_path, {"film"}) == {"out"}


def test_a_kill_after_both_renames_loses_nothing(film: Path, tmp_path: Path, measure) -> None:
    from tsvision.run import measure_to_folder

    out = measure_to_folder(film, tmp_path / "out", measure=measure)
    old = tmp_path / ".out.part-aside" / "old"
    old.mkdir(parents=True)
    for name in ("summary.json", "frames.csv", "notes.txt"):
        (old / name).write_text("old")  # what a kill at that moment leaves
    measure_to_folder(film, out, overwrite=True, measure=measure)
    assert (out / "notes.txt").read_text() == "old"
    assert (out / "summary.json").read_text() != "old"
    assert left_behind(tmp_path, {"film"}) == {"out"}


def test_two_runs_at_once_do_not_touch_each_other(film: Path, tmp_path: Path, measure) -> None:
    from tsvision.results.files import MEASUREMENT
    from tsvision.run import measure_to_folder
    from tsvision.staging import staged

    with staged(tmp_path / "out", MEASUREMENT) as other:
        (other / "half.txt").write_text("")
        measure_to_folder(film, tmp_path / "out", measure=measure)
        assert (other / "half.txt").exists()


@pytest.fixture
def drawn(measure, monkeypatch: pytest.MonkeyPatch) -> list[Recording]:
    """The recordings on whose pictures films are drawn, by the command line."""
    recordings: list[Recording] = []
    monkeypatch.setattr("tsvision.run.measuring", lambda: measure)
    monkeypatch.setattr(
        "tsvision.report.video.write_overlay_video", lambda out, rec: recordings.append(rec)
    )
    return recordings


def test_the_overlay_is_drawn_on_the_pictures_that_were_measured(
    film: Path, tmp_path: Path, drawn: list[Recording]
) -> None:
    """Under the rig of the command line: with a lens, axis and edges lie on undistorted ones."""
    from cli.main import run

    lens = "--lens=70,70,32,18,-0.6,0,0,0,0"
    assert run(["measure", str(film), "--out", str(tmp_path / "out"), "--video", lens, "-q"]) == 0
    assert drawn[0].rig.camera.lens == (70, 70, 32, 18, -0.6, 0, 0, 0, 0)


def test_the_overlay_is_drawn_with_the_turns_of_the_command_line(
    film: Path, tmp_path: Path, drawn: list[Recording]
) -> None:
    """The table beside the frames, left out in measuring, was read for the film and refused."""
    from cli.main import run

    (film / "turns.csv").write_text("frame,turns\n0,0\n99,1\n")
    line = ["measure", str(film), "--out", str(tmp_path / "out"), "--turns-per-frame", "2", "-q"]
    assert run([*line, "--video"]) == 0
    assert drawn[0].turns[:3].tolist() == [0.0, 2.0, 4.0]


def test_the_command_tells_people_and_programs(
    film: Path, tmp_path: Path, measure, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    import json

    from cli.main import run

    monkeypatch.setattr("tsvision.run.measuring", lambda: measure)
    monkeypatch.chdir(tmp_path)
    assert run(["measure", str(film)]) == 0
    told = capsys.readouterr().out
    assert "film: 12 frames, 12 measured" in told
    assert "0.11" in told and "written to film-measured" in told
    assert run(["measure", str(film), "--json", "--out", "b", "--frames", "2:4"]) == 0
    assert json.loads(capsys.readouterr().out)["frames_total"] == 2
    pictures = sorted(str(p) for p in film.glob("*.png"))
    assert run(["measure", *pictures, "--out", "c", "--turns-from-name", r"f(\d+)"]) == 0
    assert "film: 12 frames" in capsys.readouterr().out
    (tmp_path / "loop").symlink_to("loop")
    for bad in (
        ["measure", str(film)],  # exists
        ["measure", "loop"],
        ["measure", "gone", "--out", "d"],
        ["measure", str(film), "--out", "d", "--frames", "x"],
        ["measure", str(film), "--out", "d", "--mm-per-px", "0"],
        ["measure", str(film), "--out", "d", "--count", "0"],
        ["measure", str(film), "--out", "d", "--turns-file", "gone.csv"],
        ["measure", str(film), "--out", "d", "--rig", "gone.toml"],
        ["measure", str(film), "--out", "d", "--turns-per-frame", "nan"],
    ):
        assert run(bad) == 2, bad
        shown = capsys.readouterr()
        assert shown.out == "" and shown.err.count("\n") == 1, shown.err
    assert not (tmp_path / "d").exists()
