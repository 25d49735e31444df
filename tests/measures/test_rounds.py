"""One round of learning: what a frame's blur is taken for, and whether frames differ in it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from tsvision.measures import rounds
from tsvision.measures.rounds import _of_frames, _steady


def test_a_frame_has_one_blur_however_many_stretches_it_shows() -> None:
    one, other, unknown = (SimpleNamespace() for _ in range(3))
    fits = [SimpleNamespace(cut=cut) for cut in (one, one, one, other, unknown)]
    blurs = _of_frames(fits, np.array([1.0, 2.0, np.nan, 3.0, np.nan]))  # type: ignore[arg-type]
    assert blurs[id(one)] == 1.5
    assert blurs[id(other)] == 3.0
    assert np.isnan(blurs[id(unknown)])


@pytest.mark.parametrize("coiled", [False, True])
def test_only_straight_bundles_say_whose_a_blur_is(
    monkeypatch: pytest.MonkeyPatch, coiled: bool
) -> None:
    """Coils are not as thick as each other: that they happen to agree better under blurs of their
    own had a film that was left to the encoder measured twice a frame."""
    bundle = SimpleNamespace(fit=SimpleNamespace(coiled=coiled, diameter_px=20.0))
    fits = [SimpleNamespace(cut=SimpleNamespace(), bundle=bundle) for _ in range(4)]
    blurs = {id(f.cut): blur for f, blur in zip(fits, (0.8, 0.9, 1.0, 1.1), strict=True)}
    monkeypatch.setattr(rounds, "agree_better", lambda _shared, _own: True)
    monkeypatch.setattr(rounds, "_own_diameter_px", lambda *_: 20.0)
    assert _steady(fits, blurs, None, None) is coiled  # type: ignore[arg-type]


@pytest.mark.parametrize("in_colour", [False, True])
def test_two_readings_by_colour_do_not_say_that_frames_differ(in_colour: bool) -> None:
    cut = SimpleNamespace(in_colour=in_colour)
    bundle = SimpleNamespace(fit=SimpleNamespace(coiled=False, diameter_px=20.0))
    fits = [SimpleNamespace(cut=cut, bundle=bundle)]
    assert _steady(fits, {1: 0.8, 2: 2.6}, None, None) is in_colour  # type: ignore[arg-type]
