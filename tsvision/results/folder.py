"""An output folder appears whole or not at all.

Everything is written into a hidden folder beside it, which takes its place by renaming. What a
killed run left behind is told by its lock, which the system drops with the process.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from tsvision.atomic import telling_what_failed
from tsvision.errors import InputError

SUMMARY = "summary.json"
PROFILES = "profiles.parquet"
ALWAYS_THERE = (
    "frames.parquet",
    "frames.csv",
    PROFILES,
    "knots.parquet",
    "knots.csv",
    SUMMARY,
)
# made from a measurement: they would lie about the one that replaces it
_DERIVED = ("budget.csv", "report.html", "overlay.mp4", "sheet.jpg", "measured.rrd", "verdict.json")
OWN_FILES = frozenset({*ALWAYS_THERE, *_DERIVED})
_OLD = "old"
_SPARE_BYTES = 5_000_000


def check_out(out: Path, overwrite: bool, need_bytes: int = 0) -> None:
    """Refuse an output place before any work: it exists, cannot be written, or has no room."""
    if os.path.lexists(out):
        if not out.is_dir():
            raise InputError(f"{out}: exists and is no folder; choose another --out")
        if any(out.iterdir()):
            if not overwrite:
                raise InputError(f"{out}: exists; --overwrite replaces it, or choose another --out")
            if not (out / SUMMARY).is_file():
                raise InputError(
                    f"{out}: holds files but no measurement ({SUMMARY}), so --overwrite leaves it "
                    "alone; choose another --out"
                )
    with telling_what_failed(out):
        out.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=out.parent):
            pass
    free_bytes = shutil.disk_usage(out.parent).free
    if free_bytes < need_bytes + _SPARE_BYTES:
        raise InputError(
            f"{out}: needs about {(need_bytes + _SPARE_BYTES) / 1e6:.0f} MB and the disk has "
            f"{free_bytes / 1e6:.0f} MB free; make room or choose another --out"
        )


@contextmanager
def staged(out: Path) -> Iterator[Path]:
    """A folder to write into that becomes `out` when the block ends well, and nothing if not."""
    _clear_left_behind(out)
    with telling_what_failed(out):
        staging = Path(tempfile.mkdtemp(prefix=_prefix(out), dir=out.parent))
    lock = os.open(staging, os.O_RDONLY)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        with telling_what_failed(out):
            yield staging
            for path in staging.iterdir():
                _sync(path)
            os.chmod(staging, 0o777 & ~_umask())
            _take_place(staging, out)
    except BaseException:
        shutil.rmtree(staging, ignore_errors=True)
        raise
    finally:
        os.close(lock)


def _prefix(out: Path) -> str:
    return f".{out.name[:60]}.part-"


def _take_place(staging: Path, out: Path) -> None:
    """Rename; an old measurement steps aside first, and files not our own are carried over."""
    if not os.path.lexists(out):
        os.rename(staging, out)
        _sync(out.parent)
        return
    aside = Path(tempfile.mkdtemp(prefix=_prefix(out), dir=out.parent))
    lock = os.open(aside, os.O_RDONLY)
    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    old = aside / _OLD
    os.rename(out, old)
    try:
        os.rename(staging, out)
    except OSError:
        os.rename(old, out)
        os.rmdir(aside)
        os.close(lock)
        raise
    for path in old.iterdir():
        if path.name not in OWN_FILES and not os.path.lexists(out / path.name):
            os.rename(path, out / path.name)
    _sync(out.parent)
    shutil.rmtree(aside, ignore_errors=True)
    os.close(lock)


def _clear_left_behind(out: Path) -> None:
    """Undo what a killed run left half-way, unless a running one still holds its lock."""
    for path in out.parent.glob(f"{_glob_safe(_prefix(out))}*"):
        with suppress(OSError):
            lock = os.open(path, os.O_RDONLY)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if (path / _OLD).exists() and not os.path.lexists(out):
                    os.rename(path / _OLD, out)
                shutil.rmtree(path, ignore_errors=True)
            finally:
                os.close(lock)


def _glob_safe(text: str) -> str:
    return "".join(f"[{c}]" if c in "*?[" else c for c in text)


def _sync(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
