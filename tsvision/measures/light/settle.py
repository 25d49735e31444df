"""How a recording's edges look, learnt in rounds until they stay."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from tsvision.measures.edges.cut import Cut
from tsvision.measures.edges.shading import Shading
from tsvision.measures.helix.silhouette import Section
from tsvision.measures.helix.uncertainty import light_sd_px, place_sd_px
from tsvision.measures.light.rounds import (
    SUREST_PX,
    EdgeLook,
    less_sure,
    next_look,
    wider_px,
    widths_px,
)

ROUNDS = (2, 8, 14)  # at least, at most, and at most while each moves the edges less, ...
SETTLED_PX = 0.1  # ... until their places move by no more
TAKEN_BACK = 2.0 * 2.0**0.5  # sds of a width from which two of them contradict each other
GROWS_FROM = 3  # frames, from more than which on it is told whether a bundle does
# Of the columns, those in which a template misses edges that another found: so many are chance, and
# so many prove that it describes no edges better.
CHANCE, FEWER = 0.05, 0.2
SHIFTS, FURTHEST_SHIFT = 4, 0.6  # times that edges are sent elsewhere, and how far, in radii


def settle(cuts: list[Cut], section: Section, first: EdgeLook) -> EdgeLook:
    """The look of the edges in some frames, from what a first glance took them for."""
    look = _settled(cuts, section, first)
    return less_sure(look, place_sd_px(look.hidden_px))


def _settled(cuts: list[Cut], section: Section, first: EdgeLook) -> EdgeLook:
    looks = [first]
    ahead = None  # the round after, where it is known
    for turn in range(1, ROUNDS[2] + 1):
        if turn > ROUNDS[1] and not looks[-1].last.moved_px < looks[-2].last.moved_px:
            break
        looks.append(ahead or next_look(cuts, section, looks[-1]))
        ahead = None
        if turn >= ROUNDS[0] and looks[-1].last.moved_px < SETTLED_PX:
            ahead = next_look(cuts, section, looks[-1])
            if _holds(looks[-1], ahead):
                return _as_found(_no_surer(looks[-1], ahead), ahead, looks[1:])
    return _sent(cuts, section, _unstrained(looks[1:]), looks[2:])


def _no_surer(look: EdgeLook, ahead: EdgeLook) -> EdgeLook:
    """A look no surer of its width than what its own template makes of the same edges: of few
    frames one round may be twice as sure as the next."""
    sd_px = max(light_sd_px(look.shading), light_sd_px(ahead.shading))
    return replace(look, shading=_as_sure(look.shading, sd_px))


def _as_found(look: EdgeLook, ahead: EdgeLook, rounds: list[EdgeLook]) -> EdgeLook:
    """A settled look with the edges of the side that is trusted less drawn to where that template
    found them which found most, as far as the look's own finds fewer (told by the round `ahead`).

    A template may confirm itself: one of a limb as bright as its ground finds edges where there is
    none, here and there and askew, and along what is fitted to these the mean edge looks as it
    says. That of a limb in the dark finds it in nearly all columns.
    """
    many = [r for r in rounds if r.last.frames >= ahead.last.frames]
    most = max(many, key=lambda r: r.last.matched, default=ahead)
    fewer = most.last.matched - ahead.last.matched
    share = float(np.clip((fewer - CHANCE) / (FEWER - CHANCE), 0.0, 1.0))
    apart_px = wider_px(most, ahead)
    drawn = _side_moved(look, share * apart_px)
    drawn = replace(drawn, diameter_px=look.diameter_px + share * apart_px)
    not_known_px = np.sqrt(share * (1.0 - share)) * abs(apart_px)
    return less_sure(drawn, place_sd_px(float(not_known_px)))


def _less_trusted(look: EdgeLook) -> int:
    """The side, 0 or 1, whose edges count less in a fit."""
    return int(np.argmin(look.trust))


def _side_moved(look: EdgeLook, by_px: float) -> EdgeLook:
    """The look with the edges of the side that is trusted less so much farther out."""
    shading, side = list(look.shading), _less_trusted(look)
    shading[side] = replace(shading[side], beyond_px=shading[side].beyond_px + by_px)
    return replace(look, shading=(shading[0], shading[1]))


def _holds(look: EdgeLook, ahead: EdgeLook) -> bool:
    """Whether a look's own template finds the bundles as thick as the look says they are: along a
    dark limb it may well find others, pixels away, or see the limb there."""
    light_px = light_sd_px(look.shading)
    found_px = wider_px(ahead, look) + look.last.wide_px
    said_px = found_px - ahead.last.wide_px
    held = abs(found_px) < max(light_px, SETTLED_PX)
    return held and abs(said_px) < max(TAKEN_BACK * light_px, SETTLED_PX)


def _unstrained(looks: list[EdgeLook]) -> EdgeLook:
    """Of rounds that go to and fro the look whose bundles light and outline's shape contradict
    least, less sure by as much as its edges were still to be moved. What a look makes of the edges
    is said by the round after it: along a dark limb the next template may well find others."""
    look, under = min(pairwise(looks), key=lambda pair: pair[1].last.strain)
    upper, lower = (
        replace(s, place_sd_px=now.place_sd_px)
        for s, now in zip(look.shading, under.shading, strict=True)
    )
    found = replace(
        under,
        shading=(upper, lower),
        trust=look.trust,
        steady=look.steady,
        hidden_px=look.hidden_px,
    )
    return less_sure(found, found.last.moved_px)


def _as_sure(shading: tuple[Shading, Shading], sd_px: float) -> tuple[Shading, Shading]:
    """The shading with a width's sd of so much."""
    by = sd_px / max(light_sd_px(shading), 1e-6)
    upper, lower = (replace(s, place_sd_px=s.place_sd_px * by) for s in shading)
    return upper, lower


