"""Which stretches of a frame's bundle are fitted: beside the separator, and in mid-span."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tsvision.measures.edges.cut import Cut
from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.bundle import (
    FLANK,
    SCALE_PX,
    SWINGS,
    BundleFit,
    as_elsewhere,
    counted,
    explains_as_much,
    fit_window,
    laid_like,
    lesser,
    swing_px,
)
from tsvision.measures.helix.silhouette import KC, RC, Section
from tsvision.measures.helix.unevenly import fit_unevenly
from tsvision.measures.helix.weigh import told_by_noise, unsure
from tsvision.measures.helix.windows import even_stretches
from tsvision.measures.looks import Looks

NAN = float("nan")
# Widths from the apex on, from where a straight bundle is fitted, and a coil: that takes so much to
# reach its full radius, and starting earlier costs 2 to 6 % of pitch. Where the apex is out of view
# so much of either.
STRAIGHT_FROM_D, COIL_FROM_D, UNSEEN_SKIP = 0.6, 2.4, 0.25
LOOSE_END_D = 0.3  # at the end of what is seen, that is not fitted
# Widths of a first straight fit, of the shortest later one and of the shortest tried again, and by
# how much that has to end elsewhere; of a fit farther on.
FIRST_D, LEAST_STRAIGHT_D, LEAST_AGAIN_D, OTHER_END_D, COILED_D = 7.0, 4.0, 2.0, 0.5, 8.0
LOST = 0.5  # cost from which a fit describes nothing, and its pitch is not to go by
# Widths behind the apex up to which the middle line is asked whether it swings, and the least of
# them.
BEYOND_D, LEAST_BEYOND_D = 10.0, 4.0
# Widths in view from which mid-span is fitted apart; half of its stretch: a pitch, which is so many
# widths where none is known, but no less than so many widths nor more than that share of all.
MID_SPAN_D, USUAL_PITCH_D, LEAST_HALF_D, MOST_HALF = 12.0, 2.0, 3.5, 0.25
SHOWN_TURNS = 2.0  # of the strands, that a straight fit beside the separator spans
TRIED = 3  # stretches from the separator on, until one can be fitted at all
LEAST_TURNS = 0.9  # that tell pitch and width apart
# Of two stretches of one coil: the ratio of their pitches, at most, and by how many lobes a turn of
# the coil their strands may differ. Half a lobe is as near to another branch.
ALIKE, LOBES_OFF = 1.15, 0.5
AS_WELL = 0.1  # of the light inside, that a coil may explain less than the best known to be it
OTHERS_TRIED = 0.3  # cost of a fit above which others are tried
HELPS = 0.75  # of a coil's cost, that one which goes wider and narrower has to come below


def within_zone(edges: Edges, cut: Cut, looks: Looks) -> Edges:
    """Edges between apex and connector only."""
    end = looks.ends.connector_px
    inside = cut.silhouette.bundle & (cut.s_px < (end - 1.0 if np.isfinite(end) else np.inf))
    return replace(edges.within(inside), trust=looks.trust)


def apex_of(cut: Cut, looks: Looks) -> float:
    """s (px) where the legs meet; NaN when the bundle starts at the strip's end or plate."""
    first = cut.silhouette.apex_column
    if not np.isfinite(first):
        return NAN
    s = float(cut.s_px[int(first)])
    plate = looks.ends.plate_px
    seen = first > 3 and not (np.isfinite(plate) and s < plate + 0.3 * looks.diameter_px)
    return s if seen else NAN


def expected_rate(looks: Looks, turns: float, start_px: float) -> float:
    """Rate of strands and coiling together (rad/px) that the motor's turns lead one to expect
    between the apex at `start_px` and the connector; the two legs hold a quarter turn. With neither
    end in view the zone is taken to begin at the apex: it is no less."""
    end = looks.ends.connector_px
    if not np.isfinite(end):
        end = (looks.zero_px if looks.zero_known else start_px) + looks.zone_px
    if not (np.isfinite(turns) and np.isfinite(end)) or end <= start_px:
        return NAN
    return 2.0 * np.pi * max(abs(turns) - 0.25, 0.0) / (end - start_px)


@dataclass(frozen=True)
class _Span:
    """What of a frame's bundle may be fitted: from the apex, or where that is out of view from the
    first edges on (`first_px`), to near the last; `rate` as the motor leads one to expect."""

    edges: Edges
    section: Section
    diameter_px: float
    rate: float
    first_px: float
    start_px: float
    last_px: float
    apex_seen: bool

    def after(self, widths: float) -> float:
        """s (px) so many widths behind the apex; behind the first edges fewer will do, for there
        the bundle has long been whole."""
        skip = 1.0 if self.apex_seen else UNSEEN_SKIP
        return self.start_px + widths * self.diameter_px * skip

    def before_end(self, widths: float) -> float:
        return self.last_px - widths * self.diameter_px

    def fit(
        self, low_px: float, high_px: float, before: BundleFit | None, coil: bool = True
    ) -> BundleFit | None:
        return fit_window(
            self.edges, self.section, low_px, high_px, self.diameter_px, self.rate, before,
            coil=coil,
        )  # fmt: skip


