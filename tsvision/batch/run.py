"""Run a batch: prepare every recording, measure what is not done, merge, gather.

All that decides what is left to do lies in the output folder, under keys made from content; so a
batch killed at any moment is started again by the same command and ends with the same bytes.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from tsvision.atomic import telling_what_failed, write_text
from tsvision.batch.dataset import clear_left_behind, write_dataset
from tsvision.batch.engines import (
    DaskEngine,
    Done,
    Engine,
    HereEngine,
    Job,
    LocalEngine,
    WorkerDied,
)
from tsvision.batch.jobs import (
    CHUNKS,
    MEASURE,
    RECORDINGS,
    Prepared,
    measure_chunk,
    merge,
    prepare,
    with_same_program,
)
from tsvision.batch.lock import hold
from tsvision.batch.log import RunLog
from tsvision.batch.plan import Item
from tsvision.errors import InputError
from tsvision.jsonable import to_json
from tsvision.results.summary import code_digest
from tsvision.run import SEGMENT_FRAMES

Progress = Callable[["Counts"], None]


@dataclass(frozen=True)
class Counts:
    """How far a batch is: frames include those of earlier runs that need not be measured again."""

    recordings: int = 0
    recordings_done: int = 0
    recordings_failed: int = 0
    frames_known: int = 0
    frames_done: int = 0
    frames_measured_now: int = 0


@dataclass(frozen=True)
class BatchReport:
    """What became of each recording: done now, done before, or failed with the reason."""

    done: tuple[str, ...]
    kept: tuple[str, ...]
    failed: dict[str, str]
    notes: tuple[str, ...] = ()


def run_batch(
    items: list[Item],
    out: Path,
    engine: str = "local",
    workers: int = 1,
    scheduler: str | None = None,
    chunk_frames: int = SEGMENT_FRAMES,
    progress: Progress | None = None,
    measure: str = MEASURE,
    finish: Callable[[Path], None] | None = None,
) -> BatchReport:
    """Measure all `items` into `out`: `recordings/NAME/` each, `dataset/`, `batch.json`, `log/`.

    `engine` is "local" (`workers` processes), "dask" (at `scheduler`) or "here" (this process).
    `chunk_frames` is rounded up to whole segments. `finish` is called with each good recording's
    folder before the data set is gathered (to diagnose it); what it raises becomes a note. A
    recording that cannot be measured is reported and stops no other.
    Raises InputError when the folder is locked or cannot be written.
    """
    if engine not in ("local", "dask", "here"):
        raise InputError(f"--engine {engine!r}: choose local, dask or here")
    if engine == "dask" and not scheduler:
        raise InputError("--engine dask needs --scheduler, such as tcp://10.0.0.1:8786")
    if workers < 1 or chunk_frames < 1:
        raise InputError("--workers and --chunk-frames must be at least 1")
    out = Path(out).absolute()
    with hold(out), RunLog(out) as log:
        clear_left_behind(out)
        runner = _engine(engine, workers, scheduler, out)
        try:
            report = _Batch(items, out, runner, chunk_frames, progress, measure, log).run()
        finally:
            runner.close()
        with telling_what_failed(out):
            report = replace(report, notes=_finish(out, items, report, finish))
            _gather(out, items, report)
        log.write("end", done=len(report.done), kept=len(report.kept), failed=report.failed)
    return report


def _engine(name: str, workers: int, scheduler: str | None, out: Path) -> Engine:
    if name == "dask":
        return DaskEngine.connect(scheduler or "")
    return LocalEngine(workers, out) if name == "local" else HereEngine()


def _finish(
    out: Path, items: list[Item], report: BatchReport, finish: Callable[[Path], None] | None
) -> tuple[str, ...]:
    if finish is None:
        return ()
    notes = []
    for name in (item.name for item in items if item.name not in report.failed):
        try:
            finish(out / RECORDINGS / name)
        except Exception as problem:  # hours of measuring are not lost to a fault in one of them
            notes.append(f"{name}: {_told(problem)}")
    return tuple(notes)


def _told(problem: BaseException) -> str:
    """An error in one line, with its kind where it is no word to the user."""
    known = isinstance(problem, InputError | WorkerDied)
    return " ".join((str(problem) if known else f"{type(problem).__name__}: {problem}").split())


def _gather(out: Path, items: list[Item], report: BatchReport) -> None:
    good = [item.name for item in items if item.name not in report.failed]
    write_dataset(out, good, out / RECORDINGS)
    status = [
        {
            "recording": item.name,
            "status": "failed" if item.name in report.failed else "measured",
            "problem": report.failed.get(item.name),
        }
        for item in items
    ]
    write_text(out / "batch.json", to_json({"recordings": status}))
    shutil.rmtree(out / CHUNKS, ignore_errors=True)


@dataclass
class _State:
    """A recording on its way."""

    item: Item
    prepared: Prepared | None = None
    chunks: list[tuple[int, int]] = field(default_factory=list)
    waiting: int = 0


class _Batch:
    """The order of jobs: prepare → chunks → merge, all recordings at once."""

    def __init__(
        self,
        items: list[Item],
        out: Path,
        engine: Engine,
        chunk_frames: int,
        progress: Progress | None,
        measure: str,
        log: RunLog,
    ) -> None:
        self._states = {item.name: _State(item) for item in items}
        self._out, self._engine, self._measure, self._log = out, engine, measure, log
        self._chunk = -(-chunk_frames // SEGMENT_FRAMES) * SEGMENT_FRAMES
        self._progress = progress or (lambda counts: None)
        self._program = code_digest()
        self._pending = 0
        self._done: list[str] = []
        self._kept: list[str] = []
        self._failed: dict[str, str] = {}
        self._frames = {"known": 0, "done": 0, "now": 0}

    def run(self) -> BatchReport:
        """Until nothing is left to do."""
        self._log.write("start", recordings=len(self._states))
        for name, state in self._states.items():
            self._submit(("prepare", name), prepare, state.item.request, self._out, name)
        while self._pending:
            done = self._engine.next_done()
            self._pending -= 1
            self._take(done)
            self._progress(self._counts())
        order = {name: i for i, name in enumerate(self._states)}
        failed = {name: self._failed[name] for name in sorted(self._failed, key=order.__getitem__)}
        return BatchReport(
            tuple(sorted(self._done, key=order.__getitem__)),
            tuple(sorted(self._kept, key=order.__getitem__)),
            failed,
        )

    def _submit(self, label: tuple[str, str], function: Callable[..., Any], *args: Any) -> None:
        self._pending += 1
        # what completes a recording goes first, so that a stop finds it finished
        work = (self._program, function, *args)
        self._engine.submit(Job(label, with_same_program, work, urgent=label[0] == "merge"))

    def _take(self, done: Done) -> None:
        stage, name = done.job.label
        state = self._states[name]
        if done.error is not None:
            self._fail(name, done.error)
        elif stage == "prepare":
            self._start(name, state, done.value)
        elif stage == "chunk":
            state.waiting -= 1
            self._frames["done"] += done.value
            self._frames["now"] += done.value
            if state.waiting == 0 and name not in self._failed:
                self._merge(name, state)
        else:
            self._done.append(name)
            self._log.write("measured", recording=name, frames=done.value["frames_total"])

    def _start(self, name: str, state: _State, prepared: Prepared) -> None:
        state.prepared = prepared
        self._frames["known"] += prepared.frames
        if prepared.done:
            self._frames["done"] += prepared.frames
            self._kept.append(name)
            self._log.write("kept", recording=name, frames=prepared.frames)
            return
        starts = range(0, prepared.frames, self._chunk)
        state.chunks = [(a, min(a + self._chunk, prepared.frames)) for a in starts]
        state.waiting = len(state.chunks)
        for a, b in state.chunks:
            self._submit(
                ("chunk", name),
                measure_chunk,
                state.item.request,
                self._out,
                name,
                prepared.key,
                (a, b),
                self._measure,
            )

    def _merge(self, name: str, state: _State) -> None:
        args = (state.item.request, self._out, name, state.prepared, state.chunks)
        self._submit(("merge", name), merge, *args)

    def _fail(self, name: str, error: BaseException) -> None:
        self._failed.setdefault(name, _told(error))
        self._log.write("failed", recording=name, problem=self._failed[name])

    def _counts(self) -> Counts:
        return Counts(
            recordings=len(self._states),
            recordings_done=len(self._done) + len(self._kept),
            recordings_failed=len(self._failed),
            frames_known=self._frames["known"],
            frames_done=self._frames["done"],
            frames_measured_now=self._frames["now"],
        )
