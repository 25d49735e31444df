"""Helix fits along one bundle: beside the separator, in mid-span, and with what start."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tsvision.measures.helix import (
    COILED,
    KC,
    PHI,
    PHIC,
    STRAIGHT,
    Edges,
    HelixFit,
    K,
    Section,
    fit_helix,
)
from tsvision.measures.search import best_fit, coiled_starts, straight_starts


@dataclass(frozen=True)
class BundleFit:
    """A fit and the stretch of s that it describes; `edge_px` is the edge offset assumed."""

    fit: HelixFit
    s_low_px: float
    s_high_px: float

    @property
    def middle_px(self) -> float:
        return 0.5 * (self.s_low_px + self.s_high_px)


def shift_edges(edges: Edges, offset_px: float) -> Edges:
    """Edges moved inwards by `offset_px` on both sides (the measured ones lie that far outside)."""
    return Edges(
        edges.s_px,
        edges.upper_px - offset_px,
        edges.lower_px + offset_px,
        edges.upper_weight,
        edges.lower_weight,
    )


def usable(edges: Edges) -> bool:
    return bool((edges.upper_weight > 0.2).sum() > 20 and (edges.lower_weight > 0.2).sum() > 20)


def carried(start: HelixFit, s_middle_old: float, s_middle_new: float) -> list[np.ndarray]:
    """A fit as start for another window: phases moved along; a few turned phases beside it, since
    the strands have moved on between two frames."""
    shift = s_middle_new - s_middle_old
    starts = []
    fold = 1 if len(start.section.radius_d) % 2 else 2
    for turn in range(3):
        for coil_turn in range(3) if start.coiled else range(1):
            p = start.p.copy()
            p[PHI] += p[K] * shift + turn * 2 * np.pi / fold / 3
            p[PHIC] += p[KC] * shift + coil_turn * 2 * np.pi / 3
            starts.append(p)
    return starts


def fit_window(
    edges: Edges,
    section: Section,
    s_low: float,
    s_high: float,
    diameter_px: float,
    expected_rate: float,
    before: BundleFit | None = None,
    scale_px: float = 0.5,
    coil: bool = True,
) -> BundleFit | None:
    """The best helix on s_low..s_high, straight or coiled; None when too few edges are there.

    before: a fit of a neighbouring frame or window, tried first; a full search follows where that
    does not hold. The coil is tried whenever the straight residual is high or the middle swings:
    an overlooked coil of 0.06 D costs 3 % of pitch.
    """
    part = edges.window(s_low, s_high)
    if len(part.s_px) < 24 or not usable(part):
        return None
    middle = 0.5 * (part.s_px[0] + part.s_px[-1])
    warm = None
    if before is not None and (coil or not before.fit.coiled):
        starts = carried(before.fit, before.middle_px, middle)
        warm = best_fit(part, section, starts, before.fit.coiled, scale_px, keep=1)
    best = warm
    swings = coil and swing_px(part) > 0.03 * diameter_px
    holds = _holds(warm, before) and not (swings and warm is not None and not warm.coiled)
    if not holds:
        starts = straight_starts(part, section, diameter_px, expected_rate)
        straight = best_fit(part, section, starts, False, scale_px)
        best = _choose(best, straight)
        long_enough = s_high - s_low > 3.0 * diameter_px
        if coil and long_enough and (swings or best is None or best.cost > 0.2):
            starts = coiled_starts(part, section, straight, diameter_px, expected_rate)
            best = _choose(best, best_fit(part, section, starts, True, scale_px))
    if best is None:
        return None
    return BundleFit(best, float(part.s_px[0]), float(part.s_px[-1]))


def _holds(warm: HelixFit | None, before: BundleFit | None) -> bool:
    """Whether a fit carried over from the frame before is as good as that one was."""
    return warm is not None and before is not None and warm.cost < 1.2 * before.fit.cost + 0.02


def refit(edges: Edges, found: BundleFit, edge_prior_sd: float, scale_px: float = 0.5) -> BundleFit:
    """The same window again with the edge offset free within a prior of `edge_prior_sd` px."""
    part = edges.window(found.s_low_px, found.s_high_px)
    free = COILED if found.fit.coiled else STRAIGHT
    sd = np.full(9, np.inf)
    sd[8] = edge_prior_sd
    fit = fit_helix(part, found.fit.section, found.fit.p, free, scale_px, prior_sd=sd)
    return BundleFit(fit, found.s_low_px, found.s_high_px)


def swing_px(edges: Edges) -> float:
    """rms of the middle line about its own straight trend, px."""
    w = np.minimum(edges.upper_weight, edges.lower_weight)
    keep = w > 0.2
    if keep.sum() < 10:
        return 0.0
    centre = 0.5 * (edges.upper_px + edges.lower_px)[keep]
    trend = np.polyfit(edges.s_px[keep], centre, 1)
    return float(np.std(centre - np.polyval(trend, edges.s_px[keep])))


def _better(a: HelixFit | None, b: HelixFit | None) -> HelixFit | None:
    if a is None or b is None:
        return a if b is None else b
    return a if a.cost <= b.cost else b


def _choose(a: HelixFit | None, b: HelixFit | None) -> HelixFit | None:
    """The coiled model has three parameters more: it must pay for them."""
    if a is None or b is None:
        return a if b is None else b
    if a.coiled == b.coiled:
        return _better(a, b)
    straight, coiled = (b, a) if a.coiled else (a, b)
    return coiled if coiled.cost < 0.85 * straight.cost else straight
