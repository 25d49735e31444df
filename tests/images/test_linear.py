"""Light looked up and summed at once is the same as one after the other."""

from __future__ import annotations

import numpy as np
import pytest

from tsvision.images.linear import LUMA_BGR, linear_signal, project, to_linear

NAN = float("nan")


@pytest.mark.parametrize("gamma", [NAN, 1.0, 2.2])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_of_colour(gamma: float, dtype: type) -> None:
    rng = np.random.default_rng(0)
    picture = rng.integers(0, np.iinfo(dtype).max + 1, (40, 60, 3), dtype)
    part = picture[3:31, 7:50]
    for weights in (LUMA_BGR, np.array([0.0, 0.2, 0.8], np.float32)):
        there = project(to_linear(np.ascontiguousarray(part), gamma), weights)
        signal = linear_signal(part, weights, gamma)
        assert signal.dtype == np.float32 and signal.shape == part.shape[:2]
        # a last bit, where the processor rounds sums of products once and not twice
        assert np.abs(signal - there).max() <= 1.2e-7


def test_of_grey() -> None:
    picture = np.arange(256, dtype=np.uint8).reshape(16, 16)
    assert np.array_equal(linear_signal(picture, LUMA_BGR), to_linear(picture))
