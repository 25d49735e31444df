"""What some helix fits although it is no twisted bundle: a leg, or strands side by side."""

from __future__ import annotations

import numba
import numpy as np

from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.bundle import SEEN, BundleFit
from tsvision.measures.helix.fit import HelixFit
from tsvision.measures.helix.relief import scan_relief
from tsvision.measures.helix.silhouette import K
from tsvision.measures.numeric.line import line_through
from tsvision.measures.numeric.sums import summed

SMOOTH = 0.8  # of what straight lines leave of the edges; films' bundles, fitted, leave up to 0.62
# Of the rate fitted, at which the strands inside are looked for as well, at so many phases; and of
# what the best of these leave unexplained, what the rate fitted may leave.
OTHER_RATES, RIDGE_PHASES, RIDGES = (0.05, 0.3, 0.6, 0.8, 1.25, 1.5), 12, 0.75
LEG = 1.4  # times the least width possible: what is smooth and thinner is a leg of many strands
# Of its length, by which what two borders bound grows narrower: legs from holes 5 mm apart that
# meet within 23 mm do by 0.22 and more, a bundle seen at 4 degrees from 90 mm by 0.004. And how
# evenly, of its width: strands, coils and knots swell and narrow by more.
TAPERED, EVENLY = 0.1, 0.04


def is_smooth(edges: Edges, found: BundleFit) -> bool:
    """Whether straight lines describe a stretch's edges nearly as well as the strands fitted to
    them: those of a leg, of strands side by side, or of a rod."""
    if found.lobes_seen < 1.0:
        return False
    part = edges.window(found.s_low_px, found.s_high_px)
    sides = ((part.upper_px, part.upper_weight), (part.lower_px, part.lower_weight))
    if found.fit.rms_px <= SMOOTH * max(_bent_px(*side) for side in sides):
        return False
    return not _shows_ridges(part, found.fit)


def _shows_ridges(part: Edges, fit: HelixFit) -> bool:
    """Whether the light inside shows strands that turn as those fitted do, whatever the outline:
    blur levels the lobes of many strands long before their ridges. Of strands side by side, or of a
    rod, it shows none that turn at that rate rather than at another."""
    if part.light is None:
        return False
    phases = np.linspace(0.0, 2.0 * np.pi / fit.section.fold, RIDGE_PHASES, endpoint=False)
    rates = float(fit.p[K]) * np.array([1.0, *OTHER_RATES])
    unexplained = 1.0 - scan_relief(part.light, fit.p, fit.section, rates, phases).max(axis=1)
    return bool(unexplained[0] < RIDGES * unexplained[1:].min())


@numba.njit(cache=True)
def _bent_px(edge_px, weight):  # pragma: no cover - compiled
    """rms by which an edge (M,) differs from a straight line."""
    known = weight > SEEN
    if np.count_nonzero(known) < 3:
        return 0.0
    s, n, w = np.flatnonzero(known).astype(np.float64), edge_px[known], weight[known]
    constant, slope = line_through(s, n, w)
    return np.sqrt(summed(w * (n - constant - slope * s) ** 2) / summed(w))


def is_leg(edges: Edges, found: BundleFit, least_px: float) -> bool:
    """Whether what is smooth is a leg, or two on their way to meet; least_px: that a bundle of the
    stated strands may be wide."""
    if found.fit.diameter_px < LEG * least_px:
        return True
    return is_tapered(edges.window(found.s_low_px, found.s_high_px))


def is_tapered(edges: Edges) -> bool:
    """Whether the borders of a stretch run together evenly as those of two legs on their way to
    meet, and no bundle's do."""
    both = edges.both_seen
    if both.sum() < 2:
        return False
    s, width = edges.s_px[both], (edges.upper_px - edges.lower_px)[both]
    constant, slope = line_through(s, width)
    off = float(np.median(np.abs(width - constant - slope * s)))
    return abs(float(slope)) > TAPERED and off < EVENLY * float(np.median(width))
