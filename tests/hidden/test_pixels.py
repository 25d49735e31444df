"""From pixels: the renderer's actuator carries an effect, and the frames must tell which.

One recording, small; `python -m tests.bench.hidden_pixels` runs dozens under three loads.
"""

from __future__ import annotations

from pathlib import Path

from synth.build import make_settings
from synth.recording import write_recording
from tests.hidden.test_hidden import classes, names
from tsvision.diagnosis.sources import diagnose_sources
from tsvision.records import Rig
from tsvision.run import measure_to_folder

UP = (3.0, 7.0, 11.0, 15.0, 18.0)
DOWN = UP[-2::-1]


def film(folder: Path, **hidden: float) -> Path:
    """A recording with planted effects, measured."""
    changes: dict[str, object] = {
        "law.displacement": "constant_radius",
        "displacement_noise_mm": 0.1,
        "camera.width_px": 640,
        "camera.height_px": 360,
        **{f"hidden.{name}": value for name, value in hidden.items()},
    }
    settings = make_settings((*UP, *DOWN), "clean", seed=11, changes=changes)
    return measure_to_folder(write_recording(folder / "film", settings), folder / "measured")


def test_backlash_is_named_from_the_frames(tmp_path: Path) -> None:
    answer = diagnose_sources([film(tmp_path, backlash_turns=1.2)], Rig())
    assert "pitch_mm" in answer.data["observables"]
    assert answer.status == "explained"
    assert names(answer) == ("backlash",)
    turns = answer.causes[0].parameters["backlash_turns"]
    assert 1.2 * 0.85 < turns.value < 1.2 * 1.15


def test_a_camera_whose_scale_is_off_is_told_from_a_thicker_bundle(tmp_path: Path) -> None:
    answer = diagnose_sources([film(tmp_path, camera_scale_error=0.1)], Rig())
    assert ("camera_scale",) in classes(answer)
    assert ("radius_bias",) not in classes(answer)


def test_nothing_is_claimed_of_an_honest_recording(tmp_path: Path) -> None:
    answer = diagnose_sources([film(tmp_path)], Rig())
    assert answer.status == "no_discrepancy"
