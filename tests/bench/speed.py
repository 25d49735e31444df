"""Speed end to end: from files to rows, as a share of the decode rate alone.

    python -m tests.bench.speed [--frames 96] [--json]

Renders 24 frames of 1920x1080 per case (straight, coiled), repeats them forth and back as a PNG
folder and as two H.264 films, and prints for each: decoding alone, decoding and measuring, their
ratio in CPU time of the one core that a process is held to (else its two threads, one of which
decodes ahead, get in each other's way on the halves of a core), the mean and the median time of
measuring a frame, and how two processes at once do against one: in wall time (which a busy machine
does bend) and in CPU time (what they take from each other: 2 where nothing is shared). `free` is
the share in wall time of a process that may use every core, its decoding thread one and its
measuring another, still of what one core decodes. The first frames of a recording, in which its
looks are learnt once, are left out of the rates.

Of the films one has the 20 Mbit/s that cameras write at this size and rate, most of which is the
sensor's noise; the other is left to the encoder, which takes that noise out: at 0.3 Mbit/s there is
hardly anything to decode.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from fractions import Fraction
from pathlib import Path
from typing import Any, TypeVar

Thing = TypeVar("Thing")
RENDERED = 24
UNTIMED = 6  # in which what is compiled is loaded as well
DECODED = 2  # times: the first reads from the disk
MEASURED = 0.9  # of the frames: what is not measured is not fast
CASES = {"straight": "10:11.15:0.05", "coiled": "34:35.15:0.05"}  # film-like steps
AIMS = {"straight": 0.8, "coiled": 0.4}
RATE_PER_S = 50
CAMERA_BITS = 20_000_000  # a second
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")


def main() -> None:
    """Render, run every case in processes of their own, print the table."""
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    words.add_argument("--frames", type=int, default=96)
    words.add_argument("--case", action="append", choices=list(CASES), help="default: all")
    words.add_argument("--alone", action="store_true", help="do not run two processes at once")
    words.add_argument("--json", action="store_true")
    words.add_argument("--one", help=argparse.SUPPRESS)  # a child process: measure this recording
    words.add_argument("--core", type=int, help=argparse.SUPPRESS)  # of the child
    given = words.parse_args()
    if given.one:
        if given.core is not None:
            os.sched_setaffinity(0, {given.core})
        print(json.dumps(run_one(Path(given.one))))
        return
    with tempfile.TemporaryDirectory() as place:
        rows = [
            row
            for case in given.case or CASES
            for row in run_case(Path(place), case, given.frames, given.alone)
        ]
    if given.json:
        print(json.dumps(rows, indent=2))
        return
    head = f"{'case':9} {'kind':7} {'Mbit/s':>7} {'decode/s':>9} {'whole/s':>8} {'share':>6}"
    print(
        f"{head} {'free':>5} {'aim':>5} {'ms mean':>8} {'median':>7} {'2 of 1 wall':>12} {'cpu':>5}"
    )
    for r in rows:
        print(
            f"{r['case']:9} {r['kind']:7} {r['mbit_per_s']:7.1f} {r['decode_per_cpu_s']:9.1f} "
            f"{r['whole_per_cpu_s']:8.1f} {r['share']:6.2f} {r['free']:5.2f} {r['aim']:5.2f} "
            f"{r['measure_ms']:8.1f} {r['median_ms']:7.1f} "
            f"{r['two_of_one']:12.2f} {r['two_of_one_cpu']:5.2f}"
        )


def run_case(place: Path, case: str, count: int, alone: bool) -> list[dict[str, Any]]:
    """The PNG folder and the films of one case."""
    rendered = render(place, case)
    sources = {
        "png": png_folder(place / f"{case}_png", rendered, count),
        "camera": film(place / f"{case}_camera.mp4", rendered, count, bits_per_s=CAMERA_BITS),
        "encoder": film(place / f"{case}.mp4", rendered, count),
    }
    return [
        {
            "case": case,
            "kind": kind,
            "aim": AIMS[case],
            "mbit_per_s": bits_of(p) * RATE_PER_S / count / 1e6,
            **timed(p, alone),
        }
        for kind, p in sources.items()
    ]


def bits_of(source: Path) -> int:
    """Of a film or of a folder's pictures."""
    files = list(source.glob("*.png")) if source.is_dir() else [source]
    return 8 * sum(f.stat().st_size for f in files)


def timed(source: Path, only_alone: bool) -> dict[str, Any]:
    """One process alone on one core, one on all, then two at once on one each."""
    cores = sorted(os.sched_getaffinity(0))
    alone = finish(start(source, cores[0]))
    alone["free"] = alone["decode_s"] / finish(start(source, None))["wall_s"]
    if only_alone:
        return {**alone, "two_of_one": float("nan"), "two_of_one_cpu": float("nan")}
    both = [finish(child) for child in [start(source, cores[0]), start(source, cores[-1])]]
    alone["two_of_one"] = sum(alone["wall_s"] / one["wall_s"] for one in both)
    alone["two_of_one_cpu"] = sum(alone["cpu_s"] / one["cpu_s"] for one in both)
    return alone


def start(source: Path, core: int | None) -> subprocess.Popen[str]:
    """A child process that measures `source` on one core, or on all, one thread a library."""
    command = [sys.executable, "-m", "tests.bench.speed", "--one", str(source)]
    command += ["--core", str(core)] if core is not None else []
    environment = {**os.environ, **dict.fromkeys(ONE_THREAD, "1")}
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)


