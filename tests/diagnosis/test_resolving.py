"""Which reading leaves one cause: Gaussians whose divergence is known, and three rivals."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from tsvision.diagnosis.resolving import Expected, Rival, _gain, chance_to_resolve

NOISE = np.full(6, 0.1)
ALARM = 3.0


def rival(name: str, log_evidence: float = 20.0) -> Rival:
    fitted: Any = SimpleNamespace(names=tuple(name.split("+")))
    return Rival(fitted, log_evidence)


def at(level: float, unsure: float = 0.0) -> Expected:
    """Six readings at one level that is itself known only to `unsure`."""
    return Expected(np.full(6, level), np.full((6, 1), unsure))


BASE = rival("base", 0.0)


def test_the_gain_is_that_of_many_draws() -> None:
    g = np.random.default_rng(5)
    root_own, root_other = g.normal(size=(2, 3, 3))
    own = root_own @ root_own.T + np.eye(3)
    other = root_other @ root_other.T + np.eye(3)
    apart = np.array([0.5, -1.0, 0.7])
    y = g.multivariate_normal(apart, own, 200_000)
    ratio = multivariate_normal(apart, own).logpdf(y) - multivariate_normal(None, other).logpdf(y)
    mean, spread = _gain(apart, own, other)
    assert mean == pytest.approx(ratio.mean(), abs=4 * ratio.std() / np.sqrt(len(y)))
    assert spread == pytest.approx(ratio.std(), rel=0.02)


def test_what_parts_all_resolves_and_what_parts_none_does_not() -> None:
    rivals = [rival("a"), rival("b"), rival("c")]
    apart = [at(0.0), at(1.0), at(2.0), at(9.0)]
    alike = [at(0.0), at(0.0), at(0.0), at(9.0)]
    assert chance_to_resolve(rivals, apart, NOISE, BASE, ALARM) > 0.99
    assert chance_to_resolve(rivals, alike, NOISE, BASE, ALARM) < 0.01


def test_a_third_that_stays_beside_two_is_seen() -> None:
    """One of three stands far off and is alone if it is true; the other two stay together."""
    rivals = [rival("a"), rival("b"), rival("c")]
    seen = [at(0.0), at(0.0), at(5.0), at(9.0)]
    assert chance_to_resolve(rivals, seen, NOISE, BASE, ALARM) == pytest.approx(1 / 3, abs=0.01)


def test_a_rival_that_can_follow_anything_is_not_left_behind() -> None:
    rivals = [rival("a"), rival("b")]
    sure = chance_to_resolve(rivals, [at(0.0), at(0.3), at(9.0)], NOISE, BASE, ALARM)
    loose = chance_to_resolve(rivals, [at(0.0, 0.3), at(0.3, 0.3), at(9.0)], NOISE, BASE, ALARM)
    assert sure > 0.99 and loose < 0.2


def test_readings_on_which_a_rival_and_the_base_agree_leave_the_alarm_where_it_was() -> None:
    """What just passed the alarm by displacement may fall below it, by no fault of the reading."""
    seen = [at(0.0), at(5.0), at(0.0)]
    faint = [rival("a", 3.0), rival("b", -30.0)]
    plain = [rival("a", 20.0), rival("b", -30.0)]
    assert chance_to_resolve(plain, seen, NOISE, BASE, ALARM) > 0.99
    assert chance_to_resolve(faint, seen, NOISE, BASE, ALARM) == pytest.approx(0.5, abs=0.01)


def test_a_larger_set_must_earn_its_place_and_a_smaller_one_is_kept_longer() -> None:
    together = [rival("a", 20.0), rival("a+b", 20.5)]
    seen = [at(0.0), at(0.0), at(9.0)]
    # If `a` is true the pair leads by 0.5, not by the 2.5 that it needs; if the pair is, `a` stays.
    share = 1.0 / (1.0 + np.exp(0.5))
    found = chance_to_resolve(together, seen, NOISE, BASE, ALARM)
    assert found == pytest.approx(share, abs=0.01)
