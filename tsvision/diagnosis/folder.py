"""Folders that `tsvision measure` wrote, as DATA: displacement, D, S, pitch, else angle.

The pitch tells the turns that lie in the strands better than angle and turns seen do: it needs
neither the edges (D) nor the place where the strands meet. Each folder is a run. What a frame's
flags make doubtful is left out; the rig that the measurement used comes from its summary, and a
rig given now wins over it.
"""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from tsvision.diagnosis.frame_readings import (
    KNOTTED,
    STRAIGHT,
    coiled_from,
    gap_in,
    middle_of,
    number_of,
    seen_coiled,
    seen_in,
    zone_seen_mm,
)
from tsvision.diagnosis.observations import Sighting, Table
from tsvision.diagnosis.rows import NAN
from tsvision.diagnosis.table import table_from_rows
from tsvision.errors import InputError
from tsvision.records import Rig

BAD = {"UNREADABLE", "WRONG_SIZE", "BLANK", "NO_BUNDLE", "TRACK_LOST", "CAMERA_MOVED"}
# The helix is read beside the separator: as a mean over the zone it carries a gain of its own. An
# edge on a strand lit from one side is 0.5 to 2 px off, which acts on all diameters of a recording
# alike: what the measurement states as the diameters' uncertainty is mostly that. Holes that do not
# lie quite in the picture's plane seem nearer to each other, and a string leaves its hole at a rim.
GAIN_SD = {
    "diameter_mm": 0.02,
    "helix_angle_deg": 0.03,
    "pitch_mm": 0.01,
    "hole_distance_mm": 0.02,
    "turns_seen": 0.02,
}
COMMON = 3.0  # times the median stated uncertainty of D
EACH_RUN = 0.3  # times the same: how an edge is misread is learnt for each recording anew
COILED_COMMON = 1.5  # times the uncertainty of the turns seen: what repeats at equal turns
ZONE_SHARE = 0.05  # of L: by which turns seen and pitch of the straight bundle may contradict it
HEADER = ("run", "turns", "load_N", "branch", "time_s", "cycle", "observable", "value", "value_sd")
ONSETS = {"overtwist_onset": "coiling", "knot_onset": "knot_absorption"}
CONSTANTS = {
    "strings": "strings.count",
    "string_diameter_mm": "strings.diameter_mm",
    "twisting_zone_mm": "actuator.twisting_zone_mm",
    "hole_distance_nominal_mm": "actuator.hole_distance_mm",
}


def table_from_folders(folders: Sequence[Path], rig: Rig) -> Table:
    """The table of one or more measured folders; InputError where a folder holds none."""
    rows: list[dict] = []
    notes: list[str] = []
    for folder in folders:
        rows += _rows(folder, rig, _run_name(folder, folders), notes)
    if not rows:
        raise InputError(
            f"'{folders[0]}': no frame has turns and a displacement, diameter or angle; "
            "give turns.csv (with displacement_mm) and a scale when measuring"
        )
    header = [*HEADER, *CONSTANTS]
    table = table_from_rows(header, rows, rig, str(folders[0]))
    gains = {name: sd for name, sd in GAIN_SD.items() if name in table.observables}
    drifts, run_gains = {}, {}
    if "diameter_mm" in gains:
        gains["diameter_mm"] = math.hypot(gains["diameter_mm"], COMMON * _edges_sd(table))
        run_gains["diameter_mm"] = EACH_RUN * _edges_sd(table)
        # What acts on all diameters alike still wanders with the strands' shading.
        seen = table.value[table.observable == table.observables.index("diameter_mm")]
        drifts["diameter_mm"] = 2.0 * _edges_sd(table) * float(np.median(seen))
    if "pitch_mm" in gains:
        # Frames of equal turns show the same strands in the same light, under any load: most of
        # what a pitch is off by repeats.
        own = table.value_sd[table.observable == table.observables.index("pitch_mm")]
        if np.all(np.isfinite(own)):
            drifts["pitch_mm"] = float(np.exp(np.mean(np.log(own))))
    if "turns_seen" in gains:
        own = table.value_sd[table.observable == table.observables.index("turns_seen")]
        drifts["turns_seen"] = 2.0 * COILED_COMMON * float(np.exp(np.mean(np.log(own))))
    scale = _scale_sd(folders[0])
    return replace(
        table,
        drifts=drifts,
        run_gain_sd=run_gains,
        sightings=tuple(s for folder in folders for s in _sightings(folder)),
        gain_sd={**table.gain_sd, **gains},
        notes=(*notes, *table.notes),
        camera_sd=table.camera_sd if math.isnan(scale) else max(scale, 1e-4),
    )


def _sightings(folder: Path) -> list[Sighting]:
    """What the onsets in the summary say of coils and of knots."""
    _, summary = _read(folder)
    found = []
    for key, mechanism in ONSETS.items():
        onset = summary.get(key) or {}
        status = onset.get("status")
        if status == "not_observed":
            found.append(Sighting(mechanism, observed=False))
        elif status == "observed":
            low, high = number_of(onset.get("low")), number_of(onset.get("high"))
            if low <= high:
                found.append(Sighting(mechanism, True, low, high))
    return found


