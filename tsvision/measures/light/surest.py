"""What some pictures teach of the strings' edges, in the signal that tells most of them.

A hue tells strings from ground where brightness does not, under any shadow. But files store colour
at half the resolution, mixed beyond the edges; and it fades at a limb in ways that the light there
does not tell. So where strings were found by their colour, their edges are looked at by brightness
alone as well: those of dark strings before a bright ground are as sharp as the lens, whatever light
falls on the limbs. Where they were found by brightness and that leaves their width open, one of the
limbs may be as bright as its ground: then a hue is asked.
Beside a hue its counterpart is asked, in which strings are as dark as black however they are lit:
it shows how much of the ground they leave, up to the edge itself, and shadows on that as well.
Where colours across the ground's own are asked, so that light and shadow there need not count, all
of the difference from the ground is looked at as well: strands of the ground's hue show by it. So
it is where a hue shows hardly an edge.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tsvision.images.seen import FAR_APART, HUE_APART
from tsvision.images.sharpness import sharpness_px
from tsvision.images.sight import cover_along, hue_along, seen_by
from tsvision.images.signal import DISTANCE, LUMA, Signal, Way
from tsvision.measures.edges.cut import Cut
from tsvision.measures.edges.shading import is_resolved
from tsvision.measures.helix.silhouette import Section
from tsvision.measures.helix.uncertainty import light_sd_px, place_sd_px
from tsvision.measures.light.beside import SHARP_PX
from tsvision.measures.light.bright import BrightCuts
from tsvision.measures.light.learnt import Learnt, cut_alike, learn_edges, toned
from tsvision.measures.light.rounds import EdgeLook, Round, less_sure, next_look, wider_px
from tsvision.measures.light.settle import settle
from tsvision.measures.light.stored import colours_in, is_halved, luma_in, stored_in
from tsvision.measures.light.witness import Witness, heard

# Of a width by brightness that is not left to it alone, besides what light leaves open: parts of
# coloured limbs are as bright as their ground (74 films of coloured strings).
BRIGHT_SD_PX = 0.3
# Of the width's uncertainty by colour, which that by brightness has to stay below; and of what
# edges across the ground's colour are off by.
SURER = 0.6
# Thinner than by colour, whose blocks add less, from which on lit limbs are as bright as ground:
# px, of a strand's radius, of which such limbs are a fair part, and of sds of the width by colour.
FADED_PX, FADED_RHO, UNSURE = 3.0, 0.6, 2.0
MOST_PX = 3.0  # of a width, that storing a colour at half the resolution may move its edges by
OPEN_PX = 0.5  # sd of a width by brightness, from which on a hue may tell it better, or be heard
BLURRED_PX = 2.0  # sd of a width, from which on its edges do not tell blur from light
GROUNDLESS = 0.1  # of what strings stand out by in a hue, by which their ground may do so too
FEWEST = 2  # frames that tell
ASKED = 3  # pictures for how sharp they are
LEAST_COST_PX2 = 1e-3  # of edges that fit: less is noise
# Share of the columns whose edges were found, and times as wide as by colour: what shows fewer and
# is wider or narrower is no bundle.
LEAST_MATCHED, ALIKE = 0.2, 1.3
AS_OFTEN = 0.5  # of the columns whose edges a hue shows, those that brightness has to show as well
AS_LONG = 0.5  # of a bundle by colour, that brightness has to show as well
SHORT = 0.25  # of the line: of legs alone, or strands of one colour of several
MISSED_PX = 1.0  # as much off as this counts an edge that was not found, or in no frame's fit


def surest(learnt: Learnt, section: Section, half_px: int) -> Learnt:
    """The same, or what another signal teaches of the strings, alone or along, if that is more:
    where they were told by their colour, brightness or all of their difference from the ground;
    where brightness leaves them open, a hue; and beside a hue how much of the ground they cover."""
    learnt = _colour_by_distance(learnt, section, half_px)
    if learnt.sight.signal.in_colour:
        other = _learnt_by(LUMA, learnt, section, half_px)
    else:
        learnt, other = _by_hue(learnt, section, half_px)
        learnt = _brightness_by_distance(learnt, section, half_px)
    if other is not None:
        learnt = _beside_brightness(learnt, other, section)
    return _beside_cover(learnt, section, half_px)


def _colour_by_distance(learnt: Learnt, section: Section, half_px: int) -> Learnt:
    """The same, or what all of the difference from the ground teaches: where colours across the
    ground's own show less than that, or a hue hardly an edge, maybe of one of several colours."""
    way = learnt.sight.signal.way
    hardly = way is Way.HUE and not _is_matched(learnt.edge)
    whole = _learnt_by(DISTANCE, learnt, section, half_px) if hardly or way is Way.ACROSS else None
    if whole is None:
        return learnt
    if hardly:
        shown = _shows_at_all(whole.edge, learnt.edge)
    else:
        shown = _shows_better(whole.edge, learnt.edge)
    return whole if shown else learnt


