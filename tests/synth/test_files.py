"""What lands on disk: complete, repeatable, silent about planted effects, whole or not at all."""

from __future__ import annotations

import json
import tomllib
import tracemalloc
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest

from cli.main import run
from synth.build import make_settings, parse_turns
from synth.effects import string_tension_N
from synth.recording import write_recording
from synth.settings import Actuator, Hidden, Settings, Strings
from synth.validate import check
from tsvision.errors import InputError

TINY: dict[str, object] = {"camera.width_px": 320, "camera.height_px": 180}


def tiny(turns: str = "0:8:4", preset: str = "clean", **changes: object) -> Settings:
    more = {key.replace("__", "."): value for key, value in changes.items()}
    return make_settings(parse_turns(turns), preset, 3, None, changes={**TINY, **more})


def test_a_recording_is_complete(tmp_path: Path) -> None:
    seen: list[tuple[int, int]] = []
    out = write_recording(
        tmp_path / "rec", tiny(), progress=lambda done, total: seen.append((done, total))
    )
    names = sorted(path.name for path in out.iterdir())
    assert names == [
        "frame_00000.png", "frame_00001.png", "frame_00002.png", "rig.toml", "truth.json",
        "truth.parquet", "truth_profiles.parquet", "turns.csv",
    ]  # fmt: skip
    assert seen == [(1, 3), (2, 3), (3, 3)]
    turns = pd.read_csv(out / "turns.csv")
    assert list(turns["turns"]) == [0.0, 4.0, 8.0]
    assert list(turns["file"]) == names[:3]
    rig = tomllib.loads((out / "rig.toml").read_text())
    assert rig["strings"] == {"count": 2, "diameter_mm": 0.24}
    assert rig["actuator"]["twisting_zone_mm"] == 23.2
    truth = pd.read_parquet(out / "truth.parquet")
    assert np.isnan(truth["diameter_mm"][0])
    assert truth["diameter_mm"][2] == pytest.approx(0.48, abs=1e-4)
    assert truth["mm_per_px"][2] == pytest.approx(rig["camera"]["mm_per_px"], rel=1e-6)
    story = json.loads((out / "truth.json").read_text())
    assert story["onsets"]["knot_onset"]["status"] == "not_observed"
    assert len(story["frames"]) == 3
    assert {"conventions", "settings", "hardware"} <= set(story)
    profiles = pd.read_parquet(out / "truth_profiles.parquet")
    last = profiles[profiles["frame"] == 2]
    width = (last["upper_px"] - last["lower_px"]).max() * truth["mm_per_px"][2]
    assert width == pytest.approx(0.48, abs=0.005)
    assert last["mask"].all()
    assert last["s_mm"].min() == pytest.approx(truth["apex_mm"][2], abs=0.1)


def test_equal_seeds_give_equal_bytes(tmp_path: Path) -> None:
    settings = tiny("0:24:12", "hard", sensor__format="png", camera__turning_blur_turns=0.0)
    one = write_recording(tmp_path / "one", settings)
    two = write_recording(tmp_path / "two", settings)
    other = write_recording(tmp_path / "other", replace(settings, seed=4))
    for path in one.iterdir():
        assert path.read_bytes() == (two / path.name).read_bytes(), path.name
    frames = [path.name for path in one.glob("frame_*.png")]
    assert len(frames) == 3
    assert all((one / n).read_bytes() != (other / n).read_bytes() for n in frames)


def test_planted_effects_show_nowhere_but_in_the_truth(tmp_path: Path) -> None:
    """The stated rig and the file names are those of the clean recording, byte for byte."""
    hidden = Hidden(
        slip=0.0371,
        lost_turns=0.4127,
        backlash_turns=0.2391,
        stretch_per_N=0.000731,
        compression_exponent=0.0613,
        creep_mm_per_decade=0.1733,
        radius_step=0.0713,
        radius_step_turns=5.0,
        hole_distance_error_mm=0.2917,
        zone_length_error_mm=0.3719,
        diameter_error_mm=0.00913,
        unequal_diameters=0.0531,
        flattening=0.0719,
        slack_pair=0.0371,
        taper=0.0417,
        diameter_drift=0.0519,
    )
    clean = tiny()
    plain = write_recording(tmp_path / "plain", clean)
    planted = write_recording(tmp_path / "planted", replace(clean, hidden=hidden))
    assert sorted(p.name for p in plain.iterdir()) == sorted(p.name for p in planted.iterdir())
    assert (plain / "rig.toml").read_bytes() == (planted / "rig.toml").read_bytes()
    values = [f"{value:g}" for value in vars(hidden).values() if value]
    for path in planted.iterdir():
        if path.name in ("rig.toml", "turns.csv"):
            text = path.read_text()
            assert not any(value in text for value in values if len(value) > 4), path.name
        if path.suffix == ".png":
            chunks = path.read_bytes()
            assert b"tEXt" not in chunks
            assert b"iTXt" not in chunks
            assert b"eXIf" not in chunks
    story = json.loads((planted / "truth.json").read_text())
    assert story["settings"]["hidden"]["slip"] == 0.0371


