"""Strings that an eye parts from their ground at once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.bench.colours import drawn
from tests.measures.films import measured


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "most_px"),
    [(303, 1.2), (304, 2.2), (341, 0.8), (344, 2.0), (346, 0.8), (413, 0.6), (446, 1.0)],
    ids=[
        "blue before blue",
        "green and grey",
        "wider line",
        "orange before green",
        "gleaming",
        "red before green",
        "yellow before grey",
    ],
)
def test_strings_that_an_eye_sees_at_once(tmp_path: Path, seed: int, most_px: float) -> None:
    """Blue ones before blue cloth were followed between their crests, at half their width, and no
    frame had a D. Of green and grey ones before green a hue showed the grey's, in a twentieth of
    the columns, which made D twice too large, or none. Of grey and orange ones before a bright
    ground the likeliest line was wider than any bundle of these strings, and no other was tried:
    6 px thin of 28, as cords that bow. Of orange ones before green, in shadow and JPEG, the
    outline's shape was believed instead of limbs that no darkness hides: D stated to 14 px of 80.
    Black ones before black that gleam were 5 px thin of 14, stated to 0.7. Six red ones before
    green, a twelfth thicker in one of three frames, were 1.8 px thin of 61, stated to 1.6: rounds
    passed for going to and fro that did not, but for which of the frames fitted best. Yellow ones
    before mottled grey, with a soft shadow beside them, were 2.3 px wide of 16, stated to 1.0, by
    brightness alone: no hue, in which there is no shadow, was asked as long as that was said to
    tell the width to a px."""
    _, error_px, sd_px = measured(tmp_path / "film", drawn(seed).settings)
    assert np.abs(error_px).max() < most_px
    assert (np.abs(error_px) < 2.0 * sd_px).all()
    assert sd_px.max() < 3.0
