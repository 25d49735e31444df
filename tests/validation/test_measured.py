"""Bundle models against measured diameters: the right one is named, or none is."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from cli.main import run
from tsvision.errors import InputError
from tsvision.models import SECTIONS
from tsvision.validation.bundles import read_bundles
from tsvision.validation.measured import Bundles, check, judge

NOTHING = {"value": None, "sd": None}
EMPTY_SUMMARY = {
    **dict.fromkeys(("format", "frames_total", "frames_measured", "frames_flagged"), 1),
    **dict.fromkeys(("diameter_mm", "diameter_px", "helix_angle_deg"), NOTHING),
    **{key: {} for key in ("rig", "input", "flags")},
}
DATA = Path(__file__).resolve().parents[2] / "data"


def made(section: str, counts: tuple[int, ...], sd_mm: float, seed: int = 0) -> Bundles:
    rng = np.random.default_rng(seed)
    n = np.array(counts, dtype=float)
    d = np.full(n.size, 0.24)
    diameter = SECTIONS[section].bundle_diameter_mm(n, d) + rng.normal(0, sd_mm, n.size)
    nothing = np.full(n.size, math.nan)
    names = tuple(f"bundle {k}" for k in counts)
    return Bundles(names, n, d, 0 * d, diameter, np.full(n.size, sd_mm), nothing)


@pytest.mark.parametrize("section", ["pair_core", "ring", "packing_fraction"])
@pytest.mark.parametrize("seed", range(5))
def test_the_section_that_made_the_bundles_is_supported(section: str, seed: int) -> None:
    support = judge(made(section, (2, 4, 6, 8), 0.008, seed))
    assert support.decided and support.verdicts[0].model.startswith(section)
    assert sum(v.weight for v in support.verdicts) == pytest.approx(1)


def test_a_pair_alone_cannot_tell_ring_from_pair_core() -> None:
    support = judge(made("ring", (2,), 0.01))
    weights = {v.model: v.weight for v in support.verdicts}
    assert weights["ring"] == pytest.approx(weights["pair_core"])
    assert not support.decided


def test_a_coarse_caliper_decides_nothing() -> None:
    assert not judge(made("pair_core", (2, 4), 0.15)).decided


def test_an_uncertain_string_weakens_the_verdict() -> None:
    sure = made("packing_fraction", (2, 4), 0.005)
    values = {name: getattr(sure, name) for name in sure.__dataclass_fields__}
    unsure = Bundles(**{**values, "string_sd_mm": np.full(2, 0.03)})
    assert judge(unsure).odds < judge(sure).odds


def test_the_papers_caliper_supports_a_constant_packing_fraction() -> None:
    bundles, notes = read_bundles([DATA / "diameter.csv"])
    assert bundles.strings.tolist() == [2, 3, 4, 5, 6, 7, 8] and "d = 0.24" in notes[0]
    support = judge(bundles)
    assert support.verdicts[0].model == "packing_fraction" and support.decided
    found = {v.model: v for v in support.verdicts}
    # The figures of an independent working: 0.077, 0.127, 0.023, and 0.026 leaving one N out.
    assert found["pair_core"].rmse_mm == pytest.approx(0.077, abs=0.0005)
    assert found["ring"].rmse_mm == pytest.approx(0.127, abs=0.0005)
    assert found["packing_fraction"].rmse_mm == pytest.approx(0.023, abs=0.0005)
    assert found["packing_fraction_refitted"].left_out_mm == pytest.approx(0.026, abs=0.0005)


def test_a_trend_with_load_is_shown() -> None:
    bundles = made("pair_core", (4,) * 9, 0.001)
    load = np.repeat([10.0, 30.0, 90.0], 3)
    values = {name: getattr(bundles, name) for name in bundles.__dataclass_fields__}
    thinner = bundles.diameter_mm * (1 - 0.05 * np.log10(load / 30))
    slope, low, high = judge(
        Bundles(**{**values, "load_N": load, "diameter_mm": thinner})
    ).load_slope
    assert low < -0.05 < high and slope == pytest.approx(-0.05, abs=0.004)


def summary(folder: Path, **changes: object) -> Path:
    folder.mkdir()
    content = (
        EMPTY_SUMMARY
        | {
            "diameter_mm": {"value": 0.71, "sd": 0.004},
            "rig": {"strings.count": 4, "strings.diameter_mm": 0.24, "actuator.load_N": 19.6},
        }
        | changes
    )
    (folder / "summary.json").write_text(json.dumps(content))
    return folder


def test_measured_folders_and_tables_together(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    one = summary(tmp_path / "run_one")
    table = tmp_path / "more.csv"
    table.write_text("N,d,load,diameter,sd\n2,0.24,20,0.48,0.01\n6,0.24,20,0.87,0.01\n")
    assert run(["validate", "--measured", str(one), str(table), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert [b["strings"] for b in answer["bundles"]] == [4, 2, 6]
    assert answer["bundles"][0]["load_N"] == 19.6
    assert run(["validate", "--measured", str(one), str(table)]) == 0
    assert "run_one" in capsys.readouterr().out


@pytest.mark.parametrize("separator", [";", "\t"])
def test_semicolons_and_tabs_part_values_too(separator: str, tmp_path: Path) -> None:
    path = tmp_path / "own.csv"
    path.write_text("N,d,load,diameter\n2,0.24,20,0.48\n6,0.24,20,0.87\n".replace(",", separator))
    bundles, _ = read_bundles([path])
    assert bundles.strings.tolist() == [2, 6] and bundles.diameter_mm.tolist() == [0.48, 0.87]


def test_a_decimal_comma_is_named(tmp_path: Path) -> None:
    """Of a load it would else be lost without a word."""
    path = tmp_path / "own.csv"
    path.write_text("N;d;load;diameter\n2;0.24;19,6;0.48\n")
    with pytest.raises(InputError, match="row 1: '19,6' in column 'load'; write a decimal point"):
        read_bundles([path])


@pytest.mark.parametrize(
    "changes", [{"diameter_mm": {"value": None, "sd": None}}, {"rig": {"strings.count": 4}}]
)
def test_a_folder_without_scale_or_string_is_one_line(
    changes: dict[str, object], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = summary(tmp_path / "run", **changes)
    assert run(["validate", "--measured", str(folder)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_misuse_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["validate", "--measured"]) == 2
    assert run(["validate", "somewhere"]) == 2
    assert run(["validate", "--measured", "nowhere.csv"]) == 2
    assert capsys.readouterr().err.count("\n") == 3
    with pytest.raises(InputError, match="bundle 2"):
        bundles = made("ring", (2,), 0.01)
        values = {name: getattr(bundles, name) for name in bundles.__dataclass_fields__}
        check(Bundles(**{**values, "diameter_mm": np.array([math.nan])}))
