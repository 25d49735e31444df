"""Which parts of a mask are strings: those that touch, seen column by column."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from tsvision.measures.edges.strands import _components, _runs, outline


def runs_of(mask: np.ndarray) -> np.ndarray:
    framed = np.zeros((mask.shape[0] + 2, mask.shape[1]), np.uint8)
    framed[1:-1] = mask
    return np.asarray(_runs(np.flatnonzero(framed[1:] != framed[:-1]), mask.shape[1]))


def test_runs_of_a_mask_drawn_by_hand() -> None:
    mask = np.array([[1, 0, 0, 1], [0, 1, 0, 1], [1, 0, 0, 0]], np.uint8)
    column, first, beyond = runs_of(mask)
    assert column.tolist() == [0, 0, 1, 3]
    assert first.tolist() == [0, 2, 1, 0]
    assert beyond.tolist() == [1, 3, 2, 2]
    # Corners touch: the three runs on the left are of one, the fourth stands alone.
    parts = _components(runs_of(mask))
    assert parts[0] == parts[1] == parts[2] != parts[3]


@pytest.mark.parametrize("seed", range(20))
def test_components_are_those_of_the_pixels(seed: int) -> None:
    rng = np.random.default_rng(seed)
    noise = rng.standard_normal((41, 120)).astype(np.float32)
    mask = (cv2.GaussianBlur(noise, (0, 0), 0.3 + 0.1 * seed) > 0.05).astype(np.uint8)
    _, labels = cv2.connectedComponents(mask, connectivity=8)
    runs = runs_of(mask)
    parts = _components(runs)
    assert int((runs[2] - runs[1]).sum()) == int(mask.sum())
    label = labels[runs[1], runs[0]]
    pairs = set(zip(parts.tolist(), label.tolist(), strict=True))
    assert len(pairs) == len(set(parts.tolist())) == len(set(label.tolist()))


HALF, WIDTH_PX = 75, 30.0  # of a strip, and of the bundle in it


def seen(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Contrast of what lies between rows low and high (M,) off the axis."""
    n = np.arange(-HALF, HALF + 1)[:, None]
    return ((n >= low) & (n <= high)).astype(np.float32)


def beside_plate(reach: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What reaches so far (M,) to either side before a bundle of 300 px."""
    half = np.concatenate([reach, 15.0 + 2.0 * np.sin(np.arange(300) / 6.0)])
    return -half, half


LEGS = np.linspace(90.0, 15.0, 100)
JAMMED = 36.0 + 4.0 * np.sin(np.arange(60) / 3.0) - 20.0 * np.linspace(-1.0, 1.0, 60) ** 4


@pytest.mark.parametrize("unbounded", [False, True], ids=["between legs", "and beyond one"])
def test_ground_beside_a_bright_plate_that_looks_like_strings_is_no_bundle(unbounded: bool) -> None:
    """Purple light on the ground between plate and legs had a third of orange strings' hue: a knot
    was told there in six frames of eight, and the onset 14 turns too early (`wild 850`)."""
    low, high = beside_plate(LEGS)
    if unbounded:
        low[:95] = -HALF
    found = outline(seen(low, high), WIDTH_PX, 15.0, 0, 0.5)
    assert found.apex_column == pytest.approx(95.0, abs=8.0)
    assert not found.bundle[: int(found.apex_column)].any()
    assert found.bundle[110:].all()


def test_where_there_are_but_legs_there_is_no_bundle() -> None:
    found = outline(seen(-LEGS[:70], LEGS[:70]), WIDTH_PX, 15.0, 0, 0.5)
    assert not found.bundle.any()
    assert np.isnan(found.apex_column)


def test_a_knot_jammed_at_the_separator_is_the_bundle_s() -> None:
    """Three times as thick as that: a lump, whose borders are not straight."""
    found = outline(seen(*beside_plate(JAMMED)), WIDTH_PX, 15.0, 0, 0.5)
    assert found.apex_column == 0.0
    assert found.bundle.all()


def test_ground_in_the_shadow_of_a_plate_is_no_knot() -> None:
    """Soft, and as long as it is wide: a knot four times as thick as its bundle was told there in
    seven frames of eight, and the onset 26 turns too early (`wild 1306`)."""
    ramp = np.interp(np.arange(150), [0, 15, 140, 150], [20.0, HALF + 9.0, HALF + 9.0, 15.0])
    found = outline(seen(*beside_plate(ramp)), WIDTH_PX, 15.0, 0, 0.5)
    assert not found.bundle[:135].any()
    assert found.bundle[160:].all()
    assert np.isnan(found.apex_column)  # strings come out of the shadow there
