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

from tsvision.diagnosis.observations import Sighting, Table
from tsvision.diagnosis.rows import NAN
from tsvision.diagnosis.table import table_from_rows
from tsvision.errors import InputError
from tsvision.records import Rig

BAD = {"UNREADABLE", "WRONG_SIZE", "BLANK", "NO_BUNDLE", "TRACK_LOST", "CAMERA_MOVED"}
# Where hardly a lobe is seen, strands that still run apart are easily taken for a bundle.
NO_DIAMETER = {"NO_SCALE", "TOO_FEW_TURNS", "CLIPPED", "FEW_LOBES", "ENVELOPE_ONLY", "NO_PITCH"}
NO_PITCH = {"ENVELOPE_ONLY", "NO_PITCH", "AMBIGUOUS_HARMONIC", "TOO_FEW_TURNS", "FEW_LOBES"}
NO_HELIX = {"ENVELOPE_ONLY", "NO_PITCH", "AMBIGUOUS_HARMONIC", "TOO_FEW_TURNS"}
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
LEAST_SD = {"diameter_mm": 0.004, "helix_angle_deg": 0.2, "hole_distance_mm": 0.02}
LEAST_TURNS = 0.1  # what a pitch tells of the turns in the strands, at best
COILED_SD = 0.02  # of the turns seen where the bundle coils: 68 in 100 of rendered frames
COILED_COMMON = 1.5  # times the uncertainty of the turns seen: what repeats at equal turns
ZONE_SHARE = 0.05  # of L: by which turns seen and pitch of the straight bundle may contradict it
FEWEST_TURNS = 1.0
STEEPEST_RAD = math.radians(70.0)  # strands side by side cannot be laid steeper
STRAIGHT = "twist"  # the phase in which the zone's mean helix is the one beside the separator
KNOTTED = {"knotted", "irreversible"}  # from here on, knots keep turns that the motor takes back
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
            low, high = _number(onset.get("low")), _number(onset.get("high"))
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
    zone_mm = constants["twisting_zone_mm"]
    peak, knotted = -math.inf, False
    turned = [abs(_number(f.get("turns"))) for f in frames]
    most = max((t for t in turned if not math.isnan(t)), default=NAN)
    coiled = _coiled_from(frames, turned)
    rows = []
    zone_seen_mm = _zone_seen_mm(frames, turned, coiled)
    counts = abs(zone_seen_mm - zone_mm) < ZONE_SHARE * zone_mm  # between the right ends
    if not counts and not math.isnan(zone_seen_mm):
        notes.append(
            f"{run}: turns and pitch of the straight bundle make up a zone of {zone_seen_mm:.1f} "
            f"mm, stated are {zone_mm:.1f}: was the connector found, is L right? turns are not read"
        )
    # One reading of S a recording, which tells nothing of turns: it stands in their midst.
    gap_at = _middle_of([i for i, f in enumerate(frames) if _gap(f, constants)], turned)
    for i, (frame, turns) in enumerate(zip(frames, turned, strict=True)):
        flags = set(filter(None, (frame.get("flags") or "").split("|")))
        if math.isnan(turns) or flags & BAD:
            continue
        peak = max(peak, turns)
        phase = frame.get("phase") or STRAIGHT
        knotted = knotted or phase in KNOTTED
        load = _number(frame.get("load_N"))
        common = {
            "run": run,
            "turns": turns,
            "load_N": constants["load_N"] if math.isnan(load) else load,
            "branch": "unwind" if peak == most and turns < most else "wind",
            "time_s": _number(frame.get("time_s")),
            "cycle": _number(frame.get("cycle")),
            **{name: constants[name] for name in CONSTANTS},
        }
        straight = turns < coiled and not knotted
        rows += [{**common, **seen} for seen in _seen(frame, flags, turns, zone_mm, straight)]
        if counts and not straight and not knotted:
            rows += [{**common, **seen} for seen in _seen_coiled(frame, flags)]
        if i == gap_at:
            rows.append({**common, **_gap(frame, constants)})
    return rows


def _zone_seen_mm(frames: list[dict], turned: list[float], coiled: float) -> float:
    """The zone that turns and pitch of the straight bundle make up; NaN where none is read."""
    made_up = []
    for frame, turns in zip(frames, turned, strict=True):
        seen, pitch, apex = (_number(frame.get(k)) for k in ("turns_seen", "pitch_mm", "apex_mm"))
        if FEWEST_TURNS < turns < coiled and not math.isnan(seen + pitch + apex):
            made_up.append(apex + (seen - 0.25) * pitch)
    return float(np.median(made_up)) if made_up else NAN


