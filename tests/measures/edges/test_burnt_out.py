"""Strings brighter than the sensor holds: said so, and measured with less certainty."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from tests.measures.pictures import CASE, measure, picture
from tests.srgb import encode
from tsvision.flags import Flag, flags_from_text
from tsvision.images.linear import to_linear
from tsvision.measures.recording import Measurer
from tsvision.records import Frame, Rig, Strings, View


def exposed(times: float) -> np.ndarray:
    """Bright strings under so many times the light."""
    light = to_linear(picture(dark_on_bright=False, strings=4), float("nan"))
    return encode(np.minimum(times * light, 1.0))


@pytest.fixture(scope="module")
def burnt() -> np.ndarray:
    return exposed(4.0)


@pytest.mark.slow
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


def test_a_full_channel_is_told_of_frames_decoded_as_luma_alone() -> None:
    """Green strings whose green is full, and whose luma is not (`wild 1141`): told by luma, nothing
    else is decoded of a film's frames."""
    light = to_linear(picture(dark_on_bright=False, strings=4), float("nan"))
    channels = [np.minimum(times * light, 1.0) for times in (0.8, 4.0, 0.8)]
    colour = encode(np.stack(channels, axis=-1))
    luma = cv2.cvtColor(colour, cv2.COLOR_BGR2GRAY)
    assert luma.max() < 240
    measurer = Measurer(Rig(strings=Strings(count=4), view=View(separator_side="none")))
    measurer.prime([colour])
    assert not measurer.needs_colour
    row = measurer.measure(Frame(0, "picture.png", luma)).row
    assert Flag.OVEREXPOSED in flags_from_text(row.flags)
