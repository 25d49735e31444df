"""Several lines looked up at once are what numpy's interp says of each."""

from __future__ import annotations

import numpy as np

from tsvision.measures.numeric.interpolated import interpolated


def test_to_the_last_bit_as_numpy_on_the_grid_between_and_beyond_it() -> None:
    rng = np.random.default_rng(3)
    grid = np.arange(-14.0, 30.0, 0.05)
    lines = rng.normal(size=(5, grid.size))
    at = np.concatenate([rng.uniform(-16.0, 32.0, 400), rng.choice(grid, 40), grid[[0, 1, -2, -1]]])
    expected = np.stack([np.interp(at, grid, line) for line in lines], axis=1)
    np.testing.assert_array_equal(interpolated(at, grid, lines), expected)
