"""What a recording looks like, learnt once from a few of its frames: where, how bright, how thick.

`learn_looks` sees the sampled frames together; `measure_frame` then needs one frame at a time.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice

import cv2
import numpy as np

from tsvision.images.sight import Sight, Told, find_sights
from tsvision.measures.count import count_strands
from tsvision.measures.edges.cut import BURNT_OUT, Cut
from tsvision.measures.edges.find import find_edges
from tsvision.measures.edges.shading import Shading
from tsvision.measures.ends.ends import NEAR_SHARE, Ends, find_ends
from tsvision.measures.ends.gap import Gap
from tsvision.measures.ends.leg_gauge import gauge_from_legs
from tsvision.measures.ends.legs import Face
from tsvision.measures.ends.start import Start, find_start
from tsvision.measures.handedness import slope_between
from tsvision.measures.helix.gives import gives_alike
from tsvision.measures.helix.section import pair_core
from tsvision.measures.helix.silhouette import Section
from tsvision.measures.helix.uncertainty import light_sd_px
from tsvision.measures.helix.windows import learning_windows
from tsvision.measures.light.learnt import (
    Learnt,
    Pairs,
    as_sure_as_exposed,
    cut_alike,
    cut_all,
    learn_edges,
    toned,
)
from tsvision.measures.light.surest import surest
from tsvision.measures.light.witness import heard
from tsvision.records import Rig, Scale

# What numerics raise on pictures without a usable edge; anything else is a fault of the code.
UNLEARNABLE = (ValueError, FloatingPointError, ZeroDivisionError, np.linalg.LinAlgError, cv2.error)
# Of the section's width: what is thinner is no bundle of these strands but one leg of two, which
# has half of them; as wide comes a bundle that coils; what is wider is a plate, or both legs.
THIN, WIDE = 0.6, 2.2
LIKELIEST = 4  # lines, of which one may be that of a bundle of these strands
UNTOLD_PX = 1.0  # of a width, by which light and shape are unsure, from which on legs are asked


@dataclass(frozen=True)
class Looks:
    """All that stays the same in a recording.

    strand_count N and its confidence (1 when given); shading of the upper and lower edge, and how
    much either counts in a fit; steady: whether all frames are equally sharp; diameter_px as
    learnt; half_px rows of a strip; zero_px: s of the separator's face; zone_px: L;
    face: the same as the legs tell it, None where they do not; gap: S as they tell it;
    slope_sum: of the ridges in the frames that were learnt from, which tells S from Z, and way: to
    which side the motor had turned in these (-1 or 1; 0: not known); possible_px: least and largest
    width of a bundle of the stated strands; saturated: share of the bundle's core where the sensor
    is full in any channel, typical of the frames learnt from.
    """

    sight: Sight
    section: Section
    strand_count: int
    strand_count_given: bool
    strand_count_confidence: float
    shading: tuple[Shading, Shading]
    trust: tuple[float, float]
    steady: bool
    diameter_px: float
    half_px: int
    ends: Ends
    scale: Scale
    zero_px: float
    zero_known: bool
    zone_px: float
    hole_distance_mm: float
    face: Face | None
    gap: Gap | None
    slope_sum: float = 0.0
    way: int = 0
    possible_px: tuple[float, float] = (0.0, float("inf"))
    saturated: float = 0.0


def learn_looks(
    pictures: list[np.ndarray], rig: Rig, scale: Scale, sight: Sight | None = None
) -> Looks | None:
    """Find the bundle (unless `sight` tells where) and learn its looks from some pictures of one
    size; None if there is none. Never raises on what they show: pictures from which nothing can be
    learnt are left out."""
    try:
        return _learn(pictures, rig, scale, sight)
    except UNLEARNABLE:
        usable = [p for p in pictures if _teaches(p, rig, scale, sight)]
    try:
        return _learn(usable, rig, scale, sight) if usable else None
    except UNLEARNABLE:
        return None


def _teaches(picture: np.ndarray, rig: Rig, scale: Scale, sight: Sight | None) -> bool:
    try:
        return _learn([picture], rig, scale, sight) is not None
    except UNLEARNABLE:
        return False


def _learn(pictures: list[np.ndarray], rig: Rig, scale: Scale, sight: Sight | None) -> Looks | None:
    given = rig.strings.count
    sight = sight or sight_of(pictures, rig, scale)
    if sight is None or not _is_possible(sight, rig, scale):
        return None
    strand_px = sight.width_px / pair_core(given or 2).diameter_d
    half = int(np.ceil(2.3 * sight.width_px)) + 6
    placed = _placed(pictures, sight, rig, scale, strand_px, half)
    if placed is None:
        return None
    sight, ends, pairs = placed
    sight, pairs = toned(pictures, sight, pairs, strand_px, half)
    cuts = [cut for _, cut in pairs]
    count, sure = (given, 1.0) if given is not None else _counted(cuts, sight, rig, scale)
    section = pair_core(count)
    learnt = surest(learn_edges(pairs, sight, section), section, half)
    learnt = as_sure_as_exposed(learnt)
    edge, cuts = learnt.edge, learnt.cuts
    start = find_start(learnt, ends, rig, scale)
    shading, diameter = edge.shading, edge.diameter_px
    burnt = learnt.saturated > BURNT_OUT and not learnt.sight.signal.in_colour
    untold = burnt or light_sd_px(shading) > UNTOLD_PX
    if count == 2 and start.known and untold:
        shading, wider = _by_legs(learnt, start, ends, rig, scale)
        diameter += wider
    seen = [replace(find_edges(cut, shading), trust=edge.trust) for cut in cuts]
    windows = [learning_windows(cut, diameter)[:1] for cut in cuts]
    stretches = [(e, window) for e, of in zip(seen, windows, strict=True) for window in of]
    section = gives_alike(stretches, section, diameter)
    return Looks(
        sight=learnt.sight,
        section=section,
        strand_count=count,
        strand_count_given=given is not None,
        strand_count_confidence=sure,
        shading=shading,
        trust=edge.trust,
        steady=edge.steady,
        diameter_px=diameter,
        half_px=max(half, int(np.ceil(2.2 * diameter)) + 6),
        ends=ends,
        scale=scale,
        zero_px=start.zero_px,
        zero_known=start.known,
        zone_px=_in_px(rig.actuator.twisting_zone_mm, scale),
        hole_distance_mm=rig.actuator.hole_distance_mm,
        face=start.face,
        gap=start.gap,
        slope_sum=_slope_sum(cuts, shading, diameter),
        possible_px=possible_px(rig, scale),
        saturated=learnt.saturated,
    )


def _in_px(length_mm: float, scale: Scale) -> float:
    return length_mm / scale.mm_per_px


def _placed(
    pictures: list[np.ndarray],
    sight: Sight,
    rig: Rig,
    scale: Scale,
    strand_px: float,
    half_px: int,
) -> tuple[Sight, Ends, Pairs] | None:
    """The sight from separator to connector, where both are, and what is cut of the pictures there;
    None where no picture shows strings."""
    pairs = cut_all(pictures, sight, strand_px, half_px)
    if not pairs:
        return None
    zone_px = _in_px(rig.actuator.twisting_zone_mm, scale)
    gap_px = _in_px(rig.actuator.hole_distance_mm, scale)
    ends = find_ends(pictures, [cut for _, cut in pairs], sight, zone_px, gap_px)
    view = rig.view
    if view.separator_side == "auto" and not view.axis_px and not _agree(ends, zone_px):
        other = sight.reversed()
        there = find_ends(pictures, [], other, zone_px, gap_px)
        if _agree(there, zone_px):  # plate and connector outweigh what the legs seemed to tell
            sight, ends = other, there
    sight, between = cut_alike(pictures, _between(sight, ends), strand_px, half_px)
    return sight, ends, between or pairs


def _by_legs(
    learnt: Learnt, start: Start, ends: Ends, rig: Rig, scale: Scale
) -> tuple[tuple[Shading, Shading], float]:
    """The shading as two strings' legs tell it, and by how much bundles are wider so, px."""
    shading = learnt.edge.shading
    d_px = _in_px(rig.strings.diameter_mm, scale)
    gauge = gauge_from_legs(
        learnt.pairs, learnt.sight, shading, start.zero_px, ends.plate_px, start.half_gap_px, d_px
    )
    if gauge is None:
        return shading, 0.0
    # What frames show of one limb is no more alike for their legs being so.
    gauge = replace(gauge, sd_px=float(np.hypot(gauge.sd_px, learnt.edge.apart_px)))
    return heard(shading, gauge)


