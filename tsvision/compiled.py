"""Where numba keeps what it compiled: beside the sources, else in the user's cache, else, where
neither can be written (a read-only system, a service without a home), in a folder of this process.

That folder is private and removed at the end: numba loads what it finds there, so a place that
others can write to would let them run code here.
"""

from __future__ import annotations

import os

_PLACE = "NUMBA_CACHE_DIR"


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
