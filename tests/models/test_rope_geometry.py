"""Rope geometry against figures published by others and against brute force."""

from __future__ import annotations

import numpy as np
import pytest

from tsvision.models import helix_then_coil, locked_pitch
from tsvision.models.rope_geometry import (
    centre_radius,
    coil_pitch,
    pair_centre_radius,
    tightest_coil,
    zero_twist_angle_rad,
)


@pytest.mark.parametrize(("strands", "degrees"), [(2, 39.4), (3, 42.8), (4, 43.8)])
def test_zero_twist_angles_of_olsen_and_bohr(strands: int, degrees: float) -> None:
    assert np.degrees(zero_twist_angle_rad(strands)) == pytest.approx(degrees, abs=0.05)


def test_more_strands_approach_half_a_right_angle() -> None:
    angles = np.degrees([zero_twist_angle_rad(n) for n in range(2, 13)])
    assert np.all(np.diff(angles) > 0) and 44.8 < angles[-1] < 45.0


def test_ideal_helix_has_its_known_pitch_to_radius() -> None:
    radius, pitch = tightest_coil()
    assert pitch / radius == pytest.approx(2.512, abs=0.002)


@pytest.mark.parametrize("radius", [0.45, 0.5, 0.7, 1.2])
def test_coils_at_their_smallest_pitch_just_touch(radius: float) -> None:
    pitch = float(coil_pitch(radius))
    t = np.linspace(np.pi, 3 * np.pi, 200001)
    apart = np.sqrt(2 * radius**2 * (1 - np.cos(t)) + (pitch * t / (2 * np.pi)) ** 2)
    inner = apart[1:-1]
    dips = inner[(inner < apart[:-2]) & (inner < apart[2:])]
    assert dips.min() == pytest.approx(1.0, abs=1e-3)


def test_two_strands_touch_straight_across_down_to_pitch_pi() -> None:
    pitch = np.array([6.0, np.pi, 3.0, 2.7, 2.2])
    radius = pair_centre_radius(pitch)
    np.testing.assert_allclose(radius[:2], 0.5)
    assert np.all(np.diff(radius[1:]) > 0)
    for p, a in zip(pitch, radius, strict=True):
        assert centre_radius(p / (2 * np.pi * a), 2) == pytest.approx(a, rel=1e-4)


def test_two_strands_have_no_helix_under_pitch_two() -> None:
    assert np.isnan(pair_centre_radius(1.99))


def test_feed_of_a_coiling_pair_lies_below_one_locked_turn() -> None:
    feed = float(helix_then_coil.feed_mm_per_turn(string_diameter_mm=0.4))
    assert feed == pytest.approx(2.888 * 0.4, rel=1e-3)
    whole_turn = locked_pitch.feed_mm_per_turn(centre_radius_mm=0.2, pitch_mm=np.pi * 0.4)
    assert feed < float(whole_turn)


def test_locked_pitch_is_a_3_4_5_turn() -> None:
    around = 3.0 / (2 * np.pi)
    assert locked_pitch.feed_mm_per_turn(centre_radius_mm=around, pitch_mm=4.0) == pytest.approx(5)


def test_past_the_lock_the_law_is_a_straight_line() -> None:
    turns = np.array([40.0, 41.0, 60.0])
    x = helix_then_coil.displacement_mm(
        turns, twisting_zone_mm=23.2, hole_distance_mm=5.0, string_diameter_mm=0.38
    )
    assert (x[1] - x[0]) == pytest.approx((x[2] - x[1]) / 19)
