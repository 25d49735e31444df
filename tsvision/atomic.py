"""Write beside, then rename: whoever reads sees the old or the new, never half of either."""

from __future__ import annotations

import errno
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from tsvision.errors import InputError


def write_text(path: Path, text: str) -> None:
    """Write a text file at once; raises InputError when there is no room or no permission."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file at once; raises InputError when there is no room or no permission."""
    with telling_what_failed(path):
        handle, name = tempfile.mkstemp(prefix=f".{path.name[:60]}.", dir=path.parent)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            os.chmod(name, 0o666 & ~umask())
            os.replace(name, path)
        except BaseException:
            with suppress(OSError):
                os.unlink(name)
            raise


def check_place(path: Path) -> None:
    """Refuse, before the work that fills it, a file that cannot be written."""
    with telling_what_failed(path):
        if path.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        with tempfile.TemporaryFile(dir=path.parent):
            pass


@contextmanager
def telling_what_failed(path: Path) -> Iterator[None]:
    """Turn the system's errors about writing into one line that says what would mend it."""
    try:
        yield
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({_reason(error)})") from error


def _reason(error: OSError) -> str:
    mends = {
        errno.ENOSPC: "no room on the disk; make room or choose another place",
        errno.EDQUOT: "the quota is used up; make room or choose another place",
        errno.EFBIG: "the file would exceed the allowed size; raise the limit",
        errno.EACCES: "no permission; choose another place",
        errno.EPERM: "no permission; choose another place",
        errno.EROFS: "the disk is read-only; choose another place",
        errno.ENOENT: "its folder does not exist; create it",
        errno.EISDIR: "it is a folder; name a file",
        errno.ENOTDIR: "part of the path is a file; choose another place",
        errno.ENAMETOOLONG: "the name is too long; choose a shorter one",
        errno.ELOOP: "links in a circle; choose another place",
    }
    return mends.get(error.errno or 0, error.strerror or str(error))


def umask() -> int:
    """The permissions that new files are not to have; the system tells them only by a change."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
