"""Which parts of a mask are strings: those that touch, seen column by column."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from tsvision.measures.strands import _components, _runs


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
