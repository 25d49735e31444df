"""One round of learning: what a frame's blur is taken for, and whether frames differ in it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.bench.pictures48_draw import cases, draw
from tsvision.images.sight import Told, find_sight
from tsvision.measures.edges.cut import Cut, cut_frame
from tsvision.measures.edges.shading import plain_shading
from tsvision.measures.helix.section import pair_core
from tsvision.measures.helix.silhouette import Section
from tsvision.measures.light import rounds
from tsvision.measures.light.rounds import (
    EdgeLook,
    Round,
    _of_frames,
    _steady,
    next_look,
    widths_px,
)


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


def a_look() -> tuple[list[Cut], Section, EdgeLook]:
    """A picture of four strands, cut, and how its edges look at first glance."""
    case = cases(4)[21]
    picture = draw(case)
    sight = find_sight([picture], Told())
    assert sight is not None
    section = pair_core(4)
    strand_px = sight.width_px / section.diameter_d
    cut = cut_frame(picture, sight, strand_px, int(2.3 * sight.width_px) + 6)
    assert cut is not None
    shade = plain_shading(0.5 * strand_px)
    return [cut], section, EdgeLook((shade, shade), sight.width_px)


def test_a_round_that_teaches_nothing_tells_what_it_saw_all_the_same(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Edges by brightness that were found in all frames, but along which no mean edge could be
    told, counted for one: that colour was wrong by 1.2 px of 37 remained (`--wild 699`)."""
    cuts, section, look = a_look()
    monkeypatch.setattr(rounds, "_taught", lambda *_: None)
    after = next_look(cuts, section, replace(look, last=Round(frames=5, rms_px=9.0, matched=0.1)))
    assert after.last.frames == 1
    assert after.last.rms_px < 1.0
    assert after.last.matched > 0.5
    assert after.last.places_px == (0.0, 0.0)
    assert after.shading == look.shading


@pytest.mark.parametrize("seen", [True, False])
def test_a_round_that_teaches_nothing_leaves_edges_as_unsure_as_they_were_moved(
    seen: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A template that moved edges by 2.1 px, and along which none could be told then, was taken for
    one that knew them within 0.6 (`--wild 715`)."""
    cuts, section, look = a_look()
    monkeypatch.setattr(rounds, "_taught", lambda *_: None)
    if not seen:
        monkeypatch.setattr(rounds, "_fitted", lambda *_, **__: [])
    moved = replace(look, last=Round((-0.3, 2.1)))
    sd_px = look.shading[0].place_sd_px
    after = next_look(cuts, section, moved)
    assert after.shading[0].place_sd_px == pytest.approx(np.hypot(sd_px, 2.1))
    assert after.last.moved_px == 0.0
    again = next_look(cuts, section, after)
    assert again.shading == after.shading


def test_of_frames_unlike_in_blur_each_shows_its_width_by_its_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Under one blur for all, shaken frames said that a bundle was as many pixels wide as they were
    shaken by (`--wild 544`: 5 px of sd)."""
    cuts, section, look = a_look()
    blurred: list[float] = []

    def own(_found: object, blur_px: float, *_: object) -> float:
        blurred.append(blur_px)
        return 20.0

    monkeypatch.setattr(rounds, "_own_diameter_px", own)
    assert list(widths_px(cuts, section, look).values()) != [20.0]
    assert list(widths_px(cuts, section, replace(look, steady=False)).values()) == [20.0]
    assert 0.3 < blurred[0] < 3.0
