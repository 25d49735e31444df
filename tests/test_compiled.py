"""What is compiled has a place, also in a read-only installation without a home, and is compiled
anew when anything that it is made of changes."""

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


CALLER = """
from pathlib import Path

from tsvision.compiled import keep_current

keep_current(Path(__file__).parent)
"""
KERNEL = """
import numba

from strings.inner.lengths import LENGTH, twice


@numba.njit(cache=True)
def both(x):
    return twice(x) + LENGTH
"""
LENGTHS = """
import numba

LENGTH = {length}


@numba.njit(cache=True)
def twice(x):
    return {factor} * x
"""


@pytest.mark.parametrize("place", ["beside the sources", "a folder given"])
def test_what_is_compiled_follows_a_change_in_another_file(tmp_path: Path, place: str) -> None:
    """Numba looks at a function's own file only: a called function's body and a constant of
    another file stayed what they were, after an upgrade in place as well."""
    inner = tmp_path / "strings" / "inner"
    inner.mkdir(parents=True)
    (tmp_path / "strings" / "__init__.py").write_text(CALLER)
    (inner / "__init__.py").touch()
    (inner / "kernel.py").write_text(KERNEL)
    env = {k: v for k, v in os.environ.items() if k != PLACE}
    env["PYTHONPATH"] = os.pathsep.join([str(tmp_path), str(ROOT)])
    kept = inner / "__pycache__"
    if place == "a folder given":
        kept = tmp_path / "kept"
        env[PLACE] = str(kept)

    def result(length: int, factor: int) -> tuple[int, float]:
        (inner / "lengths.py").write_text(LENGTHS.format(length=length, factor=factor))
        code = "from strings.inner.kernel import both; print(both(10))"
        done = subprocess.run(
            [sys.executable, "-c", code], cwd=tmp_path, env=env, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        (index,) = kept.rglob("kernel.both*.nbi")
        return int(done.stdout), index.stat().st_mtime_ns

    first, made = result(1, 2)
    again, kept_since = result(1, 2)
    assert first == again == 21
    assert kept_since == made, "compiled anew without need"
    assert result(5, 2)[0] == 25
    assert result(5, 3)[0] == 35
