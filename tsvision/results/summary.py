"""summary.json: the recording in one page for programs; strict JSON, no NaN, no clock, no paths
of the machine, so that the same input gives the same bytes."""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import math
import platform
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from tsvision import __version__
from tsvision.jsonable import jsonable, printable
from tsvision.records import Onset, Recording, Rig
from tsvision.results.schema import FORMAT
from tsvision.rig import rig_values

_LIBRARIES = ("numpy", "scipy", "pandas", "opencv-python-headless", "numba", "pyarrow", "av")
_TWISTED = ("overtwist", "local overtwist", "knotted", "irreversible")
_FEW = 3
_DECIDING = ("images", "measures", "timeline", "results")  # besides the files at the top


def make_summary(
    recording: Recording,
    frames: pd.DataFrame,
    onsets: Mapping[str, Onset],
    digests: Mapping[Path, str],
    more: Mapping[str, Any] = {},
    first: int = 0,
) -> dict[str, Any]:
    """All of summary.json. `frames` is the final table; `digests` the sha256 of each input file;
    `first` the number of the first frame measured."""
    flagged = frames["flags"].astype(str)
    counts = Counter(name for text in flagged for name in text.split("|") if name)
    return {
        "tool": "tsvision",
        "format": FORMAT,
        "key": content_key(recording, digests, first),
        "input": describe_input(recording, digests),
        "frames_total": len(frames),
        "frames_measured": int(frames["diameter_px"].notna().sum()),
        "frames_flagged": int((flagged != "").sum()),
        "flags": dict(sorted(counts.items())),
        "diameter_mm": typical(frames, "diameter_mm"),
        "diameter_px": typical(frames, "diameter_px"),
        "mm_per_px": typical(frames, "mm_per_px"),
        "helix_angle_deg": typical_angle_deg(frames),
        "handedness": _majority(frames["handedness"]),
        **{name: asdict(onset) for name, onset in onsets.items()},
        **more,
        "notes": list(recording.notes),
        "rig": rig_values(recording.rig),
        "rig_source": _sources(recording.rig),
        "versions": versions(),
    }


def typical(frames: pd.DataFrame, column: str) -> dict[str, Any]:
    """Median over the measured frames; `sd` is the standard uncertainty of that value (the
    typical frame's own, which repeats from frame to frame, or the scatter's if that is larger),
    `scatter` the robust standard deviation from frame to frame."""
    return _typical(
        frames[column].to_numpy(float), frames[f"{column}_sd"].to_numpy(float), "all frames"
    )


def typical_angle_deg(frames: pd.DataFrame) -> dict[str, Any]:
    """The angle beside the separator, once the bundle is laid: frames from overtwist on; where
    there are fewer than three of them, the one with the most turns (before, it still grows)."""
    angle = np.degrees(frames["helix_angle_rad"].to_numpy(float))
    sd = np.degrees(frames["helix_angle_rad_sd"].to_numpy(float))
    laid = frames["phase"].astype(str).str.replace("_", " ").isin(_TWISTED).to_numpy()
    laid &= np.isfinite(angle)
    if laid.sum() >= _FEW:
        return _typical(angle[laid], sd[laid], "frames from overtwist on")
    turns = np.where(np.isfinite(angle), np.abs(frames["turns"].to_numpy(float)), np.nan)
    if not np.isfinite(turns).any():
        return _typical(angle, sd, "all frames")
    most = [int(np.nanargmax(turns))]
    return _typical(angle[most], sd[most], "the frame with the most turns")


def _typical(value: np.ndarray, sd: np.ndarray, over: str) -> dict[str, Any]:
    good = np.isfinite(value)
    if not good.any():
        return {"value": None, "sd": None, "scatter": None, "frames": 0, "over": over}
    middle = float(np.median(value[good]))
    count = int(good.sum())
    own = sd[good][np.isfinite(sd[good])]
    frame_sd = float(np.median(own)) if len(own) else math.nan
    scatter = float(1.4826 * np.median(np.abs(value[good] - middle))) if count > 1 else math.nan
    sd_of_middle = float(np.fmax(frame_sd, scatter * 1.2533 / math.sqrt(count)))
    return {"value": middle, "sd": sd_of_middle, "scatter": scatter, "frames": count, "over": over}


def _majority(values: pd.Series) -> str | None:
    counts = Counter(v for v in values.astype(str) if v in ("S", "Z"))
    return counts.most_common(1)[0][0] if counts else None


def describe_input(recording: Recording, digests: Mapping[Path, str]) -> dict[str, Any]:
    """Names and sha256 of the files, and one sha256 over them all."""
    folder = recording.source if recording.kind == "folder" else recording.source.parent
    files = [
        {"name": printable(path.relative_to(folder).as_posix()), "sha256": digest}
        for path, digest in digests.items()
    ]
    together = hashlib.sha256()
    for file in files:
        together.update(f"{len(file['name'])}:{file['name']}:{file['sha256']}\n".encode())
    return {
        "name": printable(recording.source.resolve().name),
        "kind": recording.kind,
        "sha256": together.hexdigest(),
        "files": files,
    }


def content_key(recording: Recording, digests: Mapping[Path, str], first: int = 0) -> str:
    """sha256 of all that decides the result: pictures, their order, turns, rig, the program."""
    known = hashlib.sha256()
    for part in (
        json.dumps([FORMAT, __version__, code_digest(), first, recording.kind]),
        describe_input(recording, digests)["sha256"],
        json.dumps([printable(name) for name in recording.files]),
        json.dumps(jsonable(rig_values(recording.rig)), sort_keys=True),
    ):
        known.update(part.encode() + b"\n")
    for name in ("turns", "time_s", "displacement_mm", "load_N", "cycle"):
        known.update(np.ascontiguousarray(getattr(recording, name), dtype="<f8").tobytes())
    return known.hexdigest()


def diagnosis_key(summary: Mapping[str, Any]) -> str:
    """sha256 of all that decides the verdict on a measured recording: its key, the program."""
    package = Path(__file__).parents[1]
    program = digest_of_sources(package, ("diagnosis", "mechanisms", "models"))
    return hashlib.sha256(f"{summary.get('key')}\n{program}\n".encode()).hexdigest()


@lru_cache(maxsize=1)
def code_digest() -> str:
    """sha256 of the sources that decide a measurement, so that an updated program, whatever its
    version says, does not take old results for its own."""
    return digest_of_sources(Path(__file__).parents[1], _DECIDING)


def digest_of_sources(package: Path, parts: Sequence[str]) -> str:
    """sha256 over the modules at the top of a package and all below its folders `parts`, however
    deep: a part that moves into a folder of its own must not drop out."""
    files = [*package.glob("*.py"), *(p for part in parts for p in (package / part).rglob("*.py"))]
    together = hashlib.sha256()
    for path in sorted(files):
        together.update(f"{path.relative_to(package).as_posix()}:{sha256_of(path)}\n".encode())
    return together.hexdigest()


def sha256_of(path: Path) -> str:
    """Hex digest of a file; "unreadable" when it cannot be read."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return "unreadable"


def versions() -> dict[str, str]:
    """What computed the numbers."""
    found = {"tsvision": __version__, "python": platform.python_version()}
    for name in _LIBRARIES:
        found[name] = importlib.metadata.version(name)
    return found


def _sources(rig: Rig) -> dict[str, str]:
    known = {k: v for k, v in rig.source.items() if v != "not given"}
    return {k: printable(Path(v).name) for k, v in known.items()}
