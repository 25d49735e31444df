"""What enters the standard uncertainties besides the fit's own."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tsvision.measures.edges.shading import LAMPS_RAD, Shading, plain_shading
from tsvision.measures.helix.section import pair_core
from tsvision.measures.helix.uncertainty import (
    diameter_sd_px,
    limb_unseen,
    pitch_sd_px,
    rests_on_shape,
)


def fit_of(strands: int, coiled: bool, seen_px: float = 90.0) -> SimpleNamespace:
    """A good fit of D = 20 px and p = 30 px, itself sure of both to 0.01 px."""
    return SimpleNamespace(
        p=np.full(9, 4.0),
        coiled=coiled,
        section=pair_core(strands),
        cost=0.05,
        uneven=False,
        light_cost=0.0,
        diameter_px=20.0,
        diameter_px_sd=0.005,
        pitch_px=30.0,
        z_px=(100.0, 100.0 + seen_px),
        derived=(np.array([20.0, 30.0, 2.0]), np.eye(3) * 2.5e-5),
    )


def lit_from(theta_deg: float, ambient: float) -> tuple[Shading, Shading]:
    """The upper and lower edge's shading under one lamp, seen from the upper limb's side."""
    sides = []
    for sign in (1.0, -1.0):
        lamps = np.where(np.isclose(LAMPS_RAD, sign * np.deg2rad(theta_deg)), 1.5, 0.0)
        sides.append(Shading(4.0, 0.8, ambient, lamps))
    return sides[0], sides[1]


def test_a_blurred_coil_s_pitch_is_less_sure_and_a_straight_bundle_s_is_not() -> None:
    sharp, blurred = (pitch_sd_px(fit_of(2, coiled=True), blur) for blur in (0.7, 2.8))  # type: ignore[arg-type]
    assert sharp < 0.1
    assert blurred == pytest.approx(1.5 * (2.8 / 20.0 - 0.04) * 30.0, rel=0.01)
    straight = [pitch_sd_px(fit_of(2, coiled=False), blur) for blur in (0.7, 2.8)]  # type: ignore[arg-type]
    assert straight[0] == straight[1] == sharp


def test_strands_that_are_held_by_earlier_frames_are_less_sure() -> None:
    fit = fit_of(2, coiled=True)
    even = diameter_sd_px(fit, (plain_shading(4.0),) * 2), pitch_sd_px(fit, 0.7)  # type: ignore[arg-type]
    fit.uneven = True
    uneven = diameter_sd_px(fit, (plain_shading(4.0),) * 2), pitch_sd_px(fit, 0.7)  # type: ignore[arg-type]
    for before, after, value in zip(even, uneven, (20.0, 30.0), strict=True):
        assert after == pytest.approx(np.hypot(before, 0.02 * value), rel=0.02)


def test_of_less_than_half_a_pitch_some_sides_are_not_seen() -> None:
    """A third of a turn beside the apex: 6 px of 93 and a fifth of the pitch off, stated to 1.2 px
    and a fortieth (`--wild 555`; `643` 5 px of 99, stated to 1.3)."""
    shade = plain_shading(4.0)

    def sds(seen_px: float) -> tuple[float, float]:
        fit = fit_of(2, False, seen_px)
        return diameter_sd_px(fit, (shade, shade)), pitch_sd_px(fit, 0.7)  # type: ignore[arg-type]

    whole, half, third = sds(90.0), sds(15.0), sds(11.0)
    assert whole == half
    assert third[0] > np.hypot(half[0], 0.03 * 20.0)
    assert third[1] > 0.1 * 30.0


def test_a_coil_of_more_than_two_strands_may_open() -> None:
    shade = plain_shading(4.0)
    sd = {n: diameter_sd_px(fit_of(n, coiled=True), (shade, shade)) for n in (2, 4, 6, 8)}  # type: ignore[arg-type]
    assert sd[2] < sd[4] == sd[6] == sd[8]
    straight = diameter_sd_px(fit_of(6, coiled=False), (shade, shade))  # type: ignore[arg-type]
    assert straight == pytest.approx(sd[2])


def test_a_limb_in_the_dark_is_told_by_the_diameter_s_uncertainty() -> None:
    assert limb_unseen(lit_from(67.5, 0.0))
    assert not limb_unseen(lit_from(67.5, 0.2))  # light from everywhere
    assert not limb_unseen(lit_from(22.5, 0.0))  # a lamp near the camera lights both
    beside, around = (
        diameter_sd_px(fit_of(2, coiled=False), lit_from(67.5, a))  # type: ignore[arg-type]
        for a in (0.0, 0.2)
    )
    assert beside == pytest.approx(np.hypot(around, 0.06 * 20.0), rel=0.01)


def test_a_frame_says_so_where_light_tells_the_width_no_better_than_the_shape_does() -> None:
    upper, lower = lit_from(67.5, 0.2)
    assert not rests_on_shape((upper, lower), 20.0)
    unsure = (replace(upper, place_sd_px=0.7), replace(lower, place_sd_px=0.7))
    assert rests_on_shape(unsure, 20.0)
    assert not rests_on_shape(unsure, 40.0)
    assert rests_on_shape(lit_from(67.5, 0.0), 40.0)


@pytest.mark.parametrize("coiled", [True, False])
def test_what_neither_outline_nor_light_is_sure_of_is_less_sure(coiled: bool) -> None:
    """Six strings that begin to coil, fitted as straight: 7 px thin of 97 and stated to 2.4
    (`wild 869`)."""
    good, poor = fit_of(2, coiled), fit_of(2, coiled)
    poor.cost, poor.relief = 0.67, 0.55
    shade = plain_shading(4.0)
    sds = [diameter_sd_px(fit, (shade, shade)) for fit in (good, poor)]  # type: ignore[arg-type]
    assert sds[1] == pytest.approx(np.hypot(sds[0], 0.04 * 20.0))
    assert pitch_sd_px(poor, 0.7) > 0.06 * 30.0 > pitch_sd_px(good, 0.7)  # type: ignore[arg-type]
