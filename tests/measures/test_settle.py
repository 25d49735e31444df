"""What a recording's edges are learnt from, and which of rounds that do not agree is taken."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from tsvision.measures.settle import EdgeLook, _unstrained
from tsvision.measures.shading import plain_shading
from tsvision.measures.windows import learning_windows, near_window


def bundle_of(columns: int) -> SimpleNamespace:
    """A cut whose bundle fills it from column 100 on."""
    s = np.arange(100.0 + columns)
    return SimpleNamespace(s_px=s, silhouette=SimpleNamespace(bundle=s >= 100.0))


@pytest.mark.parametrize(("columns", "stretches"), [(20, 0), (100, 1), (400, 2), (2000, 4)])
def test_light_is_learnt_from_stretches_one_behind_the_other(columns: int, stretches: int) -> None:
    cut = bundle_of(columns)
    windows = learning_windows(cut, 20.0)  # type: ignore[arg-type]
    assert len(windows) == stretches
    if windows:
        assert windows[0] == near_window(cut, 20.0)  # type: ignore[arg-type]
        assert windows[-1][1] <= cut.s_px[-1]
    for (_, ends), (begins, _) in pairwise(windows):
        assert begins == ends


def test_of_rounds_that_go_to_and_fro_the_least_contradicted_is_taken_and_less_sure() -> None:
    shade = replace(plain_shading(5.0), place_sd_px=0.3)
    rounds = [
        EdgeLook((shade, shade), diameter, moved_px=moved, strain=strain)
        for diameter, moved, strain in ((21.0, 1.2, 3.0), (20.0, 0.4, 0.2), (23.0, 0.05, 1.0))
    ]
    taken = _unstrained(rounds)
    assert taken.diameter_px == 20.0
    assert taken.shading[0].place_sd_px == pytest.approx(0.5)
