"""The results of a batch as one data set: Parquet partitioned by recording, and a table over the
recordings. `dataset/frames/recording=NAME/part-0.parquet` is the recording's own file (a hard link
where the disk allows), so nothing is stored twice."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterable
from pathlib import Path
from urllib.parse import quote

import pyarrow.parquet as pq

from tsvision.results.files import SUMMARY
from tsvision.results.overview import recordings_table

DATASET = "dataset"
TABLES = ("frames", "profiles", "knots")


def write_dataset(out: Path, names: Iterable[str], recordings: Path) -> None:
    """Write `out`/dataset anew for the finished recordings `names` and put it in place at once."""
    names = sorted(names)
    building = Path(tempfile.mkdtemp(prefix=".dataset.", dir=out))
    try:
        for name in names:
            for kind in TABLES:
                place = building / kind / f"recording={quote(name)}"
                place.mkdir(parents=True)
                _link(recordings / name / f"{kind}.parquet", place / "part-0.parquet")
        table = recordings_table({name: recordings / name for name in names})
        pq.write_table(table, building / "recordings.parquet")
        os.chmod(building, 0o755)
        target = out / DATASET
        old = Path(tempfile.mkdtemp(prefix=".dataset.", dir=out))
        if target.exists():
            os.rename(target, old / "old")
        os.rename(building, target)
        shutil.rmtree(old, ignore_errors=True)
    finally:
        shutil.rmtree(building, ignore_errors=True)


def clear_left_behind(out: Path) -> None:
    """Remove what a killed batch left while it built a data set."""
    for path in out.glob(".dataset.*"):
        shutil.rmtree(path, ignore_errors=True)


def finished(recordings: Path) -> list[str]:
    """Names of the recordings that are measured whole."""
    if not recordings.is_dir():
        return []
    inside = (p for p in recordings.iterdir() if not p.name.startswith("."))
    return sorted(p.name for p in inside if (p / SUMMARY).is_file())


def _link(source: Path, target: Path) -> None:
    try:
        os.link(source, target)
    except OSError:
        shutil.copyfile(source, target)
