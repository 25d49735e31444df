"""A read-only installation without a home still has a place for what is compiled."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tsvision import compiled

ROOT = Path(__file__).parents[1]
PLACE = "NUMBA_CACHE_DIR"


def test_no_kernel_may_reorder_its_sums() -> None:
    """Under fast-math a kernel that is compiled anew inlines others, one that comes from a cache
    does not, and their last bits differ: learning a recording's looks made 0.6 px of D of that
    (the same pictures, a first and a second run)."""
    sources = sorted((ROOT / "tsvision").rglob("*.py"))
    kernels = [path for path in sources if "numba.njit" in path.read_text()]
    assert len(kernels) > 5
    assert not [path.name for path in kernels if "fastmath" in path.read_text()]


def test_nothing_is_set_where_numba_finds_a_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(PLACE, raising=False)
    monkeypatch.setattr(compiled, "_places", lambda: (str(tmp_path / "gone" / "numba"),))
    compiled.find_place()
    assert PLACE not in os.environ
    assert not (tmp_path / "gone").exists()


def test_a_private_folder_where_nothing_can_be_written_and_gone_at_the_end() -> None:
    code = (
        "import os, stat\n"
        "from tsvision import compiled\n"
        "compiled._can_be_written = lambda place: False\n"
        "compiled.find_place()\n"
        f"place = os.environ['{PLACE}']\n"
        "assert stat.S_IMODE(os.stat(place).st_mode) == 0o700\n"
        "print(place)\n"
    )
    clean = {k: v for k, v in os.environ.items() if k != PLACE}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, env=clean, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert not Path(done.stdout.strip()).exists()