@pytest.mark.parametrize(("count", "diameter_mm"), [(2, 0.48), (4, 0.656), (8, 0.875)])
def test_a_strings_tension_is_that_of_the_bundles_outer_radius(
    count: int, diameter_mm: float
) -> None:
    """T = F / (N cos β), tan β = α D / 2L, at any turn count."""
    settings = make_settings(
        (0.0, 45.0),
        strings=Strings(count=count, diameter_mm=0.24),
        actuator=Actuator(load_N=19.61, twisting_zone_mm=23.2),
    )
    for turns in (0.0, 8.0, 45.0):
        lay = np.arctan(np.pi * turns * diameter_mm / 23.2)
        expected = 19.61 / count / np.cos(lay)
        assert string_tension_N(settings, turns) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize(
    ("name", "value", "column", "sign"),
    [
        ("slip", 0.1, "helix_angle_rad", -1),
        ("lost_turns", 1.0, "helix_angle_rad", -1),
        ("compression_exponent", 0.2, "diameter_mm", -1),
        ("diameter_error_mm", 0.02, "diameter_mm", 1),
        ("radius_step", 0.1, "diameter_mm", 1),
        ("flattening", 0.1, "diameter_mm", -1),
        ("unequal_diameters", 0.1, "diameter_mm", 1),
        ("taper", 0.2, "diameter_mm", -1),
        ("diameter_drift", 0.2, "diameter_mm", 1),
        ("zone_length_error_mm", 1.0, "helix_angle_rad", -1),
        ("hole_distance_error_mm", 1.0, "apex_mm", 1),
        ("stretch_per_N", 0.002, "displacement_mm", -1),
        ("creep_mm_per_decade", 0.5, "displacement_mm", -1),
    ],
)
def test_each_effect_is_in_the_scene(name: str, value: float, column: str, sign: int) -> None:
    from synth.actuator import state_at
    from synth.camera import place
    from synth.truth import frame_truth

    base = make_settings((0.0, 6.0, 12.0), changes=dict(TINY))
    planted = replace(base, hidden=replace(base.hidden, **{name: value}))
    view = place(base.camera, 23.2)
    rows = [frame_truth(s, view, state_at(s, 2), 2).row for s in (base, planted)]
    change = float(rows[1][column]) - float(rows[0][column])
    assert change * sign > 1e-4
    assert abs(float(rows[1]["turn_budget_error"])) < 1e-4


def test_backlash_and_slack_pair_and_knot_absorption() -> None:
    from synth.actuator import state_at
    from synth.laws import law_displacement_mm
    from synth.strands import strand_paths

    back = make_settings((0.0, 10.0, 9.0, 5.0), changes={"hidden.backlash_turns": 0.8})
    reached = [state_at(back, i).wound_turns for i in range(4)]
    assert reached == pytest.approx([0.0, 10.0, 9.8, 5.8])
    slack = make_settings((0.0, 8.0), strings=Strings(count=4), changes={"hidden.slack_pair": 0.3})
    state = state_at(slack, 1)
    reach = [np.linalg.norm(p.offset_mm, axis=1).max() for p in strand_paths(slack, state)]
    assert min(reach[2:]) > 1.25 * np.hypot(*state.sites_mm[2])
    changes: dict[str, object] = {
        "hidden.knot_absorption": 0.5,
        "law.knot_turns": 20.0,
        "law.displacement": "constant_radius",
    }
    absorbed = make_settings((0.0, 30.0), changes=changes)
    at = state_at(absorbed, 1)
    free = law_displacement_mm(replace(absorbed, hidden=Hidden()), at.real, 25.0)
    assert law_displacement_mm(absorbed, at.real, 30.0) == pytest.approx(free)


def test_camera_scale_error_is_in_the_stated_scale_alone(tmp_path: Path) -> None:
    changes: dict[str, object] = {"hidden.camera_scale_error": 0.02}
    out = write_recording(tmp_path / "r", make_settings((0.0, 4.0), changes={**TINY, **changes}))
    stated = tomllib.loads((out / "rig.toml").read_text())["camera"]["mm_per_px"]
    true = pd.read_parquet(out / "truth.parquet")["mm_per_px"][1]
    assert true / stated == pytest.approx(1.02, rel=1e-5)


