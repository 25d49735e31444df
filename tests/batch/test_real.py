"""A batch with the measuring that users get: cut into chunks it ends as if measured in one go."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.batch.compare import assert_same_bytes
from tsvision.batch import run_batch
from tsvision.batch.jobs import measure_chunk
from tsvision.batch.plan import plan
from tsvision.run import Request, measure_to_folder

ROOT = Path(__file__).parents[2]
SEGMENT = 3


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Six small frames from the first twist to knots."""
    folder = tmp_path_factory.mktemp("shelf") / "film"
    command = "cli.main synth --turns 3:63:12 --preset bench --look bright_on_dark --seed 5 --quiet"
    subprocess.run(
        [sys.executable, "-m", *command.split(), "--size", "480x270", "--out", str(folder)],
        check=True,
        cwd=ROOT,
    )
    return folder


@pytest.mark.slow
def test_chunks_merge_to_the_bytes_of_one_go(
    film: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tsvision.run.SEGMENT_FRAMES", SEGMENT)
    monkeypatch.setattr("tsvision.batch.run.SEGMENT_FRAMES", SEGMENT)
    chunks: list[object] = []

    def seen(*given: Any) -> int:
        chunks.append(given[4])
        return measure_chunk(*given)

    monkeypatch.setattr("tsvision.batch.run.measure_chunk", seen)
    alone = measure_to_folder(film, tmp_path / "alone")
    items = plan(str(film.parent), Request(""))
    report = run_batch(items, tmp_path / "out", engine="here", chunk_frames=SEGMENT)
    assert report.done == ("film",) and report.failed == {}
    assert chunks == [(0, 3), (3, 6)]
    assert_same_bytes(alone, tmp_path / "out" / "recordings" / "film")
