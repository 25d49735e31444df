"""Whether two batches, or a batch and a measurement, left the same bytes."""

from __future__ import annotations

from pathlib import Path

import pytest

from tsvision.results.summary import code_digest

PROGRAM = code_digest()


def assert_same_bytes(a: Path, b: Path) -> None:
    """Two folders of results are alike to the byte. Both keys name the program that measured: where
    its sources were edited between the two, as in a shared checkout, nothing can be told."""
    if bytes_below(a) != bytes_below(b):
        if code_digest.__wrapped__() != PROGRAM:
            pytest.skip("the program's sources were edited while the test ran")
        assert bytes_below(a) == bytes_below(b)


def skip_if_edited(failed: dict[str, str]) -> None:
    """No verdict either where workers met sources that were edited since the test began."""
    if any("other sources" in problem for problem in failed.values()):
        pytest.skip("the program's sources were edited while the test ran")


def bytes_below(folder: Path) -> dict[str, bytes]:
    """Every file of a batch's results, but for locks and the log, which knows the time."""
    found = {}
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if path.is_file() and not name.startswith((".lock", ".workers.lock", "log/")):
            found[name] = path.read_bytes()
    return found
