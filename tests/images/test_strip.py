"""Means over squares of a strip that leaves the view."""

from __future__ import annotations

import numpy as np
import pytest

from tsvision.images.strip import averaged


@pytest.mark.parametrize("side", [2, 3, 5])
@pytest.mark.parametrize("channels", [(), (3,)])
def test_what_lies_out_of_view_hides_nothing_in_it(side: int, channels: tuple[int, ...]) -> None:
    """A box filter's running sums carry a NaN on to the strip's other end: with a corner out of
    view all of a noisy strip was unknown."""
    values = np.random.default_rng(5).normal(1.0, 0.1, (40, 60, *channels)).astype(np.float32)
    whole = averaged(values, side)
    values[:6, :30] = np.nan
    some = averaged(values, side)
    assert np.isnan(some[:6, :30]).all()
    assert np.isfinite(some[6:]).all() and np.isfinite(some[:, 30:]).all()
    np.testing.assert_allclose(some[6 + side :], whole[6 + side :], rtol=1e-5)
    assert np.nanstd(some) < np.nanstd(values)


def test_a_mean_over_a_corner_is_of_what_is_known_there() -> None:
    values = np.array([[np.nan, np.nan, 4.0], [np.nan, 2.0, 6.0], [1.0, 3.0, 8.0]], np.float32)
    assert averaged(values, 3)[1, 1] == pytest.approx(np.mean([4.0, 2.0, 6.0, 1.0, 3.0, 8.0]))
