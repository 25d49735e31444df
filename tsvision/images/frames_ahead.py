"""Decode ahead in a thread of its own, a few frames and no more, so that memory stays flat."""

from __future__ import annotations

import atexit
import os
import queue
import threading
from collections.abc import Callable, Iterator
from typing import TypeVar

T = TypeVar("T")
_WAIT_S = 0.1
_running: dict[threading.Thread, threading.Event] = {}


@atexit.register
def _stop_all() -> None:
    """A thread that is killed inside a decoder takes the whole process down with it: an iterator
    that was left half-way is ended before the interpreter goes."""
    running = list(_running.items())
    for _, stopped in running:
        stopped.set()
    for thread, _ in running:
        if thread.is_alive():  # an interrupt may have come before it was
            thread.join(timeout=10)


def _cores() -> int:
    """That this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def ahead(make: Callable[[], Iterator[T]], count: int) -> Iterator[T]:
    """Yield what `make()` yields, with up to `count` items made in advance, in order.

    Errors of the maker are raised here; when the consumer stops early the thread ends too. Where
    there is but one core, what decodes and what measures would only take turns on it: nothing is
    made in advance.
    """
    if count < 1 or _cores() < 2:
        yield from make()
        return
    made: queue.Queue[tuple[str, object]] = queue.Queue(maxsize=count)
    stopped = threading.Event()

    def put(item: tuple[str, object]) -> bool:
        while not stopped.is_set():
            try:
                made.put(item, timeout=_WAIT_S)
                return True
            except queue.Full:
                continue
        return False

    def work() -> None:
        source = make()
        try:
            for item in source:
                if not put(("item", item)):
                    return
            put(("end", None))
        except BaseException as error:  # handed to the consumer, never lost
            put(("error", error))
        finally:
            close = getattr(source, "close", None)
            if close is not None:
                close()

    thread = threading.Thread(target=work, name="decode-ahead", daemon=True)
    _running[thread] = stopped
    thread.start()
    try:
        while True:
            kind, value = made.get()
            if kind == "end":
                return
            if kind == "error":
                assert isinstance(value, BaseException)
                raise value
            yield value  # type: ignore[misc]
    finally:
        stopped.set()
        thread.join(timeout=10)
        _running.pop(thread, None)
