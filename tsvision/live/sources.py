"""Frames as they come: a folder that grows, a camera, a stream; each with its turns and its time.

A source yields `Arrival`s until it ends. A folder ends when nothing new has come for a while; a
camera or stream never waits for the measuring: while one frame is measured, newer ones replace
each other, so that what is measured is now.
"""

from __future__ import annotations

import io
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import tee
from pathlib import Path
from typing import Any

import numpy as np

from tsvision.errors import InputError
from tsvision.images.frames_find import PICTURE_SUFFIXES, natural_key
from tsvision.images.frames_picture import Unreadable, read_picture
from tsvision.images.turns import (
    bare_name,
    frame_number,
    must_hold_turns,
    name_pattern,
    number,
    number_in_name,
    rows_in,
)
from tsvision.records import Frame

NAN = float("nan")
POLL_S = 0.02
HALF_WRITTEN_S = 1.0  # a picture that stays unreadable this long is unreadable
TURNS_WAIT_S = 0.5  # how long a picture waits for its row in turns.csv


@dataclass(frozen=True)
class Arrival:
    """One frame with its turn count (NaN where unknown)."""

    frame: Frame
    turns: float


Turns = Callable[[int, str, float], float]  # frame number, file, seconds since the first -> turns


def turns_per_frame(turns: float) -> Turns:
    """Turns rise by the same amount from frame to frame."""
    return lambda index, file, elapsed_s: turns * index


def turns_per_second(turns: float) -> Turns:
    """The motor runs at a steady speed from the first frame on."""
    return lambda index, file, elapsed_s: turns * elapsed_s


def turns_from_name(expression: str) -> Turns:
    """Turns stand in the file's name, in the expression's one group."""
    pattern = name_pattern(expression)
    return lambda index, file, elapsed_s: number_in_name(pattern, file)


def turns_from_file(path: Path) -> Turns:
    """Turns from a file that is rewritten or grows: a turns.csv, or a lone number, the newest."""
    table = _GrowingTable(path)

    def read(index: int, file: str, elapsed_s: float) -> float:
        return table.turns(index, file)

    return read


class _GrowingTable:
    """The rows of a turns.csv by file name and by frame number, read again when it changes; by the
    rules of `images.turns`, so that a film that was watched can be measured later."""

    def __init__(self, path: Path) -> None:
        self._path, self._stamp = path, (0, 0)
        self._by_file: dict[str, float] = {}
        self._by_frame: dict[int, float] = {}
        self._newest: float | None = None

    def turns(self, index: int, file: str) -> float:
        self._refresh()
        if self._newest is not None:
            return self._newest
        by_name = self._by_file.get(file, self._by_file.get(bare_name(file)))
        return self._by_frame.get(index, NAN) if by_name is None else by_name

    def _refresh(self) -> None:
        try:
            stat = self._path.stat()
            if (stat.st_mtime_ns, stat.st_size) == self._stamp:
                return
            data = self._path.read_bytes()
        except OSError:
            return
        self._stamp = (stat.st_mtime_ns, stat.st_size)
        end = data.rfind(b"\n") + 1
        # What follows the last line's end may be half written, even in the middle of a letter.
        told = data[end:].decode(errors="replace")
        try:
            whole = data[:end].decode("utf-8-sig")
        except UnicodeDecodeError as error:
            raise InputError(f"{self._path}: no readable CSV in UTF-8 ({error})") from None
        self._newest = _lone_number(whole + told)
        if self._newest is not None:
            return
        if whole.strip() and told.strip():
            with suppress(InputError):  # whatever is wrong with it, there may be more to come
                self._take(whole + told)
        self._take(whole)  # last: half a row must not speak for another frame

    def _take(self, text: str) -> None:
        rows = list(rows_in(self._path, io.StringIO(text, newline="")))
        if rows:
            must_hold_turns(self._path, list(rows[0][1]))
        for place, (line, row) in enumerate(rows):
            turns = number(self._path, line, "turns", row.get("turns", ""))
            name = row.get("file", "").strip()
            if name:
                self._by_file[name] = self._by_file[bare_name(name)] = turns
            else:
                at = frame_number(self._path, line, row) if "frame" in row else place
                self._by_frame[at] = turns


def _lone_number(text: str) -> float | None:
    filled = [line for line in text.splitlines() if line.strip()]
    try:
        value = float(filled[0].replace(",", ".")) if len(filled) == 1 else NAN
    except ValueError:
        return None
    return value if np.isfinite(value) else None


