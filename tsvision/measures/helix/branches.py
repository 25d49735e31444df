"""Which of the coils with nearly the same outline it is.

Strands that turn a lobe more or less from one coil to the next show their lobes at the same places:
the fits are all good, and all but one wrong. What is seen inside the outline tells them apart.
"""

from __future__ import annotations

import numpy as np

from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.band import Band
from tsvision.measures.helix.fit import HelixFit, descend, fit_helix, with_relief
from tsvision.measures.helix.reduced import SEARCH_DIAMETER_PX, Reduced, reduced
from tsvision.measures.helix.relief import scan_relief
from tsvision.measures.helix.silhouette import FREE_COILED, KC, PHI, K
from tsvision.measures.helix.weigh import believed, weighed

LOBES_OFF = (-2, -1, 1, 2)  # a turn of the coil, that are tried, ...
ROUNDS = 3  # ... and again from what was found
STEPS = 5  # of a descent at reduced size
FOLLOWED = 2  # descents of each kind that are fitted in full
DECIDED = 0.9  # of the weighed cost, that another branch must stay below
SCAN_STEP_RAD = 0.6  # turn by which neighbouring rates differ at the ends of a window
SCAN_PHASES = 12  # over one turn of the section
PEAKS = 6  # of that scan that are followed


def best_branch(edges: Edges, found: HelixFit, band: Band, scale_px: float) -> HelixFit:
    """The best of a coiled fit, which knows its relief, and of the others that their outline or the
    light inside suggests; a straight fit is one of its kind."""
    if not found.coiled:
        return found
    small = reduced(edges, found.diameter_px / SEARCH_DIAMETER_PX)
    best = found
    for _ in range(ROUNDS):
        before = best
        for more in LOBES_OFF:
            starts = _lobes_off(before, more)
            best = _better(edges, small, best, starts, band.expected, scale_px)
        if best is before:
            break
    light = edges.relief_light
    if light is not None and not believed(best):
        starts = _by_light(edges, light, best, band)
        best = _better(edges, small, best, starts, band.expected, scale_px)
    return best


def _better(
    edges: Edges,
    small: Reduced,
    best: HelixFit,
    starts: list[np.ndarray],
    expected: float,
    scale_px: float,
) -> HelixFit:
    """The best of a fit and of those that follow from `starts`, (12,) each."""
    wide = 2.0 * scale_px / small.factor
    tried = [
        descend(small.edges, best.section, small.down(p), FREE_COILED, wide, STEPS) for p in starts
    ]
    tried.sort(key=lambda reached: reached[1])
    for p, _ in tried[:FOLLOWED]:
        fit = fit_helix(edges, best.section, small.up(p), FREE_COILED, scale_px)
        fit = with_relief(edges, fit)
        if weighed(fit, expected) < DECIDED * weighed(best, expected):
            best = fit
    return best


def _lobes_off(fit: HelixFit, more: int) -> list[np.ndarray]:
    """Starts at all phases with `more` lobes a turn of the coil; none where strands would turn
    back altogether."""
    rate = fit.p[K] + more * fit.p[KC] / fit.section.lobes
    if rate + fit.p[KC] <= 0.0:
        return []
    return [_turned(fit, rate, phase) for phase in _phases(fit)]


def _by_light(edges: Edges, light: np.ndarray, fit: HelixFit, band: Band) -> list[np.ndarray]:
    """Starts about the coil of `fit` at those rates and phases that explain most of the light."""
    half = 0.5 * float(edges.s_px[-1] - edges.s_px[0])
    count = int(np.clip((band.high - band.low) * half / SCAN_STEP_RAD, 3, 80)) + 1
    rates = np.linspace(band.low, band.high, count)
    phases = _phases(fit)
    shares = scan_relief(light, fit.p, fit.section, rates, phases)
    most = np.argsort(-shares.max(axis=1))[:PEAKS]
    return [_turned(fit, rates[i], phases[int(np.argmax(shares[i]))]) for i in most]


def _phases(fit: HelixFit) -> np.ndarray:
    return np.linspace(0.0, 2.0 * np.pi / fit.section.fold, SCAN_PHASES, endpoint=False)


def _turned(fit: HelixFit, rate: float, phase: float) -> np.ndarray:
    """(12,) the same coil with other strands about it."""
    p: np.ndarray = fit.p.copy()
    p[[K, PHI]] = rate, phase
    return p
