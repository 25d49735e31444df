"""A rendered recording spoilt on its way to us: the right answer, or a flag; never a wrong number
in silence."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest

from synth.build import make_settings
from synth.recording import write_recording
from synth.settings import Strings
from tsvision.images.frames import open_recording
from tsvision.records import Onset
from tsvision.rig import load_rig
from tsvision.timeline.account import Account, account
from tsvision.timeline.steadily import measure_steadily, moves
from tsvision.timeline.tables import tables

STEP_TURNS = 2.0
COUNT = 13


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    turns = tuple(3.0 + STEP_TURNS * k for k in range(COUNT))
    changes = {
        "camera.width_px": 960,
        "camera.height_px": 540,
        "law.overtwist_turns": 10.2,
        "law.local_turns": 20.0,
        "law.knot_turns": 21.5,
    }
    settings = make_settings(turns, "clean", 5, None, Strings(count=4), changes=dict(changes))
    return write_recording(tmp_path_factory.mktemp("sound") / "recording", settings)


@pytest.fixture(scope="module")
def pictures(sound: Path) -> list[np.ndarray]:
    return [cv2.imread(str(path), cv2.IMREAD_UNCHANGED) for path in sorted(sound.glob("*.png"))]


@pytest.fixture(scope="module")
def true_turns(sound: Path) -> float:
    return float(json.loads((sound / "truth.json").read_text())["onsets"]["knot_onset"]["turns"])


def written(folder: Path, sound: Path, pictures: list[np.ndarray], turns: list[float]) -> Path:
    folder.mkdir()
    (folder / "rig.toml").write_bytes((sound / "rig.toml").read_bytes())
    for number, picture in enumerate(pictures):
        assert cv2.imwrite(str(folder / f"g{number:03d}.png"), picture)
    names = [f"g{number:03d}.png" for number in range(len(pictures))]
    pd.DataFrame({"file": names, "turns": turns}).to_csv(folder / "turns.csv", index=False)
    return folder


def told(folder: Path) -> Account:
    rig = load_rig(folder / "rig.toml")
    frames, knots = tables(measure_steadily(open_recording(folder, rig)))
    return account(frames, knots, rig)


def right(onset: Onset, true_turns: float) -> bool:
    return onset.turns is not None and abs(onset.turns - true_turns) <= 2 * STEP_TURNS + 1e-9


def given(sound: Path) -> list[float]:
    return pd.read_csv(sound / "turns.csv")["turns"].tolist()


def test_sound_as_it_is(sound: Path, true_turns: float) -> None:
    story = told(sound)
    assert right(story.onsets["knot_onset"], true_turns)
    assert story.notes == ()


@pytest.mark.slow
def test_frames_and_turns_shuffled_together(
    tmp_path: Path, sound: Path, pictures: list[np.ndarray], true_turns: float
) -> None:
    order = np.random.default_rng(1).permutation(COUNT)
    turns = given(sound)
    spoilt = written(tmp_path / "s", sound, [pictures[i] for i in order], [turns[i] for i in order])
    story = told(spoilt)
    assert right(story.onsets["knot_onset"], true_turns)
    assert any("sorted by turns" in note for note in story.notes)


def test_pictures_shuffled_against_their_turns_tell_no_number(
    tmp_path: Path, sound: Path, pictures: list[np.ndarray]
) -> None:
    order = np.random.default_rng(1).permutation(COUNT)
    spoilt = written(tmp_path / "s", sound, [pictures[i] for i in order], given(sound))
    story = told(spoilt)
    assert story.onsets["knot_onset"].status == "undetermined"
    assert "right order" in story.reasons["knot_onset"]


def test_read_backward(
    tmp_path: Path, sound: Path, pictures: list[np.ndarray], true_turns: float
) -> None:
    spoilt = written(tmp_path / "s", sound, pictures[::-1], given(sound)[::-1])
    story = told(spoilt)
    assert right(story.onsets["knot_onset"], true_turns)
    assert any("backward" in note for note in story.notes)


@pytest.mark.slow
def test_pictures_reversed_against_their_turns_tell_no_number(
    tmp_path: Path, sound: Path, pictures: list[np.ndarray]
) -> None:
    story = told(written(tmp_path / "s", sound, pictures[::-1], given(sound)))
    assert story.onsets["knot_onset"].status == "undetermined"
    assert "fall where the turns rise" in story.reasons["knot_onset"]


def test_missing_frames(
    tmp_path: Path, sound: Path, pictures: list[np.ndarray], true_turns: float
) -> None:
    kept = [i for i in range(COUNT) if i % 4 != 2]
    turns = given(sound)
    spoilt = written(tmp_path / "s", sound, [pictures[i] for i in kept], [turns[i] for i in kept])
    assert right(told(spoilt).onsets["knot_onset"], true_turns)


@pytest.mark.slow
@pytest.mark.parametrize("at", [COUNT - 3])
def test_one_flash_frame(
    tmp_path: Path, sound: Path, pictures: list[np.ndarray], true_turns: float, at: int
) -> None:
    shown = list(pictures)
    shown[at] = np.clip(2.5 * shown[at].astype(float) + 90, 0, 255).astype(np.uint8)
    spoilt = written(tmp_path / "s", sound, shown, given(sound))
    assert right(told(spoilt).onsets["knot_onset"], true_turns)
    assert moves(open_recording(spoilt)) == []


@pytest.mark.slow
@pytest.mark.parametrize("bump_px", [(3, 5), (40, 22)])
def test_camera_bumped_once_in_the_middle(
    tmp_path: Path,
    sound: Path,
    pictures: list[np.ndarray],
    true_turns: float,
    bump_px: tuple[int, int],
) -> None:
    move = np.array([[1, 0, bump_px[0]], [0, 1, bump_px[1]]], dtype=np.float32)
    after = [
        cv2.warpAffine(p, move, p.shape[1::-1], borderMode=cv2.BORDER_REPLICATE)
        for p in pictures[COUNT // 2 :]
    ]
    spoilt = written(tmp_path / "s", sound, pictures[: COUNT // 2] + after, given(sound))
    story = told(spoilt)
    flagged = story.frames["flags"].str.contains("CAMERA_MOVED").to_numpy()
    assert np.flatnonzero(flagged).tolist() == [COUNT // 2]
    assert any("camera" in note for note in story.notes)
    assert right(story.onsets["knot_onset"], true_turns)


def test_without_a_scale_no_px_passes_for_mm(
    tmp_path: Path, sound: Path, pictures: list[np.ndarray], true_turns: float
) -> None:
    spoilt = written(tmp_path / "s", sound, pictures, given(sound))
    lines = (sound / "rig.toml").read_text().splitlines()
    rest = [line for line in lines if not line.startswith("mm_per_px")]
    assert len(rest) == len(lines) - 1
    (spoilt / "rig.toml").write_text("\n".join(rest))
    story = told(spoilt)
    assert right(story.onsets["knot_onset"], true_turns)
    assert story.onsets["irreversible_onset"].status == "undetermined"
    assert "irreversible" not in set(story.frames["phase"])
    in_mm = story.knots[["centre_mm", "length_mm", "max_diameter_mm"]]
    assert len(in_mm) and in_mm.isna().all(axis=None)
    assert (story.knots["max_diameter_px"] > 20).all()
