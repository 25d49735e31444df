"""What some pictures teach of the strings' edges, in one signal that tells strings from ground."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tsvision.images.sight import Sight
from tsvision.measures.edges.cut import BURNT_OUT, LOST, Cut, cut_frame
from tsvision.measures.edges.shading import plain_shading
from tsvision.measures.edges.tones import faint_tone
from tsvision.measures.helix.silhouette import Section
from tsvision.measures.light.profiles import learn_shading
from tsvision.measures.light.rounds import EdgeLook, less_sure
from tsvision.measures.light.settle import settle
from tsvision.measures.light.stored import luma_in

COLOUR_PLACE_SD_PX = 0.3  # an edge in colour, which pictures store at half resolution
# Of the blur: an edge of burnt-out strings. How bright they are beyond what the sensor holds, and
# how far out their blur therefore seems to end, nobody knows.
BURNT_PLACE_SD = 0.35
SHOWN = 75.0  # per cent of the frames whose cores show less: most may be of hardly a turn

Pairs = list[tuple[np.ndarray, Cut]]


@dataclass(frozen=True)
class Learnt:
    """pairs: the pictures that show strings, each with what was cut of it by `sight`; edge: how the
    edges look there."""

    sight: Sight
    pairs: Pairs
    edge: EdgeLook

    @property
    def cuts(self) -> list[Cut]:
        return [cut for _, cut in self.pairs]

    @property
    def saturated(self) -> float:
        """Share of the bundle's core where the sensor is full, typical of the frames."""
        return float(np.median([cut.saturated for cut in self.cuts]))


def cut_all(pictures: list[np.ndarray], sight: Sight, strand_px: float, half_px: int) -> Pairs:
    """What is cut of those pictures that show strings."""
    cuts = ((p, cut_frame(p, sight, strand_px, half_px)) for p in pictures)
    return [(p, cut) for p, cut in cuts if cut is not None]


def cut_alike(
    pictures: list[np.ndarray], sight: Sight, strand_px: float, half_px: int
) -> tuple[Sight, Pairs]:
    """The same, by a sight that knows what the core shows in the frames where it lies on the axis:
    in others, of hardly a turn, ground between legs does."""
    pairs = cut_all(pictures, sight, strand_px, half_px)
    if pairs:
        shares = np.abs([cut.core_share for _, cut in pairs])
        share = float(np.percentile(shares, SHOWN))
        sight = replace(sight, core_share=sight.sense * share)
        if (shares < LOST * share).any():
            pairs = cut_all(pictures, sight, strand_px, half_px)
    return sight, pairs


def toned(
    pictures: list[np.ndarray], sight: Sight, pairs: Pairs, strand_px: float, half_px: int
) -> tuple[Sight, Pairs]:
    """The same, where strands are of two brightnesses each in units of its own."""
    tone = faint_tone(
        [cut.contrast for _, cut in pairs],
        [cut.silhouette for _, cut in pairs],
        sight.width_px,
    )
    if tone < 1.0:
        sight = replace(sight, faint_tone=tone)
        pairs = cut_all(pictures, sight, strand_px, half_px) or pairs
    return sight, pairs


def learn_edges(pairs: Pairs, sight: Sight, section: Section) -> Learnt:
    """The edges in some pictures, as `sight` shows them."""
    # The lamp stands still: limbs that most of these show darker than their ground are so in all.
    told = [cut.sunk for _, cut in pairs]
    sight = replace(sight, sunk=int(np.sign(np.median(told))))
    if any(sunk != sight.sunk for sunk in told):
        strand_px = sight.width_px / section.diameter_d
        pairs = cut_all([p for p, _ in pairs], sight, strand_px, pairs[0][1].half_px)
    cuts = [cut for _, cut in pairs]
    # What lies in the bundle's shadow in none of these does so in none.
    sight = replace(sight, some_dim=any(cut.some_dim for cut in cuts))
    rho_px = 0.5 * sight.width_px / section.diameter_d
    shading = learn_shading(cuts, rho_px) or (plain_shading(rho_px), plain_shading(rho_px))
    edge = settle(cuts, section, EdgeLook(shading, sight.width_px, stored=luma_in(cuts)))
    if sight.signal.in_colour:
        # Half the resolution and its blocks outdo what frames differ by.
        edge = less_sure(edge, COLOUR_PLACE_SD_PX)
    return Learnt(sight, pairs, edge)


def as_sure_as_exposed(learnt: Learnt) -> Learnt:
    """The same, less sure of where edges lie that are a burnt-out bundle's."""
    if learnt.saturated < BURNT_OUT:
        return learnt
    by_px = BURNT_PLACE_SD * learnt.saturated * learnt.edge.shading[0].blur_px
    return replace(learnt, edge=less_sure(learnt.edge, by_px))
