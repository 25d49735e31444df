"""A fast part of the battery: what was planted must be found, and nothing else.

Seeds differ from those that anything was tuned on; the whole battery is a benchmark.
"""

from __future__ import annotations

import ast
import itertools
from pathlib import Path

import pytest

from tests.hidden import planted
from tsvision.diagnosis.diagnose import diagnose
from tsvision.diagnosis.table import table_from_rows
from tsvision.diagnosis.verdict import Verdict
from tsvision.records import Rig

SMALL = planted.Setting(levels=11, count=4)


def verdict(case: planted.Case) -> Verdict:
    return diagnose(table_from_rows(list(case.rows[0]), case.rows, Rig()))


def names(answer: Verdict) -> tuple[str, ...]:
    return tuple(sorted(cause.name for cause in answer.causes))


def classes(answer: Verdict) -> list[tuple[str, ...]]:
    return [tuple(sorted(found)) for found in answer.equivalent]


def test_the_generator_knows_nothing_of_the_mechanisms() -> None:
    tree = ast.parse(Path(planted.__file__).read_text())
    imported = {
        alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.Import)
        for alias in node.names
    } | {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    assert not any(name and name.startswith(("tsvision", "synth")) for name in imported)


@pytest.mark.parametrize(
    "name",
    ["radius_bias", "radial_compression", "backlash", "camera_scale", "coiling", "creep"],
)
def test_a_planted_effect_is_named(name: str) -> None:
    answer = verdict(planted.plain_case(name, 910_001, SMALL))
    assert answer.status == "explained"
    assert names(answer) == (name,)


@pytest.mark.parametrize(("name", "which"), [("radial_compression", 0), ("lost_turns", 1)])
def test_an_effect_in_a_form_that_is_not_on_the_shelf(name: str, which: int) -> None:
    answer = verdict(planted.foreign_case(name, which, 910_011, SMALL))
    assert (name,) in classes(answer)


def test_a_pair_is_named_exactly() -> None:
    answer = verdict(planted.pair_case("radius_bias", "backlash", 910_021, SMALL))
    assert ("backlash", "radius_bias") in classes(answer)


def test_what_diameter_displacement_and_angle_cannot_part_is_one_class() -> None:
    """Of radius, gear and camera any two make up for each other."""
    answer = verdict(planted.pair_case("radius_bias", "angle_scale", 910_023, SMALL))
    three = ("angle_scale", "camera_scale", "radius_bias")
    assert {tuple(sorted(p)) for p in itertools.combinations(three, 2)} == set(classes(answer))
    assert len(answer.exact_equivalences) == 1
    assert answer.next_experiment is not None
    assert answer.next_experiment["observable"] not in ("displacement_mm", "helix_angle_deg")


@pytest.mark.parametrize("seed", [910_031, 910_032])
def test_nothing_is_claimed_of_nothing(seed: int) -> None:
    answer = verdict(planted.plant([], seed, SMALL, "null"))
    assert answer.status == "no_discrepancy"
    assert answer.causes == () and answer.equivalent == ()


@pytest.mark.parametrize(("which", "seed"), [(0, 910_041), (2, 910_041), (3, 910_042)])
def test_an_effect_like_none_is_flagged_and_not_named(which: int, seed: int) -> None:
    """A ripple, a hump at one load, a drift with the clock."""
    answer = verdict(planted.unlike_case(which, seed, SMALL))
    assert answer.status == "unexplained"
    assert answer.causes == ()
    assert "displacement_mm" in answer.residual["hint"]


def test_displacement_alone_gives_the_class_and_a_reading_that_would_tell() -> None:
    setting = planted.Setting(observables=("displacement_mm",), count=4)
    answer = verdict(planted.plain_case("radius_bias", 910_051, setting))
    assert answer.status == "ambiguous"
    assert {("radius_bias",), ("angle_scale",), ("camera_scale",)} <= set(classes(answer))
    assert answer.next_experiment is not None
    assert answer.next_experiment["observable"] != "displacement_mm"


def test_the_proposed_reading_carried_out_shrinks_the_class() -> None:
    setting = planted.Setting(observables=("displacement_mm",), count=4)
    before = verdict(planted.plain_case("angle_scale", 910_061, setting))
    assert len(before.equivalent) > 1 and before.next_experiment is not None
    wider = planted.Setting(
        observables=("displacement_mm", before.next_experiment["observable"]), count=4
    )
    after = verdict(planted.plain_case("angle_scale", 910_061, wider))
    assert classes(after) == [("angle_scale",)]
