"""Where jobs run: processes on this machine, or a Dask cluster. Both survive a worker's death."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from tsvision.batch.lock import hold_as_worker
from tsvision.errors import InputError

_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
_DEATHS_ALLOWED = 2
_LOOK_AT_PARENT_S = 0.25


class WorkerDied(Exception):
    """The process that ran a job died, more than once."""


@dataclass(frozen=True)
class Job:
    """A function with its arguments; `label` says to the caller what it was."""

    label: Any
    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    urgent: bool = False


@dataclass(frozen=True)
class Done:
    """A finished job: its value, or the error that it raised."""

    job: Job
    value: Any = None
    error: BaseException | None = None


class Engine(Protocol):
    """Takes jobs, gives back finished ones in any order."""

    def submit(self, job: Job) -> None:
        """Queue a job; an urgent one goes first."""

    def next_done(self) -> Done:
        """Wait for the next finished job."""

    def close(self) -> None:
        """End the workers; unfinished jobs are dropped."""


class HereEngine:
    """In this very process, one job after the other: for a debugger, and for tests."""

    def __init__(self) -> None:
        self._waiting: deque[Job] = deque()

    def submit(self, job: Job) -> None:
        """Queue a job; an urgent one goes first."""
        (self._waiting.appendleft if job.urgent else self._waiting.append)(job)

    def next_done(self) -> Done:
        """Run the next job."""
        job = self._waiting.popleft()
        try:
            return Done(job, job.function(*job.arguments))
        except Exception as error:  # told by the caller, as from any other engine
            return Done(job, error=error)

    def close(self) -> None:
        """Nothing to end."""


class LocalEngine:
    """Processes of this machine, one thread each.

    When one dies (out of memory, killed) the pool is made anew; jobs that were running are tried
    again one at a time, so that the one that kills its worker is found and given up alone.
    """

    def __init__(self, workers: int, out: Path) -> None:
        self._workers, self._out = workers, out
        self._pool = self._new_pool(workers)
        self._waiting: deque[Job] = deque()
        self._running: dict[Future[Any], Job] = {}  # never more than workers: only they are suspect
        self._suspects: deque[Job] = deque()

    def submit(self, job: Job) -> None:
        """Queue a job; an urgent one goes first."""
        (self._waiting.appendleft if job.urgent else self._waiting.append)(job)

    def next_done(self) -> Done:
        """Wait for the next finished job."""
        self._top_up()
        while self._running:
            finished, _ = wait(self._running, return_when=FIRST_COMPLETED)
            for future in finished:
                if not isinstance(future.exception(), BrokenProcessPool):
                    return _outcome(self._running.pop(future), future)
            self._renew()
            self._top_up()
        return self._try_alone(self._suspects.popleft())

    def close(self) -> None:
        """End the workers at once; what they had finished is on disk."""
        processes = list((getattr(self._pool, "_processes", None) or {}).values())
        self._pool.shutdown(wait=False, cancel_futures=True)
        for process in processes:
            process.terminate()
        for process in processes:
            process.join(timeout=10)

    def _new_pool(self, workers: int) -> ProcessPoolExecutor:
        for name in _ONE_THREAD:
            os.environ.setdefault(name, "1")
        return ProcessPoolExecutor(
            workers,
            mp_context=multiprocessing.get_context("spawn"),
            initializer=begin_worker,
            initargs=(os.getpid(), str(self._out)),
        )

    def _top_up(self) -> None:
        while self._waiting and len(self._running) < self._workers:
            job = self._waiting.popleft()
            try:
                self._running[self._pool.submit(job.function, *job.arguments)] = job
            except BrokenProcessPool:
                self._waiting.appendleft(job)
                self._renew()

    def _renew(self) -> None:
        """A new pool. Every job that ran is suspect, since any may have killed its process."""
        self._pool.shutdown(wait=True, cancel_futures=True)
        self._suspects += self._running.values()
        self._running = {}
        self._pool = self._new_pool(self._workers)

    def _try_alone(self, job: Job) -> Done:
        for _ in range(_DEATHS_ALLOWED):
            with self._new_pool(1) as alone:
                future = alone.submit(job.function, *job.arguments)
                wait([future])
            if not isinstance(future.exception(), BrokenProcessPool):
                return _outcome(job, future)
        return Done(job, error=WorkerDied("its process died each time (out of memory?)"))


def _outcome(job: Job, future: Any) -> Done:
    error = future.exception()
    return Done(job, error=error) if error is not None else Done(job, future.result())


def begin_worker(parent: int, out: str) -> None:
    """One thread for OpenCV, Ctrl-C left to the parent, and no life without the parent."""
    import cv2

    cv2.setNumThreads(1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    hold_as_worker(Path(out))

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_LOOK_AT_PARENT_S)
        os._exit(1)

    threading.Thread(target=watch, daemon=True, name="parent-watch").start()


@dataclass
class DaskEngine:
    """Jobs on a Dask scheduler; its workers must see the same files under the same paths."""

    client: Any
    _queue: Any = None
    _jobs: dict[str, Job] = field(default_factory=dict)

    @classmethod
    def connect(cls, scheduler: str) -> DaskEngine:
        """Connect to a scheduler, such as tcp://10.0.0.1:8786; raises InputError."""
        try:
            from distributed import Client
        except ImportError:
            raise InputError(
                "--engine dask: dask is not installed; pip install 'tsvision[cluster]'"
            ) from None
        try:
            return cls(Client(scheduler, timeout=10, set_as_default=False))
        except (OSError, ValueError, TimeoutError) as error:
            raise InputError(f"--scheduler {scheduler}: no answer ({error}); start it") from None

    def submit(self, job: Job) -> None:
        """Queue a job; an urgent one goes first."""
        from distributed import as_completed

        priority = 1 if job.urgent else 0
        future = self.client.submit(
            job.function, *job.arguments, pure=False, retries=0, priority=priority
        )
        self._jobs[future.key] = job
        if self._queue is None:
            self._queue = as_completed(loop=self.client.loop)
        self._queue.add(future)

    def next_done(self) -> Done:
        """Wait for the next finished job."""
        from distributed import KilledWorker

        future = next(self._queue)
        job = self._jobs.pop(future.key)
        done = _outcome(job, future)
        if isinstance(done.error, KilledWorker):
            return Done(job, error=WorkerDied("its worker died each time (out of memory?)"))
        return done

    def close(self) -> None:
        """Cancel what is queued and leave the cluster running."""
        self.client.close()
