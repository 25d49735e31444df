"""What is handed out: build an sdist and a wheel, install the wheel where nothing else is, run it.

    python -m tests.bench.wheel [--place FOLDER] [--quick]

The wheel is built from the sdist, so that both are whole. It is installed in a new virtual
environment, and every command runs in an empty folder, so that nothing of the checkout can help.
`--quick` leaves out the demo. Prints one line a step; ends with exit 1 where one falls short.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HELP_AIM_S = 0.3
COMMANDS = (  # each needs another part of the package's own files
    "--version",
    "validate",
    "rig init rig.toml",
    "synth --out film --turns 0:20:10 --size 640x360 --quiet",
    "predict --turns 0:20:10 --rig film/rig.toml",
    "measure film --out measured --quiet",
    "report measured --recording film --video",
)
_TRIES = 7


def main() -> None:
    """Build, install, run."""
    words = argparse.ArgumentParser(description="Build, install in an empty environment, run.")
    words.add_argument("--place", type=Path, help="folder to use and keep; default a temporary one")
    words.add_argument("--quick", action="store_true", help="without the demo")
    given = words.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        place = Path(temporary) if given.place is None else given.place.resolve()
        for name in ("dist", "env", "empty"):
            shutil.rmtree(place / name, ignore_errors=True)
        (place / "empty").mkdir(parents=True)
        wheel = build(place / "dist")
        tool = install(wheel, place / "env")
        help_s = run(tool, place / "empty", given.quick)
    print(
        f"tsvision --help: {help_s:.2f} s of wall time, the median of {_TRIES} (aim {HELP_AIM_S})"
    )
    if help_s > HELP_AIM_S:
        raise SystemExit(1)


def build(dist: Path) -> Path:
    """An sdist, and from it the wheel."""
    step([sys.executable, "-m", "build", "--outdir", str(dist), str(ROOT)], ROOT, "build")
    (wheel,), (sdist,) = dist.glob("*.whl"), dist.glob("*.tar.gz")
    for made in (sdist, wheel):
        print(f"  {made.name}: {made.stat().st_size / 1024:.0f} KB")
    return wheel


def install(wheel: Path, place: Path) -> Path:
    """The wheel in a new environment; its `tsvision`."""
    venv.create(place, with_pip=True)
    folder = place / ("Scripts" if os.name == "nt" else "bin")
    pip = [str(folder / "python"), "-m", "pip", "--disable-pip-version-check", "install", "--quiet"]
    step([*pip, str(wheel)], place, "install")
    return folder / "tsvision"


def run(tool: Path, empty: Path, quick: bool) -> float:
    """The commands that need files of the package, then the demo; the time of a help page."""
    home = ["-c", "import tsvision, synth, cli; print(tsvision.__file__)"]
    where = step([str(tool.with_name("python")), *home], empty, "import", show=False)
    if Path(where.strip()).is_relative_to(ROOT):
        raise SystemExit(f"the checkout was used: {where.strip()}")
    for command in COMMANDS:
        step([str(tool), *command.split()], empty, command, show=False)
    if not quick:
        step([str(tool), "demo"], empty, "demo")
        if not (empty / "demo" / "measured" / "report.html").is_file():
            raise SystemExit("the demo wrote no report")
    times_s = []
    for _ in range(_TRIES):
        begun_s = time.monotonic()
        subprocess.run([tool, "--help"], check=True, stdout=subprocess.DEVNULL, cwd=empty)
        times_s.append(time.monotonic() - begun_s)
    return sorted(times_s)[_TRIES // 2]


def step(command: list[str], folder: Path, name: str, show: bool = True) -> str:
    """Run one command without the caller's Python settings; what it printed."""
    clean = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "VIRTUAL_ENV"))}
    begun_s = time.monotonic()
    done = subprocess.run(command, cwd=folder, env=clean, capture_output=True, text=True)
    print(f"{name}: {time.monotonic() - begun_s:.0f} s", flush=True)
    if done.returncode:
        raise SystemExit(f"{name} failed ({done.returncode})\n{done.stdout}\n{done.stderr[-4000:]}")
    if show and name == "demo":
        print("  " + done.stdout.strip().replace("\n", "\n  "))
    return done.stdout


if __name__ == "__main__":
    main()