@pytest.mark.parametrize(
    ("format", "bits", "dtype"),
    [("png", 16, np.uint16), ("tif", 16, np.uint16), ("jpg", 8, np.uint8)],
)
def test_formats(tmp_path: Path, format: str, bits: int, dtype: type) -> None:
    settings = tiny("4", sensor__format=format, sensor__bits=bits)
    out = write_recording(tmp_path / "r", settings)
    picture = cv2.imread(str(out / f"frame_00000.{format}"), cv2.IMREAD_UNCHANGED)
    assert picture is not None
    assert picture.dtype == dtype
    assert picture.shape == (180, 320)


def test_video_holds_every_frame_and_repeats(tmp_path: Path) -> None:
    av = pytest.importorskip("av")
    settings = tiny("0:12:4", sensor__format="mp4", sensor__quality=20)
    one = write_recording(tmp_path / "one", settings)
    two = write_recording(tmp_path / "two", settings)
    assert (one / "recording.mp4").read_bytes() == (two / "recording.mp4").read_bytes()
    with av.open(str(one / "recording.mp4")) as video:
        shapes = [frame.to_ndarray(format="gray").shape for frame in video.decode(video=0)]
    assert shapes == [(180, 320)] * 4


def files_in(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_a_recording_replaces_a_recording_and_what_is_not_of_it_stays(tmp_path: Path) -> None:
    target = write_recording(tmp_path / "rec", tiny("0:4:1"), with_ids=True)
    first = files_in(target)
    mine = {"notes.txt": b"1", "truth_ids/notes.txt": b"2", "frame_00009.png": b"3", "m/a": b"4"}
    for name, data in mine.items():
        (target / name).parent.mkdir(exist_ok=True)
        (target / name).write_bytes(data)
    with pytest.raises(InputError, match="--overwrite"):
        write_recording(target, tiny())
    assert files_in(target) == {**first, **mine}
    write_recording(target, tiny("4"), overwrite=True)
    fresh = files_in(write_recording(tmp_path / "fresh", tiny("4")))
    assert files_in(target) == {**fresh, **mine}
    assert {p.name for p in tmp_path.iterdir()} == {"rec", "fresh"}


@pytest.mark.parametrize(
    "held",
    [
        {"thesis.txt": b"years of work"},
        {"truth.json": b"{}", "thesis.txt": b"years of work"},
        {"truth.json": b"no JSON"},
        {"summary.json": b"{}"},
    ],
)
def test_overwrite_leaves_a_folder_alone_that_is_no_recording(
    tmp_path: Path, held: dict[str, bytes]
) -> None:
    target = tmp_path / "work"
    target.mkdir()
    for name, data in held.items():
        (target / name).write_bytes(data)
    with pytest.raises(InputError, match="no rendered recording"):
        write_recording(target, tiny(), overwrite=True)
    assert files_in(tmp_path) == {f"work/{name}": data for name, data in held.items()}


def test_a_frame_never_takes_the_place_of_a_file_that_is_not_of_the_recording(
    tmp_path: Path,
) -> None:
    target = write_recording(tmp_path / "rec", tiny("4"))
    (target / "frame_00001.png").write_bytes(b"mine")
    before = files_in(tmp_path)
    with pytest.raises(InputError, match=r"frame_00001\.png.*move it"):
        write_recording(target, tiny("0:4:2"), overwrite=True)
    assert files_in(tmp_path) == before


@pytest.mark.parametrize("out", [".", "../gone/..", "../here"])
def test_the_folder_one_is_in_is_refused_and_left_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, out: str
) -> None:
    here = write_recording(tmp_path / "here", tiny("4"))
    monkeypatch.chdir(here)
    before = files_in(tmp_path)
    with pytest.raises(InputError, match="current folder"):
        write_recording(Path(out), tiny(), overwrite=True)
    assert files_in(tmp_path) == before


