"""Lines closed, opened and smoothed as scipy does."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import grey_closing, grey_opening, median_filter

from tsvision.measures.numeric.closing import closed, median_of_five, median_of_three, opened


@pytest.mark.parametrize("count", [1, 2, 5, 40, 301])
@pytest.mark.parametrize("size", [1, 2, 3, 4, 17, 18, 50])
def test_closed_and_opened(count: int, size: int) -> None:
    line = np.random.default_rng(count).normal(size=count)
    assert np.array_equal(closed(line, size), grey_closing(line, size=size, mode="nearest"))
    assert np.array_equal(opened(line, size), grey_opening(line, size=size, mode="nearest"))


@pytest.mark.parametrize("count", [1, 2, 3, 40])
def test_running_medians(count: int) -> None:
    line = np.random.default_rng(count).normal(size=count)
    assert np.array_equal(median_of_three(line), median_filter(line, size=3, mode="nearest"))
    assert np.array_equal(median_of_five(line), median_filter(line, size=5, mode="nearest"))


def test_a_dip_is_filled_and_a_spike_is_cut() -> None:
    line = np.zeros(40)
    line[10:13], line[30:33] = -1.0, 1.0
    assert closed(line, 5).min() == 0.0 and opened(line, 5).max() == 0.0
    assert closed(line, 3).min() == -1.0 and opened(line, 3).max() == 1.0
