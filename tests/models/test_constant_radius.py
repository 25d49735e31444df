"""The paper's own law, against numbers worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from tsvision.data import table

from tsvision.models import MODELS

LAW = MODELS["constant_radius"]


def test_a_3_4_5_triangle() -> None:
    turns = 1 / (2 * np.pi)  # one rad
    x = LAW.displacement_mm(turns, twisting_zone_mm=4.0, hole_distance_mm=2.0, radius_mm=2.0)
    assert x == pytest.approx(1.0, abs=1e-12)
    slope = LAW.slope_mm_per_turn(turns, twisting_zone_mm=4.0, hole_distance_mm=2.0, radius_mm=2.0)
    assert slope == pytest.approx(2 * np.pi * 2.0 * 3 / 5)


def test_errors_on_the_life_cycle_table() -> None:
    """0.3 to 8.7 mm, always too large, 4.5 mm RMSE: the yardstick for every extension."""
    data = table("life_cycle")
    x = LAW.displacement_mm(
        data["turns"], twisting_zone_mm=23.2, hole_distance_mm=5.0, radius_mm=0.235
    )
    error = x - data["contraction_mm"].to_numpy()
    assert error.min() == pytest.approx(0.29, abs=0.005)
    assert error.max() == pytest.approx(8.70, abs=0.005)
    assert np.sqrt(np.mean(error**2)) == pytest.approx(4.53, abs=0.005)


def test_variable_radius_solves_its_own_equation() -> None:
    turns, zone, hole, radius = np.linspace(0, 90, 50), 23.2, 5.0, 0.235
    x = MODELS["variable_radius"].displacement_mm(
        turns, twisting_zone_mm=zone, hole_distance_mm=hole, radius_mm=radius
    )
    grown = radius * np.sqrt((zone + x) / zone)
    right = np.sqrt(zone**2 + (hole / 2 + 2 * np.pi * turns * grown) ** 2) - zone
    assert np.max(np.abs(right / np.maximum(x, 1e-9) - 1)) < 1e-10
