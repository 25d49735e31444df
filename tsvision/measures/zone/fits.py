"""Which stretches of a frame's bundle are fitted: beside the separator, and in mid-span."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tsvision.measures.edges.cut import Cut
from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.bundle import (
    FLANK,
    SCALE_PX,
    BundleFit,
    as_elsewhere,
    explains_as_much,
    fit_window,
    swing_px,
)
from tsvision.measures.helix.unevenly import fit_unevenly
from tsvision.measures.helix.weigh import told_by_noise, unsure
from tsvision.measures.helix.windows import even_stretches
from tsvision.measures.looks import Looks

NAN = float("nan")
SHOWN_TURNS = 2.0  # of the strands, that a straight fit beside the separator spans
TRIED = 3  # stretches from the separator on, until one can be fitted at all
LEAST_TURNS = 0.9  # that tell pitch and width apart
ALIKE = 1.15  # ratio of two pitches of one bundle, at most
AS_WELL = 0.1  # of the light inside, that a coil may explain less than the best known to be it
POOR = 0.3  # cost of a fit above which others are tried
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
    coils of earlier frames, see `best_known`.

    A straight bundle is fitted from 0.6 D after the apex on; coiling takes 2.4 D to reach its full
    radius, and starting earlier costs 2-6 % of pitch.
    """
    d = looks.diameter_px
    known = np.flatnonzero((edges.upper_weight > 0) & (edges.lower_weight > 0))
    if known.size < 1.0 * d:
        return None, None
    first, last = float(edges.s_px[known[0]]), float(edges.s_px[known[-1]]) - 0.3 * d
    start = apex_px if np.isfinite(apex_px) else first
    skip = 1.0 if np.isfinite(apex_px) else 0.25
    rate = expected_rate(looks, turns, start)
    beyond = edges.window(min(start + 2.4 * d * skip, last - 4.0 * d), start + 10.0 * d)
    swings = swing_px(beyond) > 0.03 * d
    near: BundleFit | None = None
    if not swings:
        low = start + 0.6 * d * skip
        ends = low + 7.0 * d
        if near_before is not None and not near_before.fit.coiled:
            ends = start + max(SHOWN_TURNS * near_before.fit.pitch_px, 4.0 * d)
        near = fit_window(
            edges, looks.section, low, min(ends, last), d, rate, near_before, coil=False
        )
        if near is not None and near.fit.cost < 0.5:
            high = min(start + max(SHOWN_TURNS * near.fit.pitch_px, 4.0 * d), last)
            if abs(high - near.s_high_px) > 0.5 * d and high - low > 2.0 * d:
                again = fit_window(edges, looks.section, low, high, d, rate, near, coil=False)
                near = again or near
    poor = near is None or _is_poor(edges, near)
    if swings or poor:
        low = min(start + 2.4 * d * skip, max(last - 7.0 * d, start + 0.6 * d * skip))
        # Costs can be compared only where both limbs count alike.
        part = edges if swings else replace(edges, trust=(1.0, 1.0))
        for begins, ends in even_stretches(edges, low, last, d)[:TRIED]:
            ends = min(begins + 8.0 * d, ends)
            coiled = fit_window(part, looks.section, begins, ends, d, rate, near_before)
            if near is not None or coiled is not None:
                break
        if near is None or (coiled is not None and _better(coiled, near)):
            near = coiled or near
    mid = None
    middle = 0.5 * (first + last)
    if last - first > 12.0 * d:
        pitch = near.fit.pitch_px if near is not None else 2.0 * d
        span = max(3.5 * d, min(pitch, 0.25 * (last - first)))
        stretches = even_stretches(edges, start + 2.4 * d * skip, last, d)
        low, high = min(stretches, key=lambda w: max(w[0] - middle, middle - w[1], 0.0))
        centre = float(np.clip(middle, low + span, max(high - span, low + span)))
        low, high = max(low, centre - span), min(high, centre + span)
        mid = fit_window(edges, looks.section, low, high, d, rate, mid_before or near)
    near, mid = _as_known(edges, near, best), _as_known(edges, mid, best)
    if near is not None and mid is not None and mid.fit.coiled:
        if unsure(near.fit) or _contradict(near, mid):
            near = as_elsewhere(edges, near, mid)
        if near.fit.coiled and _contradict(near, mid):
            mid = as_elsewhere(edges, mid, near)
    return near, mid


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
    """Whether two stretches of a coil would be twisted differently: one is another branch."""
    ratio = near.fit.pitch_px / mid.fit.pitch_px
    return near.fit.coiled and not 1.0 / ALIKE < ratio < ALIKE


def _is_poor(edges: Edges, found: BundleFit) -> bool:
    """Whether a fit leaves more of its edges than their noise."""
    part = edges.window(found.s_low_px, found.s_high_px)
    return found.fit.cost > POOR and not told_by_noise(part, found.fit, SCALE_PX)


def _better(other: BundleFit, near: BundleFit) -> bool:
    """Whether a fit farther from the apex describes the bundle better than the straight one beside
    it. A short stretch is easily described: straight, it must show as much of a turn, or one."""
    turns = [(f.s_high_px - f.s_low_px) / f.fit.pitch_px for f in (other, near)]
    shown = other.fit.coiled or turns[0] > min(turns[1], LEAST_TURNS)
    return shown and other.fit.cost < 0.9 * near.fit.cost
