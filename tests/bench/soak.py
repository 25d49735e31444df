"""Memory over a long recording: it must not grow with the number of frames.

    python -m tests.bench.soak [--frames 20000] [--width 640]

Renders 24 frames, makes them one long H.264 film (forth and back), measures it into a folder as a
user would, and prints the process's memory, sampled after each tenth of the frames, and the rate.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tests.bench.speed import CASES, film

PAGE_BYTES = 4096


def main() -> None:
    """Render, film, measure, print."""
    words = argparse.ArgumentParser(description="Memory over a long recording.")
    words.add_argument("--frames", type=int, default=20_000)
    words.add_argument("--width", type=int, default=640)
    given = words.parse_args()
    with tempfile.TemporaryDirectory() as place:
        rendered = Path(place) / "rendered"
        size = f"{given.width}x{given.width * 9 // 16}"
        command = [sys.executable, "-m", "cli.main", "synth", "--out", str(rendered)]
        command += ["--turns", CASES["straight"], "--size", size, "--preset", "clean"]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        source = film(Path(place) / "long.mp4", rendered, given.frames, size)
        soak(source, Path(place) / "out")


def soak(source: Path, out: Path) -> None:
    """Measure and watch."""
    from tsvision.run import measure_to_folder

    seen: list[float] = []
    begun_s = time.monotonic()

    def watch(done: int, total: int) -> None:
        if done % max(1, total // 10) == 0:
            seen.append(resident_mb())
            rate = done / (time.monotonic() - begun_s)
            print(f"{done:7d} frames  {seen[-1]:7.1f} MB  {rate:6.1f} frames/s", flush=True)

    measure_to_folder(source, out, turns_per_frame=0.01, progress=watch)
    print(f"growth from a tenth to the end: {seen[-1] - seen[0]:.1f} MB")


def resident_mb() -> float:
    """Memory that the process holds now (Linux)."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * PAGE_BYTES / 1e6


if __name__ == "__main__":
    main()
