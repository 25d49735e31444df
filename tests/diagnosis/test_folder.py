"""Measured folders as DATA: what a recording's readings share is no evidence of a cause."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tsvision.diagnosis.folder import table_from_folders
from tsvision.diagnosis.sources import diagnose_sources
from tsvision.records import Actuator, Rig

ZONE_MM, HOLES_MM, DIAMETER_MM = 23.2, 5.0, 0.48
LOADS_N = (9.81, 29.42, 49.03)
LEVELS = np.linspace(0.0, 18.0, 7)
NOISE_MM = 0.15
RIG = {
    "strings.count": 2,
    "strings.diameter_mm": 0.24,
    "actuator.twisting_zone_mm": ZONE_MM,
    "actuator.hole_distance_mm": HOLES_MM,
}
Odd = Callable[[float, int], float]  # of turns and the recording's number


def folders(
    where: Path,
    holes_mm: float = HOLES_MM,
    pitch_off_turns: Odd = lambda turns, run: 0.0,
    diameter_gain: Odd = lambda turns, run: 1.0,
    seen: bool = True,
) -> list[Path]:
    """Three measured recordings of two strings, wound and unwound, that obey the formula."""
    g = np.random.default_rng(4)
    made = []
    for run, load in enumerate(LOADS_N):
        folder = where / f"run{run}"
        folder.mkdir(parents=True)
        rows = []
        for frame, turns in enumerate([*LEVELS, *LEVELS[-2::-1]]):
            drawn = np.hypot(ZONE_MM, holes_mm / 2 + np.pi * turns * DIAMETER_MM) - ZONE_MM
            row: dict[str, object] = {
                "frame": frame,
                "turns": turns,
                "time_s": 2.0 * frame,
                "load_N": load,
                "displacement_mm": drawn + g.normal(0.0, NOISE_MM),
                "mm_per_px": 0.03,
                "mm_per_px_sd": 0.0001,
                "phase": "twist",
                "flags": "" if turns > 1 else "TOO_FEW_TURNS",
            }
            if turns > 1:
                way = holes_mm / (np.pi * DIAMETER_MM) - 0.25
                laid = turns + way + pitch_off_turns(turns, run)
                row["pitch_mm"] = ZONE_MM / laid + g.normal(0.0, 0.001)
                row["pitch_mm_sd"] = 0.005
                gain = diameter_gain(turns, run)
                row["diameter_mm"] = DIAMETER_MM * gain + g.normal(0.0, 0.001)
                row["diameter_mm_sd"] = 0.02 * DIAMETER_MM
            if seen:
                row["hole_distance_mm"] = holes_mm + 0.02 * run
                row["hole_distance_mm_sd"] = 0.04
            rows.append(row)
        names = list(dict.fromkeys(name for row in rows for name in row))
        with open(folder / "frames.csv", "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, names)
            writer.writeheader()
            writer.writerows(rows)
        (folder / "summary.json").write_text(json.dumps({"rig": RIG}), encoding="utf-8")
        made.append(folder)
    return made


def test_s_seen_in_the_picture_tells_a_wrong_s_from_lost_turns(tmp_path: Path) -> None:
    answer = diagnose_sources(folders(tmp_path, holes_mm=HOLES_MM - 1.7), Rig())
    assert [c.name for c in answer.causes] == ["hole_distance"]
    assert answer.status == "explained"
    shift = next(iter(answer.causes[0].parameters.values()))
    assert -1.7 - 0.25 < shift.value < -1.7 + 0.25


def test_s_is_one_reading_a_recording(tmp_path: Path) -> None:
    table = table_from_folders(folders(tmp_path), Rig())
    rows = table.observable == table.observables.index("hole_distance_mm")
    assert rows.sum() == len(LOADS_N)
    assert table.gain_sd["hole_distance_mm"] > 0.01
    unseen = table_from_folders(folders(tmp_path / "unseen", seen=False), Rig())
    assert "hole_distance_mm" not in unseen.observables


def coiled(where: Path, reached: float, counted: float = 1.0) -> Path:
    """One folder whose bundle coils from 12 turns on and holds a knot at the last; `reached`: share
    of the turns that reach it, `counted`: share of the zone in which they were counted."""
    folder = folders(where)[0]
    path = folder / "frames.csv"
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        turns = float(row["turns"])
        row["phase"] = "knotted" if turns == LEVELS[-1] else "overtwist" if turns > 11 else "twist"
        if not row["pitch_mm"]:
            continue
        pitch = float(row["pitch_mm"])
        apex = ZONE_MM - (turns - 0.25) * pitch
        seen = 0.25 + counted * (turns - 0.25)
        row["apex_mm"], row["turns_seen"] = str(apex), str(seen if turns < 11 else reached * seen)
        row["turns_seen_sd"] = "0.2"
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [*rows[0], "apex_mm", "turns_seen", "turns_seen_sd"])
        writer.writeheader()
        writer.writerows(rows)
    return folder


def test_turns_seen_tell_of_a_coiled_bundle_until_it_knots(tmp_path: Path) -> None:
    table = table_from_folders([coiled(tmp_path, reached=0.9)], Rig())
    rows = table.observable == table.observables.index("turns_seen")
    at = table.at.take(table.condition[rows])
    assert set(at.turns) == {t for t in LEVELS[:-1] if t > 11}
    assert not at.unwinding.any()  # knots keep turns that the motor takes back
    np.testing.assert_allclose(table.value[rows], 0.9 * at.turns)


def test_turns_counted_between_the_wrong_ends_are_left_out(tmp_path: Path) -> None:
    table = table_from_folders([coiled(tmp_path, reached=1.0, counted=0.55)], Rig())
    assert "turns_seen" not in table.observables
    assert any("was the connector found" in note for note in table.notes)
    right = table_from_folders([coiled(tmp_path / "right", reached=1.0)], Rig())
    assert not any("connector" in note for note in right.notes)


def test_a_pitch_misread_alike_at_equal_turns_is_no_discrepancy(tmp_path: Path) -> None:
    def repeats(turns: float, run: int) -> float:
        return 0.1 * float(np.cos(0.5 * turns))  # shading of the strands, the same in each film

    answer = diagnose_sources(folders(tmp_path, pitch_off_turns=repeats), Rig())
    assert answer.status == "no_discrepancy"


def test_a_diameter_far_beyond_what_edges_are_misread_by_is_not_passed_over(tmp_path: Path) -> None:
    def squeezed(turns: float, run: int) -> float:
        return float((LOADS_N[run] / LOADS_N[0]) ** -0.12)  # while the displacement stays the same

    answer = diagnose_sources(folders(tmp_path, diameter_gain=squeezed), Rig())
    assert answer.status == "unexplained"
    assert answer.residual["observable"] == "diameter_mm"


def test_a_rig_given_beside_folders_leaves_their_load_recorded(tmp_path: Path) -> None:
    """One recording under 9.81 N, diagnosed with and without a rig that says so too; a load that
    only the rig knows is no recorded one."""
    folder = folders(tmp_path)[0]
    given = Rig(actuator=Actuator(load_N=LOADS_N[0]))
    assert table_from_folders([folder], Rig()).load_recorded
    assert table_from_folders([folder], given).load_recorded
    frames = folder / "frames.csv"
    frames.write_text(frames.read_text().replace("load_N", "unused"))
    bare = table_from_folders([folder], given)
    assert not bare.load_recorded and np.all(bare.at.load_N == LOADS_N[0])
    summary = json.loads((folder / "summary.json").read_text())
    summary["rig"]["actuator.load_N"] = LOADS_N[0]
    (folder / "summary.json").write_text(json.dumps(summary))
    assert table_from_folders([folder], given).load_recorded
