"""rig.toml: every key checked, named when wrong, and traced to where it came from."""

from __future__ import annotations

import math
import re
import tomllib
from dataclasses import fields
from pathlib import Path

import pytest

from cli.main import run
from tsvision.errors import InputError
from tsvision.records import Camera, Rig
from tsvision.rig import KEYS, find_rig, load_rig, rig_values
from tsvision.rig_keys import SECTIONS, commented_file

FULL = """
[strings]
count = 2
diameter_mm = 0.24
[actuator]
twisting_zone_mm = 23.20
hole_distance_mm = 5.0
hole_diameter_mm = 0.6
load_N = 19.61
[camera]
mm_per_px = 0.02281
[view]
separator_side = "auto"
roi_px = [0, 0, 1280, 720]
"""

LENGTH = '[camera]\nscale_from = "length"\nlength_mm = 3\n'


def rig_of(tmp_path: Path, text: str, **overrides) -> Rig:
    path = tmp_path / "rig.toml"
    path.write_text(text)
    return load_rig(path, {k.replace("__", "."): v for k, v in overrides.items()})


def test_the_interface_example(tmp_path: Path) -> None:
    rig = rig_of(tmp_path, FULL)
    assert rig.strings.count == 2
    assert rig.actuator.load_N == 19.61
    assert rig.view.roi_px == (0, 0, 1280, 720)
    assert rig.source["strings.count"].endswith("rig.toml")
    assert rig.source["camera.gamma"] == "not given"


def test_nothing_given_is_nothing_known() -> None:
    rig = load_rig(None)
    assert rig.strings.count is None
    assert math.isnan(rig.camera.mm_per_px)
    assert rig_values(rig)["camera.mm_per_px"] is None


def test_the_keys_are_the_fields_of_the_nouns() -> None:
    for section, model in SECTIONS.items():
        noun = type(getattr(Rig(), section))
        assert set(model.model_fields) == {f.name for f in fields(noun)}


def test_options_win_and_say_so(tmp_path: Path) -> None:
    rig = rig_of(
        tmp_path,
        FULL,
        strings__count="4",
        view__roi_px="[1, 2, 30, 40]",
        camera__points_px="0,0 3.5,4",
        view__axis_px="[[1, 2], [30, 40]]",
        camera__gamma=None,
    )
    assert rig.strings.count == 4
    assert rig.view.roi_px == (1, 2, 30, 40)
    assert rig.camera.points_px == ((0.0, 0.0), (3.5, 4.0))
    assert rig.view.axis_px == ((1.0, 2.0), (30.0, 40.0))
    assert load_rig(None, {"view.roi_px": "1,2,3 4"}).view.roi_px == (1, 2, 3, 4)
    assert rig.source["strings.count"] == "option"
    assert rig.source["camera.gamma"] == "not given"