def test_a_link_to_a_folder_stays_one(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to("real")
    write_recording(tmp_path / "link", tiny("4"))
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real" / "truth.json").is_file()


def test_nothing_half_written_is_left_behind(tmp_path: Path) -> None:
    def stop(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_recording(tmp_path / "rec", tiny(), progress=stop)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"actuator.hole_distance_mm": 0.56, "actuator.hole_diameter_mm": 0.6},
            ["hole_diameter_mm", "overlap"],
        ),
        ({"strings.diameter_mm": 2.4}, ["hole_distance_mm", "more than"]),
        ({"camera.k1": -0.29}, ["camera.k1", "above 0.1"]),
        ({"actuator.hole_diameter_mm": 0.1}, ["hole_diameter_mm", "at least"]),
        ({"strings.diameter_mm": -0.24}, ["diameter_mm", "0.01"]),
        ({"strings.count": 0}, ["strings.count", "2 to 10"]),
        ({"seed": -1}, ["seed", "0 or more"]),
        ({"strings.count": 1}, ["strings.count", "2 to 10"]),
        ({"actuator.holes": 3}, ["actuator.holes", "2, 4, 6"]),
        ({"camera.side": "front"}, ["camera.side", "left"]),
        ({"hidden.slip": 2.0}, ["hidden.slip", "0.9"]),
        ({"law.overtwist_turns": 500.0}, ["overtwist_turns", "at most"]),
        ({"law.displacement": "magic"}, ["law.displacement", "constant_radius"]),
        ({"sensor.bits": 12}, ["sensor.bits", "16"]),
    ],
)
def test_bad_parameters_name_themselves_and_their_bound(
    tmp_path: Path, changes: dict[str, object], words: list[str]
) -> None:
    with pytest.raises(InputError) as caught:
        write_recording(tmp_path / "r", make_settings((0.0, 6.0), changes={**TINY, **changes}))
    message = str(caught.value)
    assert "\n" not in message
    assert all(word in message for word in words), message
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("preset", ["clean", "bench", "hard"])
def test_no_seed_below_zero(preset: str) -> None:
    with pytest.raises(InputError, match="seed = -1: must be 0 or more"):
        check(make_settings((0.0,), preset, seed=-1))


def test_turns_that_no_geometry_holds(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="at most"):
        write_recording(tmp_path / "r", make_settings((0.0, 400.0), changes=dict(TINY)))
    assert list(tmp_path.iterdir()) == []


def test_turn_ranges() -> None:
    assert parse_turns("0:70:2")[-1] == 70.0
    assert parse_turns("0:1:0.25") == (0.0, 0.25, 0.5, 0.75, 1.0)
    assert parse_turns("0:4:2,3:1:1") == (0.0, 2.0, 4.0, 3.0, 2.0, 1.0)
    assert parse_turns("5") == (5.0,)
    for bad in ("", "a:b", "0:1:0", "0:1:2:3", "nan", "0:inf:1"):
        with pytest.raises(InputError, match="--turns"):
            parse_turns(bad)


def test_unknown_settings_name_the_nearest() -> None:
    with pytest.raises(InputError, match=r"hidden\.slip"):
        make_settings((0.0,), changes={"hidden.slp": 1})
    with pytest.raises(InputError, match="number"):
        make_settings((0.0,), changes={"camera.blur_px": "wide"})
    with pytest.raises(InputError, match="clean, bench, hard"):
        make_settings((0.0,), "nice")


def test_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "rec"
    words = ["synth", "--strings", "6", "--turns", "0:3:3", "--preset", "bench", "--holes", "4"]
    assert run([*words, "--size", "320x180", "--out", str(out), "--ids", "-q"]) == 0
    assert capsys.readouterr().out.strip() == str(out)
    assert (out / "truth_ids" / "frame_00001.png").exists()
    ids = cv2.imread(str(out / "truth_ids" / "frame_00001.png"), cv2.IMREAD_UNCHANGED)
    assert ids is not None
    assert set(np.unique(ids)) <= set(range(7))
    assert run([*words, "--out", str(out), "-q"]) == 2
    assert "overwrite" in capsys.readouterr().err
    assert run(["synth", "--turns", "0:3:3"]) == 2
    assert "--out" in capsys.readouterr().err
    assert run(["synth", "--set", "look.brade=1", "--out", str(tmp_path / "x")]) == 2
    assert "look.braid" in capsys.readouterr().err


def test_memory_is_flat_in_the_number_of_frames(tmp_path: Path) -> None:
    def peak(turns: str, name: str) -> int:
        tracemalloc.start()
        write_recording(tmp_path / name, tiny(turns))
        top = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return top

    peak("0:2:2", "warm")
    few, many = peak("0:4:2", "few"), peak("0:8:0.25", "many")
    assert many < few + 1_500_000  # 30 more frames; their pictures alone would be 1.7 MB


def test_separators_with_more_holes_take_the_same_string(tmp_path: Path) -> None:
    """Fewer strands a leg are pulled towards places farther out: they meet the bundle earlier."""
    from synth.actuator import state_at

    drawn = []
    for holes in (2, 4, 6):
        settings = make_settings(
            (0.0, 5.0), strings=Strings(count=6), actuator=Actuator(holes=holes)
        )
        drawn.append(state_at(settings, 1))
    assert np.all(np.diff([state.apex_mm for state in drawn]) < 0)
    assert np.all(np.diff([state.pitch_mm for state in drawn]) > 0)
    assert np.ptp([state.pitch_mm for state in drawn]) < 0.05 * drawn[0].pitch_mm