def _brightness_by_distance(learnt: Learnt, section: Section, half_px: int) -> Learnt:
    """The same, or where it shows hardly an edge what any difference from the ground teaches, if
    that settles: strands nearly as bright as their ground are brighter than it in their middle and
    darker at their limbs."""
    if _is_matched(learnt.edge):
        return learnt
    whole = _learnt_by(DISTANCE, learnt, section, half_px)
    if whole is None or whole.edge.last.moved_px >= MISSED_PX:
        return learnt
    return whole if _shows_at_all(whole.edge, learnt.edge) else learnt


def _beside_brightness(learnt: Learnt, other: Learnt, section: Section) -> Learnt:
    """What brightness teaches (`other`), alone or along with what the strings' colour taught."""
    hue = learnt.sight.signal.way is Way.HUE
    sharp_px = _sharp_px(learnt, other.edge) if hue else float("nan")
    in_shreds = learnt.sight.signal.by_distance and not _is_as_long(other, learnt)
    if in_shreds or not _is_seen(other.edge, learnt.edge):
        if hue and is_resolved(learnt.edge.shading[0].rho_px, SHARP_PX[-1]):
            return _as_bright(learnt, other, section, sharp_px, seen=False)
        return _as_stored(learnt, sharp_px, section)
    if hue and is_resolved(other.edge.shading[0].rho_px, sharp_px):
        learnt = _as_bright(learnt, other, section, sharp_px, seen=True)
        return other if _tells_more(other.edge, learnt.edge) else learnt
    learnt = _as_stored(learnt, sharp_px, section)
    if _tells_more(other.edge, learnt.edge):
        return other
    return replace(learnt, edge=_joined(learnt.edge, other.edge))


def _beside_cover(learnt: Learnt, section: Section, half_px: int) -> Learnt:
    """Edges by a hue that are where both it and the ground that the strings leave say, each by how
    sure it is of the width. A hue fades at a limb as the light there does; the ground does not, but
    falls into shadow close to them. What the two differ by is not known. Of strands of several
    colours a hue may show one alone: then what is seen of the ground tells the bundle."""
    if learnt.sight.signal.way is not Way.HUE:
        return learnt
    signal, apart = cover_along(learnt.sight, [picture for picture, _ in learnt.pairs])
    # An uneven ground, which a hue leaves out, is all there in what is seen of it.
    far = apart > FAR_APART
    asked = far or (apart > HUE_APART and _is_short(learnt))
    cover = _learnt_by(signal, learnt, section, half_px) if asked else None
    if cover is None:
        return learnt
    if not _is_as_long(learnt, cover) and _shows_more(cover.edge, learnt.edge):
        return cover
    if not (far and _is_no_thicker(cover.edge, learnt.edge)):
        return learnt
    return replace(learnt, edge=_joined(learnt.edge, cover.edge))


