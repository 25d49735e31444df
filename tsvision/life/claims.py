"""What the paper says about life, tested on its own table (or on any other).

One model carries all tests: log(cycles · x) = a_F + s_F log(turns), an intercept and a slope for
each load, one scatter for all. A slope of zero means that contraction endured does not depend on
how far each cycle goes. Intervals are Student's t at 95 %.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import stats

from tsvision.life.fit import LEVEL, Estimate
from tsvision.life.table import LifeTests
from tsvision.units import kgf_to_newton, newton_to_kgf

ABOUT_CONSTANT = 1.25  # "approximately constant": within this factor from least to most turns


@dataclass(frozen=True)
class Claim:
    """`estimate` is a factor on contraction endured (or an exponent, see `quantity`)."""

    claim: str
    quantity: str
    estimate: Estimate
    p_value: float
    verdict: str  # supported | not contradicted | contradicted | untestable


def test_claims(tests: LifeTests) -> list[Claim]:
    """Constant contraction endured at light loads; overtwist harms at heavy ones; load matters."""
    light, heavy = (float(kgf_to_newton(kgf)) for kgf in (3.5, 4.5))
    loads = np.unique(np.round(tests.load_N, 6))
    slopes = {load: _slope(tests, load) for load in loads}
    claims = [_constant(load, *slopes[load]) for load in loads if load < light]
    claims += [_harms(load, *slopes[load]) for load in loads if load > heavy]
    if any(load < light for load in loads) and any(load > heavy for load in loads):
        claims.append(_differs(tests, light, heavy))
    return [*claims, _load_matters(tests)]


test_claims.__test__ = False  # type: ignore[attr-defined]  # not one of pytest's


def _design(tests: LifeTests) -> tuple[np.ndarray, np.ndarray]:
    """Columns (n, 2 k): an intercept and a log-turns slope for each load; loads (k,)."""
    loads = np.unique(np.round(tests.load_N, 6))
    member = np.isclose(tests.load_N[:, None], loads[None])
    return np.hstack([member, member * np.log(tests.turns)[:, None]]).astype(float), loads


def _contrast(tests: LifeTests, weights: np.ndarray) -> tuple[Estimate, float, int]:
    """Estimate of weights · parameters with interval, one-sided p that it is >= 0, freedom."""
    columns, _ = _design(tests)
    broke = tests.broke
    columns, goal = columns[broke], np.log((tests.cycles * tests.contraction_mm)[broke])
    freedom = len(goal) - columns.shape[1]
    if freedom < 1 or np.linalg.matrix_rank(columns) < columns.shape[1]:
        return Estimate(math.nan, math.nan, math.nan), math.nan, 0
    values = np.linalg.solve(columns.T @ columns, columns.T @ goal)
    variance = float(np.sum((goal - columns @ values) ** 2)) / freedom
    sd = math.sqrt(variance * weights @ np.linalg.solve(columns.T @ columns, weights))
    value = float(weights @ values)
    half = float(stats.t.ppf(0.5 + LEVEL / 2, freedom)) * sd
    p_value = float(stats.t.cdf(value / sd, freedom))
    return Estimate(value, value - half, value + half), p_value, freedom


def _slope(tests: LifeTests, load: float) -> tuple[Estimate, float]:
    """Slope of one load, as the factor from its least to its most turns; one-sided p."""
    _, loads = _design(tests)
    span = tests.turns[np.isclose(tests.load_N, load)]
    weights = np.zeros(2 * loads.size)
    weights[loads.size + int(np.argmin(np.abs(loads - load)))] = math.log(span.max() / span.min())
    found, p_value, _ = _contrast(tests, weights)
    return Estimate(*(math.exp(v) for v in (found.value, found.low, found.high))), p_value


def _constant(load: float, factor: Estimate, p_value: float) -> Claim:
    two_sided = 2 * min(p_value, 1 - p_value)
    if math.isnan(factor.value):
        verdict = "untestable"
    elif not factor.low <= 1 <= factor.high:
        verdict = "contradicted"
    elif factor.low > 1 / ABOUT_CONSTANT and factor.high < ABOUT_CONSTANT:
        verdict = "supported"
    else:
        verdict = "not contradicted"
    return Claim(
        f"contraction endured is about constant at {newton_to_kgf(load):.3g} kgf",
        "contraction endured at the most turns over that at the fewest",
        factor,
        two_sided,
        verdict,
    )


def _harms(load: float, factor: Estimate, p_value: float) -> Claim:
    if math.isnan(factor.value):
        verdict = "untestable"
    elif factor.high < 1:
        verdict = "supported"
    else:
        verdict = "contradicted" if factor.low > 1 else "not contradicted"
    return Claim(
        f"overtwist shortens life at {newton_to_kgf(load):.3g} kgf",
        "contraction endured at the most turns over that at the fewest",
        factor,
        p_value,
        verdict,
    )


def _differs(tests: LifeTests, light: float, heavy: float) -> Claim:
    """Mean slope at heavy loads minus mean slope at light ones."""
    _, loads = _design(tests)
    weights = np.zeros(2 * loads.size)
    weights[loads.size :] += np.where(loads > heavy, 1 / (loads > heavy).sum(), 0.0)
    weights[loads.size :] -= np.where(loads < light, 1 / (loads < light).sum(), 0.0)
    found, p_value, freedom = _contrast(tests, weights)
    verdict = "untestable" if freedom < 1 else "supported" if found.high < 0 else "not contradicted"
    return Claim(
        "overtwist harms more under heavy load than under light",
        "difference of the slopes of log contraction endured against log turns",
        found,
        p_value,
        verdict,
    )


def _load_matters(tests: LifeTests) -> Claim:
    """Power of the load in contraction endured, slopes of the turns left free."""
    broke = tests.broke
    loads = np.log(tests.load_N[broke])
    columns = np.column_stack([np.ones_like(loads), loads, np.log(tests.turns[broke])])
    goal = np.log((tests.cycles * tests.contraction_mm)[broke])
    freedom = len(goal) - 3
    if freedom < 1 or np.linalg.matrix_rank(columns) < 3:
        nothing = Estimate(math.nan, math.nan, math.nan)
        return Claim(
            "life depends on the load", "power of the load", nothing, math.nan, "untestable"
        )
    inverse = np.linalg.inv(columns.T @ columns)
    values = inverse @ columns.T @ goal
    sd = math.sqrt(float(np.sum((goal - columns @ values) ** 2)) / freedom * inverse[1, 1])
    half = float(stats.t.ppf(0.5 + LEVEL / 2, freedom)) * sd
    found = Estimate(float(values[1]), float(values[1]) - half, float(values[1]) + half)
    verdict = "supported" if found.high < 0 else "not contradicted"
    p_value = float(stats.t.cdf(values[1] / sd, freedom))
    return Claim("life depends strongly on the load", "power of the load", found, p_value, verdict)
