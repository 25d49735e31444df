"""Coverage-guided fuzzing of everything that reads files (atheris / libFuzzer).

    python -m tests.bench.fuzz_readers [--seconds 60] [TARGET ...]

For each target the fuzzer mutates whole, valid files; a target must either answer or raise the one
error that its callers know. Prints runs and coverage; exit 1 and the file's bytes on a finding.
Needs `pip install atheris` (extra `fuzz`). tests/images/test_fuzz.py holds a short, seeded version.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

TARGETS = ("picture", "tiff", "video", "turns", "rig", "manifest", "summary")


def main() -> None:
    """Each target in a process of its own."""
    words = argparse.ArgumentParser(description="Fuzz the readers.")
    words.add_argument("targets", nargs="*", metavar="TARGET", help=", ".join(TARGETS))
    words.add_argument("--seconds", type=int, default=60)
    words.add_argument("--one", choices=TARGETS, help=argparse.SUPPRESS)
    words.add_argument("--place", help=argparse.SUPPRESS)
    given = words.parse_args()
    if given.one:
        fuzz(given.one, Path(given.place), given.seconds)
        return
    bad = 0
    for target in given.targets or TARGETS:
        with tempfile.TemporaryDirectory() as place:
            command = [sys.executable, "-m", "tests.bench.fuzz_readers", "--one", target]
            command += ["--place", place, "--seconds", str(given.seconds)]
            child = subprocess.run(command, capture_output=True, text=True)
            told = [x for x in child.stderr.splitlines() if "Done " in x or "cov:" in x]
            print(f"{target:9} exit {child.returncode}  {told[-1].strip() if told else ''}")
            if child.returncode:
                bad = 1
                print(child.stderr[-3000:])
                for crash in Path(place).glob("crash-*"):
                    print(crash.read_bytes()[:400])
    raise SystemExit(bad)


def fuzz(target: str, place: Path, seconds: int) -> None:
    """Run one target under libFuzzer, starting from valid files."""
    import atheris

    with atheris.instrument_imports(include=["tsvision"]):
        run = reader(target, place)
    corpus = place / "corpus"
    corpus.mkdir()
    for i, seed in enumerate(seeds(target)):
        (corpus / f"seed{i}").write_bytes(seed)
    flags = [f"-max_total_time={seconds}", "-max_len=20000", "-rss_limit_mb=4000", "-timeout=20"]
    flags += [f"-artifact_prefix={place}/", str(corpus)]
    atheris.Setup([sys.argv[0], *flags], run)
    atheris.Fuzz()


def reader(target: str, place: Path) -> Callable[[bytes], None]:
    """The function under test, taking a file's bytes."""
    import cv2

    from tsvision.batch.plan import plan
    from tsvision.errors import InputError
    from tsvision.images.frames import iter_frames, open_recording
    from tsvision.images.frames_picture import Unreadable, decode
    from tsvision.images.turns import read_turns
    from tsvision.results.read import read_summary
    from tsvision.rig import load_rig
    from tsvision.run import Request

    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)

    def as_file(name: str, use: Callable[[Path], object]) -> Callable[[bytes], None]:
        path = place / name

        def run(data: bytes) -> None:
            path.write_bytes(data)
            try:
                use(path)
            except InputError as problem:
                assert "\n" not in str(problem)

        return run

    def picture(data: bytes) -> None:
        try:
            decode(data)
        except Unreadable as problem:
            assert "\n" not in str(problem)

    def frames(path: Path) -> None:
        recording = open_recording(path)
        assert len(list(iter_frames(recording, 0, min(5, len(recording.files)), ahead=0))) > 0

    readers: dict[str, Callable[[bytes], None]] = {
        "picture": picture,
        "tiff": as_file("f.tif", frames),
        "video": as_file("f.mkv", frames),
        "turns": as_file("turns.csv", lambda path: read_turns(path, ("a.png", "b.png"))),
        "rig": as_file("rig.toml", load_rig),
        "manifest": as_file("m.csv", lambda path: plan(str(path), Request(""))),
        "summary": as_file("summary.json", lambda path: read_summary(path.parent)),
    }
    return readers[target]


def seeds(target: str) -> list[bytes]:
    """Small valid files."""
    import io

    import av
    import cv2
    import numpy as np
    import tifffile

    grey = np.arange(12 * 16, dtype=np.uint8).reshape(12, 16)
    if target == "picture":
        return [cv2.imencode(suffix, grey)[1].tobytes() for suffix in (".png", ".jpg", ".bmp")]
    held = io.BytesIO()
    if target == "tiff":
        tifffile.imwrite(held, np.stack([grey, grey]), photometric="minisblack")
    elif target == "video":
        with av.open(held, "w", format="matroska") as container:
            stream = container.add_stream("mpeg4", rate=25)
            stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"  # type: ignore[union-attr]
            for _ in range(4):
                frame = av.VideoFrame.from_ndarray(np.zeros((48, 64), np.uint8), format="gray")
                container.mux(stream.encode(frame.reformat(format="yuv420p")))  # type: ignore
            container.mux(stream.encode())  # type: ignore[union-attr]
    texts = {
        "turns": [b"frame,turns,time_s\n0,1,0.5\n1,2,\n", b"file;turns\na.png;1\n"],
        "rig": [b'[strings]\ncount = 2\n[view]\nroi_px = [0, 0, 5, 5]\nseparator_side = "left"\n'],
        "manifest": [b"recording,name,frames,strings.count\na,b,0:5,2\n"],
        "summary": [b'{"format": 1, "frames_total": 1, "rig": {}, "diameter_mm": {"value": 1}}'],
    }
    return texts.get(target) or [held.getvalue()]


if __name__ == "__main__":
    main()