def finish(child: subprocess.Popen[str]) -> dict[str, Any]:
    """Its answer."""
    out, _ = child.communicate()
    if child.returncode:
        raise SystemExit(f"the child failed ({child.returncode})")
    return json.loads(out)


def run_one(source: Path) -> dict[str, Any]:
    """Decode alone, then decode and measure, in CPU seconds of this process."""
    import cv2
    import numpy as np

    from tsvision.images.frames import iter_frames
    from tsvision.measures.recording import measure_frames
    from tsvision.run import Request, open_request

    cv2.setNumThreads(1)
    recording, _ = open_request(Request(source, turns_file=turns_of(source)))
    count = len(recording.files)
    decodes_s = []
    for _ in range(DECODED):
        begun_s = time.process_time()
        decoded = sum(f.pixels is not None for f in iter_frames(recording, threads=1, color=False))
        decodes_s.append(time.process_time() - begun_s)
    decode_s = min(decodes_s)
    results = measure_frames(recording)
    begun_s = time.process_time()
    rows = [next(results).row for _ in range(UNTIMED)]  # the looks are learnt here, once
    learn_s = time.process_time() - begun_s
    begun_s, begun_wall_s = time.process_time(), time.monotonic()
    done_s = [begun_s]
    for result in results:
        rows.append(result.row)
        done_s.append(time.process_time())
    whole_s, wall_s = done_s[-1] - begun_s, time.monotonic() - begun_wall_s
    timed_count = count - UNTIMED
    decode_s *= timed_count / count
    measured = int(np.isfinite([row.diameter_px for row in rows]).sum())
    assert decoded == count
    if measured < MEASURED * count:
        raise SystemExit(f"{source.name}: only {measured} of {count} frames measured")
    return {
        "frames": count,
        "measured": measured,
        "learn_s": learn_s,
        "decode_per_cpu_s": timed_count / decode_s,
        "whole_per_cpu_s": timed_count / whole_s,
        "share": decode_s / whole_s,
        "measure_ms": 1000 * (whole_s - decode_s) / timed_count,
        "median_ms": 1000 * (float(np.median(np.diff(done_s))) - decode_s / timed_count),
        "wall_s": wall_s,
        "cpu_s": whole_s,
        "decode_s": decode_s,
    }


def render(place: Path, case: str) -> Path:
    """24 frames with sensor noise."""
    out = place / f"{case}_rendered"
    command = [sys.executable, "-m", "cli.main", "synth", "--out", str(out)]
    command += ["--turns", CASES[case], "--size", "1920x1080", "--preset", "bench", "--seed", "3"]
    begun_s = time.monotonic()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    print(f"{case}: rendered in {time.monotonic() - begun_s:.0f} s", file=sys.stderr, flush=True)
    return out


def there_and_back(things: list[Thing], count: int) -> list[Thing]:
    """Pictures or their turns forth and back, so that one always follows its neighbour."""
    round_trip = things + things[-2:0:-1]
    return [round_trip[i % len(round_trip)] for i in range(count)]


def pictures_of(rendered: Path) -> list[Path]:
    """The frames of a rendered recording."""
    from tsvision.images.frames import input_files, open_recording

    return list(input_files(open_recording(rendered)))[:RENDERED]


def turns_of(source: Path) -> Path:
    """The table of motor turns that goes with a folder or film."""
    return source.with_name(f"{source.name}.turns.csv")


def write_turns(source: Path, rendered: Path, count: int) -> None:
    """Turns forth and back like the pictures: turns that contradict them would cost a search in
    every frame."""
    import pandas as pd

    known = pd.read_csv(rendered / "turns.csv")["turns"].to_list()[:RENDERED]
    table = pd.DataFrame({"frame": range(count), "turns": there_and_back(known, count)})
    table.to_csv(turns_of(source), index=False)


def png_folder(folder: Path, rendered: Path, count: int) -> Path:
    """The pictures as a folder, linked."""
    folder.mkdir()
    for i, picture in enumerate(there_and_back(pictures_of(rendered), count)):
        os.link(picture, folder / f"f{i:05d}.png")
    (folder / "rig.toml").write_bytes((rendered / "rig.toml").read_bytes())
    write_turns(folder, rendered, count)
    return folder


def film(
    path: Path, rendered: Path, count: int, size: str = "1920x1080", bits_per_s: int | None = None
) -> Path:
    """The pictures as H.264, of as many bits as the encoder finds enough unless told."""
    import av
    import cv2

    with av.open(str(path), "w") as container:
        stream: Any = container.add_stream(
            "libx264", rate=RATE_PER_S, options={"preset": "veryfast"}
        )
        stream.width, stream.height = map(int, size.split("x"))
        stream.pix_fmt = "yuv420p"
        if bits_per_s:
            stream.bit_rate = bits_per_s
        stream.time_base = Fraction(1, RATE_PER_S)
        for i, picture in enumerate(there_and_back(pictures_of(rendered), count)):
            pixels: Any = cv2.imread(str(picture))
            frame = av.VideoFrame.from_ndarray(pixels, format="bgr24")
            frame.pts = i
            container.mux(stream.encode(frame.reformat(format="yuv420p")))
        container.mux(stream.encode())
    path.with_suffix(".rig.toml").write_bytes((rendered / "rig.toml").read_bytes())
    write_turns(path, rendered, count)
    return path


if __name__ == "__main__":
    main()