def test_a_scale_given_by_hand_replaces_the_recipe(tmp_path: Path) -> None:
    text = '[actuator]\nhole_distance_mm = 5\n[camera]\nscale_from = "hole_distance"\n'
    assert rig_of(tmp_path, text).camera.scale_from == "hole_distance"
    by_hand = rig_of(tmp_path, text, camera__mm_per_px="0.02").camera
    assert by_hand == Camera(mm_per_px=0.02) or math.isnan(by_hand.gamma)
    assert by_hand.mm_per_px == 0.02 and by_hand.scale_from is None
    other = rig_of(tmp_path, FULL, camera__scale_from="hole_distance").camera
    assert math.isnan(other.mm_per_px) and other.scale_from == "hole_distance"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[strings]\ncuont = 2\n", "'strings.cuont'; did you mean 'strings.count'"),
        ("[string]\ncount = 2\n", "did you mean 'strings.count'"),
        ("[camera]\nmm_per_pixel = 2\n", "did you mean 'camera.mm_per_px'"),
        ("[camera]\nhole_distance_mm = 2\n", "did you mean 'actuator.hole_distance_mm'"),
        ("count = 2\n", "did you mean 'strings.count'"),
        ("[strings.count]\nx = 2\n", "strings.count"),
        ("[[strings]]\ncount = 2\n", "[strings] must be a table of keys"),
        ("strings = 3\n", "[strings] must be a table of keys"),
        ("[strings]\ncount = 0\n", "strings.count = 0: should be greater than or equal to 1"),
        ("[strings]\ncount = -2\n", "strings.count = -2"),
        ("[strings]\ncount = 2.5\n", "strings.count = 2.5"),
        ("[strings]\ncount = true\n", "not true or false"),
        ("[strings]\ncount = 99999999999999999999\n", "strings.count"),
        ("[strings]\ndiameter_mm = 0\n", "greater than 0"),
        ("[strings]\ndiameter_mm = nan\n", "finite"),
        ("[camera]\nmm_per_px = 0\n", "camera.mm_per_px = 0: should be greater than 0"),
        ("[camera]\nmm_per_px = -0.1\n", "greater than 0"),
        ("[camera]\nmm_per_px = inf\n", "finite"),
        ("[camera]\nmm_per_px_sd = 0.1\n", "needs camera.mm_per_px"),
        ('[camera]\nscale_from = "guess"\n', "hole_distance"),
        ('[camera]\nscale_from = "length"\n', "needs camera.length_mm"),
        ('[camera]\nscale_from = "charuco"\n', "needs camera.board"),
        ('[camera]\nscale_from = "hole_distance"\nmm_per_px = 1\n', "both given"),
        ("[camera]\npoints_px = [[1, 2]]\n", "two points"),
        (
            LENGTH + "points_px = [[9, 9], [9, 9]]\n",
            "camera.points_px must be two different points",
        ),
        ('[view]\nseparator_side = "up"\n', "'left', 'right'"),
        ("[view]\nroi_px = [0, 0, 0, 5]\n", "size of at least 1"),
        ("[view]\nroi_px = [0, 0, 5]\n", "such as roi_px = [0, 0, 1280, 720]"),
        ("[strings]\ncount = \n", "no valid TOML"),
        ("[strings]\ncount = 2\ncount = 3\n", "no valid TOML"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(InputError) as caught:
        rig_of(tmp_path, text)
    assert says in str(caught.value)
    assert "rig.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_unreadable_files(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        load_rig(tmp_path / "gone.toml")
    (tmp_path / "b.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match="no valid TOML"):
        load_rig(tmp_path / "b.toml")
    (tmp_path / "deep.toml").write_text("a = " + "[" * 5000 + "]" * 5000)
    with pytest.raises(InputError, match=r"deep\.toml"):
        load_rig(tmp_path / "deep.toml")
    with pytest.raises(InputError, match="options"):
        load_rig(None, {"strings.cuont": 3})


def test_init_writes_a_file_that_holds_every_key_and_reads_back(tmp_path: Path, capsys) -> None:
    assert run(["rig", "init", str(tmp_path)]) == 0
    path = tmp_path / "rig.toml"
    assert load_rig(path).strings.count is None
    assert run(["rig", "init", str(tmp_path)]) == 2
    assert "--overwrite" in capsys.readouterr().err
    lines = [x for x in commented_file().splitlines() if re.match(r"\[|# [A-Za-z_]+ = ", x)]
    examples = tomllib.loads("\n".join(x.removeprefix("# ") for x in lines))
    found = {f"{s}.{k}" for s, keys in examples.items() for k in keys}
    assert found == set(KEYS)
    for key in KEYS:  # each example is valid by itself or says what it needs
        section, name = key.split(".")
        if name not in ("mm_per_px_sd", "scale_from"):
            load_rig(None, {key: examples[section][name]})


def test_show_tells_values_and_sources(tmp_path: Path, capsys) -> None:
    (tmp_path / "rig.toml").write_text(FULL)
    assert run(["rig", "show", str(tmp_path), "--mm-per-px", "0.5", "--strings.count", "6"]) == 0
    lines = capsys.readouterr().out.splitlines()
    told = {line.split()[0]: line.split()[1:] for line in lines}
    assert told["camera.mm_per_px"] == ["0.5", "option"]
    assert told["strings.count"] == ["6", "option"]
    assert told["actuator.load_N"][0] == "19.61"
    assert told["actuator.load_N"][1].endswith("rig.toml")
    assert told["camera.gamma"] == ["-", "not", "given"]


@pytest.mark.parametrize("spelling", ["--mm-per-px", "--mm_per_px", "--camera.mm_per_px"])
def test_spellings_of_an_option(tmp_path: Path, capsys, spelling: str) -> None:
    assert run(["rig", "show", str(tmp_path), spelling, "-1"]) == 2
    assert "camera.mm_per_px = '-1': should be greater than 0" in capsys.readouterr().err


def test_the_rig_beside_a_recording(tmp_path: Path) -> None:
    assert find_rig(tmp_path) is None
    (tmp_path / "rig.toml").write_text("")
    (tmp_path / "film.rig.toml").write_text("")
    assert find_rig(tmp_path) == tmp_path / "rig.toml"
    assert find_rig(tmp_path / "film.mp4") == tmp_path / "film.rig.toml"
    assert find_rig(tmp_path / "other.mp4") == tmp_path / "rig.toml"
