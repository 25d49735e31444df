"""Decoding ahead: in order, errors handed on, and no thread left behind."""

from __future__ import annotations

import subprocess
import sys
import threading
from collections.abc import Iterator
from itertools import count, islice

import pytest

from tsvision.images.frames_ahead import ahead


def test_items_come_in_order_and_the_thread_ends() -> None:
    before = threading.active_count()
    assert list(ahead(lambda: iter(range(50)), 3)) == list(range(50))
    some = ahead(lambda: count(), 3)
    assert list(islice(some, 4)) == [0, 1, 2, 3]
    some.close()  # type: ignore[attr-defined]
    assert threading.active_count() == before


@pytest.mark.parametrize(("cores", "made"), [(1, 1), (2, 4)])
def test_one_core_makes_nothing_in_advance(
    cores: int, made: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tsvision.images.frames_ahead._cores", lambda: cores)
    begun = threading.Semaphore(0)

    def counted() -> Iterator[int]:
        for i in count():
            begun.release()
            yield i

    some = ahead(counted, 2)
    assert next(some) == 0
    # One is used, two wait and one is held by who makes them.
    assert all(begun.acquire(timeout=5.0) for _ in range(made))
    assert not begun.acquire(timeout=0.2)
    some.close()  # type: ignore[attr-defined]


def test_an_error_comes_where_it_was_made() -> None:
    def two_then_none() -> Iterator[int]:
        yield from (1, 2)
        raise OSError("no more")

    got = ahead(two_then_none, 4)
    assert [next(got), next(got)] == [1, 2]
    with pytest.raises(OSError, match="no more"):
        next(got)


def test_a_program_may_end_with_frames_still_to_come() -> None:
    """It ended by SIGABRT: the interpreter killed the thread inside the decoder."""
    program = """
import cv2, numpy as np
from tsvision.images.frames_ahead import ahead
coded = cv2.imencode(".png", np.random.default_rng(0).integers(0, 255, (1080, 1920), "u1"))[1]
def frames():
    while True:
        yield cv2.imdecode(coded, cv2.IMREAD_GRAYSCALE)
left = ahead(frames, 2)
next(left)
"""
    for _ in range(3):
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, timeout=60)
        assert done.returncode == 0, done.stderr.decode()


def test_an_interrupt_before_the_thread_runs_ends_cleanly() -> None:
    """Ctrl-C between naming a thread and its first breath: joining it at exit raised."""
    program = """
import threading
from tsvision.images import frames_ahead
frames_ahead._cores = lambda: 2
def interrupted(thread):
    raise KeyboardInterrupt
threading.Thread.start = interrupted
try:
    next(frames_ahead.ahead(lambda: iter(range(9)), 2))
except KeyboardInterrupt:
    pass
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, timeout=60)
    assert done.returncode == 0 and not done.stderr, done.stderr.decode()
