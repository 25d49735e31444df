"""An output folder appears whole or not at all, and replaces nothing but what we wrote ourselves.

Everything is written into a hidden folder beside it, which takes its place by renaming. An old one
steps aside first; what is not our own in it is carried over, and only files that we wrote are
removed. What a killed run left behind is told by its lock, which the system drops with the process.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from tsvision.atomic import telling_what_failed, umask
from tsvision.errors import InputError

_OLD = "old"
_SPARE_BYTES = 5_000_000


@dataclass(frozen=True)
class Kind:
    """What we write as one folder.

    noun: its name in words. mark: the file that every such folder holds. own_names: which files of
    such a folder are ours, relative to it; empty where the mark is none of ours.
    """

    noun: str
    mark: str
    own_names: Callable[[Path], frozenset[str]]


def check_out(out: Path, kind: Kind, overwrite: bool, need_bytes: int = 0) -> None:
    """Refuse an output place before any work: it exists, cannot be written, or has no room."""
    place = _real(out)
    if os.path.lexists(place):
        if not place.is_dir():
            raise InputError(f"{out}: exists and is no folder; choose another --out")
        _refuse_immovable(out, place)
        if any(place.iterdir()):
            _refuse_foreign(out, place, kind, overwrite)
    with telling_what_failed(out):
        place.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=place.parent):
            pass
    free_bytes = shutil.disk_usage(place.parent).free
    if free_bytes < need_bytes + _SPARE_BYTES:
        raise InputError(
            f"{out}: needs about {(need_bytes + _SPARE_BYTES) / 1e6:.0f} MB and the disk has "
            f"{free_bytes / 1e6:.0f} MB free; make room or choose another --out"
        )


def _real(out: Path) -> Path:
    """Where a folder really lies: a link to one stays a link, and what it names is replaced."""
    return Path(os.path.realpath(out))


def _refuse_immovable(out: Path, place: Path) -> None:
    """A folder takes another's place by renaming, which these do not bear."""
    if os.path.ismount(place):
        raise InputError(f"{out}: is where a disk is mounted; name a folder within it as --out")
    if Path.cwd().is_relative_to(place):
        raise InputError(
            f"{out}: is or holds the current folder, which cannot be replaced from within; name "
            "a folder within it as --out"
        )


def _refuse_foreign(out: Path, place: Path, kind: Kind, overwrite: bool) -> None:
    if not overwrite:
        raise InputError(f"{out}: exists; --overwrite replaces it, or choose another --out")
    if not ((place / kind.mark).is_file() and kind.own_names(place)):
        raise InputError(
            f"{out}: holds files but no {kind.noun} ({kind.mark}), so --overwrite leaves it "
            "alone; choose another --out"
        )


@contextmanager
def staged(out: Path, kind: Kind) -> Iterator[Path]:
    """A folder to write into that becomes `out` when the block ends well, and nothing if not."""
    place = _real(out)
    _clear_left_behind(place, kind)
    with telling_what_failed(out):
        staging = Path(tempfile.mkdtemp(prefix=_prefix(place), dir=place.parent))
    lock = os.open(staging, os.O_RDONLY)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        with telling_what_failed(out):
            yield staging
            for path in staging.iterdir():
                _sync(path)
            os.chmod(staging, 0o777 & ~umask())
            _take_place(staging, place, kind)
    except BaseException:
        shutil.rmtree(staging, ignore_errors=True)
        raise
    finally:
        os.close(lock)


def _prefix(place: Path) -> str:
    return f".{place.name[:60]}.part-"


def _take_place(staging: Path, place: Path, kind: Kind) -> None:
    """Rename; an old folder steps aside first, and files not our own are carried over."""
    if not os.path.lexists(place):
        os.rename(staging, place)
        _sync(place.parent)
        return
    _refuse_clashes(staging, place, kind)
    aside = Path(tempfile.mkdtemp(prefix=_prefix(place), dir=place.parent))
    lock = os.open(aside, os.O_RDONLY)
    old = aside / _OLD
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        os.rename(place, old)
        try:
            os.rename(staging, place)
        except OSError:
            os.rename(old, place)
            raise
        _sync(place.parent)
        _retire(old, place, kind)
    finally:
        os.close(lock)
        with suppress(OSError):  # it stays where something is left in it
            os.rmdir(aside)


def _refuse_clashes(staging: Path, place: Path, kind: Kind) -> None:
    """Nothing of ours may take the name of what is not ours."""
    own = _own_files(place, kind)
    for name in sorted(_file_names(staging)):
        found = place / name
        above = [place / parent for parent in list(Path(name).parents)[:-1]]
        taken = [p for p in above if os.path.lexists(p) and not _is_folder(p)]
        if name not in own and os.path.lexists(found):
            taken.append(found)
        if taken:
            raise InputError(
                f"{taken[0]}: is not of the {kind.noun} that would be replaced, and the new one "
                "needs its name; move it or choose another --out"
            )


def _own_files(folder: Path, kind: Kind) -> set[str]:
    """What we wrote of what is there; a folder by the name of a file of ours is not."""
    return _file_names(folder) & kind.own_names(folder)


def _retire(old: Path, place: Path, kind: Kind) -> None:
    """Carry over what is not ours, then remove what is; the mark last, as it tells which that is,
    so that a kill midway can be made good."""
    own = _own_files(old, kind)
    _carry_over(old, place, own)
    for name in sorted(own, key=lambda name: name == kind.mark):
        os.unlink(old / name)
        for parent in list(Path(name).parents)[:-1]:
            with suppress(OSError):
                os.rmdir(old / parent)
    with suppress(OSError):
        os.rmdir(old)


def _carry_over(old: Path, place: Path, own_files: set[str], below: str = "") -> None:
    """Move whatever is not of own_files; a folder as a whole where none of it is ours."""
    for path in list((old / below).iterdir()):
        name = f"{below}{path.name}"
        if name in own_files:
            continue
        if any(own.startswith(f"{name}/") for own in own_files):
            _carry_over(old, place, own_files, f"{name}/")
        elif not os.path.lexists(place / name):
            (place / name).parent.mkdir(parents=True, exist_ok=True)
            os.rename(path, place / name)
        elif _is_folder(path) and _is_folder(place / name):
            _carry_over(old, place, own_files, f"{name}/")
            with suppress(OSError):
                os.rmdir(path)


def _file_names(folder: Path) -> set[str]:
    """Whatever is no folder below a folder, relative to it."""
    return {
        (Path(where) / name).relative_to(folder).as_posix()
        for where, folders, files in os.walk(folder)
        for name in [*files, *(f for f in folders if not _is_folder(Path(where) / f))]
    }


def _is_folder(path: Path) -> bool:
    return path.is_dir() and not path.is_symlink()


def _clear_left_behind(place: Path, kind: Kind) -> None:
    """End or undo what a killed run left half-way, unless a running one still holds its lock."""
    for path in place.parent.glob(f"{_glob_safe(_prefix(place))}*"):
        with suppress(OSError):
            lock = os.open(path, os.O_RDONLY)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                old = path / _OLD
                if not os.path.lexists(old):
                    shutil.rmtree(path, ignore_errors=True)
                elif os.path.lexists(place):
                    _retire(old, place, kind)
                else:
                    os.rename(old, place)
                os.rmdir(path)
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
