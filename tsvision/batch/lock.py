"""One batch at a time on an output folder, told by locks that the system drops with a process."""

from __future__ import annotations

import fcntl
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tsvision.atomic import telling_what_failed
from tsvision.errors import InputError

_LOCK = ".lock"
_WORKERS = ".workers.lock"
_WAIT_FOR_ORPHANS_S = 30.0
_held: list[int] = []


@contextmanager
def hold(out: Path) -> Iterator[None]:
    """Hold the folder for this batch; raises InputError when another one does."""
    with telling_what_failed(out):
        out.mkdir(parents=True, exist_ok=True)
        handle = os.open(out / _LOCK, os.O_CREAT | os.O_RDWR, 0o644)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            other = os.pread(handle, 20, 0).decode(errors="replace").strip() or "unknown"
            raise InputError(
                f"{out}: another batch (process {other}) is writing there; wait for it, or choose "
                "another --out"
            ) from None
        os.ftruncate(handle, 0)
        os.pwrite(handle, str(os.getpid()).encode(), 0)
        _wait_for_orphans(out)
        yield
    finally:
        # the file stays: unlinking it would let a third batch lock another file of that name
        os.close(handle)


def hold_as_worker(out: Path) -> None:
    """A worker shows for all its life that it may still write."""
    handle = os.open(out / _WORKERS, os.O_CREAT | os.O_RDWR, 0o644)
    fcntl.flock(handle, fcntl.LOCK_SH)
    _held.append(handle)


def _wait_for_orphans(out: Path) -> None:
    """Workers of a killed batch end within a moment; until then nothing is started."""
    handle = os.open(out / _WORKERS, os.O_CREAT | os.O_RDWR, 0o644)
    try:
        end_s = time.monotonic() + _WAIT_FOR_ORPHANS_S
        while True:
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                return
            except OSError:
                if time.monotonic() > end_s:
                    raise InputError(
                        f"{out}: workers of an earlier batch are still writing there; end them"
                    ) from None
                time.sleep(0.05)
    finally:
        os.close(handle)