def fit_bundle(
    edges: Edges,
    looks: Looks,
    turns: float,
    apex_px: float,
    near_before: BundleFit | None,
    mid_before: BundleFit | None,
    best: BundleFit | None = None,
) -> tuple[BundleFit | None, BundleFit | None]:
    """Fits beside the separator and in mid-span, the frame before's tried first; best: of the
    coils of earlier frames, see `best_known`."""
    span = _span(edges, looks, turns, apex_px)
    if span is None:
        return None, None
    near = _near(span, near_before)
    mid = _mid(span, near, mid_before)
    return _agreed(edges, _as_known(edges, near, best), _as_known(edges, mid, best))


def _span(edges: Edges, looks: Looks, turns: float, apex_px: float) -> _Span | None:
    """What may be fitted; None where hardly an edge is known."""
    d = looks.diameter_px
    known = np.flatnonzero((edges.upper_weight > 0) & (edges.lower_weight > 0))
    if known.size < d:
        return None
    first, last = float(edges.s_px[known[0]]), float(edges.s_px[known[-1]])
    seen = bool(np.isfinite(apex_px))
    start = apex_px if seen else first
    rate = expected_rate(looks, turns, start)
    return _Span(edges, looks.section, d, rate, first, start, last - LOOSE_END_D * d, seen)


def _near(span: _Span, before: BundleFit | None) -> BundleFit | None:
    """The fit beside the separator: straight where the middle hardly swings and that describes the
    edges, else farther from the apex as well, where coils have come to their full radius."""
    low = min(span.after(COIL_FROM_D), span.before_end(LEAST_BEYOND_D))
    beyond = span.edges.window(low, span.start_px + BEYOND_D * span.diameter_px)
    swings = swing_px(beyond) > SWINGS * span.diameter_px
    near = None if swings else _straight(span, before)
    if near is not None and not _is_poor(span.edges, near):
        return near
    # Costs can be compared only where both limbs count alike.
    alike = span if swings else replace(span, edges=replace(span.edges, trust=(1.0, 1.0)))
    farther = _farther(alike, before, near is not None)
    if near is None or (farther is not None and _better(farther, near)):
        return farther or near
    return near


def _straight(span: _Span, before: BundleFit | None) -> BundleFit | None:
    """A straight fit from just behind the apex on, over SHOWN_TURNS of its own."""
    low, least = span.after(STRAIGHT_FROM_D), LEAST_STRAIGHT_D * span.diameter_px

    def end_of(pitch_px: float) -> float:
        return min(span.start_px + max(SHOWN_TURNS * pitch_px, least), span.last_px)

    if before is not None and not before.fit.coiled:
        high = end_of(before.fit.pitch_px)
    else:
        high = min(low + FIRST_D * span.diameter_px, span.last_px)
    near = span.fit(low, high, before, coil=False)
    if near is None or near.fit.cost >= LOST:
        return near
    high = end_of(near.fit.pitch_px)
    other = abs(high - near.s_high_px) > OTHER_END_D * span.diameter_px
    if not other or high - low <= LEAST_AGAIN_D * span.diameter_px:
        return near
    return span.fit(low, high, near, coil=False) or near


def _farther(span: _Span, before: BundleFit | None, once: bool) -> BundleFit | None:
    """A fit, straight or coiled, from where coils have their full radius, between knots: of the
    first stretch that can be fitted at all, or of the first alone (`once`)."""
    low = min(span.after(COIL_FROM_D), max(span.before_end(FIRST_D), span.after(STRAIGHT_FROM_D)))
    stretches = even_stretches(span.edges, low, span.last_px, span.diameter_px)
    for begins, ends in stretches[: 1 if once else TRIED]:
        high = min(begins + COILED_D * span.diameter_px, ends)
        found = span.fit(begins, high, before)
        if found is not None:
            return found
    return None


def _mid(span: _Span, near: BundleFit | None, before: BundleFit | None) -> BundleFit | None:
    """The fit nearest to the middle of what is in view, between knots; None of a short bundle."""
    d, whole = span.diameter_px, span.last_px - span.first_px
    if whole <= MID_SPAN_D * d:
        return None
    middle = 0.5 * (span.first_px + span.last_px)
    pitch = near.fit.pitch_px if near is not None else USUAL_PITCH_D * d
    half = max(LEAST_HALF_D * d, min(pitch, MOST_HALF * whole))
    stretches = even_stretches(span.edges, span.after(COIL_FROM_D), span.last_px, d)
    low, high = min(stretches, key=lambda w: max(w[0] - middle, middle - w[1], 0.0))
    centre = float(np.clip(middle, low + half, max(high - half, low + half)))
    return span.fit(max(low, centre - half), min(high, centre + half), before or near)


