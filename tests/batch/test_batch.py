"""A batch loses nothing, repeats nothing finished, and ends with the same bytes whatever befell."""

from __future__ import annotations

import json
import multiprocessing
import os
import random
import signal
import subprocess
import sys
import time
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import av
import cv2
import duckdb
import numpy as np
import pandas as pd
import polars
import pyarrow.parquet as pq
import pytest

from cli.batch import write_verdict
from tests.batch.compare import PROGRAM, assert_same_bytes, bytes_below, skip_if_edited
from tsvision.batch import BatchReport, run_batch
from tsvision.batch.plan import plan
from tsvision.errors import InputError
from tsvision.records import Rig
from tsvision.results import read_measurement
from tsvision.results.overview import read_verdict
from tsvision.results.summary import code_digest
from tsvision.results.table import query_results
from tsvision.run import Request, measure_to_folder

HERE = str(Path(__file__).parent)
ROOT = str(Path(__file__).parents[2])
LONG_FRAMES = 2300  # three segments


@pytest.fixture(autouse=True)
def workers_find_the_stand_in(monkeypatch: pytest.MonkeyPatch) -> None:
    """Workers inherit sys.path and the environment."""
    monkeypatch.setattr(sys, "path", [HERE, *sys.path])
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([HERE, ROOT]))


def write_folder(folder: Path, count: int, level: int) -> None:
    folder.mkdir(parents=True)
    for i in range(count):
        assert cv2.imwrite(str(folder / f"f{i}.png"), np.full((8, 16), level + i, np.uint8))
    rows = "".join(f"{i},{i}\n" for i in range(count))
    (folder / "turns.csv").write_text("frame,turns\n" + rows)


def write_long_video(path: Path) -> None:
    with av.open(str(path), "w") as container:
        stream: Any = container.add_stream("libx264", rate=100, options={"g": "50"})
        stream.width, stream.height, stream.pix_fmt = 32, 16, "yuv420p"
        stream.time_base = Fraction(1, 100)
        for i in range(LONG_FRAMES):
            grey = np.full((16, 32), 40 + i % 150, np.uint8)
            frame = av.VideoFrame.from_ndarray(grey, format="gray").reformat(format="yuv420p")
            frame.pts = i
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


@pytest.fixture
def shelf(tmp_path: Path) -> Path:
    """Three folders of frames."""
    place = tmp_path / "shelf"
    for i in range(3):
        write_folder(place / f"film{i}", 12, 50 + 20 * i)
    (place / "film0" / "rig.toml").write_text("[strings]\ncount = 2\n[actuator]\nload_N = 19.61\n")
    return place


@pytest.fixture
def long_shelf(shelf: Path) -> Path:
    """The three folders and a long video."""
    write_long_video(shelf / "long.mp4")
    return shelf


def batch(shelf: Path, out: Path, measure: str = "measure", **options: Any) -> BatchReport:
    options = {"engine": "here", **options}
    items = plan(str(shelf), Request(""))
    report = run_batch(items, out, measure=f"stand_in:{measure}", **options)
    if code_digest() == PROGRAM:
        skip_if_edited(report.failed)
    return report


def events(out: Path) -> list[dict]:
    return [json.loads(line) for line in (out / "log" / "run.jsonl").read_text().splitlines()]


# ------------------------------------------------------------------ what it leaves


def test_each_recording_is_as_if_measured_alone_and_unsplit(
    long_shelf: Path, tmp_path: Path
) -> None:
    import stand_in

    report = batch(long_shelf, tmp_path / "out", chunk_frames=1)  # the video in three chunks
    assert report.done == ("film0", "film1", "film2", "long")
    assert report.failed == {}
    for name in ("film1", "long.mp4"):
        alone = measure_to_folder(
            long_shelf / name, tmp_path / "alone" / name, measure=stand_in.measure
        )
        in_batch = tmp_path / "out" / "recordings" / name.removesuffix(".mp4")
        assert_same_bytes(alone, in_batch)
    frames = read_measurement(tmp_path / "out" / "recordings" / "long").frames
    assert frames["frame"].tolist() == list(range(LONG_FRAMES))


