"""The extended model is a model: predict and invert with it, from the verdict's JSON."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from cli.main import run
from tests.hidden import planted
from tsvision.diagnosis.diagnose import diagnose
from tsvision.diagnosis.extended import load_model
from tsvision.diagnosis.table import table_from_rows
from tsvision.errors import InputError
from tsvision.records import Rig

SETTING = planted.Setting(count=4, tolerance_times=0.0, outliers=0.0, levels=11)


@pytest.fixture(scope="module")
def case() -> planted.Case:
    return planted.plain_case("radial_compression", 940_001, SETTING)


@pytest.fixture(scope="module")
def file(case: planted.Case, tmp_path_factory: pytest.TempPathFactory) -> Path:
    answer = diagnose(table_from_rows(list(case.rows[0]), case.rows, Rig()))
    path = tmp_path_factory.mktemp("verdict") / "verdict.json"
    path.write_text(json.dumps(answer.to_json(), allow_nan=False))
    return path


def test_it_predicts_what_truly_is_at_each_load(case: planted.Case, file: Path) -> None:
    model = load_model(file)
    rows = [r for r in case.rows if r["observable"] == "displacement_mm"]
    turns, loads = (np.array([r[k] for r in rows]) for k in ("turns", "load_N"))
    off = model.displacement_mm(turns, load_N=loads) - case.clean_mm
    assert np.sqrt(np.mean(off**2)) < 0.1  # noise of a reading: 0.1 to 0.3 mm


def test_slope_and_inverse_agree_with_the_curve(file: Path) -> None:
    model = load_model(file)
    turns = np.array([5.0, 14.0, 30.0])
    x = model.displacement_mm(turns, load_N=29.4)
    np.testing.assert_allclose(model.turns_for_displacement(x, load_N=29.4), turns, atol=2e-3)
    step = model.displacement_mm(turns + 0.01, load_N=29.4) - x
    np.testing.assert_allclose(model.slope_mm_per_turn(turns, load_N=29.4), step / 0.01, rtol=1e-2)
    assert np.isnan(model.turns_for_displacement(1e4, load_N=29.4))


def test_predict_and_invert_take_the_verdict(
    file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert (
        run(["predict", "--turns", "10,30", "--model", str(file), "--load", "9.8", "--json"]) == 0
    )
    low = [row["displacement_mm"] for row in json.loads(capsys.readouterr().out)["rows"]]
    assert run(["predict", "--turns", "10,30", "--model", str(file), "--load", "49", "--json"]) == 0
    high = [row["displacement_mm"] for row in json.loads(capsys.readouterr().out)["rows"]]
    assert all(a > b for a, b in zip(low, high, strict=True))  # squeezed: draws less
    asked = ["invert", "-x", str(low[1]), "--model", str(file), "--load", "9.8", "--json"]
    assert run(asked) == 0
    turns = json.loads(capsys.readouterr().out)["rows"][0]["turns"]
    assert turns == pytest.approx(30.0, abs=0.01)


@pytest.fixture(scope="module")
def several(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A verdict on bundles of 2, 4, 6 and 8 strings, each 6 % thicker than stated and with a zone
    of its own, all readings zeroed at 0 turns where the formula is not."""
    chance = np.random.default_rng(940_003)
    rows = [
        {
            "run": f"N{count}",
            "turns": turns,
            "load_N": 19.61,
            "observable": "displacement_mm",
            "value": drawn(turns, count) - drawn(0.0, count) + chance.normal(0.0, 0.1),
            "strings": count,
            "bundle_diameter_mm": BUNDLES[count][0],
            "twisting_zone_mm": BUNDLES[count][1],
            "hole_distance_nominal_mm": 5.0,
        }
        for count in BUNDLES
        for turns in np.linspace(0.0, 45.0, 10)
    ]
    answer = diagnose(table_from_rows(list(rows[0]), rows, Rig()))
    path = tmp_path_factory.mktemp("several") / "verdict.json"
    path.write_text(json.dumps(answer.to_json(), allow_nan=False))
    return path


BUNDLES = {2: (0.47, 23.2), 4: (0.70, 25.0), 6: (0.86, 22.85), 8: (0.99, 21.0)}  # D and L, mm


def drawn(turns: float, count: int) -> float:
    diameter, zone = BUNDLES[count]
    return float(np.hypot(zone, 2.5 + np.pi * turns * diameter * 1.06) - zone)


def test_several_bundles_have_no_actuator_in_common(
    several: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["predict", "--turns", "45", "--model", str(several), "--json"]
    assert run(asked) == 2
    assert "--zone" in (said := capsys.readouterr().err) and "--diameter" in said
    with pytest.raises(InputError, match="radius_mm"):
        load_model(several).displacement_mm(45.0)
    for count, (diameter, zone) in BUNDLES.items():
        known = ["-N", str(count), "--diameter", str(diameter), "--zone", str(zone)]
        assert run([*asked, *known]) == 0
        x = json.loads(capsys.readouterr().out)["rows"][0]["displacement_mm"]
        assert x == pytest.approx(drawn(45.0, count) - drawn(0.0, count), abs=0.5)


def test_a_load_that_matters_is_asked_for(file: Path) -> None:
    with pytest.raises(InputError, match="depends on load_N"):
        load_model(file).displacement_mm(30.0)


def test_a_file_that_is_no_verdict_is_refused(tmp_path: Path) -> None:
    other = tmp_path / "other.json"
    other.write_text('{"a": 1}')
    with pytest.raises(InputError, match="no verdict"):
        load_model(other)
