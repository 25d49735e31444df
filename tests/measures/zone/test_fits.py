"""How often the motor lets one expect the strands to turn; which coil of a recording is known."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tsvision.measures.helix.bundle import BundleFit
from tsvision.measures.helix.fit import HelixFit
from tsvision.measures.helix.section import pair_core
from tsvision.measures.helix.silhouette import KC, PARAMETERS, RC, RHO, K
from tsvision.measures.zone import fits
from tsvision.measures.zone.fits import best_known, expected_rate

NAN = float("nan")


def looks(connector_px: float, zero_px: float) -> Any:
    """A zone of 1000 px; NaN: out of view."""
    return SimpleNamespace(
        ends=SimpleNamespace(connector_px=connector_px),
        zero_known=np.isfinite(zero_px),
        zero_px=zero_px,
        zone_px=1000.0,
    )


@pytest.mark.parametrize(
    ("connector_px", "zero_px", "length_px"),
    [
        (1100.0, 100.0, 900.0),
        (NAN, 100.0, 900.0),
        (NAN, NAN, 1000.0),  # a close-up: no longer than the zone is
    ],
)
def test_between_apex_and_connector(connector_px: float, zero_px: float, length_px: float) -> None:
    rate = expected_rate(looks(connector_px, zero_px), 10.25, 200.0)
    assert rate == pytest.approx(2.0 * np.pi * 10.0 / length_px)


def test_without_turns_nothing_is_expected() -> None:
    assert np.isnan(expected_rate(looks(1100.0, 100.0), NAN, 200.0))


def coil(relief: float, cost: float = 0.2, radius_px: float = 7.0) -> BundleFit:
    """A coil that explains so much of the light inside."""
    p = np.zeros(PARAMETERS)
    p[RHO], p[K], p[RC], p[KC] = 4.0, 0.1, radius_px, 0.2
    nothing = np.zeros((PARAMETERS, PARAMETERS))
    fit = HelixFit(p, nothing, 0.3, cost, 200, pair_core(2), (0.0, 100.0), relief=relief)
    return BundleFit(fit, 0.0, 100.0, NAN)


def test_the_coil_known_best_is_the_last_that_explains_the_light_as_well() -> None:
    best, as_good, worse = coil(0.88), coil(0.8), coil(0.4)
    assert best_known(None, None, best) is best
    assert best_known(best, worse, None) is best
    assert best_known(best, worse, as_good) is as_good
    assert best_known(best, coil(0.95, radius_px=0.0), coil(0.88, cost=1.2)) is best


def test_beside_a_growing_knot_a_coil_is_what_it_was_before(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Coils unwind there: frame after frame another branch was told, a third off in pitch, from
    where the last of them had come to (bench seed 1312; turns seen 27 % short)."""
    before = coil(0.86)
    monkeypatch.setattr(fits, "as_elsewhere", lambda edges, found, best: best)
    branch, like = coil(0.4), coil(0.8)
    edges: Any = None
    assert fits._as_known(edges, branch, before) is before
    assert fits._as_known(edges, like, before) is like
    assert fits._as_known(edges, branch, None) is branch
    straight = coil(0.4, radius_px=0.0)
    assert fits._as_known(edges, straight, before) is straight


def twisted(rate: float, cost: float) -> BundleFit:
    """A coil of two strands that turn at `rate`, and what it costs."""
    found = coil(0.6, cost)
    p = found.fit.p.copy()
    p[K] = rate
    return replace(found, fit=replace(found.fit, p=p))


@pytest.mark.parametrize(("near_as_mid", "branch"), [(0.24, 0.1), (0.4, 0.2)])
def test_of_stretches_a_lobe_apart_the_one_that_describes_both_is_believed(
    monkeypatch: pytest.MonkeyPatch, near_as_mid: float, branch: float
) -> None:
    """Another branch was told beside the separator, where it leaves less of its own stretch than
    the right one, but twice as much of the other's (`tests.bench.pathtraced --wild 1485`: pitch a
    seventh off)."""
    near, mid = twisted(0.2, cost=0.2), twisted(0.1, cost=0.1)
    as_mid, as_near = twisted(0.1, near_as_mid), twisted(0.2, cost=0.25)
    laid = {id(near): as_mid, id(mid): as_near}
    monkeypatch.setattr(fits, "laid_like", lambda edges, found, other: laid[id(found)])
    edges: Any = None
    for found in fits._agreed(edges, near, mid):
        assert found is not None and found.fit.p[K] == branch


@pytest.mark.parametrize(("near_as_mid", "told"), [(0.24, 0.2), (0.15, 0.1)])
def test_where_only_one_makes_anything_of_the_other_it_has_to_describe_that_better(
    monkeypatch: pytest.MonkeyPatch, near_as_mid: float, told: float
) -> None:
    near, mid = twisted(0.2, cost=0.2), twisted(0.1, cost=0.1)
    laid = {id(near): twisted(0.1, near_as_mid), id(mid): twisted(0.2, cost=2.0)}
    monkeypatch.setattr(fits, "laid_like", lambda edges, found, other: laid[id(found)])
    edges: Any = None
    found, other = fits._agreed(edges, near, mid)
    assert found is not None and found.fit.p[K] == told
    assert other is mid


def test_stretches_that_do_not_lay_each_other_stay_as_they_are(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    near, mid = twisted(0.2, cost=0.2), twisted(0.1, cost=0.1)
    monkeypatch.setattr(fits, "laid_like", lambda edges, found, other: twisted(0.1, cost=2.0))
    edges: Any = None
    assert fits._agreed(edges, near, mid) == (near, mid)
