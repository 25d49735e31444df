"""Sensors that count to 10, 12 or 14 bits, stored in 16."""

from __future__ import annotations

import numpy as np
import pytest

from tsvision.images.depth import bits_of, filled


@pytest.mark.parametrize("bits", [10, 12, 14, 16])
def test_the_brightest_pixel_of_all_pictures_tells_the_bits(bits: int) -> None:
    dark, bright = np.zeros((4, 5), np.uint16), np.full((4, 5), 2**bits - 1, np.uint16)
    assert bits_of([dark, bright]) == bits_of([bright]) == bits
    assert bits_of([np.full((4, 5), 255, np.uint8)]) == 8


@pytest.mark.parametrize("bits", [10, 12, 14, 16])
def test_codes_keep_their_share_of_full(bits: int) -> None:
    codes = np.arange(0, 2**bits, 7, dtype=np.uint16)
    codes[-1] = 2**bits - 1
    share = filled(codes, bits) / 65535.0
    assert np.abs(share - codes / (2**bits - 1.0)).max() < 1.0 / 65535.0
    assert share[-1] == 1.0


def test_what_is_brighter_than_was_known_is_full_and_not_dark() -> None:
    assert filled(np.array([4095, 4096, 9000], np.uint16), 12).tolist() == [65535] * 3


def test_8_bits_pass_through() -> None:
    pixels = np.arange(12, dtype=np.uint8)
    assert filled(pixels, 8) is pixels
    assert filled(pixels, 12) is pixels
