"""Rendered recordings of the onset battery on disk: pictures once, measured rows beside them.

Everything is written aside and renamed, so a run that was broken off goes on where it stopped.
The measured rows carry the fingerprint of the code that read them off the pictures; after a change
of that code only the recordings that it has not yet measured are measured `again`.
"""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import replace
from functools import cache
from pathlib import Path

import pandas as pd

import tsvision
from synth.recording import write_recording
from tests.bench.onset_cases import ORDER, Case
from tsvision.images.frames import open_recording
from tsvision.measures.recording import measure_frames
from tsvision.records import Rig
from tsvision.rig import load_rig
from tsvision.timeline.tables import tables

READING = ("images", "measures")  # the packages whose change makes the rows out of date


@cache
def fingerprint() -> str:
    """Of the sources that turn pictures into rows, as they were when this process began."""
    digest = hashlib.sha256()
    root = Path(tsvision.__file__).parent
    for package in READING:
        for path in sorted((root / package).rglob("*.py")):
            digest.update(str(path.relative_to(root)).encode() + path.read_bytes())
    return digest.hexdigest()[:12]


def pictures(case: Case, folder: Path) -> Path:
    """The recording's folder below `folder`, rendered unless it is there."""
    source = folder / case.name
    if not source.exists():
        write_recording(source, case.settings)
    return source


def is_measured(source: Path, again: bool) -> bool:
    """Rows are there and, if `again`, by the code as it is now."""
    stamp = source / "measured.json"
    if not stamp.exists():
        return False
    return not again or json.loads(stamp.read_text())["code"] == fingerprint()


def measured(source: Path, again: bool = False) -> tuple[pd.DataFrame, pd.DataFrame, Rig]:
    """(frames, knots, rig) of a rendered recording, from disk where they are fit for use."""
    rig = load_rig(source / "rig.toml")
    if not is_measured(source, again):
        code = fingerprint()
        frames, knots = tables(measure_frames(open_recording(source, rig)))
        _replace(source / "measured_frames.parquet", frames)
        _replace(source / "measured_knots.parquet", knots)
        (source / "measured.json").write_text(json.dumps({"code": code}))
    frames = pd.read_parquet(source / "measured_frames.parquet")
    return frames, pd.read_parquet(source / "measured_knots.parquet"), rig


def _replace(path: Path, table: pd.DataFrame) -> None:
    aside = path.with_suffix(".partial")
    table.to_parquet(aside)
    os.replace(aside, path)


def as_rendered(case: Case, source: Path) -> Case:
    """The case with the truth that was written beside its pictures."""
    story = json.loads((source / "truth.json").read_text())["frames"]
    names = ["frame", "turns", "diameter_mm", "coil_amplitude_mm", "unevenness"]
    truth = pd.DataFrame(story)[names].assign(level=[ORDER.index(f["phase"]) for f in story])
    truth["diameter_mm"] = pd.to_numeric(truth["diameter_mm"], errors="coerce")
    knots = tuple(
        tuple((k["centre_mm"], k["length_mm"], k["max_diameter_mm"]) for k in f["knots"])
        for f in story
    )
    return replace(case, truth=truth, knots=knots)