def _seen_coiled(frame: dict, flags: set[str]) -> list[dict]:
    """Turns of strands and coils together, where the pitch alone does not tell the turns. Knots
    hide up to a sixth of theirs on small pictures: with them, nothing is said."""
    seen, sd = _number(frame.get("turns_seen")), _number(frame.get("turns_seen_sd"))
    if flags & NO_PITCH or math.isnan(seen) or math.isnan(sd):
        return []
    return [
        {"observable": "turns_seen", "value": seen, "value_sd": math.hypot(sd, COILED_SD * seen)}
    ]


def _gap(frame: dict, constants: dict[str, float]) -> dict:
    """S as the legs show it; nothing where they do not, or where more strings than two leave holes
    of which the legs' outlines tell no single distance."""
    gap, sd = (_number(frame.get(f"hole_distance_mm{end}")) for end in ("", "_sd"))
    if math.isnan(gap) or math.isnan(sd) or constants["strings"] != 2.0:
        return {}
    least = LEAST_SD["hole_distance_mm"]
    return {"observable": "hole_distance_mm", "value": gap, "value_sd": math.hypot(sd, least)}


def _middle_of(frames: list[int], turned: list[float]) -> int:
    """Of some frames, one in the midst of their turns; -1 where there are none."""
    known = sorted((i for i in frames if not math.isnan(turned[i])), key=lambda i: turned[i])
    return known[len(known) // 2] if known else -1


def _coiled_from(frames: list[dict], turned: list[float]) -> float:
    """The fewest turns, up to the first knot, at which the bundle was no longer straight: on the
    other branch the same turns may pass as straight, by little."""
    fewest = math.inf
    for frame, turns in zip(frames, turned, strict=True):
        phase = frame.get("phase") or STRAIGHT
        if phase != STRAIGHT:
            fewest = min(fewest, turns)
        if phase in KNOTTED:
            break
    return fewest


def _seen(frame: dict, flags: set[str], turns: float, zone_mm: float, straight: bool) -> list[dict]:
    """What one frame says, as observables with their standard deviations. Where the bundle is not
    `straight`, its pitch does not tell the turns."""
    said = [("displacement_mm", _number(frame.get("displacement_mm")), NAN)]
    angle, angle_sd = (_number(frame.get(f"helix_angle_rad{end}")) for end in ("", "_sd"))
    pitch, pitch_sd = (_number(frame.get(f"pitch_mm{end}")) for end in ("", "_sd"))
    # Before the first turn there is hardly a bundle to see, and what is seen is the legs.
    laid = not angle > STEEPEST_RAD and not turns < FEWEST_TURNS
    if laid and not flags & NO_DIAMETER:
        said.append(
            ("diameter_mm", _number(frame.get("diameter_mm")), _number(frame.get("diameter_mm_sd")))
        )
    straight = straight and laid
    least = {**LEAST_SD, "pitch_mm": LEAST_TURNS * pitch**2 / zone_mm}
    if straight and not flags & NO_PITCH and not math.isnan(least["pitch_mm"]):
        said.append(("pitch_mm", pitch, pitch_sd))
    elif straight and not flags & NO_HELIX:
        said.append(("helix_angle_deg", math.degrees(angle), math.degrees(angle_sd)))
    return [
        {
            "observable": name,
            "value": value,
            "value_sd": NAN if math.isnan(sd) else math.hypot(sd, least[name]),
        }
        for name, value, sd in said
        if not math.isnan(value)
    ]


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
        key: _number(used.get(key)) if math.isnan(value) else value for key, value in now.items()
    }
    constants = {name: found[key] for name, key in CONSTANTS.items()}
    return {**constants, "load_N": found["actuator.load_N"]}


def _scale_sd(folder: Path) -> float:
    """Relative standard deviation of the camera's scale, from the first frame that tells."""
    frames, _ = _read(folder)
    for frame in frames:
        scale, sd = _number(frame.get("mm_per_px")), _number(frame.get("mm_per_px_sd"))
        if scale > 0 and sd >= 0:
            return sd / scale
    return NAN


def _number(text: object) -> float:
    try:
        return float(text)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return NAN
