"""Onset and reversible contraction from geometry, beside what the paper saw."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tsvision.data import table

from tsvision.actuator.onset import RULES, predict_onset, rule_errors, scatter
from tsvision.actuator.reversible import coil_ratio, limit_errors, reversible_limit


def test_the_rule_comes_within_15_percent_of_all_four_onsets() -> None:
    errors = rule_errors("zero_twist_outer")
    assert set(errors) == {2, 4, 6, 8}
    assert max(map(abs, errors.values())) < 0.15


def test_it_is_the_best_of_the_rules_tried() -> None:
    assert min(RULES, key=lambda rule: scatter(rule)[0]) == "zero_twist_outer"


@pytest.mark.parametrize(
    "line", list(table("overtwist").itertuples()), ids=lambda r: f"N{r.strings}"
)
def test_interval_holds_the_observed_onset(line) -> None:
    zone = table("dimensions").set_index("strings")["twisting_zone_mm"][line.strings]
    onset = predict_onset(line.strings, zone, line.bundle_diameter_mm, 0.03)
    assert onset.low < line.onset_turns < onset.high
    assert math.tan(onset.helix_angle_rad) == pytest.approx(
        math.pi * line.bundle_diameter_mm * onset.turns / zone
    )


def test_onset_depends_on_shape_alone() -> None:
    small, big = predict_onset(4, 20.0, 0.7), predict_onset(4, 40.0, 1.4)
    assert small.turns == pytest.approx(big.turns)
    assert predict_onset(4, 40.0, 0.7).turns == pytest.approx(2 * small.turns)


def test_an_uncertain_diameter_widens_the_interval() -> None:
    sure, unsure = predict_onset(2, 23.2, 0.47), predict_onset(2, 23.2, 0.47, 0.05)
    assert unsure.high > sure.high and unsure.low < sure.low


def test_a_narrower_hole_allows_less() -> None:
    holes = np.linspace(0.3, 1.5, 25)
    limits = [reversible_limit(2, 23.2, 0.47, 5.0, h).displacement_mm for h in holes]
    assert np.all(np.diff(limits) >= 0)
    assert reversible_limit(2, 23.2, 0.47, 5.0, 0.3).limited_by == "hole"
    unknown = reversible_limit(2, 23.2, 0.47, 5.0)
    assert unknown.limited_by == "coil"
    assert limits[-1] == pytest.approx(unknown.displacement_mm)


def test_no_coil_stores_nothing() -> None:
    assert coil_ratio(0.0) == 1.0
    assert coil_ratio(0.01) == pytest.approx(1.0, abs=0.02)


def test_share_of_string_within_nine_points_of_the_paper() -> None:
    """Measured: 8.2 points at N = 2, 3.1 at most at N = 4, 6, 8."""
    data = table("contraction").set_index("strings")
    for strings, (predicted, _) in limit_errors().items():
        share = 100 * predicted / (predicted + data["twisting_zone_mm"][strings])
        error = abs(share - data["contraction_percent"][strings])
        assert error < (8.5 if strings == 2 else 4.0)
