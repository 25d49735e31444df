"""What the zero of the displacement may hide, and a hole distance that was left out."""

from __future__ import annotations

import numpy as np
import pytest

from tests.hidden import planted
from tsvision.diagnosis.diagnose import diagnose
from tsvision.diagnosis.extended import build_model
from tsvision.diagnosis.problem import prepare
from tsvision.diagnosis.table import table_from_rows
from tsvision.diagnosis.verdict import Verdict
from tsvision.errors import InputError
from tsvision.records import Rig

ONLY_X = planted.Setting(observables=("displacement_mm",))
AT_REST_MM = np.hypot(23.2, 2.5) - 23.2  # the formula's x at 0 turns


def verdict(rows: list[dict], base: str = "constant_radius") -> Verdict:
    return diagnose(table_from_rows(list(rows[0]), rows, Rig()), base)


def zeroed(rows: list[dict]) -> list[dict]:
    return [{**row, "value": row["value"] - AT_REST_MM} for row in rows]


def test_the_common_zero_is_as_wide_as_being_zeroed_half_of_the_time() -> None:
    """All of x(0) is missing in one table of two: the root mean square is 0.71 of it."""
    case = planted.plant([], 940_001, planted.Setting(ONLY_X.observables, tolerance_times=0.0))
    asked = prepare(table_from_rows(list(case.rows[0]), case.rows, Rig()))
    assert asked.offsets[:, -1] == pytest.approx(np.sqrt(0.5) * AT_REST_MM, rel=1e-9)


@pytest.mark.parametrize("seed", [940_011, 940_012, 940_013])
def test_no_alarm_whichever_zero_the_readings_have(seed: int) -> None:
    rows = planted.plant([], seed, ONLY_X).rows
    assert verdict(rows).status == "no_discrepancy"
    assert verdict(zeroed(rows)).status == "no_discrepancy"


def narrower(w: planted.World, _: np.random.Generator) -> None:
    w.hole = w.hole - 1.5


@pytest.mark.parametrize("seed", [940_021, 940_022, 940_026])
def test_holes_nearer_by_1_5_mm_show_in_displacement_whichever_zero_it_has(seed: int) -> None:
    rows = planted.plant([("hole_distance", narrower)], seed, ONLY_X).rows
    assert ("hole_distance",) in verdict(rows).equivalent
    assert ("hole_distance",) in verdict(zeroed(rows)).equivalent


@pytest.mark.parametrize("seed", [77_000, 77_002, 77_004, 77_005])
def test_a_hole_distance_that_was_left_out_is_named(seed: int) -> None:
    """The claim says so: "or S was left out". It must not take a second cause to get there."""
    rows = [
        {**row, "hole_distance_nominal_mm": 0.0} for row in planted.plant([], seed, ONLY_X).rows
    ]
    assert verdict(rows).equivalent == (("hole_distance",),)


@pytest.mark.parametrize("seed", [77_000, 77_002])
def test_the_model_without_s_is_shown_to_lack_it(seed: int) -> None:
    case = planted.plant([], seed, ONLY_X)
    found = verdict(case.rows, "separator_no_offset")
    assert found.equivalent == (("hole_distance",),)
    change = found.causes[0].parameters["hole_distance_change_mm"]
    assert change.value == pytest.approx(5.0, abs=0.7)  # L and r, off by 1 sd, take some of it
    x = build_model(found.model).displacement_mm([row["turns"] for row in case.rows])
    assert x == pytest.approx(case.clean_mm, abs=0.3)


@pytest.mark.parametrize("model", ["no_separator", "locked_pitch", "helix_then_coil"])
def test_a_model_that_causes_cannot_act_on_is_refused(model: str) -> None:
    rows = planted.plant([], 77_000, ONLY_X).rows
    with pytest.raises(InputError, match="cannot be questioned"):
        verdict(rows, model)


def test_no_model_of_that_name_lists_the_shelf() -> None:
    rows = planted.plant([], 77_000, ONLY_X).rows
    with pytest.raises(InputError, match="did you mean 'variable_radius'"):
        verdict(rows, "variable_radios")