def _by_hue(bright: Learnt, section: Section, half_px: int) -> tuple[Learnt, Learnt | None]:
    """What brightness taught, and nothing beside it; or where that leaves the width open and a hue
    tells more, what that hue taught, and brightness beside it: of strings brighter than their
    ground one limb may be just as bright. A hue that tells no more, or is stored more coarsely than
    what brightness shows as often, is heard along, if it is one: it fades at limbs that pass for
    too far out by brightness."""
    if bright.edge.last.frames and light_sd_px(bright.edge.shading) <= OPEN_PX:
        return bright, None
    signal, apart = hue_along(bright.sight, [picture for picture, _ in bright.pairs])
    hue = _learnt_by(signal, bright, section, half_px) if apart > HUE_APART else None
    if hue is None:
        return bright, None
    sharp_px = bright.edge.shading[0].blur_px
    by_colour = _is_hue(hue, sharp_px)
    whole = by_colour and not is_halved(hue.edge.shading[0].blur_px, sharp_px)
    instead = whole or not _is_often_seen(bright.edge, hue.edge)
    if instead and _is_surer(hue.edge, bright.edge):
        return hue, bright
    joined = _joined(bright.edge, hue.edge) if by_colour else bright.edge
    return replace(bright, edge=joined), None


def _is_hue(hue: Learnt, sharp_px: float) -> bool:
    """Whether strings stand out by a hue, and the ground does not by its light. Of pale strings
    before grey it is mostly their brightness, which lost 3.4 px of 38, stated to 1.3, where
    brightness itself lost 0.9."""
    colours = colours_in(hue.cuts, sharp_px)
    return colours is not None and colours.black > -GROUNDLESS