def growing_folder(folder: Path, turns: Turns, idle_s: float | None) -> Iterator[Arrival]:
    """Pictures of a folder in natural order, then new ones as they come.

    Ends when none has come for `idle_s` (None: never). A picture that is still being written is
    tried again; one that stays broken comes as unreadable.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; create it, or name a camera index or a URL")
    done: set[str] = set()
    index, first_s, last_news = 0, None, time.monotonic()
    while True:
        waiting = _new_pictures(folder, done)
        for name in waiting:
            frame = _read_when_whole(folder / name, index, name, more_waits=len(waiting) > 1)
            now = time.monotonic()
            first_s = now if first_s is None else first_s
            yield Arrival(frame, _turns_when_there(turns, index, name, now - first_s))
            done.add(name)
            index, last_news = index + 1, time.monotonic()
        if not waiting and idle_s is not None and time.monotonic() - last_news > idle_s:
            return
        time.sleep(POLL_S)


def _new_pictures(folder: Path, done: set[str]) -> list[str]:
    names = (p.name for p in folder.iterdir() if p.suffix.lower() in PICTURE_SUFFIXES)
    return sorted((n for n in names if n not in done and not n.startswith(".")), key=natural_key)


def _read_when_whole(path: Path, index: int, name: str, more_waits: bool) -> Frame:
    """Try until the picture is whole; one with newer ones behind it is not being written."""
    began = time.monotonic()
    while True:
        try:
            return Frame(index, name, read_picture(path))
        except Unreadable as problem:
            if more_waits or time.monotonic() - began > HALF_WRITTEN_S:
                return Frame(index, name, None, str(problem))
        time.sleep(POLL_S)


def _turns_when_there(turns: Turns, index: int, name: str, elapsed_s: float) -> float:
    began = time.monotonic()
    while True:
        value = turns(index, name, elapsed_s)
        if np.isfinite(value) or time.monotonic() - began > TURNS_WAIT_S:
            return value
        time.sleep(POLL_S)


def camera(
    source: int | str,
    turns: Turns,
    idle_s: float | None = None,
    drop: bool = True,
) -> Iterator[Arrival]:
    """Frames of a camera (index) or stream (URL, or a video file, from which none is dropped)."""
    import cv2

    capture = cv2.VideoCapture(source)
    if not capture.isOpened():
        raise InputError(f"{source}: no camera or stream answers there; check the index or the URL")
    grabber = _Grabber(capture, drop)
    first_s = None
    index = 0
    try:
        while True:
            taken = grabber.next(idle_s)
            if taken is None:
                return
            number, pixels, came_s = taken
            first_s = came_s if first_s is None else first_s
            name = f"{source}#{number}"
            frame = Frame(index, name, pixels)
            yield Arrival(frame, turns(number, name, came_s - first_s))
            index += 1
    finally:
        grabber.stop()
        capture.release()


def without_lens(arrivals: Iterator[Arrival], lens: tuple[float, ...]) -> Iterator[Arrival]:
    """The same without the lens's distortion, as `iter_frames` gives a recording's frames; as they
    are where no lens is known."""
    if not lens:
        yield from arrivals
        return
    from tsvision.images.calibration_recording import undistorted  # scipy loads slowly

    came, seen = tee(arrivals)
    frames = undistorted((one.frame for one in seen), lens)
    for arrival, frame in zip(came, frames, strict=True):
        yield replace(arrival, frame=frame)


class _Grabber:
    """Reads in a thread and keeps the newest frame (`drop`), or hands over each in turn."""

    def __init__(self, capture: Any, drop: bool) -> None:
        self._capture, self._drop = capture, drop
        self._condition = threading.Condition()
        self._newest: tuple[int, np.ndarray, float] | None = None
        self._ended = self._stopped = False
        self._thread = threading.Thread(target=self._run, daemon=True, name="grabber")
        self._thread.start()

    def _run(self) -> None:
        number = 0
        while not self._stopped:
            good, pixels = self._capture.read()
            with self._condition:
                while good and not self._drop and self._newest is not None and not self._stopped:
                    self._condition.wait(0.1)
                if not good:
                    self._ended = True
                    self._condition.notify_all()
                    return
                self._newest = (number, pixels, time.monotonic())
                self._condition.notify_all()
            number += 1

    def next(self, idle_s: float | None) -> tuple[int, np.ndarray, float] | None:
        with self._condition:
            self._condition.wait_for(lambda: self._newest is not None or self._ended, idle_s)
            taken, self._newest = self._newest, None
            self._condition.notify_all()
            return taken

    def stop(self) -> None:
        with self._condition:
            self._stopped = True
            self._condition.notify_all()
        self._thread.join(timeout=2.0)
