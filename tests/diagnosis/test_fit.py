"""The fit's laws: units, noise, nuisances, correlation, evidence."""

from __future__ import annotations

import numpy as np
import pytest

from tests.hidden import planted
from tsvision.diagnosis.fit import fit, posterior
from tsvision.diagnosis.lack_of_fit import lack_of_fit
from tsvision.diagnosis.problem import Problem, prepare
from tsvision.diagnosis.table import table_from_rows
from tsvision.mechanisms import MECHANISMS, Simulation
from tsvision.records import Rig


def problem(case: planted.Case) -> Problem:
    return prepare(table_from_rows(list(case.rows[0]), case.rows, Rig()))


def test_an_exact_radius_is_recovered_within_its_interval() -> None:
    """radius_bias of the generator: r (1 ± 5 … 20 %); D is stated within 1 %."""
    given = planted.plain_case("radius_bias", 930_001, planted.Setting(count=4, tolerance_times=0))
    asked = problem(given)
    found = posterior(asked, fit(asked, MECHANISMS["radius_bias"].extend(Simulation())))
    value, low, high = found["radius_bias.radius_change_mm"]
    seen = [r["value"] for r in given.rows if r["observable"] == "diameter_mm"]
    truth = (float(np.median(seen)) - 0.70) / 2
    assert low < truth < high
    assert value == pytest.approx(truth, abs=0.01)


def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    held = 0
    for seed in range(40):
        g = np.random.default_rng(seed)
        lost = g.uniform(0.8, 3.0)

        def plan(w: planted.World, _: np.random.Generator, lost: float = lost) -> None:
            w.n = np.maximum(w.n - lost, 0)

        given = planted.plant([("lost_turns", plan)], 931_000 + seed, planted.Setting(levels=9))
        asked = problem(given)
        found = posterior(asked, fit(asked, MECHANISMS["lost_turns"].extend(Simulation())))
        _, low, high = found["lost_turns.lost_turns"]
        held += low < lost < high
    assert held >= 35  # 95 % of 40 are 38; fewer than 35 by chance in 1 of 40 runs


def test_the_noise_and_its_correlation_are_estimated() -> None:
    setting = planted.Setting(
        correlation=0.6, outliers=0.0, tolerance_times=0.0, levels=25, count=2
    )
    rho = []
    for seed in range(5):
        asked = problem(planted.plant([], 932_000 + seed, setting, "null"))
        rho.append(lack_of_fit(asked, fit(asked, Simulation())).rho)
    assert np.mean(rho) == pytest.approx(0.6, abs=0.1)


def test_lack_of_fit_is_quiet_on_noise_and_loud_on_a_ripple() -> None:
    quiet = problem(planted.plant([], 933_001, planted.Setting(), "null"))
    assert lack_of_fit(quiet, fit(quiet, Simulation())).p > 1e-4
    loud = problem(planted.unlike_case(0, 933_002))
    assert lack_of_fit(loud, fit(loud, Simulation())).p < 1e-6


def test_evidence_prefers_the_cause_that_acts() -> None:
    asked = problem(planted.plain_case("backlash", 934_001))
    base = fit(asked, Simulation()).log_evidence
    right = fit(asked, MECHANISMS["backlash"].extend(Simulation())).log_evidence
    wrong = fit(asked, MECHANISMS["zone_length"].extend(Simulation())).log_evidence
    assert right - base > 20
    assert right - wrong > 20


def test_evidence_of_an_idle_cause_pays_for_its_parameter() -> None:
    asked = problem(planted.plant([], 935_001, planted.Setting(), "null"))
    base = fit(asked, Simulation()).log_evidence
    for name in ("lost_turns", "axial_stretch", "backlash", "zone_length"):
        assert fit(asked, MECHANISMS[name].extend(Simulation())).log_evidence - base < 3.0
