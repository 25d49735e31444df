"""Knots: what stands out of E(s) by the written criterion, told from its neighbours.

A knot coils more tightly than the bundle beside it, and the dips of an uneven bundle are about one
coil wide: closed over the bundle's own coil the dips would vanish, and two knots that lie near each
other run together. What stands out of E(s) closed over half a coil is therefore looked at again,
closed over little more than the half coil of its own after which the next lobe shows on the other
side.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tsvision.measures.edges.edges import Edges
from tsvision.measures.zone.definitions import KNOT_RATIO, KNOT_RISE
from tsvision.measures.zone.envelope import baseline_px, closed_over, envelope_px, reach_px
from tsvision.measures.zone.laid import coil_rate
from tsvision.records import NAN, KnotSighting

PLAIN = 1.70  # of the lower quartile of E: what reaches it is a knot whatever the beats
# Lobes of the strands meet those of the coil now here, now there: closed over one coil alone, the
# lower quartile of an even coil comes out a tenth low, and stretches seen better look like knots.
BEATS = 1.4  # periods over which the envelope is closed where its baseline is read
# One view shows E only where a lobe of the coil happens to point sideways: either end of a knot
# comes out short by up to half a lobe, both together by this part of D; of a young one, of which a
# single lobe reaches out of the bundle, no more may show than the lobe itself.
COMES_SHORT = 0.45
AT_END = 1.2  # of D, from either end of what is seen: what lies there alone belongs to the end
JOINED = 0.4  # of a coil: what stands out so near to each other is one
LOBE = 0.2  # confidence in a knot of which a single lobe shows, too short for one by itself
OWN_COIL = 0.7  # of a knot's own coil, over which it is closed to tell it from its neighbour
# A coil reaches out as far on one side as half a turn later on the other. What does not is an edge
# that was lost to a shadow or a cable; of 400 knots on films the least reaches 0.75.
OTHER_SIDE, ALONG_D = 0.6, 0.2  # of its reach, over this part of D
DENSE = 0.5  # of a knot's columns, in which strings are seen: of 19 on films 0.95 and more
BESIDE_D = 0.5  # from a knot's ends: how far off its other side is looked for
# A limb trusted by less than this share of the other shows its crests here and not there, and an
# even coil seems to stand out where it does. A knot reaches farther out on the side that is lit,
# too, than its lower quartile: 1.4 to 2.2 times on films with a dark limb, what was none up to 1.2.
IN_THE_DARK, IN_LIGHT = 0.5, 1.25


@dataclass(frozen=True)
class Outline:
    """Both edges' distances (M,) to the frame's axis, px, 0 where not seen, in columns `known`.

    `edges`: the same as found; period_px: over which E is closed; coils: whether it swings."""

    edges: Edges
    upper_px: np.ndarray
    lower_px: np.ndarray
    known: np.ndarray
    diameter_px: float
    diameter_sd_px: float
    period_px: float
    coils: bool

    def closed_px(self, period_px: float, within: np.ndarray | None = None) -> np.ndarray:
        """E(s) (M,), dips shorter than a period filled; of the columns `within` alone if given."""
        known = self.known if within is None else self.known & within
        if within is None or np.array_equal(known, self.known):
            return closed_over(self.reach_px, period_px)
        return envelope_px(self.upper_px, self.lower_px, known, period_px, self.diameter_px)

    @cached_property
    def reach_px(self) -> np.ndarray:
        """How far (M,) the strings reach from the axis."""
        return reach_px(self.upper_px, self.lower_px, self.known, self.diameter_px)

    @cached_property
    def tight_px(self) -> np.ndarray:
        """E(s) (M,) closed over no more than a knot's coil."""
        return self.closed_px(self.tight_over_px)

    @property
    def tight_over_px(self) -> float:
        """No more than a coil of a knot."""
        return max(0.5 * self.period_px, 1.2 * self.diameter_px)


