"""DATA for the comparison: displacement against turns, with each row's geometry."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from tsvision.data import table
from tsvision.diagnosis.table import Table, read_rows, table_from_rows
from tsvision.errors import InputError
from tsvision.records import Actuator, Rig, Strings

BLOCKS = 5  # of turns, left out in turn where there is one run under one load only


@dataclass(frozen=True)
class Sample:
    """Observed displacement and what the models need; all arrays have shape (n,).

    `known` maps the models' geometry keywords to arrays; `fold` says which group a row belongs
    to when one is left out, `folds` names them and `scheme` the way they were made.
    """

    name: str
    turns: np.ndarray
    displacement_mm: np.ndarray
    strings: np.ndarray
    known: dict[str, np.ndarray]
    fold: np.ndarray
    folds: tuple[str, ...]
    scheme: str
    notes: tuple[str, ...] = ()


def paper_sample() -> Sample:
    """The life-cycle table's twelve contractions with the N = 2 system's geometry."""
    pair = table("dimensions").set_index("strings").loc[2]
    rig = Rig(
        strings=Strings(2, float(table("diameter").set_index("strings")["diameter_mm"][1])),
        actuator=Actuator(
            twisting_zone_mm=float(pair["twisting_zone_mm"]),
            hole_distance_mm=float(pair["hole_distance_mm"]),
        ),
    )
    data = table("life_cycle").assign(bundle_diameter_mm=float(pair["bundle_diameter_mm"]))
    data["run"] = [f"{load:g} kgf" for load in data["load_kgf"]]
    keep = ["run", "turns", "load_kgf", "contraction_mm", "bundle_diameter_mm"]
    return _from_frame(data[keep], rig, "the paper's life-cycle table")


def read_sample(
    sources: Sequence[Path],
    rig: Rig,
    bundle_diameter_mm: float = math.nan,
    pitch_mm: float = math.nan,
) -> Sample:
    """One sample of one or more DATA files (long or wide form) or `measure` folders.

    Each source is a run of its own unless it names runs itself. Raises InputError.
    """
    frames = []
    for source in sources:
        if source.is_dir():
            frame, rig, pitch_mm = _measured(source, rig, pitch_mm)
        else:
            frame = pd.DataFrame(read_rows(source)[1])
        prefix = f"{source.stem} " if len(sources) > 1 else ""
        runs = frame["run"].astype(str) if "run" in frame else pd.Series("run", frame.index)
        frames.append(frame.assign(run=[f"{prefix}{run}".strip() for run in runs]))
    data = pd.concat(frames, ignore_index=True)
    if not math.isnan(bundle_diameter_mm):
        data["bundle_diameter_mm"] = bundle_diameter_mm
    return _from_frame(data, rig, ", ".join(s.name for s in sources), pitch_mm)


def _measured(folder: Path, rig: Rig, pitch_mm: float) -> tuple[pd.DataFrame, Rig, float]:
    """Displacement, diameter and pitch of a measured recording, and its rig where ours lacks."""
    from tsvision.comparison.measured import bundle_diameter_mm, locked_pitch_mm, rig_of_summary
    from tsvision.results import read_measurement

    measured = read_measurement(folder)
    frames = measured.frames
    if "displacement_mm" not in frames or frames["displacement_mm"].notna().sum() == 0:
        raise InputError(
            f"'{folder}' holds no displacement; put displacement_mm into the recording's turns.csv"
        )
    keep = frames[["turns", "displacement_mm", "load_N", "time_s"]].assign(
        bundle_diameter_mm=bundle_diameter_mm(frames)
    )
    if math.isnan(pitch_mm):
        pitch_mm = locked_pitch_mm(frames)
    return keep.astype(object), rig_of_summary(measured.summary, rig), pitch_mm


def _from_frame(data: pd.DataFrame, rig: Rig, name: str, pitch_mm: float = math.nan) -> Sample:
    rows = [{str(key): value for key, value in row.items()} for row in data.to_dict("records")]
    parsed = table_from_rows(list(data.columns), rows, rig, name)
    return _arrange(parsed, name, pitch_mm)


def _arrange(parsed: Table, name: str, pitch_mm: float) -> Sample:
    """Rows of displacement while winding, with geometry, folds and notes."""
    if "displacement_mm" not in parsed.observables:
        raise InputError(f"{name} holds no displacement_mm; the models predict nothing else")
    index = parsed.observables.index("displacement_mm")
    rows = np.flatnonzero((parsed.observable == index) & ~parsed.at.unwinding[parsed.condition])
    notes = list(parsed.notes)
    unwinding = int(np.sum(parsed.observable == index)) - rows.size
    if unwinding:
        notes.append(f"{unwinding} rows of unwinding were left out: no model here knows backlash")
    at = parsed.at.take(parsed.condition[rows])
    known = {
        "twisting_zone_mm": at.twisting_zone_mm,
        "hole_distance_mm": at.hole_distance_mm,
        "radius_mm": at.radius_mm,
        "string_diameter_mm": at.string_diameter_mm,
        "centre_radius_mm": at.radius_mm - at.string_diameter_mm / 2,
        "pitch_mm": np.full(rows.size, pitch_mm),
    }
    fold, folds, scheme = _folds(at.turns, at.load_N, parsed.run[rows], parsed.runs)
    return Sample(
        name=name,
        turns=at.turns,
        displacement_mm=parsed.value[rows],
        strings=at.strings,
        known={key: value for key, value in known.items() if np.all(np.isfinite(value))},
        fold=fold,
        folds=folds,
        scheme=scheme,
        notes=tuple(notes),
    )


def _folds(
    turns: np.ndarray, load_N: np.ndarray, run: np.ndarray, runs: tuple[str, ...]
) -> tuple[np.ndarray, tuple[str, ...], str]:
    """Groups to leave out: loads, else runs, else blocks of turns."""
    loads = np.unique(load_N[np.isfinite(load_N)])
    if loads.size > 1 and np.all(np.isfinite(load_N)):
        names = tuple(f"{load:.4g} N" for load in loads)
        return np.searchsorted(loads, load_N), names, "leave-one-load-out"
    present = np.unique(run)
    if present.size > 1:
        names = tuple(runs[k] for k in present)
        return np.searchsorted(present, run), names, "leave-one-run-out"
    edges = np.quantile(turns, np.linspace(0, 1, BLOCKS + 1)[1:-1])
    fold = np.searchsorted(edges, turns, side="right")
    names = tuple(
        f"{turns[fold == k].min():g}-{turns[fold == k].max():g} turns" for k in np.unique(fold)
    )
    return np.unique(fold, return_inverse=True)[1], names, "leave-one-fifth-of-the-turns-out"
