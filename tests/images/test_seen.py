"""Which signal shows strings: one of two hues, or any difference where brightness shows none."""

from __future__ import annotations

import numpy as np
import pytest

from tsvision.images.linear import LUMA_BGR
from tsvision.images.seen import Seen, is_clearer, is_told, seen_by_any, seen_in
from tsvision.images.shadow import NO_SHADOW, Shadow
from tsvision.images.signal import LUMA, Signal, summed
from tsvision.images.strip import Strip

SHARPEST = np.array([-0.34, -0.30, 0.36], np.float32)
OF_NO_SHADOW = np.array([-0.34, -0.17, 0.49], np.float32)


def seen(signal: Signal, separation: float, level: float) -> Seen:
    """Strings told from their ground by so many sd, from so much contrast on."""
    return Seen(signal, separation, [], Shadow(level, level, 0.0, level))


@pytest.mark.parametrize(
    ("separation", "level", "clearer"),
    [(6.0, 0.09, True), (6.0, 0.2, False), (3.5, 0.09, False)],
)
def test_an_uneven_ground_hides_a_shadow(separation: float, level: float, clearer: bool) -> None:
    """Red strings that touch their shadow on blotchy green, told by 7 sd: what the ground varies by
    was as much as its shadow, the lower edge was the shadow's, coils came out 60 % long. A hue that
    shadows do not change is taken if it shows much more of the strings and tells them as well."""
    first = seen(summed(SHARPEST), 7.0, 0.29)
    assert is_clearer(seen(summed(OF_NO_SHADOW), separation, level), first) is clearer


def test_brightness_is_not_left_for_a_hue_that_is_clearer() -> None:
    """Files store it at twice the resolution."""
    assert summed(LUMA_BGR) is LUMA
    assert not is_clearer(seen(summed(OF_NO_SHADOW), 6.0, 0.09), seen(LUMA, 7.0, 0.29))


@pytest.mark.parametrize(
    ("shares", "told"), [((0.0, 0.0), False), ((1.0, 1.0), False), ((1.0, 0.3), True)]
)
def test_strips_that_show_nothing_but_strings_or_none_tell_nothing(
    shares: tuple[float, float], told: bool
) -> None:
    masks = [(np.arange(100).reshape(10, 10) < 100 * share).astype(np.uint8) for share in shares]
    assert is_told(Seen(LUMA, 1.0, masks, NO_SHADOW)) is told


def test_strands_brighter_and_as_much_darker_than_their_ground_differ_from_it() -> None:
    """Their core was as bright as it, and all of the strip as bright as their core."""
    random = np.random.default_rng(3)
    values = 0.2 + random.normal(0.0, 0.002, (101, 300))
    values[43:50] += 0.08
    values[51:58] -= 0.08
    strip = Strip(values.astype(np.float32), 0.0, 50)
    assert not is_told(seen_in([strip], 16.0, rough=False))
    seen = seen_by_any([strip], 16.0)
    assert is_told(seen)
    assert 12.0 < np.median(seen.masks[0].sum(axis=0)) < 18.0