def _slope_sum(cuts: list[Cut], shading: tuple[Shading, Shading], diameter_px: float) -> float:
    """Of the ridges' slopes within the twisted part."""
    slopes = [
        slope_between(cut, find_edges(cut, shading).within(cut.silhouette.bundle), diameter_px)
        for cut in cuts
    ]
    return float(np.nansum(slopes))


def _agree(ends: Ends, zone_px: float) -> bool:
    """Whether a plate and a connector are seen, L apart."""
    apart = abs(ends.connector_px - ends.plate_px - zone_px)
    return bool(ends.connector_seen and apart < NEAR_SHARE * zone_px)


def _between(sight: Sight, ends: Ends) -> Sight:
    """The sight from the plate to the connector only: neither is to be measured."""
    start, end = sight.start_px, sight.end_px
    if np.isfinite(ends.plate_px):
        start = max(start, ends.plate_px)
    if np.isfinite(ends.connector_px):
        end = min(end, ends.connector_px)
    if end - start < 2.0 * sight.width_px:
        return sight
    return replace(sight, start_px=start, end_px=end)


def _counted(cuts: list[Cut], sight: Sight, rig: Rig, scale: Scale) -> tuple[int, float]:
    return count_strands(cuts, sight, rig.strings.diameter_mm / scale.mm_per_px)


