"""Helix fits along one bundle: beside the separator, in mid-span, and with what start."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numba
import numpy as np

from tsvision.measures.edges.edges import SEEN, Edges
from tsvision.measures.helix.band import Band, full_band
from tsvision.measures.helix.branches import best_branch
from tsvision.measures.helix.crowded import crowded
from tsvision.measures.helix.fit import HelixFit
from tsvision.measures.helix.search import (
    coil_at,
    coils_of,
    search_coiled,
    search_straight,
    straight_at,
)
from tsvision.measures.helix.silhouette import KC, RC, SLOPE, K, Section, passing
from tsvision.measures.helix.weigh import PLAINLY, believed, doubt, is_plain, weighed
from tsvision.measures.numeric.line import line_through
from tsvision.measures.numeric.sums import deviation

NAN = float("nan")
SCALE_PX = 0.5  # residual at which an edge point begins to count less
STILL = 0.015  # rms of the middle line over D below which no coil could change the pitch by 1 %
SWINGS = 0.03  # ... from which a coil is tried, ...
SWINGS_WIDELY = 0.08  # ... and from which nothing else is
SWINGS_ON = 1.15  # by what factor it must grow for a coil to be sought again where none was found
LED_ON = 1.1  # times the cost of the frame before that a straight fit led on by the motor may have
POOR_FRAMES = 5  # for which a poor fit is carried on before all is searched again, ...
LONGER = 1.3  # ... or until as many times as much of the bundle is in view: that tells more
COIL_PAYS = 0.85  # share of a straight fit's cost that a coiled one must stay below, ...
IN_STEP_PAYS = 0.4  # ... and where its coils go with the strands' lobes
ASLANT = 0.12  # slope against the axis of what is a leg, or a coil longer than the stretch
COIL_LOBES = 2.0  # of its strands, that a coil shows at least
WHOLE_PITCH = 0.9  # that a stretch has to show
# Slope of an outline that coils at which an edge counts half. Small errors along s are large ones
# along n there; and on the flanks strands face other ways than on the crests, into light and shade
# that the mean edge of straight bundles does not show.
FLANK = 0.25


@dataclass(frozen=True)
class BundleFit:
    """A fit, the stretch of s that it describes, the rate (rad/px) that the motor led one to
    expect there (NaN: unknown), for how many frames it was only carried on, and the swing of the
    middle line over D at which coils were last sought and none was found."""

    fit: HelixFit
    s_low_px: float
    s_high_px: float
    expected_rate: float = float("nan")
    carried: int = 0
    straight_at: float = 0.0

    @property
    def middle_px(self) -> float:
        return 0.5 * (self.s_low_px + self.s_high_px)

    @property
    def length_px(self) -> float:
        return self.s_high_px - self.s_low_px

    @property
    def lobes_seen(self) -> float:
        """Lobes of the strands that either edge shows in the stretch."""
        return self.length_px / self.fit.pitch_px * self.fit.section.lobes

    @property
    def shows_few_lobes(self) -> bool:
        """Whether the stretch is too short for pitch and width to be told well apart."""
        return self.length_px < WHOLE_PITCH * self.fit.pitch_px


def usable(edges: Edges) -> bool:
    return bool((edges.upper_weight > SEEN).sum() > 20 and (edges.lower_weight > SEEN).sum() > 20)


def fit_window(
    edges: Edges,
    section: Section,
    s_low: float,
    s_high: float,
    diameter_px: float,
    expected_rate: float,
    before: BundleFit | None = None,
    scale_px: float = SCALE_PX,
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
    swing = swing_px(part) / diameter_px if coil else 0.0
    if swing < SWINGS:  # along a straight bundle a dark limb's light ends equally far in throughout
        part = replace(part, trust=(1.0, 1.0))
    else:
        part = replace(part, half_slope=FLANK)
    best = None
    if before is not None and (coil or not before.fit.coiled):
        best = _upright(_carried_on(part, before, expected_rate, scale_px))
    sought = 0.0 if before is None else before.straight_at
    swings = swing >= max(SWINGS, SWINGS_ON * sought)
    longer = before is not None and s_high - s_low > LONGER * before.length_px
    holds = _holds(best, before, longer) and (best is None or best.coiled or not swings)
    # What hardly swings, and no more than when no coil was found, coils no more now.
    settled = best is not None and not best.coiled and swing < min(SWINGS, SWINGS_ON * sought)
    tried = not holds and coil and s_high - s_low > 3.0 * diameter_px and not settled
    if not holds:
        # The motor's count may be wrong, or not be that of this bundle: then without it.
        for rate in (expected_rate, NAN):
            best = _searched(
                part,
                section,
                diameter_px,
                rate,
                scale_px,
                best,
                swing,
                tried,
                None if before is None else before.fit.section,
            )
            poor = before is None and best is not None and not believed(best)
            if best is not None and not (poor and np.isfinite(expected_rate)):
                break
    if best is None:
        return None
    if best.coiled and not holds:
        best = crowded(part, best, scale_px)
    carried = before.carried + 1 if holds and before is not None else 0
    if best.coiled:
        sought = 0.0
    elif tried:
        sought = swing
    ends = float(part.s_px[0]), float(part.s_px[-1])
    return BundleFit(best, *ends, expected_rate, carried, sought)


def as_elsewhere(edges: Edges, found: BundleFit, other: BundleFit) -> BundleFit:
    """A fit that may be another coil, or what the strands of `other`, farther along the bundle,
    make of its stretch, whichever counts less: a bundle is twisted alike all along."""
    return lesser(found, laid_like(edges, found, other))


def laid_like(edges: Edges, found: BundleFit, other: BundleFit) -> BundleFit | None:
    """What the strands of `other`, another stretch of the bundle, make of a fit's own; None where
    that is no coil."""
    part = replace(edges.window(found.s_low_px, found.s_high_px), half_slope=FLANK)
    fit = _carried_on(part, other, found.expected_rate, SCALE_PX)
    return None if fit is None or not fit.coiled else replace(found, fit=fit, carried=0)


def lesser(found: BundleFit, other: BundleFit | None) -> BundleFit:
    """Of two fits of the same stretch the one that counts less."""
    return other if other is not None and counted(other) < counted(found) else found


def counted(found: BundleFit) -> float:
    """The cost of a fit as it counts against others of the same stretch (`weighed`)."""
    return weighed(found.fit, found.expected_rate)


def _searched(
    part: Edges,
    section: Section,
    diameter_px: float,
    expected_rate: float,
    scale_px: float,
    best: HelixFit | None,
    swing: float,
    coil: bool,
    settled: Section | None,
) -> HelixFit | None:
    """The best of `best`, a straight helix and, where the middle line swings, a coiled one.

    settled: the one of the section's variants that the frame before showed; sought first.
    """
    variants = section.variants()
    if settled is not None:
        variants = tuple(sorted(variants, key=lambda v: v.name != settled.name))

    def straight_too(best: HelixFit | None) -> HelixFit | None:
        band = full_band(part, diameter_px, expected_rate)
        for variant in variants:
            straight = search_straight(part, variant, diameter_px, band, scale_px)
            best = _choose(best, straight, expected_rate)
        return best

    widely = coil and swing > SWINGS_WIDELY
    if not widely:
        best = straight_too(best)
    if not coil or (best is not None and _needs_no_coil(part, best, swing, scale_px)):
        return best
    best = _coiled(part, variants, diameter_px, expected_rate, scale_px, best, settled is not None)
    # A coil that hardly swings is not what makes the middle line do so: edges that were lost are.
    if widely and best is not None and best.p[RC] < SWINGS * best.diameter_px:
        best = straight_too(best)
    return best


def _needs_no_coil(part: Edges, best: HelixFit, swing: float, scale_px: float) -> bool:
    """Whether what is fitted stands without a coil being tried: the middle line hardly swings."""
    return swing < STILL or (swing < SWINGS and is_plain(part, best, scale_px))


def _coiled(
    part: Edges,
    variants: tuple[Section, ...],
    diameter_px: float,
    expected_rate: float,
    scale_px: float,
    best: HelixFit | None,
    settled: bool,
) -> HelixFit | None:
    """The best of `best` and of coiled helices; settled: whether the frame before showed which of
    the variants it is, the first then, and which coil."""
    for coils in coils_of(part, diameter_px):
        bands = [full_band(part, diameter_px, expected_rate, c) for c in coils]
        for variant in variants:
            coiled = search_coiled(part, variant, diameter_px, bands, coils, scale_px)
            if coiled is not None:
                coiled = _upright(best_branch(part, coiled, bands[0], scale_px))
            best = _choose(best, coiled, expected_rate)
            # Strands do not change places between two frames.
            if settled and best is not None and best.coiled and believed(best):
                return best
        if best is not None and best.coiled and (settled or believed(best)):
            break
    return best


def _upright(fit: HelixFit | None) -> HelixFit | None:
    """The fit, unless it is a coil that is aslant or shows hardly any strands: a straight bundle
    then tells more of the stretch."""
    if fit is None or not fit.coiled:
        return fit
    shown = (fit.z_px[1] - fit.z_px[0]) / fit.pitch_px * fit.section.lobes
    return None if is_aslant(fit) or shown < COIL_LOBES else fit


def _carried_on(
    part: Edges, before: BundleFit, expected_rate: float, scale_px: float
) -> HelixFit | None:
    """The fit of a neighbouring frame or window carried over: about its rate, or as much more as
    the motor has turned since, at any phase, for the strands have moved on."""
    fit, section = before.fit, before.fit.section
    diameter = fit.diameter_px
    rate = float(fit.p[K])
    grown = expected_rate / before.expected_rate if before.expected_rate > 0.0 else NAN
    # The coils pass as often as before, nearly: what the motor has turned since the strands have.
    grown = float(np.clip(grown, 0.7, 1.4)) if np.isfinite(grown) else 1.0
    moved = rate + passing(fit.p) * (grown - 1.0)
    if not fit.coiled and expected_rate > 0.0:
        same = straight_at(part, fit, moved, scale_px)
        if same is not None and same.cost < LED_ON * fit.cost + 0.01:
            return replace(same, relief=fit.relief)  # the same strands, under the same light
    margin = 0.04 * abs(rate) + 0.2 / max(float(np.ptp(part.s_px)), 1.0)
    led = passing(fit.p) * grown
    band = Band(min(rate, moved) - margin, max(rate, moved) + margin, expected_rate, led)
    if not fit.coiled:
        return search_straight(part, section, diameter, band, scale_px)
    coil = coil_at(part, float(fit.p[KC]))
    coiled = search_coiled(part, section, diameter, [band], [coil], scale_px)
    return None if coiled is None else crowded(part, coiled, scale_px)


def _holds(warm: HelixFit | None, before: BundleFit | None, longer: bool) -> bool:
    """Whether a fit carried over from the frame before is good, and as good as that one was; of a
    stretch that is much longer than that, only if it is good."""
    if warm is None or before is None:
        return False
    plain = not warm.coiled and warm.cost < PLAINLY  # what it explains inside was not looked at
    if not plain and not explains_as_much(warm, before.fit):
        return False
    if believed(warm):
        # Where a search would leave it at what is plainly straight, a worse fit may stay.
        factor = 2.0 if plain else 1.3
        return warm.cost < factor * before.fit.cost + 0.03
    # No good fit, but as good as the last full search's: that is not repeated every frame.
    return not longer and before.carried < POOR_FRAMES and warm.cost < 1.05 * before.fit.cost


def explains_as_much(fit: HelixFit, other: HelixFit) -> bool:
    """Whether a fit explains about as much of the light inside as another."""
    return 1.0 - fit.relief <= 1.3 * (1.0 - other.relief) + 0.1


def is_aslant(fit: HelixFit) -> bool:
    """Whether what was fitted crosses the axis, which no bundle does: legs do, on either side of
    the apex, and a curve of the middle line may be drawn as part of a coil that does."""
    return abs(float(fit.p[SLOPE])) > ASLANT


def swing_px(edges: Edges) -> float:
    """rms of the middle line about its own straight trend, px."""
    return float(
        _swing(edges.s_px, edges.upper_px, edges.lower_px, edges.upper_weight, edges.lower_weight)
    )


@numba.njit(cache=True)
def _swing(s_px, upper, lower, upper_weight, lower_weight):  # pragma: no cover - compiled
    keep = np.minimum(upper_weight, lower_weight) > 0.2
    if np.count_nonzero(keep) < 10:
        return 0.0
    s, centre = s_px[keep], (0.5 * (upper + lower))[keep]
    constant, slope = line_through(s, centre)
    return deviation(centre - (constant + slope * s))


def _choose(a: HelixFit | None, b: HelixFit | None, expected_rate: float) -> HelixFit | None:
    """The better of two fits. The coiled model has three parameters more: it must pay for them, by
    the outline alone, for with three more it explains more of any light."""
    if a is None or b is None:
        return a if b is None else b
    if a.coiled == b.coiled:
        if not (a.relief and b.relief):  # of a plain one the light inside was not asked
            return a if _by_outline(a, expected_rate) <= _by_outline(b, expected_rate) else b
        return a if weighed(a, expected_rate) <= weighed(b, expected_rate) else b
    straight, coiled = (b, a) if a.coiled else (a, b)
    cost, cost_coiled = (_by_outline(f, expected_rate) for f in (straight, coiled))
    pays = IN_STEP_PAYS if _in_step(coiled) else COIL_PAYS
    return straight if pays * cost <= cost_coiled else coiled


def _by_outline(fit: HelixFit, expected_rate: float) -> float:
    """Cost of a fit as it counts by its outline and the motor alone."""
    return fit.cost * doubt(fit.p, expected_rate)


def _in_step(fit: HelixFit) -> bool:
    """Whether all along a fit one coil takes one lobe of the strands, or as much of their turn as
    their section repeats by. Under light from one side the dark limb's edge is seen where the light
    ends, which goes to and fro with the lobes: such a coil describes it, about whose line strands
    turn backwards, and its torsion adds up to two thirds to their pitch."""
    turned, coils = passing(fit.p), float(fit.p[KC])
    beat = min(abs(a_turn * turned - coils) for a_turn in (fit.section.lobes, fit.section.fold))
    return beat * (fit.z_px[1] - fit.z_px[0]) < np.pi
