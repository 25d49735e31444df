"""What a recording's edges are learnt from, and which of rounds that do not agree is taken."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from tests.bench.pictures48_draw import cases, draw
from tsvision.measures.edges.shading import plain_shading
from tsvision.measures.helix.section import pair_core
from tsvision.measures.helix.uncertainty import light_sd_px, place_sd_px
from tsvision.measures.helix.windows import learning_windows, near_window
from tsvision.measures.light import settle
from tsvision.measures.light.blur import with_blur
from tsvision.measures.light.rounds import EdgeLook, Round, wider_px
from tsvision.measures.light.settle import _as_found, _grown_px, _holds, _sent, _unstrained
from tsvision.measures.recording import Measurer
from tsvision.records import Frame, Rig, Strings, View


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
    """What a look makes of the edges is seen in the round after it, not in its own."""
    rounds = []
    for blur, diameter, moved, strain in (
        (1.0, 21.0, 1.2, 3.0),
        (1.1, 20.0, 0.4, 0.2),
        (1.2, 23.0, 0.05, 1.0),
    ):
        shade = replace(plain_shading(5.0, blur), place_sd_px=0.3)
        rounds.append(EdgeLook((shade, shade), diameter, last=Round((-moved, 0.0), strain)))
    taken = _unstrained(rounds)
    assert taken.shading[0].blur_px == 1.0
    assert taken.diameter_px == 20.0
    assert taken.shading[0].place_sd_px == pytest.approx(0.5)


@pytest.mark.parametrize("ahead_px", [0.1, 0.8])
def test_what_settles_is_no_surer_than_what_its_template_makes_of_the_edges(
    monkeypatch: pytest.MonkeyPatch, ahead_px: float
) -> None:
    """Of a film of which single frames teach, rounds are by chance 0.4 or 0.9 px sure: its D was
    2.0 px of 17 off, stated to 0.9."""
    sds_px = iter([0.4, 0.4, ahead_px])

    def next_look(*_: object) -> EdgeLook:
        shade = replace(plain_shading(5.0), place_sd_px=next(sds_px))
        return EdgeLook((shade, shade), 20.0, last=Round((0.02, 0.0)))

    monkeypatch.setattr(settle, "next_look", next_look)
    told = settle._settled([], pair_core(2), EdgeLook((plain_shading(5.0),) * 2, 20.0))
    assert told.shading[0].place_sd_px == pytest.approx(max(0.4, ahead_px))


def test_bundles_that_are_thicker_in_a_frame_more_have_not_moved() -> None:
    """Of six strings one frame shows a bundle 4.5 px thicker than the others; whether it is among
    those that fit best is chance."""
    shade = plain_shading(8.0)
    look = EdgeLook((shade, shade), 58.75, frames_px={1: -0.05, 2: 0.05})
    ahead = EdgeLook((shade, shade), 61.0, frames_px={2: -2.2, 3: 2.3})
    assert wider_px(ahead, look) == pytest.approx(0.0)
    assert _holds(look, ahead)
    assert not _holds(look, replace(ahead, frames_px={2: -1.2, 3: 2.3}))


@pytest.mark.parametrize(
    ("diameter_px", "moved_px", "holds"),
    [(28.9, -0.3, True), (31.0, 0.1, False), (28.9, -4.9, False)],
)
def test_a_round_that_the_next_one_takes_back_has_not_settled(
    diameter_px: float, moved_px: float, holds: bool
) -> None:
    """Grey strings lit from one side (`wild 504`): edges that hardly moved any more, 4.9 px inside
    those that the next round saw."""
    shade = replace(plain_shading(4.0), place_sd_px=0.8)
    look = EdgeLook((shade, shade), 28.3, last=Round((-0.08, 0.02)))
    ahead = EdgeLook((shade, shade), diameter_px, last=Round((moved_px, 0.0)))
    assert _holds(look, ahead) is holds


@pytest.mark.parametrize(
    ("matched", "diameter_px"), [(0.55, 23.93), (0.45, 23.6), (0.66, 24.6), (0.90, 24.6)]
)
def test_a_template_that_finds_fewer_edges_has_not_proved_itself(
    matched: float, diameter_px: float
) -> None:
    """Pale strings before grey, lit from one side: by the first template bundles of 23.4 px came
    out 0.1 px thick; by the one that it led to, and that led to itself, 1.2 px, with edges in half
    of the columns (`--wild 1528`: all eight frames 1.4 to 1.6 px thick, stated to 0.6 to 0.9)."""
    shade = replace(plain_shading(4.0), place_sd_px=0.2)
    first = EdgeLook((shade, shade), 23.6, last=Round(frames=3, matched=0.70))
    ahead = EdgeLook((shade, shade), 24.6, last=Round(frames=3, matched=matched))
    look = replace(ahead, trust=(0.3, 1.0))
    found = _as_found(look, ahead, [first, look])
    assert found.diameter_px == pytest.approx(diameter_px, abs=0.01)
    assert found.shading[0].beyond_px == pytest.approx(found.diameter_px - 24.6)
    assert found.shading[1].beyond_px == 0.0
    between = 23.6 < diameter_px < 24.6
    assert (light_sd_px(found.shading) > 1.2 * light_sd_px(look.shading)) == between


class Stuck:
    """Stands for frames in which the upper edges match `off_px` inside the true ones, whatever the
    template, and for rounds of learning that say so, each by so much more or less."""

    def __init__(self, off_px: float, sd_px: float, apart_px: float = 0.0) -> None:
        self.off_px, self.sd_px, self.apart_px = off_px, sd_px, apart_px

    def __call__(self, _cuts: object, _section: object, look: EdgeLook) -> dict[int, float]:
        here = 20.0 - self.off_px + look.shading[0].beyond_px
        return dict(enumerate([here - 0.1, here, here + 0.1]))

    def rounds(self) -> list[EdgeLook]:
        shade = replace(plain_shading(5.0), place_sd_px=self.sd_px)
        return [
            EdgeLook((shade, shade), 20.0 - self.off_px, last=Round((-self.off_px - apart, 0.0)))
            for apart in (-self.apart_px, 0.0, 0.0, self.apart_px, self.apart_px)
        ]


def sent(monkeypatch: pytest.MonkeyPatch, stuck: Stuck, in_colour: bool = False) -> EdgeLook:
    monkeypatch.setattr(settle, "widths_px", stuck)
    cuts = [SimpleNamespace(in_colour=in_colour)]
    shade = replace(plain_shading(5.0), place_sd_px=stuck.sd_px)
    first = EdgeLook((shade, shade), 19.0, trust=(0.3, 1.0))
    return _sent(cuts, None, first, stuck.rounds())  # type: ignore[arg-type]


def test_edges_that_no_template_brings_out_are_sent_there(monkeypatch: pytest.MonkeyPatch) -> None:
    look = sent(monkeypatch, Stuck(1.0, 0.1))
    assert look.shading[0].beyond_px == pytest.approx(1.0)
    assert look.shading[1].beyond_px == 0.0
    assert look.diameter_px == pytest.approx(20.0)
    assert light_sd_px(look.shading) == pytest.approx(0.26, abs=0.05)  # light's own, and frames'
    assert with_blur(look.shading, 2.0)[0].beyond_px == pytest.approx(1.0)


def test_a_width_is_as_unsure_as_rounds_lie_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    look = sent(monkeypatch, Stuck(2.0, 0.1, 0.8))
    assert look.diameter_px == pytest.approx(20.0)
    assert 0.8 < light_sd_px(look.shading) < 1.6


def test_of_two_looks_that_take_turns_the_surer_one_says_where(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Cream strings of 73 px: rounds of 74.5 px, as blurred as the film is, lead to such of 70.3,
    twice as blurred and seven times as unsure, and back; of seven rounds four were these
    (`wild 1196`)."""
    surer, other = (replace(plain_shading(5.0), place_sd_px=place_sd_px(sd)) for sd in (0.33, 2.3))
    rounds = [
        EdgeLook((shade, shade), px + moved, last=Round((moved, 0.0)))
        for shade, px, moved in [(other, 70.3, 4.0), (surer, 74.5, -4.0)] * 3 + [(other, 70.3, 4.0)]
    ]
    monkeypatch.setattr(settle, "widths_px", lambda *_: {0: 74.3, 1: 74.3})
    cuts = [SimpleNamespace(in_colour=False)]
    look = _sent(cuts, None, rounds[0], rounds)  # type: ignore[arg-type]
    assert look.diameter_px - look.shading[0].beyond_px == pytest.approx(74.3)
    assert look.diameter_px > 74.0
    assert light_sd_px(look.shading) > 2.0


