"""What a worker does: prepare a recording, measure a chunk, merge the chunks. Each job can be
repeated at any time, by anyone: it looks first whether its result is there, and renames it into
place when it is whole."""

from __future__ import annotations

import importlib
import os
import shutil
import tempfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tsvision.errors import InputError
from tsvision.images.frames import input_files
from tsvision.records import Recording
from tsvision.results.files import ALWAYS_THERE, MEASUREMENT, PROFILES
from tsvision.results.read import read_summary
from tsvision.results.summary import code_digest, content_key, sha256_of
from tsvision.results.tables import (
    ProfileWriter,
    knot_table_to_parquet,
    row_table_to_parquet,
    tables_from_parquet,
)
from tsvision.run import Request, Stretch, open_request, segments, write_tables
from tsvision.run_guard import Measure, without_losing_rows
from tsvision.staging import staged

MEASURE = "tsvision.timeline.steadily:measure_steadily"
RECORDINGS = "recordings"
CHUNKS = ".chunks"
_ROWS, _KNOTS = "rows.parquet", "knots.parquet"


@dataclass(frozen=True)
class Prepared:
    """A recording that can be measured: its key, its length, and whether it is done already."""

    key: str
    frames: int
    done: bool
    digests: Mapping[Path, str]


def with_same_program(program: str, job: Callable[..., Any], *arguments: Any) -> Any:
    """Do a job if this worker's sources are those of the batch that sent it (`program`, their
    digest): results of two programs must not meet under one key. Raises InputError."""
    if code_digest() != program:
        raise InputError(
            "a worker runs other sources of tsvision than the batch that sent its work; install "
            "the same version everywhere and start again"
        )
    return job(*arguments)


def prepare(request: Request, out: Path, name: str) -> Prepared:
    """Open a recording and find its key; raises InputError."""
    recording, first = open_request(request)
    digests = {path: sha256_of(path) for path in input_files(recording)}
    key = content_key(recording, digests, first)
    done = _stored_key(out / RECORDINGS / name) == key
    return Prepared(key, len(recording.files), done, digests)


def measure_chunk(
    request: Request,
    out: Path,
    name: str,
    key: str,
    chunk: tuple[int, int],
    measure: str = MEASURE,
) -> int:
    """Measure whole segments start..stop-1 into a folder of the chunk; returns the frames done."""
    start, stop = chunk
    place = chunks_of(out, name, key) / f"{start:09d}-{stop:09d}"
    if place.is_dir():
        return stop - start
    recording, first = open_request(request)
    place.parent.mkdir(parents=True, exist_ok=True)
    folder = Path(tempfile.mkdtemp(prefix=f".{place.name}.", dir=place.parent))
    try:
        _fill(folder, recording, resolve(measure), start, stop, first)
        try:
            os.rename(folder, place)
        except OSError:
            if not place.is_dir():  # else someone else finished the very same
                raise
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return stop - start


def merge(
    request: Request, out: Path, name: str, prepared: Prepared, chunks: list[tuple[int, int]]
) -> dict[str, Any]:
    """Join the chunks into the recording's folder, as if measured in one go; its summary."""
    target = out / RECORDINGS / name
    if _stored_key(target) != prepared.key:
        recording, first = open_request(request)
        shelf = chunks_of(out, name, prepared.key)
        places = [shelf / f"{start:09d}-{stop:09d}" for start, stop in chunks]
        target.parent.mkdir(parents=True, exist_ok=True)
        with staged(target, MEASUREMENT) as folder:
            _join(folder, recording, places, prepared.digests, first)
    shutil.rmtree(chunks_of(out, name, prepared.key), ignore_errors=True)
    return read_summary(target)


def chunks_of(out: Path, name: str, key: str) -> Path:
    """Where a recording's finished chunks lie until they are merged."""
    return out / CHUNKS / f"{name}-{key[:16]}"


def resolve(name: str) -> Measure:
    """`module:function` to the function that measures frames."""
    module, function = name.split(":")
    found = getattr(importlib.import_module(module), function)
    return lambda recording, start, stop: found(recording, start=start, stop=stop)


def _stored_key(folder: Path) -> str | None:
    """The key of a finished result; None when there is none or it is damaged."""
    if not all((folder / name).is_file() for name in ALWAYS_THERE):
        return None
    with suppress(InputError):
        return read_summary(folder).get("key")
    return None


def _fill(
    folder: Path, recording: Recording, measure: Measure, start: int, stop: int, first: int
) -> None:
    with Stretch(folder / PROFILES, first) as stretch:
        for a, b in segments(len(recording.files)):
            if start <= a < stop:
                for result in without_losing_rows(measure)(recording, a, b):
                    stretch.add(result)
                stretch.end_segment()
    rows, knots = stretch.tables()
    row_table_to_parquet(folder / _ROWS, rows)
    knot_table_to_parquet(folder / _KNOTS, knots)


def _join(
    folder: Path, recording: Recording, places: list[Path], digests: Mapping[Path, str], first: int
) -> None:
    profiles = ProfileWriter(folder / PROFILES)
    try:
        for place in places:
            profiles.append(place / PROFILES)
    finally:
        profiles.close()
    rows = tables_from_parquet([place / _ROWS for place in places])
    knots = tables_from_parquet([place / _KNOTS for place in places])
    write_tables(folder, recording, rows, knots, digests, first)
