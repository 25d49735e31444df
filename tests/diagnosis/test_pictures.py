"""What `tsvision measure` saw, as data: pitch, onsets; and frames drawn again beside the photo."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from cli.main import run
from synth.build import make_settings
from synth.reconstruct import Rope, reconstruct, under_each_light
from synth.recording import write_recording
from tsvision.diagnosis.folder import table_from_folders
from tsvision.records import Rig
from tsvision.run import measure_to_folder

HEADER = (
    *("frame", "turns", "displacement_mm", "diameter_mm", "diameter_mm_sd", "pitch_mm"),
    *("pitch_mm_sd", "helix_angle_rad", "phase", "mm_per_px", "flags"),
)


def folder(path: Path, phases: list[str], summary: dict | None = None) -> Path:
    """Frames at 4 turns each up and down again, as `tsvision measure` leaves them."""
    path.mkdir()
    turns = [4.0 * i for i in (*range(5), *range(3, -1, -1))]
    with open(path / "frames.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(HEADER)
        for i, (n, phase) in enumerate(zip(turns, phases, strict=True)):
            pitch = 23.2 / (n + 3.07)
            writer.writerow([i, n, 0.1 * n, 0.47, 0.02, pitch, 0.02, 0.5, phase, 0.02, ""])
    rig = {
        "strings.count": 2,
        "strings.diameter_mm": 0.24,
        "actuator.twisting_zone_mm": 23.2,
        "actuator.hole_distance_mm": 5.0,
        "actuator.load_N": 9.8,
    }
    (path / "summary.json").write_text(json.dumps({"rig": rig, **(summary or {})}))
    return path


def pitches(path: Path) -> list[float]:
    """The turns at which the pitch is used."""
    table = table_from_folders([path], Rig())
    rows = table.observable == table.observables.index("pitch_mm")
    return [float(n) for n in table.at.turns[table.condition[rows]]]


def test_the_pitch_is_used_where_the_bundle_is_straight(tmp_path: Path) -> None:
    straight = ["twist"] * 9
    assert pitches(folder(tmp_path / "a", straight)) == [4, 8, 12, 16, 12, 8, 4]
    coiled = [*["twist"] * 3, "overtwist", "overtwist", "twist", *["twist"] * 3]
    assert pitches(folder(tmp_path / "b", coiled)) == [4, 8, 8, 4]
    knotted = [*["twist"] * 4, *["knotted"] * 3, "twist", "twist"]
    assert pitches(folder(tmp_path / "c", knotted)) == [4, 8, 12]


def test_onsets_in_the_summary_are_sightings(tmp_path: Path) -> None:
    seen = {
        "overtwist_onset": {"status": "observed", "turns": 12.0, "low": 9.0, "high": 13.0},
        "knot_onset": {"status": "not_observed", "turns": None, "low": None, "high": None},
    }
    table = table_from_folders([folder(tmp_path / "a", ["twist"] * 9, seen)], Rig())
    assert {s.mechanism: s.observed for s in table.sightings} == {
        "coiling": True,
        "knot_absorption": False,
    }


def test_a_drawing_finds_the_bundle_again_and_what_it_lacks() -> None:
    """A strip drawn with loose strands: phase, pitch and D come back, looseness mends the rest."""
    true = Rope(2, 25.0, 72.0, "Z", phase_rad=0.7, offset_px=0.8, looseness=0.15)
    lit, covered = under_each_light(true, (61, 170))
    g = np.random.default_rng(1)
    photo = 0.3 * lit[0] + 0.6 * lit[2] + 0.05 * (1 - covered)
    photo = photo + 0.004 * g.standard_normal(photo.shape)
    found = reconstruct(photo, Rope(2, 26.0, 70.0, "Z"))
    assert found.rope.pitch_px == pytest.approx(72.0, abs=0.7)
    loose = found.extras["looseness"]
    assert loose.value == pytest.approx(0.15, abs=0.03)
    assert loose.rms < 0.5 * found.rms
    assert loose.rms < 0.5 * min(found.extras["taper"].rms, found.extras["flattening"].rms)
    # Touching strands make up for the wider grooves by a larger D; loose ones need not.
    assert loose.rope.diameter_px == pytest.approx(25.0, abs=0.25)
    assert found.rope.diameter_px > 25.5


@pytest.mark.slow
def test_frames_beside_their_reconstruction(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = make_settings((18.0,), "clean", 3, changes={"camera.view": "closeup"})
    camera = replace(settings.camera, width_px=480, height_px=270)
    film = write_recording(tmp_path / "film", replace(settings, camera=camera))
    measured = measure_to_folder(film, tmp_path / "measured")
    out = tmp_path / "pictures"
    words = ["diagnose", str(measured), "--pictures", str(out), "--recording", str(film)]
    assert run(words) == 0
    assert "% of the contrast" in capsys.readouterr().out
    sheet = cv2.imread(str(out / "frame_00000.png"))
    assert sheet is not None and sheet.shape[1] >= 900
    with open(out / "reconstruction.csv", newline="", encoding="utf-8") as file:
        row = next(csv.DictReader(file))
    truth = json.loads((film / "truth.json").read_text())["frames"][0]
    # Four lights without a gloss draw the limbs a little too bright: D comes out 2.6 % low.
    assert float(row["diameter_px"]) == pytest.approx(truth["diameter_px"], rel=0.035)
    assert float(row["pitch_px"]) == pytest.approx(truth["pitch_px"], rel=0.01)
    assert float(row["rms_over_contrast"]) < 0.1


def test_pictures_need_the_recording(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["diagnose", str(tmp_path), "--pictures", str(tmp_path / "out")]) == 2
    assert "--recording" in capsys.readouterr().err