def test_edges_are_not_sent_to_what_bundles_grow_by(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Six strings grow from 58 to 68 px in ten turns: rounds that the first two frames had told
    59.5 px were sent there in all eight, and 3 px thin bundles stated to 8."""
    cuts = [SimpleNamespace(in_colour=False, wide_px=20.0 + i) for i in range(8)]
    monkeypatch.setattr(settle, "widths_px", lambda some, *_: {id(c): c.wide_px for c in some})
    shade = replace(plain_shading(5.0), place_sd_px=0.1)
    shown = frozenset(id(cut) for cut in cuts[:2])
    rounds = [
        EdgeLook((shade, shade), 20.5, last=Round((moved, 0.0), shown=shown))
        for moved in (0.15, -0.15, 0.15, -0.15, 0.15)
    ]
    look = _sent(cuts, None, rounds[-1], rounds)  # type: ignore[arg-type]
    assert look.shading[0].beyond_px == 0.0
    assert look.diameter_px == pytest.approx(20.5)
    assert light_sd_px(look.shading) < 1.2


def test_of_three_frames_edges_are_sent_to_where_those_are_that_rounds_speak_of(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Eight strings grow from 40 to 44 px in five turns. Rounds told by the first of three frames,
    which it bore out, were sent to the other two: 2.6 px, and the bundles came out 3 to 4 px thin
    (`python -m tests.bench.colours --only 449`)."""
    cuts = [SimpleNamespace(in_colour=False, wide_px=wide) for wide in (39.1, 42.1, 42.0)]
    monkeypatch.setattr(settle, "widths_px", lambda some, *_: {id(c): c.wide_px for c in some})
    shade = replace(plain_shading(8.0), place_sd_px=0.3)
    shown = frozenset({id(cuts[0])})
    rounds = [
        EdgeLook((shade, shade), 38.8, last=Round((moved, 0.0), shown=shown))
        for moved in (-0.25, -0.3, -0.2, -0.25)
    ]
    look = _sent(cuts, None, rounds[-1], rounds)  # type: ignore[arg-type]
    assert look.shading[0].beyond_px == 0.0
    assert light_sd_px(look.shading) > 1.5  # that frames differ is said nevertheless


def test_what_bundles_grow_by_is_told_from_what_frames_differ_by() -> None:
    growing = 58.0 + 1.3 * np.arange(8)
    each = dict(enumerate(growing))
    assert growing - _grown_px(each, frozenset({0, 1})) == pytest.approx(np.full(8, 58.65))
    each[5] -= 20.0  # one that shows something else
    level = np.array(list(each.values())) - _grown_px(each, frozenset({0, 1}))
    assert np.median(level) == pytest.approx(58.65, abs=0.3)
    assert np.std(level) > 5.0
    few = {0: 76.7, 1: 75.3, 2: 67.1}
    assert not _grown_px(few, frozenset({0})).any()  # three show no growth
    # No bundle thins as it is twisted: light that falls ever less on its limb does that.
    assert not _grown_px(dict(enumerate(growing[::-1])), frozenset({0})).any()


@pytest.mark.parametrize(
    ("stuck", "in_colour", "least_sd_px"),
    [(Stuck(1.0, 1.0), False, 2.0), (Stuck(1.0, 0.1), True, 0.2), (Stuck(4.0, 0.1), False, 4.0)],
)
def test_edges_stay_where_light_is_unsure_or_colour_or_far_off(
    monkeypatch: pytest.MonkeyPatch, stuck: Stuck, in_colour: bool, least_sd_px: float
) -> None:
    """And what they are off by is not known then."""
    look = sent(monkeypatch, stuck, in_colour)
    assert look.diameter_px == 19.0
    assert look.shading[0].beyond_px == 0.0
    assert light_sd_px(look.shading) > least_sd_px


@pytest.mark.parametrize(
    ("number", "beyond_px"), [(21, -np.inf), pytest.param(34, 0.15, marks=pytest.mark.slow)]
)
def test_a_dark_limb_in_noise_is_found_where_most_columns_miss_it(
    number: int, beyond_px: float
) -> None:
    """Light from 42 degrees, 5 % noise: D was 1.3 px thin by the border of what is lit. Rounds of
    matching alone come within 0.3 px there; under light from 45 degrees edges have to be sent."""
    case = cases(4)[number]
    measurer = Measurer(Rig(strings=Strings(count=4), view=View(separator_side="none")))
    picture = draw(case)
    measurer.prime([picture])
    assert measurer.looks is not None
    assert sum(side.beyond_px for side in measurer.looks.shading) > beyond_px
    row = measurer.measure(Frame(0, "picture.png", picture)).row
    assert row.diameter_px == pytest.approx(case.diameter_px, abs=0.3)