def _sharp_px(learnt: Learnt, bright: EdgeLook) -> float:
    """How sharp the pictures are, px: by the strings' edges, as brightness shows them, if it shows
    their bundle and tells its width; else by the straight edges of whatever else is there. NaN
    where neither tells."""
    if _is_matched(bright) and light_sd_px(bright.shading) < BLURRED_PX:
        return bright.shading[0].blur_px
    pictures = [picture for picture, _ in learnt.pairs][:: max(len(learnt.pairs) // ASKED, 1)]
    seen_px = sharpness_px(pictures[:ASKED], learnt.sight.gamma)
    told = np.isfinite(seen_px) or not _is_seen(bright, learnt.edge)
    return seen_px if told else bright.shading[0].blur_px


def _as_bright(
    learnt: Learnt, other: Learnt, section: Section, sharp_px: float, seen: bool
) -> Learnt:
    """The same with its edges moved by what brightness as well tells of them: of strands so thick
    that their limbs' light is seen apart from the blur. sharp_px: the picture's blur, NaN where it
    is not known; seen: whether brightness shows the bundle: along the hue's edges its limbs may
    show even where it does not."""
    edge = learnt.edge
    sought = not np.isfinite(sharp_px)
    sharp_px = SHARP_PX[0] if sought else sharp_px
    halved = is_halved(edge.shading[0].blur_px, sharp_px)
    bright = BrightCuts(_pairs(learnt, other), sharp_px, sought, halved, luma_in(other.cuts))
    # Rounds need not have settled: one more of each kind, from the same edges on.
    plain = next_look(learnt.cuts, section, edge)
    both = next_look(learnt.cuts, section, replace(edge, bright=bright))
    by_px = wider_px(both, plain) - both.last.wide_px + plain.last.wide_px
    if abs(by_px) > MOST_PX:
        unsure = _joined(edge, other.edge) if seen else less_sure(edge, place_sd_px(MOST_PX))
        return replace(learnt, edge=unsure)
    own, alone, told = (light_sd_px(look.shading) for look in (edge, plain, both))
    # Limbs that stand out from their ground by little, alone, may be gloss: half is believed then.
    believed, not_known = (1.0, 0.5) if seen else (0.5, 1.0)
    sd_px = float(np.sqrt(max(own**2 - alone**2, 0.0) + told**2 + (not_known * by_px) ** 2))
    by_px *= believed
    upper, lower = (
        replace(s, beyond_px=s.beyond_px + 0.5 * by_px, place_sd_px=place_sd_px(sd_px))
        for s in edge.shading
    )
    moved = replace(edge, shading=(upper, lower), diameter_px=edge.diameter_px + by_px)
    return replace(learnt, edge=moved)


def _as_stored(learnt: Learnt, sharp_px: float, section: Section) -> Learnt:
    """The same, where it is known how sharp the picture is, with its edges where they lie once what
    storing a colour at half the resolution makes of them is undone; half of that counts as not
    known. What is sought in every column stays as blurred as the file shows it: anything sharper
    follows the blocks."""
    edge = learnt.edge
    if not np.isfinite(sharp_px):
        return learnt
    stored = stored_in(learnt.cuts, sharp_px, edge.shading[0].blur_px)
    if stored is None:
        return learnt
    undone = settle(learnt.cuts, section, replace(edge, stored=stored))
    by_px = wider_px(undone, edge)
    if abs(by_px) > MOST_PX:  # rounds that did not settle
        return learnt
    upper, lower = (replace(s, beyond_px=s.beyond_px + 0.5 * by_px) for s in edge.shading)
    moved = replace(edge, shading=(upper, lower), diameter_px=edge.diameter_px + by_px)
    return replace(learnt, edge=less_sure(moved, place_sd_px(0.5 * by_px)))


def _pairs(learnt: Learnt, other: Learnt) -> dict[int, Cut]:
    """What another signal shows of the same pictures, by the id of the cut in the first."""
    cuts = {cut.picture: cut for cut in other.cuts}
    pairs = ((mine, cuts.get(mine.picture)) for mine in learnt.cuts)
    return {
        id(mine): cut
        for mine, cut in pairs
        if cut is not None and cut.contrast.shape == mine.contrast.shape
    }


def _learnt_by(signal: Signal, learnt: Learnt, section: Section, half_px: int) -> Learnt | None:
    """What the same pictures teach by another signal; None where it shows no strings."""
    pictures = [picture for picture, _ in learnt.pairs]
    sight = seen_by(learnt.sight, pictures, signal)
    strand_px = sight.width_px / section.diameter_d
    sight, pairs = cut_alike(pictures, sight, strand_px, half_px)
    if not pairs:
        return None
    if signal.by_distance:
        sight, pairs = toned(pictures, sight, pairs, strand_px, half_px)
    return learn_edges(pairs, sight, section)


def _joined(colour: EdgeLook, bright: EdgeLook) -> EdgeLook:
    """Edges by colour that are where both together say, each by how sure it is of the width, and
    brightness by as much less as its edges fit worse. What the two differ by is not known."""
    # What one frame of several shows by brightness may be legs, or a coil.
    told = bright.last.frames >= max(min(FEWEST, colour.last.frames), 1)
    if not (told and _is_whole(bright, colour)):
        return colour
    wide_px = wider_px(colour, bright)
    alone_px = float(np.hypot(light_sd_px(bright.shading), BRIGHT_SD_PX))
    sd_px = alone_px * _times_worse(bright, colour)
    shading, by_px = heard(colour.shading, Witness(wide_px, sd_px), apart_px=wide_px)
    return replace(colour, shading=shading, diameter_px=colour.diameter_px + by_px)


def _tells_more(bright: EdgeLook, colour: EdgeLook) -> bool:
    """Whether edges by brightness fit as well, tell the width surer, and show the limbs."""
    return _is_surer(bright, colour) and _is_whole(bright, colour)


def _is_surer(edge: EdgeLook, other: EdgeLook) -> bool:
    """Whether edges fit as well as others, in as many frames or better, and tell the width surer:
    than those that no bundle was fitted to, if one was."""
    if not other.last.frames:
        return edge.last.frames > 0
    surer = light_sd_px(edge.shading) < SURER * light_sd_px(other.shading)
    # Coils are tried where no straight bundle fits: as many frames as with them need not show one.
    frames = FEWEST if other.last.coils and not edge.last.coils else other.last.frames
    better = _cost_px2(edge.last, frames) <= _cost_px2(other.last, other.last.frames)
    return surer and better


def _shows_better(whole: EdgeLook, across: EdgeLook) -> bool:
    """Whether edges by all that strings differ by from their ground, and not across its colour
    alone, fit far better and tell the width surer: grey strands beside red ones hardly leave the
    colour of a grey ground, and their brightness is stored in full. What is thicker so by more than
    such strands' limbs may fade is strings and their shadow."""
    frames = max(whole.last.frames, across.last.frames)
    better = _cost_px2(whole.last, frames) < SURER * _cost_px2(across.last, frames)
    surer = light_sd_px(whole.shading) < light_sd_px(across.shading)
    return better and surer and _is_no_thicker(whole, across)


def _shows_at_all(whole: EdgeLook, hardly: EdgeLook) -> bool:
    """Whether all that strings differ by from their ground shows edges where another signal hardly
    does, and no shadow along with them."""
    return _is_matched(whole) and _is_no_thicker(whole, hardly)


def _shows_more(cover: EdgeLook, hue: EdgeLook) -> bool:
    """Whether a bundle was fitted to edges that hardly miss, in no fewer frames."""
    frames = max(cover.last.frames, hue.last.frames)
    better = _cost_px2(cover.last, frames) < SURER * _cost_px2(hue.last, frames)
    return _is_matched(cover) and better


def _is_no_thicker(edge: EdgeLook, hue: EdgeLook) -> bool:
    """Whether strings are thicker by no more than their limbs may fade in a hue: else it is they
    and their shadow."""
    faded_px = max(UNSURE * light_sd_px(hue.shading), FADED_RHO * edge.shading[0].rho_px)
    return wider_px(edge, hue) < faded_px


def _is_matched(edge: EdgeLook) -> bool:
    """Whether a bundle was fitted, to more edges than one of any width finds of anything."""
    return edge.last.frames > 0 and edge.last.matched > LEAST_MATCHED


def _is_seen(bright: EdgeLook, colour: EdgeLook) -> bool:
    """Whether brightness shows strings at all: before a ground as bright as they are a helix of any
    width fits some few edges of anything."""
    alike = 1.0 / ALIKE < bright.diameter_px / colour.diameter_px < ALIKE
    return _is_matched(bright) or (bright.last.frames > 0 and alike)


def _is_as_long(bright: Learnt, colour: Learnt) -> bool:
    """Whether brightness shows a bundle along much of what colour does, in most pictures. Of blue
    and black strands on a grey as bright as the blue it shows black ones alone: no bundle goes on
    between their crests."""
    pairs = _pairs(colour, bright)
    shares = [
        other.silhouette.bundle.sum() / max(cut.silhouette.bundle.sum(), 1)
        for cut in colour.cuts
        if (other := pairs.get(id(cut))) is not None
    ]
    return not shares or float(np.median(shares)) > AS_LONG


def _is_short(learnt: Learnt) -> bool:
    """Whether most pictures show a bundle along hardly any of what lies between its ends."""
    sight = learnt.sight
    seen = np.median([cut.silhouette.bundle.sum() for cut in learnt.cuts])
    return bool(seen < SHORT * (sight.end_px - sight.start_px))


def _is_often_seen(bright: EdgeLook, hue: EdgeLook) -> bool:
    """Whether brightness shows strings in many of the columns where a hue does: what gleams of them
    before a dark ground is seen in a few, and no helix of their own."""
    often = bright.last.matched > AS_OFTEN * hue.last.matched
    return often and _is_seen(bright, hue)


def _is_whole(bright: EdgeLook, colour: EdgeLook) -> bool:
    """Whether brightness shows the limbs: lit ones may be as bright as their ground."""
    unsure_px = UNSURE * light_sd_px(colour.shading)
    faded_px = max(FADED_PX, FADED_RHO * colour.shading[0].rho_px, unsure_px)
    return wider_px(colour, bright) < faded_px


def _times_worse(bright: EdgeLook, colour: EdgeLook) -> float:
    """How many times as far off its edges are, in squares of px, as those by colour; 1 where they
    are no farther."""
    cost = max(_cost_px2(colour.last, colour.last.frames), LEAST_COST_PX2)
    return max(_cost_px2(bright.last, colour.last.frames) / cost, 1.0)


def _cost_px2(seen: Round, frames: int) -> float:
    """Of all columns, of so many frames at least, the mean square by which edges are off what was
    fitted."""
    if not seen.frames:
        return MISSED_PX**2
    found = seen.matched * seen.frames / max(seen.frames, frames, 1)
    return found * seen.rms_px**2 + (1.0 - found) * MISSED_PX**2
