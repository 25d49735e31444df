"""A measure folder and its frames made up by hand, to try the report on.

Straight silhouettes with sinusoidal lobes, a coil that grows and two knots: enough to see every
part of the page. It claims nothing about real strings.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import pandas as pd

from tsvision.records import FrameRow, KnotSighting, Onset, Profile

MM_PER_PX = 0.023
ZONE_PX, LEFT_PX, HEIGHT_PX, WIDTH_PX = 1000, 130, 300, 1200
DIAMETER_MM = 0.48
KNOTS_MM = ((12.0, 40.0), (6.5, 52.0))  # position, turn of birth


@dataclass(frozen=True)
class Fake:
    """Where it was written, and what it holds."""

    measure_dir: Path
    recording_dir: Path
    rows: tuple[FrameRow, ...]


def write_fake(
    folder: Path,
    turns: np.ndarray | None = None,
    scale: bool = True,
    displacement: bool = True,
    name: str = "frame_{:03d}.png",
    unreadable: int | None = 5,
) -> Fake:
    """Write `recording/` (PNG, turns.csv) and `measured/` (the files of `tsvision measure`)."""
    turns = np.linspace(0, 66, 24) if turns is None else turns
    recording, measured = folder / "recording", folder / "measured"
    recording.mkdir(parents=True)
    measured.mkdir()
    rows: list[FrameRow] = []
    profiles: list[pd.DataFrame] = []
    knots: list[dict[str, float]] = []
    for i, turn in enumerate(turns):
        file = name.format(i)
        if i == unreadable:
            (recording / file).write_bytes(b"")
            rows.append(FrameRow(i, file, turns=float(turn), flags="UNREADABLE"))
            continue
        row, profile, seen = fake_frame(i, file, float(turn), displacement)
        cv2.imwrite(str(recording / file), picture(profile))
        if not scale:
            row, profile, seen = without_scale(row, profile)
        rows.append(row)
        columns = asdict(profile)
        profiles.append(pd.DataFrame({"frame": i, **columns}))
        knots += [{"frame": i, "turns": turn, "track": j, **asdict(k)} for j, k in seen]
    frames = pd.DataFrame([asdict(r) for r in rows])
    frames.to_parquet(measured / "frames.parquet", index=False)
    frames.to_csv(measured / "frames.csv", index=False)
    pd.concat(profiles, ignore_index=True).to_parquet(measured / "profiles.parquet", index=False)
    columns = ["frame", "turns", "track", *KnotSighting.__dataclass_fields__]
    table = pd.DataFrame(knots, columns=columns)
    table.to_parquet(measured / "knots.parquet", index=False)
    table.to_csv(measured / "knots.csv", index=False)
    summary = fake_summary(rows, turns, recording, scale)
    (measured / "summary.json").write_text(json.dumps(summary), encoding="utf-8")
    table = pd.DataFrame({"frame": range(len(turns)), "turns": turns})
    table.to_csv(recording / "turns.csv", index=False)
    return Fake(measured, recording, tuple(rows))


def fake_frame(
    i: int, file: str, turn: float, displacement: bool
) -> tuple[FrameRow, Profile, list[tuple[int, KnotSighting]]]:
    """One row with its profile and its (track, knot) pairs."""
    twisted = turn > 3
    apex_mm = 20.0 if not twisted else max(2.0, 40.0 / turn)
    pitch_mm = max(0.7, 16.0 / turn) if twisted else np.nan
    coil_mm = 0.004 * max(0.0, turn - 20)
    s_px = np.arange(0.0, ZONE_PX)
    s_mm = s_px * MM_PER_PX
    centre = coil_mm * np.sin(2 * np.pi * s_mm / 1.9)
    bulge = np.zeros_like(s_mm)
    seen = []
    for j, (where, birth) in enumerate(KNOTS_MM):
        if turn >= birth:
            size = min(0.5, 0.05 + 0.03 * (turn - birth))
            bulge += size * np.exp(-(((s_mm - where) / 0.5) ** 2))
            x = LEFT_PX + where / MM_PER_PX
            big = DIAMETER_MM + 2 * coil_mm + 2 * size
            seen.append((j, KnotSighting(where, 1.6, big, x, HEIGHT_PX / 2, 0.9)))
    lobes = 0.75 + 0.25 * np.cos(4 * np.pi * s_mm / pitch_mm) if twisted else np.ones_like(s_mm)
    half = (DIAMETER_MM / 2 + bulge) * lobes
    inside = s_mm >= apex_mm
    upper = np.where(inside, (centre + half) / MM_PER_PX, np.nan)
    lower = np.where(inside, (centre - half) / MM_PER_PX, np.nan)
    envelope = np.where(inside, DIAMETER_MM + 2 * coil_mm + 2 * bulge, np.nan)
    profile = Profile(s_mm, s_px, upper, lower, (upper - lower) * MM_PER_PX, envelope)
    unevenness = float(np.nanstd(envelope) / np.nanmean(envelope)) if inside.any() else np.nan
    phase = "twist"
    if coil_mm >= 0.05 * DIAMETER_MM:
        phase = "overtwist" if turn < 34 else "local overtwist"
    if seen:
        phase = "knotted"
    sd = 0.003 + 0.00004 * turn
    row = FrameRow(
        frame=i,
        file=file,
        turns=turn,
        time_s=i / 2,
        diameter_mm=DIAMETER_MM + 0.0002 * turn if twisted else np.nan,
        diameter_mm_sd=sd if twisted else np.nan,
        diameter_px=DIAMETER_MM / MM_PER_PX,
        diameter_px_sd=sd / MM_PER_PX,
        pitch_mm=pitch_mm,
        pitch_mm_sd=0.003 * pitch_mm,
        pitch_px=pitch_mm / MM_PER_PX,
        helix_angle_rad=float(np.arctan(np.pi * DIAMETER_MM / pitch_mm)),
        helix_angle_rad_sd=0.006,
        lay_angle_rad=float(np.arctan(np.pi * DIAMETER_MM / 2 / pitch_mm)),
        handedness="S" if twisted else "",
        coil_amplitude_mm=coil_mm if twisted else np.nan,
        unevenness=unevenness if twisted else np.nan,
        knot_count=float(len(seen)),
        phase=phase if twisted else "twist",
        turns_seen=turn * 0.99,
        turns_seen_sd=0.3,
        turn_budget_error=-0.01 * turn,
        string_length_mm=23.2 + 0.9 * turn,
        displacement_mm=0.013 * turn**2 if displacement else np.nan,
        load_N=19.61,
        mm_per_px=MM_PER_PX,
        mm_per_px_sd=0.00003,
        axis_x0_px=float(LEFT_PX),
        axis_y0_px=HEIGHT_PX / 2,
        axis_x1_px=float(LEFT_PX + ZONE_PX),
        axis_y1_px=HEIGHT_PX / 2,
        apex_mm=apex_mm,
        apex_x_px=LEFT_PX + apex_mm / MM_PER_PX,
        apex_y_px=HEIGHT_PX / 2,
        separator_x_px=float(LEFT_PX),
        separator_y_px=HEIGHT_PX / 2,
        flags="" if twisted else "TOO_FEW_TURNS|NO_PITCH",
    )
    return row, profile, seen


def without_scale(
    row: FrameRow, profile: Profile
) -> tuple[FrameRow, Profile, list[tuple[int, KnotSighting]]]:
    """The same frame as measured with no scale known: mm are NaN, px stand."""
    empty = {n: np.nan for n in FrameRow.__dataclass_fields__ if "_mm" in n or n == "mm_per_px"}
    flags = "|".join(filter(None, [row.flags, "NO_SCALE"]))
    unknown = np.full_like(profile.s_mm, np.nan)
    blank = replace(profile, s_mm=unknown, width_mm=unknown, envelope_mm=unknown)
    return replace(row, **empty, flags=flags), blank, []


def picture(profile: Profile) -> np.ndarray:
    """The silhouette in grey on dark, with a separator and the legs."""
    image = np.full((HEIGHT_PX, WIDTH_PX), 40, np.uint8)
    cv2.rectangle(image, (LEFT_PX - 60, 20), (LEFT_PX, HEIGHT_PX - 20), 120, -1)
    rows = np.arange(HEIGHT_PX)[:, None] - HEIGHT_PX / 2
    with np.errstate(invalid="ignore"):
        inside = (rows <= profile.upper_px) & (rows >= profile.lower_px)
    image[:, LEFT_PX : LEFT_PX + ZONE_PX][inside] = 210
    first = int(np.argmax(np.isfinite(profile.upper_px)))
    for side in (-1, 1):
        end = (LEFT_PX, HEIGHT_PX // 2 + side * 100)
        cv2.line(image, end, (LEFT_PX + first, HEIGHT_PX // 2), 200, 10, cv2.LINE_AA)
    return image


def fake_summary(
    rows: list[FrameRow], turns: np.ndarray, recording: Path, scale: bool = True
) -> dict[str, object]:
    """summary.json with an observed, a censored and an undetermined onset."""
    last = float(np.nanmax(turns))
    born = [r.turns for r in rows if r.knot_count > 0]
    seen = Onset("observed", born[0], born[0] - 2.9, born[0] + 0.4, last) if born else None
    gone = Onset("not_observed", None, None, None, last)
    coiled = Onset("observed", 27.0, 25.1, 28.8, last)
    unsure = Onset("undetermined", None, 30.0, 40.0, last)
    return {
        "knot_onset": asdict(seen or gone),
        "overtwist_onset": asdict(coiled),
        "local_overtwist_onset": asdict(unsure),
        "irreversible_onset": asdict(gone),
        "onset_reasons": {"local_overtwist_onset": "the pictures leave it open"},
        "safe": {"turns": 37.3, "displacement_mm": 18.1, "contraction_percent": 22.4},
        "notes": ["knots showed from <b>1</b> to 2 turns and were gone again"],
        "format": 1,
        "flags": {"UNREADABLE": 1},
        "diameter_mm": {"value": 0.4841, "sd": 0.0032} if scale else {"value": None, "sd": None},
        "diameter_px": {"value": 20.87, "sd": 0.15},
        "helix_angle_deg": {"value": 53.7, "sd": 0.41},
        "versions": {"tsvision": "0.1.0"},
        "rig": {
            "strings.count": 2,
            "strings.diameter_mm": 0.24,
            "actuator.twisting_zone_mm": 23.2,
            "actuator.hole_distance_mm": 5.0,
            "actuator.hole_diameter_mm": None,
            "actuator.load_N": 19.61,
        },
        "input": {
            "name": recording.name,
            "kind": "folder",
            "files": [{"name": r.file, "sha256": "0" * 64} for r in rows],
        },
        "frames_total": len(rows),
        "frames_measured": sum(r.flags != "UNREADABLE" for r in rows),
        "frames_flagged": sum(bool(r.flags) for r in rows),
    }
