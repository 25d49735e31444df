"""Progress on stderr: a bar for a person, a line now and then for a log."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tsvision.batch.run import Counts

_LINE_EVERY_S = 10.0


@contextmanager
def frame_progress(name: str, quiet: bool = False) -> Iterator[Callable[[int, int], None]]:
    """Yields a function to call with (frames done, frames in all)."""
    if quiet:
        yield lambda done, total: None
    elif sys.stderr.isatty():
        yield from _bar(name)
    else:
        yield _lines(name)


def _bar(name: str) -> Iterator[Callable[[int, int], None]]:
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(escape(name), total=None, rate="")
        rate_of = _rate()

        def tell(done: int, total: int) -> None:
            rate = rate_of(done)
            words = f"{rate:.1f} frames/s" if rate else ""
            bar.update(task, completed=done, total=total, rate=words)

        yield tell


def _lines(name: str) -> Callable[[int, int], None]:
    last_s = time.monotonic()
    rate_of = _rate()

    def tell(done: int, total: int) -> None:
        nonlocal last_s
        now_s, rate = time.monotonic(), rate_of(done)
        if now_s - last_s >= _LINE_EVERY_S:
            last_s = now_s
            ahead = f", {rate:.1f}/s, {(total - done) / rate:.0f} s left" if rate else ""
            print(f"{name}: {done}/{total} frames{ahead}", file=sys.stderr)

    return tell


def _rate() -> Callable[[int], float | None]:
    """Frames a second since the first report: what comes before it is done only once (compiling,
    learning what stands still) and says nothing of the rest. None until that can be told."""
    first: tuple[int, float] | None = None

    def rate(done: int) -> float | None:
        nonlocal first
        now_s = time.monotonic()
        if first is None:
            first = done, now_s
        if done <= first[0] or now_s <= first[1]:
            return None
        return (done - first[0]) / (now_s - first[1])

    return rate


@contextmanager
def batch_progress(quiet: bool = False) -> Iterator[Callable[[Counts], None]]:
    """Yields a function to call with a batch's counts."""
    with frame_progress("batch", quiet) as frames:
        failed = 0

        def tell(counts: Counts) -> None:
            nonlocal failed
            if counts.recordings_failed > failed and not quiet:
                failed = counts.recordings_failed
                print(f"batch: {failed} recording(s) failed so far", file=sys.stderr)
            frames(counts.frames_done, counts.frames_known)

        yield tell