def test_data_set_is_read_alike(shelf: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    batch(shelf, out)
    by_pandas = pd.read_parquet(out / "dataset" / "frames")
    pattern = f"{out}/dataset/frames/*/*.parquet"
    with duckdb.connect() as connection:
        sql = f"from read_parquet('{pattern}', hive_partitioning=true)"
        by_duckdb = connection.execute(sql).df()
    parts = polars.read_parquet(f"{out}/dataset/frames/**/*.parquet", hive_partitioning=True)
    by_polars = pd.DataFrame(parts.select("recording", "diameter_px").to_dict(as_series=False))
    assert len(by_pandas) == len(by_duckdb) == len(by_polars) == 36
    for table in (by_pandas, by_duckdb, by_polars):
        means = table.groupby(table["recording"].astype(str))["diameter_px"].mean()
        assert means.to_dict() == {"film0": 55.5, "film1": 75.5, "film2": 95.5}
    overview = pq.read_table(out / "dataset" / "recordings.parquet")
    assert overview.schema.field("diameter_mm").metadata[b"unit"] == b"mm"
    assert overview.schema.field("knot_turns").metadata[b"unit"] == b"turn"
    assert overview.column("load_N").to_pylist() == [19.61, None, None]


def test_query_over_recordings(shelf: Path, tmp_path: Path) -> None:
    out = tmp_path / "o'ut [1]"
    batch(shelf, out)
    verdict = {
        "status": "explained",
        "causes": [{"name": "coiling"}, {"name": "lost_turns"}],
        "base": {"model": "constant_radius", "rmse_mm": 4.5},
        "extended": {"rmse_mm": 0.5},
    }
    (out / "recordings" / "film1" / "verdict.json").write_text(json.dumps(verdict))
    sql = (
        "select verdict, causes, rmse_base_mm, rmse_extended_mm from recordings order by recording"
    )
    told = query_results(out, sql).to_pylist()
    assert list(told[1].values()) == ["explained", "coiling|lost_turns", 4.5, 0.5]
    assert set(told[0].values()) == {None}
    table = query_results(out, "select recording, strings, diameter_mm from recordings order by 1")
    assert table.to_pylist()[0] == {"recording": "film0", "strings": 2, "diameter_mm": 55.5}
    counts = query_results(out, "select recording, count(*) n from frames group by 1 order by 1")
    assert counts.column("n").to_pylist() == [12, 12, 12]
    knots = query_results(out, "select count(*) n from profiles")
    assert knots.column("n").to_pylist() == [3 * 12 * 16]
    with pytest.raises(InputError, match="results"):
        query_results(out, "select nonsense")
    with pytest.raises(InputError, match="no measured recordings"):
        query_results(shelf, "select 1")


def test_what_finishes_a_recording_enters_the_data_set(shelf: Path, tmp_path: Path) -> None:
    def finish(folder: Path) -> None:
        if folder.name == "film1":
            raise InputError("no displacement")
        if folder.name == "film2":
            raise ZeroDivisionError("a fault\nin two lines")
        (folder / "verdict.json").write_text('{"status": "no_discrepancy", "causes": []}')

    report = batch(shelf, tmp_path / "out", finish=finish)
    assert report.notes == (
        "film1: no displacement",
        "film2: ZeroDivisionError: a fault in two lines",
    )
    overview = pq.read_table(tmp_path / "out" / "dataset" / "recordings.parquet")
    assert overview.column("verdict").to_pylist() == ["no_discrepancy", None, None]
    assert overview.column("causes").to_pylist() == ["", None, None]


def test_a_verdict_is_kept_while_data_and_program_are_the_same(
    shelf: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    batch(shelf, out)
    folder = out / "recordings" / "film0"
    asked: list[Path] = []

    def diagnosed(paths: list[Path], rig: Rig) -> Any:
        asked.extend(paths)
        return SimpleNamespace(to_json=lambda: {"status": "no_discrepancy", "causes": []})

    monkeypatch.setattr("tsvision.diagnosis.sources.diagnose_sources", diagnosed)
    (folder / "verdict.json").write_text('{"status": "explained"}')  # nobody knows by what
    write_verdict(folder)
    assert len(asked) == 1 and read_verdict(folder)["status"] == "no_discrepancy"
    write_verdict(folder)
    assert len(asked) == 1
    changed = json.loads((folder / "summary.json").read_text()) | {"key": "other pictures"}
    (folder / "summary.json").write_text(json.dumps(changed))
    write_verdict(folder)
    assert len(asked) == 2
    monkeypatch.setattr("tsvision.results.summary.digest_of_sources", lambda *_: "other program")
    write_verdict(folder)
    assert len(asked) == 3
    (folder / "verdict.json").write_text("{")
    write_verdict(folder)
    assert len(asked) == 4 and read_verdict(folder)["status"] == "no_discrepancy"


# ------------------------------------------------------------------ bad recordings


def test_bad_recordings_stop_no_other(shelf: Path, tmp_path: Path) -> None:
    (shelf / "film1" / "turns.csv").write_text("frame,turns\n99,1\n")
    (shelf / "film2" / "f3.png").write_bytes(b"")
    (shelf / "broken.mp4").write_bytes(b"no video")
    report = batch(shelf, tmp_path / "out")
    assert report.done == ("film0", "film2")
    assert set(report.failed) == {"film1", "broken"}
    assert "frame 99" in report.failed["film1"]
    frames = read_measurement(tmp_path / "out" / "recordings" / "film2").frames
    assert len(frames) == 12 and frames["flags"].iloc[3] == "UNREADABLE"
    status = json.loads((tmp_path / "out" / "batch.json").read_text())["recordings"]
    assert [s["status"] for s in status] == ["failed", "measured", "failed", "measured"]
    assert len(pd.read_parquet(tmp_path / "out" / "dataset" / "frames")) == 24


def test_a_bug_in_one_recording_is_told_in_one_line(shelf: Path, tmp_path: Path) -> None:
    report = batch(shelf, tmp_path / "out", "measure_with_a_bug")
    assert report.failed == {"film1": "ZeroDivisionError: a bug in two lines"}
    assert report.done == ("film0", "film2")


def test_done_is_kept_and_what_changed_is_measured_again(shelf: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    batch(shelf, out)
    stamps = {p: p.stat().st_mtime_ns for p in (out / "recordings").rglob("*") if p.is_file()}
    os.utime(shelf / "film0" / "f0.png", (0, 0))  # the clock says nothing, the content all
    assert batch(shelf, out).kept == ("film0", "film1", "film2")
    assert {p: p.stat().st_mtime_ns for p in stamps} == stamps
    assert cv2.imwrite(str(shelf / "film1" / "f5.png"), np.full((8, 16), 200, np.uint8))
    (shelf / "film2" / "rig.toml").write_text("[strings]\ncount = 4\n")
    again = batch(shelf, out)
    assert (again.done, again.kept) == (("film1", "film2"), ("film0",))
    assert read_measurement(out / "recordings" / "film1").frames["diameter_px"].iloc[5] == 200
    (shelf / "film0" / "turns.csv").unlink()
    assert batch(shelf, out).done == ("film0",)


def test_an_updated_program_measures_again(
    shelf: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    batch(shelf, tmp_path / "out")
    for place in ("results.summary", "batch.run", "batch.jobs"):
        monkeypatch.setattr(f"tsvision.{place}.code_digest", lambda: "another program")
    assert batch(shelf, tmp_path / "out").done == ("film0", "film1", "film2")
    # a process of its own has the true sources, and must not work for another program
    items = plan(str(shelf), Request(""))
    report = run_batch(items, tmp_path / "out", engine="local", workers=1)
    assert set(report.failed) == {"film0", "film1", "film2"}
    assert "other sources" in report.failed["film0"]
    assert len(code_digest()) == 64


def test_a_damaged_result_is_measured_again(shelf: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    batch(shelf, out)
    expected = bytes_below(out)
    (out / "recordings" / "film1" / "summary.json").write_text("{")
    (out / "recordings" / "film2" / "frames.parquet").unlink()
    assert batch(shelf, out).done == ("film1", "film2")
    if code_digest.__wrapped__() == PROGRAM:
        assert bytes_below(out) == expected


# ------------------------------------------------------------------ killed, interrupted


def start_and_kill(context: Any, shelf: Path, out: Path, wait_s: float) -> bool:
    """Start a batch, kill it after a while; whether it had ended before."""
    process = context.Process(target=batch, args=(shelf, out, "measure_slowly"))
    process.start()
    process.join(wait_s)
    process.kill()
    process.join()
    assert process.exitcode in (0, -signal.SIGKILL)
    return process.exitcode == 0


@pytest.mark.slow
def test_killed_at_twenty_random_moments(long_shelf: Path, tmp_path: Path) -> None:
    for i in range(3, 9):
        write_folder(long_shelf / f"film{i}", 40, 50)
    batch(long_shelf, tmp_path / "undisturbed")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["stand_in", "tsvision.batch", "tsvision.timeline.account"])
    random_s = random.Random(20)
    out = tmp_path / "out"
    kills = complete = 0
    kept_once_done: dict[Path, int] = {}
    while kills < 20:
        if start_and_kill(context, long_shelf, out, random_s.uniform(0.05, 0.6)):
            complete += 1
            assert_same_bytes(out, tmp_path / "undisturbed")
            for path in sorted(out.rglob("*"), reverse=True):
                path.unlink() if path.is_file() else path.rmdir()
            kept_once_done = {}
            continue
        kills += 1
        for place, stamp in kept_once_done.items():  # what is finished is not repeated
            assert (place / "summary.json").stat().st_mtime_ns == stamp
        finished = (p.parent for p in out.glob("recordings/[!.]*/summary.json"))
        kept_once_done = {p: (p / "summary.json").stat().st_mtime_ns for p in finished}
    report = batch(long_shelf, out)
    assert report.failed == {}
    assert_same_bytes(out, tmp_path / "undisturbed")
    assert not [p for p in out.rglob(".*") if p.name not in (".lock", ".workers.lock")]


def local_batch(shelf: Path, out: Path, measure: str) -> subprocess.Popen[bytes]:
    code = (
        "import sys\n"
        "from pathlib import Path\n"
        "from tsvision.batch import run_batch\n"
        "from tsvision.batch.plan import plan\n"
        "from tsvision.run import Request\n"
        "if __name__ == '__main__':\n"
        "    shelf, out, measure = sys.argv[1:]\n"
        "    run_batch(plan(shelf, Request('')), Path(out), workers=2, measure=measure)\n"
    )
    script = out.parent / "start_batch.py"
    script.write_text(code)
    command = [sys.executable, str(script), str(shelf), str(out), f"stand_in:{measure}"]
    return subprocess.Popen(command, stderr=subprocess.DEVNULL)


def wait_while_running(process: subprocess.Popen[bytes], condition: Any) -> None:
    """Until it comes about, however slow the machine; the test's own time limit ends a hang."""
    while not condition():
        assert process.poll() is None, "the process ended before that"
        time.sleep(0.02)


@pytest.mark.slow
def test_workers_end_with_a_killed_batch_which_then_resumes(
    long_shelf: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    monkeypatch.setenv("STAND_IN_RELEASE", str(tmp_path / "released"))  # which it never is
    process = local_batch(long_shelf, out, "measure_held")
    wait_while_running(process, lambda: list(out.glob(".chunks/long-*/[!.]*")))
    with pytest.raises(InputError, match=f"another batch \\(process {process.pid}\\)"):
        batch(long_shelf, out)
    process.kill()
    process.wait()
    report = batch(long_shelf, out, engine="local", workers=2)  # waits for the orphans' end
    assert report.failed == {}
    batch(long_shelf, tmp_path / "undisturbed")
    assert_same_bytes(out, tmp_path / "undisturbed")


@pytest.mark.slow
def test_dying_workers_lose_only_the_recording_that_kills_them(
    shelf: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("STAND_IN_MARK", str(tmp_path / "died"))
    measure = "measure_and_die_once_or_always"
    report = batch(shelf, tmp_path / "a", measure, engine="local", workers=2)
    assert (tmp_path / "died").exists()  # film1 killed one worker, film2 every one
    assert report.done == ("film0", "film1")
    assert "died each time" in report.failed["film2"]
    batch(shelf, tmp_path / "b")
    for name in ("film0", "film1"):
        a, b = (tmp_path / side / "recordings" / name for side in "ab")
        assert_same_bytes(a, b)


def test_interrupt_keeps_what_is_finished(shelf: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"

    def interrupt(counts: Any) -> None:
        if counts.recordings_done == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        batch(shelf, out, progress=interrupt)
    assert (out / "recordings" / "film0" / "summary.json").is_file()
    assert events(out)[-1]["event"] == "stopped"
    report = batch(shelf, out)
    assert report.kept == ("film0",)
    assert report.done == ("film1", "film2")


# ------------------------------------------------------------------ a cluster


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # distributed warns of its own doings when a worker dies
def test_dask_cluster_with_a_dying_worker(
    shelf: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    distributed = pytest.importorskip("distributed")
    monkeypatch.setenv("STAND_IN_MARK", str(tmp_path / "died"))
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster:
        address = cluster.scheduler_address
        measure = "measure_and_die_once"
        report = batch(shelf, tmp_path / "a", measure, engine="dask", scheduler=address)
    assert (tmp_path / "died").exists()
    assert report.failed == {}
    batch(shelf, tmp_path / "b")
    assert_same_bytes(tmp_path / "a", tmp_path / "b")


def test_bad_engine_options_are_said(shelf: Path, tmp_path: Path) -> None:
    for options in (
        {"engine": "magic"},
        {"engine": "dask"},
        {"engine": "local", "workers": 0},
        {"chunk_frames": 0},
    ):
        with pytest.raises(InputError, match="--"):
            batch(shelf, tmp_path / "out", **options)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        batch(shelf, tmp_path / "file" / "out")