def baseline_along_px(outline: Outline) -> float:
    """E0: the 25th percentile of E(s), its dips closed over more than one coil, but never from one
    plain knot to the next: where knots take up most of the zone, what lies between them is E0."""
    tight = outline.tight_px
    low = baseline_px(tight)
    if not np.isfinite(low):
        return low
    plain = np.zeros(tight.size, dtype=bool)
    for first, last in _runs(np.isfinite(tight) & (tight >= KNOT_RISE * low)):
        plain[first : last + 1] = tight[first : last + 1].max() >= PLAIN * low
    shown = np.where(plain, tight, np.nan)
    for first, last in _runs(np.isfinite(tight) & ~plain):
        beside = np.zeros(tight.size, dtype=bool)
        beside[first : last + 1] = True
        closed = outline.closed_px(BEATS * outline.period_px, beside)
        shown = np.where(np.isfinite(closed), closed, shown)
    return baseline_px(shown)


def knots_along(
    outline: Outline, base_px: float, place_px: np.ndarray
) -> tuple[list[KnotSighting], list[KnotSighting]]:
    """(knots, lobes) with all lengths in px, centres as s of the axis: what reaches as far as a
    knot must over less than a knot's length, or to one side only, is a lobe. place_px (M, 2): x, y
    of the axis."""
    s_px = outline.edges.s_px
    short = COMES_SHORT * outline.diameter_px if outline.coils else 0.0

    def sought(closed_px: np.ndarray, gap_px: float) -> list[KnotSighting]:
        return find_knots(
            s_px,
            closed_px,
            outline.diameter_px,
            base_px,
            place_px,
            outline.diameter_sd_px,
            short,
            gap_px,
            least_length_px=0.0,
        )

    knots: list[KnotSighting] = []
    lobes: list[KnotSighting] = []
    if not np.isfinite(base_px):
        return knots, lobes
    for one in sought(outline.tight_px, JOINED * outline.period_px):
        if _is_an_end(outline, *one.ends_px) or _hardly_seen(outline, *one.ends_px):
            continue
        if (
            one.length_px < outline.diameter_px
            or _one_sided(outline, one)
            or _in_the_dark_alone(outline, one)
        ):
            lobes.append(replace(one, confidence=LOBE))
            continue
        parts = _parts(outline, *one.ends_px, sought)
        parts = [part for part in parts if part.length_px >= outline.diameter_px]
        knots += parts if len(parts) > 1 else [one]
    return [_counted(outline, k) for k in knots], [_counted(outline, k) for k in lobes]


def _counted(outline: Outline, knot: KnotSighting) -> KnotSighting:
    """The knot with the coils in it, by their own rate: E is closed over other lengths."""
    rate = coil_rate(outline.edges, *knot.ends_px, outline.diameter_px)
    return replace(knot, coils=knot.length_px * rate / (2.0 * np.pi))


def _is_an_end(outline: Outline, low_px: float, high_px: float) -> bool:
    """Whether what stands out between two s is the legs that part, or what the connector grips: it
    reaches to the end of what is seen, and not far from there."""
    seen = outline.edges.s_px[outline.known]
    near = AT_END * outline.diameter_px
    first, last = float(seen[0]), float(seen[-1])
    return high_px < first + near or low_px > last - near


def _hardly_seen(outline: Outline, low_px: float, high_px: float) -> bool:
    """Whether strings are seen in few columns between two s, so that what stands out there may be
    of the ground."""
    s_px = outline.edges.s_px  # a px apart: of a single column the ends lie on it, but for rounding
    between = (s_px >= low_px - 0.5) & (s_px <= high_px + 0.5)
    return bool(np.mean(outline.known[between]) < DENSE)


def _one_sided(outline: Outline, knot: KnotSighting) -> bool:
    """Whether the strings reach out on one side of the axis only, where both sides are seen."""
    enough, far = ALONG_D * outline.diameter_px, OTHER_SIDE * 0.5 * knot.max_diameter_px
    here = _about(outline, knot)
    sides = [np.abs(edge[here & (edge != 0.0)]) for edge in (outline.upper_px, outline.lower_px)]
    seen = all(side.size >= outline.diameter_px for side in sides)
    return seen and any((side >= far).sum() < enough for side in sides)


def _in_the_dark_alone(outline: Outline, knot: KnotSighting) -> bool:
    """Whether the strings reach farther out than elsewhere only where one limb hardly shows."""
    upper, lower = outline.edges.trust
    if min(upper, lower) >= IN_THE_DARK * max(upper, lower):
        return False
    edge = outline.upper_px if upper > lower else outline.lower_px
    side_px = np.where(outline.known, np.abs(edge), np.nan)
    closed_px = closed_over(side_px, outline.tight_over_px)
    top_px = np.nanmax(closed_px[_about(outline, knot)], initial=0.0)
    return bool(top_px < IN_LIGHT * baseline_px(closed_px))