def _edges_sd(table: Table) -> float:
    """The median uncertainty of D relative to D."""
    rows = table.observable == table.observables.index("diameter_mm")
    return float(np.nan_to_num(np.median(table.value_sd[rows] / table.value[rows])))


def _run_name(folder: Path, folders: Sequence[Path]) -> str:
    """The folder's own name, longer where two folders share it."""
    same = [f for f in folders if f.name == folder.name]
    return folder.name if len(same) == 1 else str(folder)


def _rows(folder: Path, rig: Rig, run: str, notes: list[str]) -> list[dict]:
    """The observations of one folder; what is doubtful about it is added to `notes`."""
    frames, summary = _read(folder)
    constants = _constants(summary.get("rig") or {}, rig)
    # What hung there the recording has to say; of a load that only the rig given now states, the
    # reader of rows is told nothing, and takes it from there as a default.
    told = number_of((summary.get("rig") or {}).get("actuator.load_N"))
    own_load = NAN if math.isnan(told) else constants["load_N"]
    zone_mm = constants["twisting_zone_mm"]
    peak, knotted = -math.inf, False
    turned = [abs(number_of(f.get("turns"))) for f in frames]
    most = max((t for t in turned if not math.isnan(t)), default=NAN)
    coiled = coiled_from(frames, turned)
    rows = []
    counts = _ends_are_right(zone_seen_mm(frames, turned, coiled), zone_mm, run, notes)
    # One reading of S a recording, which tells nothing of turns: it stands in their midst.
    gap_at = middle_of([i for i, f in enumerate(frames) if gap_in(f, constants)], turned)
    for i, (frame, turns) in enumerate(zip(frames, turned, strict=True)):
        flags = set(filter(None, (frame.get("flags") or "").split("|")))
        if math.isnan(turns) or flags & BAD:
            continue
        peak = max(peak, turns)
        phase = frame.get("phase") or STRAIGHT
        knotted = knotted or phase in KNOTTED
        load = number_of(frame.get("load_N"))
        common = {
            "run": run,
            "turns": turns,
            "load_N": own_load if math.isnan(load) else load,
            "branch": "unwind" if peak == most and turns < most else "wind",
            "time_s": number_of(frame.get("time_s")),
            "cycle": number_of(frame.get("cycle")),
            **{name: constants[name] for name in CONSTANTS},
        }
        straight = turns < coiled and not knotted
        rows += [{**common, **seen} for seen in seen_in(frame, flags, turns, zone_mm, straight)]
        if counts and not straight and not knotted:
            rows += [{**common, **seen} for seen in seen_coiled(frame, flags)]
        if i == gap_at:
            rows.append({**common, **gap_in(frame, constants)})
    return rows


def _ends_are_right(seen_mm: float, zone_mm: float, run: str, notes: list[str]) -> bool:
    """Whether the turns of the straight bundle were counted over a zone of about the stated L."""
    if abs(seen_mm - zone_mm) < ZONE_SHARE * zone_mm:
        return True
    if not math.isnan(seen_mm):
        notes.append(
            f"{run}: turns and pitch of the straight bundle make up a zone of {seen_mm:.1f} mm, "
            f"stated are {zone_mm:.1f}: was the connector found, is L right? turns are not read"
        )
    return False


def _read(folder: Path) -> tuple[list[dict], dict]:
    try:
        with open(folder / "frames.csv", newline="", encoding="utf-8") as file:
            frames = list(csv.DictReader(file))
        summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as problem:
        raise InputError(
            f"'{folder}' is no folder of `tsvision measure` ({problem}); measure first"
        ) from problem
    return frames, summary


def _constants(used: dict, rig: Rig) -> dict[str, float]:
    now = {
        "strings.count": NAN if rig.strings.count is None else float(rig.strings.count),
        "strings.diameter_mm": rig.strings.diameter_mm,
        "actuator.twisting_zone_mm": rig.actuator.twisting_zone_mm,
        "actuator.hole_distance_mm": rig.actuator.hole_distance_mm,
        "actuator.load_N": rig.actuator.load_N,
    }
    found = {
        key: number_of(used.get(key)) if math.isnan(value) else value for key, value in now.items()
    }
    constants = {name: found[key] for name, key in CONSTANTS.items()}
    return {**constants, "load_N": found["actuator.load_N"]}


def _scale_sd(folder: Path) -> float:
    """Relative standard deviation of the camera's scale, from the first frame that tells."""
    frames, _ = _read(folder)
    for frame in frames:
        scale, sd = number_of(frame.get("mm_per_px")), number_of(frame.get("mm_per_px_sd"))
        if scale > 0 and sd >= 0:
            return sd / scale
    return NAN
