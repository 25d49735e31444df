"""Logs with a known break and known dirt are read as they were made."""

from __future__ import annotations

import importlib.util
import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cli.main import run
from tsvision.errors import InputError
from tsvision.riglog.read import read_log
from tsvision.riglog.report import report

_SPEC = importlib.util.spec_from_file_location(
    "tests_riglog_made_log", Path(__file__).with_name("made_log.py")
)
assert _SPEC and _SPEC.loader
made_log = importlib.util.module_from_spec(_SPEC)
sys.modules[_SPEC.name] = made_log
_SPEC.loader.exec_module(made_log)
Rig = made_log.Rig
REAL = Path(__file__).resolve().parents[2] / ".." / "shared" / "real" / "rig_log"


def made(folder: Path, rig):
    truth = made_log.make(rig)
    return truth, report(made_log.write(folder / "log.csv", truth.rows))


@pytest.mark.parametrize("logs_rest", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_cycles_and_break_are_found(seed: int, logs_rest: bool, tmp_path: Path) -> None:
    rig = Rig(break_cycle=31 + seed, break_share=0.3 + 0.15 * seed, logs_rest=logs_rest, seed=seed)
    truth, found = made(tmp_path, rig)
    assert len(found.cycles.start) == rig.break_cycle + rig.cycles_after
    assert found.cycles.by == ("rests" if logs_rest else "pauses")
    assert found.cycles.sound
    assert found.end.kind == "broke" and found.end.cycle == rig.break_cycle
    # The running median of three may cost one row either way.
    assert found.end.time_s == pytest.approx(truth.break_s, abs=2.5 * rig.step_s)


def test_a_rig_that_stops_at_once_still_shows_the_break(tmp_path: Path) -> None:
    rig = Rig(break_cycle=40, break_share=0.2, cycles_after=0, seed=5)
    _, found = made(tmp_path, rig)
    assert (found.end.kind, found.end.cycle) == ("broke", 40)


@pytest.mark.parametrize("seed", range(10))
def test_no_false_break(seed: int, tmp_path: Path) -> None:
    rig = Rig(cycles=25, noise_mA=60.0, wear_share=-0.2, logs_rest=seed % 2 == 0, seed=seed)
    _, found = made(tmp_path, rig)
    assert found.end.kind == "running"
    assert len(found.cycles.start) == 25


def test_starts_lie_where_they_were_made(tmp_path: Path) -> None:
    truth, found = made(tmp_path, Rig(cycles=20))
    starts = found.log.time_s[found.cycles.start]
    np.testing.assert_allclose(starts, truth.starts_s, atol=0.06)


def test_wear_is_found_and_absent_wear_is_not(tmp_path: Path) -> None:
    _, worn = made(tmp_path, Rig(wear_share=0.3, seed=1))
    _, fresh = made(tmp_path, Rig(wear_share=0.0, seed=1))
    trend = {t.measure: t for t in worn.trends}["load_mA"]
    assert trend.low > 0 and trend.share == pytest.approx(0.3 / 1.15, abs=0.04)
    none = {t.measure: t for t in fresh.trends}["load_mA"]
    assert none.low <= 0 <= none.high


def test_dirt_is_listed_and_costs_nothing(tmp_path: Path) -> None:
    rig = Rig(cycles=20, seed=2)
    rows = made_log.make(rig).rows
    rows[100, 0] = rows[99, 0]  # a repeated stamp
    path = made_log.write(tmp_path / "log.csv", rows)
    lines = path.read_text().splitlines()
    lines[50] = "garbage,,,"
    lines.insert(200, lines[0])
    path.write_text("\n".join(lines) + "\n12.3,4")
    found = report(path)
    kinds = {f.kind: f for f in found.findings}
    assert kinds["repeated_stamp"].count == 1 and kinds["repeated_stamp"].line == 102
    assert kinds["unreadable_rows"].count == 2 and kinds["unreadable_rows"].line == 51
    assert kinds["repeated_header"].line == 201
    assert kinds["saturated"].count > 20 and "cut_short" in kinds
    assert len(found.cycles.start) == 20


@pytest.mark.parametrize("separator", [";", "\t"])
def test_semicolons_and_tabs_part_values_too(separator: str, tmp_path: Path) -> None:
    lines = ["time_s,current_mA", *(f"{i / 10},{i % 7}" for i in range(30))]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(lines).replace(",", separator) + "\n")
    assert read_log(path).current_mA.tolist() == [i % 7 for i in range(30)]