def _about(outline: Outline, knot: KnotSighting) -> np.ndarray:
    """Known columns (M,) in a knot and a little beside it."""
    (low_px, high_px), beside = knot.ends_px, BESIDE_D * outline.diameter_px
    s_px = outline.edges.s_px
    return outline.known & (s_px >= low_px - beside) & (s_px <= high_px + beside)


def _parts(
    outline: Outline,
    low_px: float,
    high_px: float,
    sought: Callable[[np.ndarray, float], list[KnotSighting]],
) -> list[KnotSighting]:
    """What stands out between two s when E is closed over the coils that are there."""
    rate = coil_rate(outline.edges, low_px, high_px, outline.diameter_px)
    if not np.isfinite(rate):
        return []
    own = outline.closed_px(OWN_COIL * 2.0 * np.pi / rate)
    s_px = outline.edges.s_px
    return sought(np.where((s_px >= low_px) & (s_px <= high_px), own, np.nan), 0.0)


def in_mm(knot: KnotSighting, centre_mm: float, mm_per_px: float) -> KnotSighting:
    """A knot in px with its centre in mm, and its sizes by the scale across the bundle."""
    return replace(
        knot,
        centre_mm=centre_mm,
        length_mm=knot.length_px * mm_per_px,
        max_diameter_mm=knot.max_diameter_px * mm_per_px,
    )


def find_knots(
    s_px: np.ndarray,
    closed_px: np.ndarray,
    diameter_px: float,
    base_px: float,
    place_px: np.ndarray,
    envelope_sd_px: float,
    short_px: float = 0.0,
    gap_px: float = 0.0,
    least_length_px: float | None = None,
) -> list[KnotSighting]:
    """Intervals of E (M,) that stand out by the written criterion: at least 1 D long with
    E >= 1.15 E0 and a largest E >= 1.40 D; their lengths in px alone. place_px (M, 2): x, y of the
    axis. short_px: by how much an interval of E as one view shows it comes out short; gap_px:
    intervals less than that apart are one; least_length_px: in place of D.
    Confidence: how far E stands above both limits, in its own sd.
    """
    above = np.isfinite(closed_px) & (closed_px >= KNOT_RISE * base_px)
    least = diameter_px if least_length_px is None else least_length_px
    found = []
    for first, last in _joined(_runs(above), s_px, gap_px):
        length = float(s_px[last] - s_px[first]) + short_px
        top = float(np.nanmax(closed_px[first : last + 1]))
        if length < least or top < KNOT_RATIO * diameter_px:
            continue
        weight = np.clip(closed_px[first : last + 1] - KNOT_RISE * base_px, 0.0, None) + 1e-12
        centre = float((s_px[first : last + 1] * weight).sum() / weight.sum())
        at = int(np.argmin(np.abs(s_px - centre)))
        margin = min(top / (KNOT_RISE * base_px) - 1.0, top / (KNOT_RATIO * diameter_px) - 1.0)
        sd = max(envelope_sd_px / max(base_px, 1e-9), 0.01)
        found.append(
            KnotSighting(
                centre_mm=NAN,
                length_mm=NAN,
                max_diameter_mm=NAN,
                centre_x_px=float(place_px[at, 0]),
                centre_y_px=float(place_px[at, 1]),
                confidence=float(1.0 - 0.5 * np.exp(-margin / sd)),
                centre_px=centre,
                length_px=length,
                max_diameter_px=top,
            )
        )
    return found


def _joined(runs: list[tuple[int, int]], s_px: np.ndarray, gap_px: float) -> list[tuple[int, int]]:
    """Runs with less than `gap_px` between them as one: the dip between two coils of one knot."""
    out: list[tuple[int, int]] = []
    for first, last in runs:
        if out and s_px[first] - s_px[out[-1][1]] < gap_px:
            out[-1] = (out[-1][0], last)
        else:
            out.append((first, last))
    return out


def _runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """(first, last) of every run of True."""
    padded = np.concatenate([[0], flags.astype(np.int8), [0]])
    change = np.diff(padded)
    return list(zip(np.flatnonzero(change == 1), np.flatnonzero(change == -1) - 1, strict=True))
