"""Bad data: an answer that holds, or a clear refusal in one line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.hidden import planted
from tsvision.diagnosis.diagnose import diagnose
from tsvision.diagnosis.rows import number
from tsvision.diagnosis.sources import diagnose_sources
from tsvision.diagnosis.table import read_rows, read_table, table_from_rows
from tsvision.diagnosis.verdict import Verdict
from tsvision.errors import InputError
from tsvision.records import Actuator, Rig, Strings

RIG = Rig(
    strings=Strings(count=4, diameter_mm=0.24),
    actuator=Actuator(twisting_zone_mm=23.2, hole_distance_mm=5.0),
)
SETTING = planted.Setting(levels=9, count=4)


def case(**changes: object) -> list[dict]:
    rows = planted.plain_case("radius_bias", 920_001, SETTING).rows
    return [{**row, **changes} for row in rows]


def answer(rows: list[dict], rig: Rig = RIG) -> Verdict:
    return diagnose(table_from_rows(list(rows[0]), rows, rig))


def refused(rows: list[dict], match: str) -> None:
    with pytest.raises(InputError, match=match) as problem:
        answer(rows)
    assert "\n" not in str(problem.value)


def without(rows: list[dict], *names: str) -> list[dict]:
    return [{k: v for k, v in row.items() if k not in names} for row in rows]


def test_too_few_observations_are_refused() -> None:
    refused(case()[:3], "at least 4")


def test_negative_load_is_refused_with_its_line() -> None:
    rows = case()
    rows[5] = {**rows[5], "load_N": -3}
    refused(rows, "line 7: load -3 N is negative")


def test_a_word_for_a_number_is_refused_with_its_line() -> None:
    rows = case()
    rows[2] = {**rows[2], "turns": "many"}
    refused(rows, "line 4: 'many'")


def test_an_unknown_observable_names_the_nearest() -> None:
    refused(case(observable="displacement"), "displacement_mm")


def test_a_misspelt_column_names_the_nearest() -> None:
    rows = [{**row, "load_n": row["load_N"]} for row in case()]
    refused(without(rows, "load_N"), "did you mean 'load_N'")


def test_metres_for_mm_are_noticed_and_asked_about() -> None:
    moved = [
        {**row, "value": row["value"] / 1000} if row["run"] == "run1" else row for row in case()
    ]
    refused([r for r in moved if r["observable"] == "displacement_mm"], "are they in m")


def test_a_few_metres_among_mm_are_noticed_and_asked_about() -> None:
    x = [row for row in case() if row["observable"] == "displacement_mm"]
    mixed = [{**r, "value": r["value"] / 1000} if i % 2 else r for i, r in enumerate(x)]
    refused(mixed, "are they in m")


def test_a_handful_of_readings_is_said_to_be_one() -> None:
    """Four contractions of the paper's table under one load: no single cause, and too few to
    test what is left."""
    shape = {
        "strings": 2,
        "bundle_diameter_mm": 0.47,
        "twisting_zone_mm": 23.2,
        "hole_distance_nominal_mm": 5.0,
    }
    x = {20: 16.06, 30: 27.77, 40: 40.26, 55: 59.02}
    rows = [
        {"turns": turns, "observable": "displacement_mm", "value": value, **shape}
        for turns, value in x.items()
    ]
    found = answer(rows)
    assert found.status in ("ambiguous", "unexplained", "no_discrepancy")
    assert found.residual["lack_of_fit_p"] is None
    assert "too few readings" in found.paragraph or found.status != "ambiguous"


def test_values_that_are_no_number_are_left_out_and_noted() -> None:
    rows = case()
    for i, nothing in enumerate((float("nan"), "NaN", "")):
        rows[3 * i] = {**rows[3 * i], "value": nothing}
    table = table_from_rows(list(rows[0]), rows, RIG)
    assert table.rows == len(rows) - 3
    assert any("3 rows without a value" in note for note in table.notes)


def test_radians_for_degrees_are_noticed() -> None:
    turned = [
        {**row, "value": np.radians(row["value"])}
        if row["observable"] == "helix_angle_deg"
        else row
        for row in case()
    ]
    refused(turned, "are they in rad")


def test_missing_constants_name_column_and_rig_key() -> None:
    rows = without(case(), "twisting_zone_mm")
    with pytest.raises(InputError, match=r"twisting_zone_mm.*actuator.twisting_zone_mm"):
        answer(rows, Rig())


def test_columns_win_over_the_rig() -> None:
    table = table_from_rows(list(case()[0]), case(twisting_zone_mm=30.0), RIG)
    assert np.all(table.at.twisting_zone_mm == 30.0)


def test_duplicates_and_empty_values_are_left_out_and_noted() -> None:
    rows = case()
    rows += [rows[3], {**rows[4], "value": ""}]
    table = table_from_rows(list(rows[0]), rows, RIG)
    assert table.rows == len(rows) - 2
    assert any("repeat" in note for note in table.notes)
    assert any("without a value" in note for note in table.notes)


def test_a_third_of_outliers_does_not_change_the_cause() -> None:
    rows = case()
    g = np.random.default_rng(3)
    wild = g.random(len(rows)) < 0.3
    spoiled = [
        {**row, "value": row["value"] * g.uniform(0.5, 1.6)} if bad else row
        for row, bad in zip(rows, wild, strict=True)
    ]
    found = answer(spoiled)
    assert ("radius_bias",) in found.equivalent


def test_one_load_only_still_gives_an_answer() -> None:
    rows = [row for row in case() if row["run"] == "run0"]
    found = answer(rows)
    assert ("radius_bias",) in found.equivalent
    assert found.gain is not None and found.gain["scheme"] == "leave-one-turn-block-out"


def test_constant_turns_name_no_single_cause() -> None:
    rows = [
        {**row, "turns": 20.0, "branch": "wind", "time_s": ""}
        for row in case()
        if row["observable"] == "displacement_mm" and row["turns"] > 10
    ]
    found = answer(rows)
    assert found.status in ("ambiguous", "unexplained", "no_discrepancy")


def test_an_empty_or_missing_file_is_refused(tmp_path: Path) -> None:
    empty = tmp_path / "empty.csv"
    empty.write_text("run,turns\n")
    with pytest.raises(InputError, match="no rows"):
        read_table(empty)
    with pytest.raises(InputError, match="does not exist"):
        diagnose_sources([tmp_path / "none.csv"], RIG)


@pytest.mark.parametrize("separator", [";", "\t"])
def test_semicolons_and_tabs_part_values_too(separator: str, tmp_path: Path) -> None:
    rows = ["run,observable,turns,value", "a,diameter_mm,1,0.5", "a,diameter_mm,2,0.6"]
    told = []
    for between in (",", separator):
        path = tmp_path / "data.csv"
        path.write_text("\n".join(rows).replace(",", between))
        told.append(read_rows(path))
    assert told[0] == told[1]


def test_a_decimal_comma_is_named() -> None:
    with pytest.raises(InputError, match=r"line 2: '1,5' in column 'turns'.*decimal point"):
        number("1,5", "turns", 2, "the table")


def test_a_wide_table_is_read_as_one() -> None:
    rows = [
        {"turns": n, "displacement_mm": x, "load_kgf": 2}
        for n, x in ((20, 16.06), (30, 27.76), (40, 40.22), (55, 59.02))
    ]
    table = table_from_rows(list(rows[0]), rows, RIG)
    assert table.observables == ("displacement_mm",)
    np.testing.assert_allclose(table.at.load_N, 19.6133)


def test_a_wide_table_states_the_noise_of_each_column() -> None:
    rows = [
        {
            "turns": n,
            "displacement_mm": x,
            "displacement_mm_sd": 0.3,
            "diameter_mm": 0.48,
            "diameter_sd_mm": 0.02,
        }
        for n, x in ((20, 16.06), (30, 27.76), (40, 40.22), (55, 59.02))
    ]
    table = table_from_rows(list(rows[0]), rows, RIG)
    assert table.observables == ("displacement_mm", "diameter_mm")
    np.testing.assert_allclose(table.value_sd[table.observable == 0], 0.3)
    np.testing.assert_allclose(table.value_sd[table.observable == 1], 0.02)
    assert not [note for note in table.notes if "not used" in note]


def test_without_times_and_branches_it_says_that_creep_is_out_of_the_question() -> None:
    rows = case()
    timeless = without(rows, "time_s")
    winding = [row for row in timeless if row["branch"] == "wind"]
    for given, said in ((rows, ""), (timeless, "for creep"), (winding, "not considered")):
        notes = [n for n in table_from_rows(list(given[0]), given, RIG).notes if "creep" in n]
        assert len(notes) == bool(said) and all(said in note for note in notes)


def test_creep_is_found_by_the_order_of_the_readings_where_times_are_missing() -> None:
    rows = planted.plain_case("creep", 7_600_001, SETTING).rows
    found = answer(without(rows, "time_s"))
    assert [cause.name for cause in found.causes] == ["creep"]


def test_time_tells_the_branch_where_no_column_does() -> None:
    def read(times: list[float]) -> list[bool]:
        turns = [0.0, 5.0, 10.0, 15.0, 10.0, 5.0]
        rows = [
            {"turns": n, "time_s": t, "observable": "displacement_mm", "value": 1.0 + n + 0.1 * i}
            for i, (n, t) in enumerate(zip(turns, times, strict=True))
        ]
        table = table_from_rows(list(rows[0]), rows, RIG)
        told = any("fell in time" in note for note in table.notes)
        back = table.at.unwinding[table.condition]
        assert told == back.any()
        return list(map(bool, back))

    assert read([0.0, 1.0, 2.0, 3.0, 4.0, 5.0]) == [False] * 4 + [True] * 2
    assert read([0.0, 1.0, 2.0, 3.0, 0.0, 1.0]) == [False] * 6  # a clock that starts again


def test_a_rig_that_states_the_load_too_takes_no_cause_away() -> None:
    """The load of the table's own rows counts, also where the rig happens to say the same."""
    shape = {"strings": 2, "bundle_diameter_mm": 0.47, "load_N": 49.03}
    rows = [
        {"turns": n, "observable": "displacement_mm", "value": x, **shape}
        for n, x in ((20, 16.06), (30, 27.76), (40, 40.22), (55, 59.02))
    ]
    rig = Rig(actuator=Actuator(twisting_zone_mm=23.2, hole_distance_mm=5.0, load_N=49.03))

    def recorded(given: list[dict], used: Rig) -> bool:
        table = table_from_rows(list(given[0]), given, used)
        np.testing.assert_allclose(table.at.load_N, 49.03)
        return table.load_recorded

    assert recorded(rows, rig)
    assert recorded(rows, Rig(actuator=replace(rig.actuator, load_N=float("nan"))))
    assert not recorded(without(rows, "load_N"), rig)