def _sent(cuts: list[Cut], section: Section, look: EdgeLook, rounds: list[EdgeLook]) -> EdgeLook:
    """The look with its edges sent to where bundles are as thick as most rounds say, where rounds
    do not bring them there.

    Along a limb that sends little light columns match the border of what is lit as often as the
    limb, by which template it is one or the other, and rounds go to and fro by pixels. What each
    says of the true width, from the mean edge along whatever was found, differs far less, and
    counts by how sure light is of it: of two looks that take turns half the rounds are one's. Under
    a template that is held the edges do go where they are sent, in those frames that the rounds
    speak of: six strings are a sixth thicker after ten turns. What is told by its hue stays where
    it is: that fades at a limb for other reasons than light does.
    """
    if any(cut.in_colour for cut in cuts):
        return look
    said_px = np.array([wider_px(r, look) - r.last.wide_px for r in rounds])
    said_px += look.diameter_px
    sds_px = np.maximum([light_sd_px(r.shading) for r in rounds], SUREST_PX)
    width_px = _middle(said_px, 1.0 / sds_px**2)
    spread_px = 1.4826 * _middle(np.abs(said_px - width_px), 1.0 / sds_px**2)
    light_px = float(np.median(sds_px))
    look = replace(look, shading=_as_sure(look.shading, float(np.hypot(spread_px, light_px))))
    shown = frozenset[int]().union(*(r.last.shown for r in rounds))
    off_px = 0.0
    for sent in range(SHIFTS):
        each_px = widths_px(cuts, section, look)
        if not each_px:
            break
        grown_px = _grown_px(each_px, shown)
        level_px = np.array(list(each_px.values())) - grown_px
        off_px = width_px - _level_px(level_px, _speaking(each_px, shown))
        # Of few frames the spread about their own mean is too small by what that mean took up.
        few = int(level_px.size > 1)
        look = replace(look, apart_px=float(np.std(level_px, ddof=few)))
        # What the light is not sure of stays where it is.
        if abs(off_px) < (SETTLED_PX if sent else max(SETTLED_PX, light_px)):
            break
        moved = _side_moved(look, off_px)
        shade = moved.shading[_less_trusted(moved)]
        if abs(shade.beyond_px) > FURTHEST_SHIFT * shade.rho_px:
            break
        look = replace(moved, diameter_px=width_px)
    return less_sure(look, place_sd_px(float(np.hypot(off_px, look.apart_px))))


def _middle(values: np.ndarray, weights: np.ndarray) -> float:
    """The weighted median of some values (K,)."""
    return float(np.quantile(values, 0.5, weights=weights, method="inverted_cdf"))


def _speaking(each_px: dict[int, float], shown: frozenset[int]) -> np.ndarray:
    """Which (K,) of the frames are among those shown."""
    return np.array([cut in shown for cut in each_px])


def _level_px(level_px: np.ndarray, speaking: np.ndarray) -> float:
    """How thick bundles are by frames (K,), of which rounds speak of some (K,): the median. By how
    much bundles grow few frames do not tell: a minority that is spoken of then says it alone."""
    alone = level_px.size <= GROWS_FROM and 0.0 < speaking.mean() < 0.5
    return float(np.median(level_px[speaking] if alone else level_px))


def _grown_px(each_px: dict[int, float], shown: frozenset[int]) -> np.ndarray:
    """By how much (K,) bundles are thicker in each frame, in order of their turns, than in those
    shown, as they steadily grow: the median of what they do from any frame to any other. Where they
    seem to shrink it is the light on ever steeper strands that makes them do so."""
    at, px = np.arange(len(each_px)), np.array(list(each_px.values()))
    if at.size <= GROWS_FROM:
        return np.zeros(at.size)
    first, last = np.triu_indices(at.size, 1)
    growth_px = max(float(np.median((px[last] - px[first]) / (at[last] - at[first]))), 0.0)
    told = _speaking(each_px, shown)
    return growth_px * (at - np.mean(at[told] if told.any() else at))
