"""Where numba keeps what it compiled, and what of that is out of date.

It is kept beside the sources, else in the user's cache, else, where neither can be written (a
read-only system, a service without a home), in a folder of this process. That folder is private
and removed at the end: numba loads what it finds there, so a place that others can write to would
let them run code here.

Numba compiles a function anew when its own file changes, but not when a function that it calls or
a constant that it reads changes in another: after an upgrade in place results would come from both.
So all that a package's kernels are made of is kept as one fingerprint beside what was compiled, and
another one removes it all.
"""

from __future__ import annotations

import hashlib
import os
import re
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

_PLACE = "NUMBA_CACHE_DIR"
_MADE_OF = "made-of.txt"  # two lines: of all files as the disk lists them, of the kernels' contents
_IMPORT = re.compile(r"^from ([\w.]+) import|^import ([\w.]+)", re.MULTILINE)


def keep_current(package: Path) -> None:
    """Before numba is imported: find a place for what the package's folder compiles, and remove
    what is there if the package's kernels have changed since."""
    find_place()
    with suppress(OSError):  # nothing can be kept there: nothing is out of date
        _keep_current(package, sorted(package.rglob("*.py")))


def _keep_current(package: Path, files: list[Path]) -> None:
    stats = [(path, path.stat()) for path in files]
    listed = _digest(f"{path} {stat.st_mtime_ns} {stat.st_size}" for path, stat in stats)
    folder = _kept_in(package)
    noted = folder / _MADE_OF
    known = noted.read_text(errors="replace").splitlines() if noted.is_file() else []
    if known[:1] == [listed]:
        return
    kernels = _digest(path.read_text(encoding="utf-8") for path in _kernels(package, set(files)))
    if known[1:] != [kernels]:
        for place in {_kept_in(path.parent) for path in files}:
            for old in (*place.glob("*.nbi"), *place.glob("*.nbc")):
                old.unlink(missing_ok=True)
    folder.mkdir(parents=True, exist_ok=True)
    # Processes that start together may all do this: none may read half a note.
    part = folder / f"{_MADE_OF}.{os.getpid()}"
    part.write_text(f"{listed}\n{kernels}\n")
    part.replace(noted)


def find_place() -> None:
    """Set NUMBA_CACHE_DIR where numba would find no place of its own; before numba is imported."""
    if os.environ.get(_PLACE) or any(map(_can_be_written, _places())):
        return
    import atexit
    import shutil
    import tempfile

    place = tempfile.mkdtemp(prefix="tsvision-compiled-")
    os.environ[_PLACE] = place  # workers share it
    atexit.register(shutil.rmtree, place, ignore_errors=True)


def _places() -> tuple[str, ...]:
    """Beside the sources, and the user's own cache."""
    cache = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    return os.path.join(os.path.dirname(__file__), "__pycache__"), os.path.join(cache, "numba")


def _can_be_written(place: str) -> bool:
    """Whether the folder can be written, or made."""
    while not os.path.exists(place) and place != os.path.dirname(place):
        place = os.path.dirname(place)
    return os.access(place, os.W_OK | os.X_OK)


def _kept_in(folder: Path) -> Path:
    """Where numba keeps what a folder's files compile: beside them, or in a place for many under
    the folder's name and the hash of its path."""
    given, beside = os.environ.get(_PLACE), folder / "__pycache__"
    if not given and _can_be_written(str(beside)):
        return beside
    inside = f"{folder.name}_{hashlib.sha1(str(folder).encode()).hexdigest()}"
    return Path(given or _places()[1]) / inside


def _kernels(package: Path, files: set[Path]) -> list[Path]:
    """The files with compiled functions and, as far as they are the package's, all that those
    import: what is compiled calls their functions and freezes their constants."""
    found: set[Path] = set()
    ahead = [path for path in files if "numba.njit" in path.read_text(encoding="utf-8")]
    while ahead:
        path = ahead.pop()
        if path in found:
            continue
        found.add(path)
        for match in _IMPORT.finditer(path.read_text(encoding="utf-8")):
            module = package.parent.joinpath(*(match[1] or match[2]).split("."))
            ahead += {module.with_suffix(".py"), module / "__init__.py"} & files
    return sorted(found)


def _digest(texts: Iterable[str]) -> str:
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()
