"""Life models: exact on made-up tables, calibrated with stopped tests, honest about claims."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from lifelines import LogNormalAFTFitter

from cli.main import run
from tsvision.errors import InputError
from tsvision.life.claims import test_claims as paper_claims
from tsvision.life.fit import fit_all, fit_life, predict_cycles
from tsvision.life.shelf import LIFE_MODELS
from tsvision.life.table import LifeTests, paper_tests, read_tests


def made_up(rng: np.random.Generator, scatter: float, repeats: int = 2) -> LifeTests:
    """cycles = 200 (F/30)^-3 (x/30)^-1.5, log-normal scatter."""
    load, turns = (
        v.ravel().repeat(repeats) for v in np.meshgrid([15.0, 30.0, 50.0], [20, 30, 40, 55])
    )
    contraction = 1.05 * turns
    life = 200 * (load / 30) ** -3 * (contraction / 30) ** -1.5
    cycles = life * np.exp(rng.normal(0, scatter, load.size))
    everything = np.ones(load.size, dtype=bool)
    return LifeTests("made up", load, turns.astype(float), contraction, cycles, everything)


@pytest.mark.parametrize("model", LIFE_MODELS)
def test_shelf_contract(model: str) -> None:
    tests = paper_tests()
    entry = LIFE_MODELS[model]
    assert entry.columns(tests).shape == (12, len(entry.parameters))
    assert entry.offset(tests).shape == (12,)
    assert entry.title and entry.equation and entry.source


def test_exact_powers_come_back() -> None:
    fit = fit_life(LIFE_MODELS["power_contraction"], made_up(np.random.default_rng(0), 1e-6))
    found = [e.value for e in fit.parameters.values()]
    np.testing.assert_allclose(found, [math.log(200), 3.0, 1.5], rtol=1e-5)


def test_intervals_cover_with_stopped_tests() -> None:
    """A third of the tests stopped early: 95 % intervals of the load exponent still hold 3."""
    rng, hits, rounds = np.random.default_rng(11), 0, 60
    for _ in range(rounds):
        tests = made_up(rng, 0.3)
        limit = tests.cycles * rng.choice([0.6, 9.0], tests.cycles.size, p=[0.33, 0.67])
        stopped = replace(
            tests, cycles=np.minimum(tests.cycles, limit), broke=tests.cycles <= limit
        )
        exponent = fit_life(LIFE_MODELS["power_contraction"], stopped).parameters["load_exponent"]
        hits += exponent.low <= 3.0 <= exponent.high
    assert hits >= 0.88 * rounds


def test_leaving_out_the_stopped_tests_would_be_biased() -> None:
    """A rig that stops all at 150 cycles: counting survival mends what leaving them out breaks."""
    tests = made_up(np.random.default_rng(3), 0.5, repeats=12)
    stopped = replace(tests, cycles=np.minimum(tests.cycles, 150), broke=tests.cycles <= 150)
    model = LIFE_MODELS["power_contraction"]
    right = fit_life(model, stopped).parameters["log_cycles_at_reference"].value
    naive = fit_life(model, stopped.select(stopped.broke)).parameters["log_cycles_at_reference"]
    assert abs(right - math.log(200)) < 0.15 < 0.3 < math.log(200) - naive.value


def test_agrees_with_lifelines() -> None:
    tests = made_up(np.random.default_rng(4), 0.3)
    stopped = replace(tests, cycles=np.minimum(tests.cycles, 400), broke=tests.cycles <= 400)
    mine = fit_life(LIFE_MODELS["power_contraction"], stopped)
    columns = LIFE_MODELS["power_contraction"].columns(stopped)
    frame = pd.DataFrame({"load": columns[:, 1], "way": columns[:, 2]})
    frame = frame.assign(cycles=stopped.cycles, broke=stopped.broke)
    other = LogNormalAFTFitter().fit(frame, "cycles", "broke").params_["mu_"]
    expected = [other["Intercept"], other["load"], other["way"]]
    np.testing.assert_allclose(mine.values, expected, rtol=2e-3)
    assert mine.log_likelihood == pytest.approx(
        LogNormalAFTFitter().fit(frame, "cycles", "broke").log_likelihood_, abs=0.01
    )


def test_prediction_interval_holds_new_strings() -> None:
    rng = np.random.default_rng(7)
    fit = fit_life(LIFE_MODELS["power_contraction"], made_up(rng, 0.3))
    new = made_up(rng, 0.3, repeats=60)
    _, low, high = predict_cycles(fit, new)
    assert 0.88 < np.mean((new.cycles > low) & (new.cycles < high)) <= 1.0


def test_the_papers_claims() -> None:
    verdicts = {claim.claim: claim.verdict for claim in paper_claims(paper_tests())}
    assert verdicts["contraction endured is about constant at 2 kgf"] == "not contradicted"
    assert verdicts["contraction endured is about constant at 3 kgf"] == "not contradicted"
    assert verdicts["overtwist shortens life at 5 kgf"] == "supported"
    assert verdicts["overtwist harms more under heavy load than under light"] == "supported"


def test_claims_fail_where_the_data_say_otherwise() -> None:
    tests = paper_tests()
    worse = replace(tests, cycles=tests.cycles * (20 / tests.turns) ** 1.5)
    verdicts = [c.verdict for c in paper_claims(worse) if "constant" in c.claim]
    assert verdicts == ["contradicted", "contradicted"]


def test_a_load_that_hastens_explains_the_paper_best() -> None:
    fits = fit_all(paper_tests())
    assert fits[0].model == "exponential_hastens"
    assert fits[0].left_out_factor < 1.25
    assert fits[-1].model == "work_endured"


def test_command_predicts(capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["--load", "19.6", "--turns", "40", "--contraction", "40.2", "--json"]
    assert run(["life", *asked]) == 0
    answer = json.loads(capsys.readouterr().out)
    best = answer["predictions"][0]
    assert best["low"] < 550 < best["high"]  # the paper's own test under 2 kgf
    assert len(answer["claims"]) == 5


def test_own_table_with_stopped_tests(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "own.csv"
    path.write_text(
        "load_N,turns,cycles,contraction_mm,broke\n10,20,900,15,1\n10,40,400,40,0\n"
        "20,20,100,15,1\n20,40,41,40,1\n30,20,33,15,yes\n"
    )
    assert not read_tests(path).broke[1]
    assert run(["life", str(path)]) == 0
    assert "1 stopped" in capsys.readouterr().out


@pytest.mark.parametrize("separator", [";", "\t"])
def test_semicolons_and_tabs_part_values_too(separator: str, tmp_path: Path) -> None:
    path = tmp_path / "own.csv"
    rows = ["load_N, turns,cycles,contraction_mm", "10,20,900.5,15", "20,20,100,15"]
    path.write_text("\n".join(rows).replace(",", separator))
    tests = read_tests(path)
    assert tests.turns.tolist() == [20, 20] and tests.cycles.tolist() == [900.5, 100]


def test_a_decimal_comma_is_named(tmp_path: Path) -> None:
    path = tmp_path / "own.csv"
    path.write_text("load_N;turns;cycles;contraction_mm\n10;20;900;15,5\n")
    with pytest.raises(InputError, match="row 1: contraction_mm is '15,5'; write a decimal point"):
        read_tests(path)


@pytest.mark.parametrize(
    "text",
    [
        "turns,cycles,contraction_mm\n1,2,3\n",
        "load_N,turns,cycle,contraction_mm\n1,2,3,4\n",
        "load_N,turns,cycles,contraction_mm\n1,2,0,4\n",
        "load_N,turns,cycles,contraction_mm,broke\n1,2,5,4,maybe\n",
        "load_N,turns,cycles,contraction_mm\n1,2,5,4\n",
        "",
    ],
)
def test_bad_tables_are_one_line(
    text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "bad.csv"
    path.write_text(text)
    assert run(["life", str(path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    with pytest.raises(InputError):
        fit_all(read_tests(path))