def test_decimal_commas_are_named(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("time_s;current_mA\n" + "".join(f"0,{i:02};5\n" for i in range(30)))
    with pytest.raises(InputError, match=r"line 2 .*'0,00'.*decimal points"):
        read_log(path)


def test_a_restarted_logger_is_noticed(tmp_path: Path) -> None:
    first, second = made_log.make(Rig(cycles=12)).rows, made_log.make(Rig(cycles=8, seed=9)).rows
    found = report(made_log.write(tmp_path / "log.csv", np.vstack([first, second])))
    kinds = {f.kind for f in found.findings}
    assert {"clock_back", "counter_falls"} <= kinds
    assert len(found.cycles.start) == 20 and not found.cycles.sound


def test_a_counter_that_counts_without_motion_is_not_sound(tmp_path: Path) -> None:
    rows = made_log.make(Rig(cycles=20)).rows
    still = rows[:, 1] == 9
    rows[still, 2] = -3.0
    found = report(made_log.write(tmp_path / "log.csv", rows))
    assert len(found.cycles.start) == 19
    assert [f.count for f in found.findings if f.kind == "counter_without_motion"] == [1]


def test_supply_loss_inside_a_cycle_starts_no_new_one(tmp_path: Path) -> None:
    rows = made_log.make(Rig(cycles=20, logs_rest=True)).rows
    inside = np.flatnonzero(rows[:, 1] == 7)[12:24]
    rows[inside, 2:] = [0.0, 8.0]
    found = report(made_log.write(tmp_path / "log.csv", rows))
    assert len(found.cycles.start) == 20
    assert len(found.supply_losses) == 1 and found.supply_losses[0].cycle == 7


def test_a_stall_before_switching_off_is_no_break(tmp_path: Path) -> None:
    rows = made_log.make(Rig(cycles=20)).rows
    end = rows[-1, 0]
    jam = [(end + 0.05 * k, 20, 3276.0, 3300.0) for k in range(1, 60)]
    off = [(end + 3 + 0.05 * k, 20, 0.0, 8.0) for k in range(1, 60)]
    found = report(made_log.write(tmp_path / "log.csv", np.vstack([rows, jam, off])))
    assert found.end.kind == "stalled" and found.end.cycle == 20
    assert [s.cycle for s in found.stalls] == [20]


def test_other_column_names_and_no_supply(tmp_path: Path) -> None:
    rows = made_log.make(Rig(cycles=12)).rows
    path = tmp_path / "log.csv"
    path.write_text("time_s,current_mA\n" + "".join(f"{t},{i}\n" for t, _, i, _ in rows))
    found = report(path)
    assert len(found.cycles.start) == 12 and np.isnan(found.counted)


@pytest.mark.parametrize("text", ["", "a,b\n1,2\n", "Timestamp,Current\n1,2\n"])
def test_bad_logs_are_one_line(
    text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(InputError):
        report(path)
    assert run(["riglog", str(path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_command_json_and_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = made_log.make(Rig(break_cycle=30)).rows
    path = made_log.write(tmp_path / "log.csv", rows)
    table = tmp_path / "cycles.csv"
    assert run(["riglog", str(path), "--json", "--cycles", str(table)]) == 0
    answer = json.loads(capsys.readouterr().out)[0]
    assert answer["cycles"] == 34 and answer["end"]["kind"] == "broke"
    assert len(table.read_text().splitlines()) == 35


def test_a_log_without_current_is_told_in_json(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = made_log.make(Rig(cycles=6)).rows.copy()
    rows[:, 2] = 0.0
    path = made_log.write(tmp_path / "log.csv", rows)
    assert run(["riglog", str(path), "--json"]) == 0

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is not JSON")

    levels = json.loads(capsys.readouterr().out, parse_constant=refuse)[0]["levels"]
    assert levels["load_mA"] is None


@pytest.mark.skipif(not REAL.is_dir(), reason="the real rig logs are not beside the project")
def test_real_logs_agree_with_their_counter_where_it_is_sound() -> None:
    counts = {"a": (172, True), "b": (53, True), "c": (1598, True), "d": (5, False)}
    for name, (cycles, sound) in counts.items():
        found = report(REAL / f"run_{name}.csv")
        assert (len(found.cycles.start), found.cycles.sound) == (cycles, sound)
        assert found.counted == (cycles if sound else 6)
    findings = {f.kind: f for f in found.findings}
    assert findings["counter_without_motion"].count == 1  # run d counts a cycle without motion
    assert findings["repeated_stamp"].count == 4


def test_the_maker_itself_is_sound() -> None:
    truth = made_log.make(replace(Rig(), break_cycle=10))
    assert truth.break_s is not None
    after = truth.rows[truth.rows[:, 0] > truth.break_s + 0.2, 2]
    assert np.all((after < 200) | (after == 3276.0))


def test_a_log_in_which_nothing_moves_has_no_cycles(tmp_path: Path) -> None:
    rows = np.column_stack(
        [np.arange(200) * 0.05, np.zeros(200), np.full(200, -3.0), np.full(200, 4700.0)]
    )
    found = report(made_log.write(tmp_path / "log.csv", rows))
    assert len(found.cycles.start) == 0 and found.end.kind == "running"


def test_a_log_of_the_ceiling_alone_is_read(tmp_path: Path) -> None:
    rows = np.column_stack(
        [np.arange(200) * 0.05, np.ones(200), np.full(200, 3276.0), np.full(200, 3300.0)]
    )
    found = report(made_log.write(tmp_path / "log.csv", rows))
    assert {f.kind for f in found.findings} >= {"saturated"}


def test_a_long_log_is_read_in_seconds(tmp_path: Path) -> None:
    import time

    rows = made_log.make(Rig(cycles=550, logs_rest=True)).rows
    path = made_log.write(tmp_path / "log.csv", rows)
    assert len(rows) > 40_000
    begun = time.perf_counter()
    assert len(report(path).cycles.start) == 550
    assert time.perf_counter() - begun < 10


@settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
@given(
    seed=st.integers(0, 10_000),
    dead=st.integers(0, 600),
    resets=st.integers(0, 3),
    spikes=st.integers(0, 40),
)
def test_any_dirt_ends_in_a_report(
    tmp_path: Path, seed: int, dead: int, resets: int, spikes: int
) -> None:
    rng = np.random.default_rng(seed)
    rows = made_log.make(Rig(cycles=6, logs_rest=bool(seed % 2), seed=seed)).rows
    rows[rng.integers(0, len(rows), dead), 2:] = 0.0
    for _ in range(resets):
        rows[rng.integers(1, len(rows)) :, 0] -= rng.uniform(0, 20)
    rows[rng.integers(0, len(rows), spikes), 2] = rng.choice([3276.0, -3276.0, 1e5], spikes)
    found = report(made_log.write(tmp_path / "log.csv", rows[rng.integers(0, 20) :]))
    assert np.all(np.diff(found.cycles.start) > 0)
    assert len(found.table) == len(found.cycles.start)
    assert found.end.kind in ("broke", "stalled", "supply_off", "running")