def test_each_cycle_of_a_run_has_its_own_reversal() -> None:
    """To 15, 30 and 20 turns in one run: what plays when the motor reverses counts from there."""
    path = [(n, peak) for peak in (15.0, 30.0, 20.0) for n in (0.0, peak / 2, peak, peak / 2, 0.0)]
    branch = ("wind", "wind", "wind", "unwind", "unwind")
    rows = [
        {"turns": n, "branch": branch[i % 5], "cycle": 1 + i // 5, "time_s": 10.0 * i}
        | {"observable": "displacement_mm", "value": 1.0 + n + 0.01 * i}
        for i, (n, _) in enumerate(path)
    ]
    whole = [peak for _, peak in path]
    for given in (rows, without(rows, "time_s"), without(rows, "cycle")):
        at = table_from_rows(list(given[0]), given, RIG).at
        np.testing.assert_array_equal(at.peak_turns[at.unwinding], np.array(whole)[at.unwinding])
        assert np.all(at.peak_turns >= at.turns)
    # Where neither tells, no order is known, and the largest turn count is the likeliest.
    bare = [{**row, "run": "r"} for row in without(rows, "time_s", "cycle")]
    at = table_from_rows(list(bare[0]), bare, RIG).at
    assert np.all(at.peak_turns[at.unwinding] == 30.0)
