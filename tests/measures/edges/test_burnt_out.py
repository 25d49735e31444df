"""Strings brighter than the sensor holds: said so, and measured with less certainty."""

from __future__ import annotations

import numpy as np
import pytest

from tests.measures.pictures import CASE, measure, picture
from tests.srgb import encode
from tsvision.flags import Flag, flags_from_text
from tsvision.images.linear import to_linear


def exposed(times: float) -> np.ndarray:
    """Bright strings under so many times the light."""
    light = to_linear(picture(dark_on_bright=False, strings=4), float("nan"))
    return encode(np.minimum(times * light, 1.0))


@pytest.fixture(scope="module")
def burnt() -> np.ndarray:
    return exposed(4.0)


def test_burnt_out_strings_are_flagged_and_less_sure(burnt: np.ndarray) -> None:
    """Of two films of eight whose strings were burnt out nothing said so, for the ground was not,
    and D was 0.5 px too thick of 13 with 0.2 stated (`wild 649`)."""
    plain, white = measure(exposed(1.0), strings=4), measure(burnt, strings=4)
    assert Flag.OVEREXPOSED not in flags_from_text(plain.flags)
    assert Flag.OVEREXPOSED in flags_from_text(white.flags)
    assert white.diameter_px_sd > plain.diameter_px_sd
    assert abs(white.diameter_px - CASE.diameter_px) < 2.0 * white.diameter_px_sd


def test_metal_that_burns_out_beside_the_strings_is_no_fault_of_theirs() -> None:
    pixels = exposed(1.0)
    pixels[:60] = 255
    assert Flag.OVEREXPOSED not in flags_from_text(measure(pixels, strings=4).flags)