def sight_of(pictures: list[np.ndarray], rig: Rig, scale: Scale) -> Sight | None:
    """Where the bundle lies in some pictures of one size, by all that the rig tells of it: of the
    likeliest lines the first along which what lies there is as wide as a bundle may be, or the
    first of all where none is."""
    first = None
    for sight in islice(sights_of(pictures, rig, scale), LIKELIEST):
        if _is_possible(sight, rig, scale):
            return sight
        first = first or sight
    return first


def _is_possible(sight: Sight, rig: Rig, scale: Scale) -> bool:
    """Whether what was found is neither thinner nor wider than a bundle of the stated strands."""
    least_px, most_px = possible_px(rig, scale)
    return least_px <= sight.width_px <= most_px


def sights_of(pictures: list[np.ndarray], rig: Rig, scale: Scale) -> Iterator[Sight]:
    """Where it may lie, likeliest first."""
    view, widths = rig.view, _possible_widths(rig, scale)
    least_px, _ = possible_px(rig, scale)
    gamma, side = rig.camera.gamma, view.separator_side
    told = Told(view.roi_px, widths, gamma, side, view.axis_px, least_px)
    return find_sights(pictures, told)


def possible_px(rig: Rig, scale: Scale) -> tuple[float, float]:
    """Least and largest width of a bundle of the stated strands; 0 and infinity where N, d or the
    scale is unknown."""
    count, d_px = rig.strings.count, rig.strings.diameter_mm / scale.mm_per_px
    if not (count and np.isfinite(d_px)):
        return 0.0, float("inf")
    width_px = pair_core(count).diameter_d * d_px
    return THIN * width_px, WIDE * width_px


def _possible_widths(rig: Rig, scale: Scale) -> tuple[float, float] | None:
    """From one strand's width to a coiled bundle's, when the rig tells d and the scale is known."""
    d = rig.strings.diameter_mm
    if not (np.isfinite(d) and np.isfinite(scale.mm_per_px)):
        return None
    count = rig.strings.count
    outer = pair_core(min(count, 8)).diameter_d if count else 3.7
    return d / scale.mm_per_px, WIDE * outer * d / scale.mm_per_px
