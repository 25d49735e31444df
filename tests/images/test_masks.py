"""Which pixels of a strip are strings, and which could be their shadow."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from tsvision.images.contrast import ROUGH
from tsvision.images.masks import MASK_LEVEL, NO_SHADOW, masks_of, string_mask
from tsvision.images.shadow import NO_SHADE, Shade
from tsvision.images.signal import LUMA, summed
from tsvision.images.strip import Strip

HALF_PX, COLUMNS, BUNDLE_PX = 60, 400, 20.0
GROUND, STRINGS = 0.12, 0.5


def strip(off_axis_px: float, seed: int) -> Strip:
    """Two bright strings as far off the axis, lit from one side, as a lens shows them."""
    n, _ = np.mgrid[-HALF_PX : HALF_PX + 1, 0:COLUMNS].astype(float)
    light = np.full(n.shape, GROUND)
    for middle in (-off_axis_px, off_axis_px):
        across = (n - middle) / 10.0
        lit = np.clip(across + 1.3, 0.4, 1.0)
        light = np.where(np.abs(across) <= 1.0, STRINGS * lit, light)
    light = cv2.GaussianBlur(light, (0, 0), 0.8)
    light += np.random.default_rng(seed).normal(0.0, 0.004, n.shape)
    return Strip(light.astype(np.float32), 0.0, HALF_PX)


def test_frames_of_hardly_a_turn_do_not_tell_of_shadows() -> None:
    """On the axis between legs lies ground, which noise makes a little darker or brighter: in units
    of that, legs and all reached as far as shadows may, and dim limbs of bright strings were left
    out as such (`wild 643`: 10 px of 100)."""
    strips = [strip(45.0, 1), strip(45.0, 2), strip(45.0, 3), strip(4.0, 4), strip(4.0, 5)]
    for few in (strips, strips[3:]):
        _, shadow = masks_of(few, LUMA, BUNDLE_PX, rough=False)
        assert shadow == NO_SHADOW


def coloured_strip(seed: int) -> Strip:
    """Red strings on a grey ground, lit from one side: the other limb fades away, over a third of
    their width, and the chroma that a camera stores is blurred."""
    n, _ = np.mgrid[-HALF_PX : HALF_PX + 1, 0:COLUMNS].astype(float)
    lit = np.clip((n + 0.5 * BUNDLE_PX) / (0.6 * BUNDLE_PX), 0.02, 1.0)
    inside = np.abs(n) <= 0.5 * BUNDLE_PX
    colour = np.where(inside[..., None], lit[..., None] * (0.05, 0.05, 0.6), (0.1, 0.1, 0.1))
    colour = cv2.GaussianBlur(colour, (0, 0), 1.5)
    colour += np.random.default_rng(seed).normal(0.0, 0.002, colour.shape)
    return Strip(colour.astype(np.float32), 0.0, HALF_PX)


def test_a_dark_limb_is_no_shadow_of_a_hue_that_shadows_do_not_have() -> None:
    """Most borders to one side were soft, and strings began at two thirds of their contrast
    (`--wild 689`: 4 px of 18; `613`, `563`, `569` likewise)."""
    redness = summed(np.array([-0.25, -0.25, 0.5], np.float32))
    masks, shadow = masks_of([coloured_strip(1), coloured_strip(2)], redness, BUNDLE_PX, rough=True)
    width = np.mean([np.median(mask.sum(axis=0)) for mask in masks])
    assert shadow.level < 0.05 + MASK_LEVEL / ROUGH
    assert width > 0.9 * BUNDLE_PX


@pytest.mark.parametrize("noise", [0.05, 0.3, 0.4])
def test_strings_that_stand_out_less_than_a_pixel_s_noise_are_seen(noise: float) -> None:
    """By their hue blue strings hardly stand out from blue cloth, pixel by pixel; noise closed to
    one mask, and no bundle was found that anyone sees (`colours --only 273`)."""
    n, _ = np.mgrid[-HALF_PX : HALF_PX + 1, 0:COLUMNS].astype(float)
    light = 0.2 + 0.5 * (np.abs(n) <= 0.5 * BUNDLE_PX)
    rng = np.random.default_rng(1)
    strips = [
        Strip((light + rng.normal(0.0, 0.5 * noise, n.shape)).astype(np.float32), 0.0, HALF_PX)
        for _ in range(2)
    ]
    masks, _ = masks_of(strips, LUMA, BUNDLE_PX, rough=False)
    for mask in masks:
        wide = mask[HALF_PX - 15 : HALF_PX + 16].sum(axis=0)
        assert np.median(wide) == pytest.approx(BUNDLE_PX, abs=2.0)
        assert mask[: HALF_PX - 15].mean() < 0.02


def glossy_strip(seed: int, side: int) -> Strip:
    """Black strings that gleam, and beside them a shadow nearly as dark as the gleam: soft where it
    ends, and they sharp on it."""
    n, _ = np.mgrid[-HALF_PX : HALF_PX + 1, 0:COLUMNS].astype(float)
    light = np.full(n.shape, 0.2)
    shadow = np.where(np.abs(side * n - 12.0) < 14.0, 0.42, 0.0)
    light *= 1.0 - cv2.GaussianBlur(shadow, (0, 0), 4.0)
    light[np.abs(n) <= 0.5 * BUNDLE_PX] = 0.03
    light[np.abs(n) <= 4.0] = 0.1
    light = cv2.GaussianBlur(light, (0, 0), 0.8)
    light += np.random.default_rng(seed).normal(0.0, 0.004, n.shape)
    return Strip(light.astype(np.float32), 0.0, HALF_PX)


@pytest.mark.parametrize("side", [1, -1])
def test_a_shadow_nearly_as_dark_as_strings_that_gleam_is_left_out(side: int) -> None:
    """Nothing up to what the gleam shows was sharp, the shadow was a part of the strings, and no
    bundle was found that anyone sees (`colours --only 50`). Only where it lies are they asked for
    more: there their limbs are black."""
    strips = [glossy_strip(1, side), glossy_strip(2, side), glossy_strip(3, side)]
    masks, shadow = masks_of(strips, LUMA, BUNDLE_PX, rough=False)
    assert shadow.shade.side == side and shadow.shade.level > 0.7
    assert shadow.shade.reversed() == Shade(-side, shadow.shade.level)
    for mask in masks:
        rows = np.flatnonzero(np.median(mask, axis=1)) - HALF_PX
        assert (rows.min(), rows.max()) == pytest.approx((-10.0, 10.0), abs=1.0)


def test_strings_end_where_they_are_dark_enough_on_the_shadow_s_side() -> None:
    """What has nothing as dark in it is shadow, and all before the last that is stays."""
    contrast = np.zeros((40, 3), np.float32)
    contrast[5:15] = 0.7
    contrast[20:35] = 0.7
    contrast[22:26] = 1.5
    plain = string_mask(contrast, 1.0, 0.4, NO_SHADE)
    above = string_mask(contrast, 1.0, 0.4, Shade(1, 1.0))
    below = string_mask(contrast, 1.0, 0.4, Shade(-1, 1.0))
    assert np.flatnonzero(plain[:, 1]).tolist() == [*range(5, 15), *range(20, 35)]
    assert np.flatnonzero(above[:, 1]).tolist() == [*range(20, 26)]
    assert np.flatnonzero(below[:, 1]).tolist() == [*range(22, 35)]