def _agreed(
    edges: Edges, near: BundleFit | None, mid: BundleFit | None
) -> tuple[BundleFit | None, BundleFit | None]:
    """Both fits; where that of a coil is unsure, as the other has its strands, and where the two
    contradict each other, as that one of them has its strands which describes both stretches
    better. Each by itself is described best by its own, which tells nothing; but where only one of
    them makes anything of the other's stretch, the strands may differ indeed."""
    if near is None or mid is None or not mid.fit.coiled:
        return near, mid
    if unsure(near.fit):
        near = as_elsewhere(edges, near, mid)
    if not _contradict(near, mid):
        return near, mid
    as_mid, as_near = _laid_alike(edges, near, mid), _laid_alike(edges, mid, near)
    if as_mid is not None and as_near is not None:
        more_by_mid = counted(as_mid) - counted(near)
        more_by_near = counted(as_near) - counted(mid)
        return (as_mid, mid) if more_by_mid < more_by_near else (near, as_near)
    return lesser(near, as_mid), lesser(mid, as_near)


def _laid_alike(edges: Edges, found: BundleFit, other: BundleFit) -> BundleFit | None:
    """A believable fit of a stretch by the strands of another; None where those make none, as of a
    coil that unwinds."""
    like = laid_like(edges, found, other)
    return None if like is None or unsure(like.fit) or _contradict(like, other) else like


def best_known(
    best: BundleFit | None, near: BundleFit | None, mid: BundleFit | None
) -> BundleFit | None:
    """Of a recording's coils so far the last that explains the light inside as well as any before.
    Where a knot grows beside them, its coils unwind, and what describes them then may be another
    branch: frame after frame would begin from it."""
    for found in (near, mid):
        if found is None or not found.fit.coiled or unsure(found.fit):
            continue
        if best is None or found.fit.relief > best.fit.relief - AS_WELL:
            best = found
    return best


def as_uneven(edges: Edges, found: BundleFit | None, best: BundleFit | None) -> BundleFit | None:
    """A coil that leaves much of its edges, as one that goes wider and narrower, by strands like
    the best known's; as it was found where that hardly describes them better. The next frame does
    not begin from it."""
    if found is None or not found.fit.coiled or not _is_poor(edges, found):
        return found
    part = replace(edges.window(found.s_low_px, found.s_high_px), half_slope=FLANK)
    fit = fit_unevenly(part, found.fit, (best or found).fit, SCALE_PX)
    helps = fit is not None and fit.cost < HELPS * found.fit.cost
    return replace(found, fit=fit) if helps and fit is not None else found


def _as_known(edges: Edges, found: BundleFit | None, best: BundleFit | None) -> BundleFit | None:
    """A coil that explains much less of the light than the best known, or what the strands of that
    make of its stretch."""
    if found is None or best is None or not found.fit.coiled:
        return found
    return found if explains_as_much(found.fit, best.fit) else as_elsewhere(edges, found, best)


def _contradict(near: BundleFit, mid: BundleFit) -> bool:
    """Whether two stretches of a coil would be twisted differently: one is another branch, whose
    strands turn a lobe more or less from one coil to the next."""
    if not near.fit.coiled:
        return False
    ratio = near.fit.pitch_px / mid.fit.pitch_px
    p, more = near.fit.p, 1.0 / near.fit.pitch_px - 1.0 / mid.fit.pitch_px
    coil_px = 2.0 * np.pi / p[KC] * np.hypot(1.0, p[RC] * p[KC])  # along the bundle
    lobes = more * coil_px * near.fit.section.lobes
    return not 1.0 / ALIKE < ratio < ALIKE or abs(lobes) > LOBES_OFF


def _is_poor(edges: Edges, found: BundleFit) -> bool:
    """Whether a fit leaves more of its edges than their noise."""
    part = edges.window(found.s_low_px, found.s_high_px)
    return found.fit.cost > OTHERS_TRIED and not told_by_noise(part, found.fit, SCALE_PX)


def _better(other: BundleFit, near: BundleFit) -> bool:
    """Whether a fit farther from the apex describes the bundle better than the straight one beside
    it. A short stretch is easily described: straight, it must show as much of a turn, or one."""
    turns = [(f.s_high_px - f.s_low_px) / f.fit.pitch_px for f in (other, near)]
    shown = other.fit.coiled or turns[0] > min(turns[1], LEAST_TURNS)
    return shown and other.fit.cost < 0.9 * near.fit.cost
