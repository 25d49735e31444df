"""Stripes: plane waves on a cylinder with exact rates, and noise that holds none."""

from __future__ import annotations

import numpy as np
import pytest

from tsvision.measures.cords.stripes import coarse_slope, find_stripes

RADIUS_PX, HALF = 20.0, 30


def striped(repeat_px: float, around: float, noise: float = 0.0, length: int = 600) -> np.ndarray:
    """(2 HALF + 1, length): cos(k s - m theta) on a cylinder seen from the front."""
    n = np.arange(-HALF, HALF + 1)[:, None]
    theta = np.arcsin(np.clip(n / RADIUS_PX, -1.0, 1.0))
    s = np.arange(length)[None, :]
    wave = np.cos(2.0 * np.pi * s / repeat_px - around * theta)
    return wave + np.random.default_rng(3).normal(0.0, max(noise, 1e-9), wave.shape)


@pytest.mark.parametrize(("around", "hand"), [(4.0, 1), (-4.0, -1), (6.0, 1)])
def test_rate_and_sense_of_a_wave(around: float, hand: int) -> None:
    found = find_stripes([striped(33.0, around, 1.0)], np.full(600, float(HALF)), RADIUS_PX)
    assert found is not None
    assert found.repeat_px == pytest.approx(33.0, rel=0.003)
    assert abs(found.repeat_px - 33.0) < 3.0 * found.repeat_px_sd
    assert found.around == pytest.approx(abs(around), abs=0.3)
    assert np.sign(found.slope) == hand
    assert found.slope == pytest.approx(RADIUS_PX * 2.0 * np.pi / 33.0 / around, rel=0.1)
    assert found.strands_a_wave == 1


def test_one_wave_a_turn_spans_two_strands() -> None:
    found = find_stripes([striped(80.0, 2.0)], np.full(600, float(HALF)), RADIUS_PX)
    assert found is not None
    assert found.strands_a_wave == 2
    assert found.repeat_px == pytest.approx(40.0, rel=0.01)


def test_the_channel_with_the_stripes_is_taken() -> None:
    plain = np.random.default_rng(5).normal(0.0, 1.0, (2 * HALF + 1, 600))
    found = find_stripes([plain, striped(33.0, 4.0)], np.full(600, float(HALF)), RADIUS_PX)
    assert found is not None
    assert found.repeat_px == pytest.approx(33.0, rel=0.003)


def test_waves_alike_on_both_senses_are_no_stripes() -> None:
    both = striped(33.0, 4.0) + striped(33.0, -4.0)
    found = find_stripes([both], np.full(600, float(HALF)), RADIUS_PX)
    assert found is None or found.confidence < 0.2


def test_coarse_bands_outlast_the_stripes_of_plied_strands() -> None:
    fine, bands = striped(22.0, -4.0), striped(200.0, 2.0)
    row = np.full(600, float(HALF))
    assert coarse_slope(fine + bands, row, RADIUS_PX) > 0.4
    assert abs(coarse_slope(fine, row, RADIUS_PX)) < 1.0
    assert find_stripes([2.0 * fine + bands], row, RADIUS_PX).slope < 0.0  # type: ignore[union-attr]
