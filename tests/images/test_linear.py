"""Light looked up and summed at once is the same as one after the other."""

from __future__ import annotations

import numpy as np
import pytest

from tsvision.images.frames_picture import to_luma
from tsvision.images.linear import LUMA_BGR, linear_signal, project, to_linear

NAN = float("nan")


@pytest.mark.parametrize("gamma", [NAN, 1.0, 2.2])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_of_colour(gamma: float, dtype: type) -> None:
    rng = np.random.default_rng(0)
    picture = rng.integers(0, np.iinfo(dtype).max + 1, (40, 60, 3), dtype)
    part = picture[3:31, 7:50]
    weights = np.array([0.0, 0.2, 0.8], np.float32)
    there = project(to_linear(np.ascontiguousarray(part), gamma), weights)
    signal = linear_signal(part, weights, gamma)
    assert signal.dtype == np.float32 and signal.shape == part.shape[:2]
    # a last bit, where the processor rounds sums of products once and not twice
    assert np.abs(signal - there).max() <= 1.2e-7


def test_luma_is_what_files_store() -> None:
    """Of grey pixels the same as the sum of their channels; of others the light of stored luma."""
    rng = np.random.default_rng(0)
    grey = rng.integers(0, 256, (40, 60), np.uint8)
    as_colour = np.repeat(grey[..., None], 3, axis=2)
    assert np.array_equal(linear_signal(as_colour, LUMA_BGR), to_linear(grey))
    coloured = rng.integers(0, 256, (40, 60, 3), np.uint8)
    stored = to_linear(to_luma(coloured))
    assert np.array_equal(linear_signal(coloured[5:], LUMA_BGR), stored[5:])


def test_half_a_white_strand_before_a_brown_ground_shows_half() -> None:
    """Luma is summed from encoded channels: of hues as far apart as luma parts, that costs a
    border between them less than a hundredth of a px."""
    white, brown = np.ones(3), np.array([0.07, 0.12, 0.2])  # linear BGR
    shares = np.array([0.0, 0.25, 0.5, 0.75, 1.0])[:, None]
    light = shares * white + (1.0 - shares) * brown
    encoded = np.where(
        light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 0.0031308) ** (1 / 2.4) - 0.055
    )
    pixels = np.round(65535 * encoded).astype(np.uint16)[None]
    seen = linear_signal(pixels, LUMA_BGR)[0]
    assert (seen - seen[0]) / (seen[-1] - seen[0]) == pytest.approx(shares[:, 0], abs=8e-3)


def test_of_grey() -> None:
    picture = np.arange(256, dtype=np.uint8).reshape(16, 16)
    assert np.array_equal(linear_signal(picture, LUMA_BGR), to_linear(picture))
