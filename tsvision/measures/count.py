"""How many strands a bundle has, from its outline alone.

Every N makes another outline: the sections of 2 to 8 strands are fitted to straight stretches of a
few frames in turn, and the one that leaves least is taken. D over the string's own diameter, where
the rig tells it and the scale is known, speaks along.
"""

from __future__ import annotations

import numpy as np

from tsvision.images.sight import Sight
from tsvision.measures.edges.cut import Cut
from tsvision.measures.edges.find import find_edges
from tsvision.measures.edges.shading import plain_shading
from tsvision.measures.helix.bundle import fit_window
from tsvision.measures.helix.section import pair_core
from tsvision.measures.helix.weigh import POOR
from tsvision.measures.helix.windows import near_window
from tsvision.measures.light.profiles import learn_shading
from tsvision.measures.numeric.spread import pick_samples

COUNTS = (2, 3, 4, 5, 6, 7, 8)
FRAMES = 4
USUAL_WIDTH = 2.7  # bundle's width in strings, before N is known
ODD = 1.1  # odd numbers of strings are rare: they have to fit that much better
SURE = 0.05  # difference of costs at which the confidence is four fifths
SIZE_TOLERANCE = 0.08  # relative, of D over the string's diameter


def count_strands(
    cuts: list[Cut], sight: Sight, string_px: float = float("nan")
) -> tuple[int, float]:
    """N and its confidence, 0.5 to 1; 2 at 0.5 where no bundle is long enough to tell, 0.5 where no
    section fits (a rope of another make).

    string_px: the string's own diameter, NaN when unknown.
    """
    strand_px = sight.width_px / USUAL_WIDTH
    shading = learn_shading(cuts, 0.5 * strand_px)
    if shading is None:
        shading = (plain_shading(0.5 * strand_px), plain_shading(0.5 * strand_px))
    rows = []
    for cut in (cuts[i] for i in pick_samples(len(cuts), FRAMES)):
        window = near_window(cut, sight.width_px)
        if window is None:
            continue
        edges = find_edges(cut, shading)
        costs = []
        for count in COUNTS:
            section = pair_core(count)
            fit = fit_window(edges, section, *window, sight.width_px, float("nan"), coil=False)
            if fit is None:
                break
            expected = string_px * section.diameter_d
            costs.append(fit.fit.cost * _rarity(count) * _misfit(fit.fit.diameter_px / expected))
        if len(costs) == len(COUNTS):
            rows.append(costs)
    if not rows:
        return 2, 0.5
    table = np.array(rows)
    # A coiled frame fits no straight section: those that fit at all decide.
    telling = table.min(axis=1) < 1.5 * table.min() + 0.05
    total = table[telling].mean(axis=0)
    first, second = np.sort(total)[:2]
    confidence = 1.0 - 0.5 * np.exp(-(second - first) / SURE) if first < POOR else 0.5
    return COUNTS[int(np.argmin(total))], float(confidence)


def _rarity(count: int) -> float:
    return ODD if count % 2 else 1.0


def _misfit(ratio: float) -> float:
    """1 where D is what N strings of this diameter make, or where that is not known."""
    if not (np.isfinite(ratio) and ratio > 0.0):
        return 1.0
    return float(np.exp(2.0 * max(abs(np.log(ratio)) - SIZE_TOLERANCE, 0.0)))
