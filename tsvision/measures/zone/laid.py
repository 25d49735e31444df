"""Turns and string that lie along the zone, where the bundle coils unevenly or holds knots.

How wide it coils beside knots, its swinging middle tells. No helix can be fitted to a knot, whose
coils grow and shrink within two or three of them. But they show: their radius in the envelope,
their rate in the middle of the edges. And a bundle passes its torque on, so that the material is
twisted as much per length of bundle inside a knot as beside it; per length of the zone it is more,
for a coil of radius R and rate q lays sqrt(1 + (R q)² + R'²) of bundle there and adds
q (1 - 1 / sqrt(1 + (R q)²)) of turning itself.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tsvision.images.percentiles import median
from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.bundle import BundleFit
from tsvision.measures.helix.coil_radius import coil_px, held, radius_along
from tsvision.measures.helix.expected import Expected, turns_before
from tsvision.measures.helix.fit import HelixFit
from tsvision.measures.helix.followed import Followed
from tsvision.measures.helix.silhouette import KC, RC, SLOPE, Y0, K, twist
from tsvision.measures.numeric.smoothing import smoothed
from tsvision.measures.numeric.spectrum import spectrum
from tsvision.measures.zone.envelope import Envelope, envelope_px

TIGHTEST, WIDEST = 0.8, 2.5  # pitches of a knot's coils, in D
BEYOND = 0.5  # D on either side of a knot, where its coils begin
LEAST_RADIUS = 0.05  # of D: thinner coils are not read from the envelope
SLOPE_SD = 0.125  # of a coil, by which a radius is smoothed before its slope is told
LEAST_SLOPE = 3  # px that tell one
DRAWN_RADII = np.array([0.25, 0.5, 0.75, 1.0])  # of the widest that an envelope shows
DRAWN_COILS = 12.0  # of a fit: all phases in which coils and strands' lobes meet


@dataclass(frozen=True)
class Laid:
    """Turns and length of bundle (px) between two s, and the shares of them inside knots."""

    turns: float
    bundle_px: float
    knot_turns: float
    knot_bundle_px: float


def expected_along(
    found: BundleFit,
    edges: Edges,
    envelope: Envelope,
    knots_px: list[tuple[float, float]],
    start_px: float,
    end_px: float,
) -> Expected:
    """What lies between two s when the bundle elsewhere is twisted as in a fit's window.

    envelope: E(s) at the edges' s, closed over no more than a coil of a knot; knots_px: first and
    last s of each.
    """
    fit = found.fit
    along = float(twist(fit.p))  # rad per px of bundle
    s = np.arange(np.ceil(start_px), end_px)
    rate, radius = np.zeros(s.size), np.zeros(s.size)
    if fit.coiled:
        rate += float(fit.p[KC])
        radius = radius_along(found, edges, s, start_px, end_px)
    known = np.isfinite(envelope.px)
    if knots_px and known.any():
        reach = np.clip(0.5 * (envelope.px[known] - fit.diameter_px), 0.0, None)
        shown = np.interp(s, edges.s_px[known], reach)
        inside = _inside(s, knots_px, BEYOND * fit.diameter_px)
        for (low, high), here in zip(knots_px, inside, strict=True):
            tight = coil_rate(edges, low, high, fit.diameter_px)
            if np.isfinite(tight):
                wide = _radius(fit, shown[here], tight, along, envelope.closed_over_px)
                rate[here], radius[here] = tight, np.maximum(wide, radius[here])
    if radius.any():
        radius *= held(s, edges.s_px[known], start_px, end_px, fit.diameter_px)
    wound = np.sqrt(1.0 + (radius * rate) ** 2)
    length = np.hypot(wound, _slope(fit, radius))
    turning = (along * length + rate * (1.0 - 1.0 / wound)) / (2.0 * np.pi)
    return Expected(s, turning, length)


def _slope(fit: HelixFit, radius: np.ndarray) -> np.ndarray:
    """By how much a radius (M,) grows per px, of what is told from place to place with noise."""
    if radius.size < LEAST_SLOPE or not radius.any():
        return np.zeros(radius.size)
    rate = float(fit.p[KC]) if fit.coiled else 0.0
    smooth = smoothed(radius, SLOPE_SD * coil_px(rate, fit.diameter_px))
    return np.asarray(np.gradient(smooth))


def laid_between(
    expected: Expected,
    knots_px: list[tuple[float, float]],
    start_px: float,
    end_px: float,
    followed: Followed | None = None,
) -> Laid:
    """What lies between two s: as expected, but for what is told from place to place (followed)."""
    s, turning, length = expected.s_px, expected.turning, expected.length
    if followed is not None:
        turning = _as_followed(turning, s, followed, followed.rate / (2.0 * np.pi))
        turning = _as_counted(turning, s, followed)
        length = _as_followed(length, s, followed, followed.stretch)
    knotted = _inside(s, knots_px).any(axis=0)
    part = (end_px - start_px) / max(s.size, 1)
    return Laid(
        float(turning.sum() * part),
        float(length.sum() * part),
        float(turning[knotted].sum()),
        float(length[knotted].sum()),
    )


def _as_followed(
    laid: np.ndarray, s: np.ndarray, followed: Followed, read: np.ndarray
) -> np.ndarray:
    """What lies at s (M,), as many times more as was read (K,) where the coil was followed. What
    one fit was off by there it is in waists, too, and in coils that no helix described: typical
    times go for those, by the share of the bundle of which they are typical."""
    times = read / np.interp(followed.s_px, s, laid)
    told = followed.told(s)
    elsewhere = 1.0 + float(told.mean()) * (median(times) - 1.0)
    return laid * (elsewhere + told * (np.interp(s, followed.s_px, times) - elsewhere))


def _as_counted(laid: np.ndarray, s: np.ndarray, followed: Followed) -> np.ndarray:
    """Turns at s (M,), as many from place to place as their phases leave possible."""
    between = np.diff(turns_before(s, laid, followed.s_px))
    times = np.concatenate([[1.0], followed.counted(between) / between, [1.0]])
    return np.asarray(laid * times[np.searchsorted(followed.s_px, s)])


def _inside(s: np.ndarray, knots_px: list[tuple[float, float]], beyond: float = 0.0) -> np.ndarray:
    """Which of s (M,) lie in which knot (K, M), or up to `beyond` outside."""
    ends = np.array(knots_px, dtype=float).reshape(-1, 2)
    return np.asarray((s >= ends[:, :1] - beyond) & (s <= ends[:, 1:] + beyond))


def coil_rate(edges: Edges, low_px: float, high_px: float, diameter_px: float) -> float:
    """Rate (rad/px) of the coils between two s, from the middle of the edges; NaN if unseen."""
    part = edges.window(low_px - BEYOND * diameter_px, high_px + BEYOND * diameter_px)
    both = (part.upper_weight > 0.1) & (part.lower_weight > 0.1)
    if both.sum() < 0.5 * diameter_px:
        return float("nan")
    middle = np.interp(part.s_px, part.s_px[both], (0.5 * (part.upper_px + part.lower_px))[both])
    tapered = np.hanning(middle.size) * (middle - middle.mean())
    rates = 2.0 * np.pi / diameter_px * np.linspace(1.0 / WIDEST, 1.0 / TIGHTEST, 200)
    return float(rates[int(np.argmax(np.abs(spectrum(tapered, 0.0, rates))))])


def _radius(
    fit: HelixFit, shown: np.ndarray, rate: float, along: float, closed_over_px: float
) -> np.ndarray:
    """Radius (M,) of a coil of such a rate whose envelope exceeds D / 2 by shown (M,) px: what the
    lobes of its strands add and closing leaves out is another share of a wide one than of a narrow
    one."""
    most = float(shown.max(initial=0.0))
    if most < LEAST_RADIUS * fit.diameter_px:
        return shown
    radii, drawn = most * np.append(0.0, DRAWN_RADII), [0.0]
    for radius_px in radii[1:]:
        stretch = float(np.hypot(1.0, radius_px * rate))
        p = fit.p.copy()
        p[RC], p[KC], p[K] = radius_px, rate, along * stretch - rate / stretch
        drawn.append(float(_drawn(fit, p, closed_over_px).mean()))
    # Beyond the widest that was drawn by its share.
    wider = np.append(np.maximum.accumulate(drawn), 2.0 * drawn[-1])
    return np.asarray(np.interp(shown, wider, np.append(radii, 2.0 * radii[-1])))


def _drawn(fit: HelixFit, p: np.ndarray, closed_over_px: float) -> np.ndarray:
    """By how much (K,) px the envelope of a coil with these parameters exceeds D / 2, all along
    some coils of it."""
    p = p.copy()
    p[Y0] = p[SLOPE] = 0.0
    count = int(DRAWN_COILS * coil_px(float(p[KC]), fit.diameter_px))
    edges = replace(fit, p=p).seen_edges(-0.5 * count, count)
    drawn = envelope_px(*edges, np.ones(count, dtype=bool), closed_over_px, fit.diameter_px)
    return np.clip(0.5 * (drawn - fit.diameter_px), 0.0, None)
