"""How far off the edges of two strings lie, told by their legs: strands of known diameter.

Between its hole and the apex each of two strings runs straight and alone, under the lamp that
lights the bundle, and seen by the same camera. What the recording's edge profile makes its width,
less what the rig says that a string has, is what it makes of a bundle's width as well, roughly:
grooves and neighbours take light in a bundle that a leg gets. Where one limb is not told from the
ground, and light and shape leave D open by pixels, that is far better. From four strings on a leg
holds several, twisted or side by side, and tells nothing.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tsvision.images.sight import Sight
from tsvision.images.strip import straight_axis
from tsvision.measures.edges.cut import Cut, cut_frame
from tsvision.measures.edges.find import find_edges
from tsvision.measures.edges.shading import Shading
from tsvision.measures.ends.legs import legs_of
from tsvision.measures.light.witness import Witness
from tsvision.measures.numeric.line import line_through
from tsvision.measures.numeric.sums import deviation

# What a leg's width is off by is a bundle's to so many px, and to such a share (path-traced films
# of two strings: 0.22 px apart in seventeen that light tells well, a fifth in four with a limb
# that it does not).
TRANSFER_PX, TRANSFER_SHARE = 0.25, 0.2
ALONE_SHARE = 0.2  # of its diameter, by which a string seen in one picture may be misread
STRAND_SHARE = 0.03  # of its stated diameter, by which a string is thicker or thinner
STEEPEST = 1.0  # slope of a leg: a steeper one turns other limbs to the lamp than the bundle does
BLURS = 4.0  # that a leg must be wide: else what is seen of one edge holds some of the other
MATCHED = 0.3  # weight of an edge that counts
FEWEST = 15  # columns of a leg where both its edges do
# Of a strand's diameter, what is measured of it: of dark ones that gleam hardly half is seen, and
# what is as thick as one and a half is not one alone.
THINNEST, THICKEST = 1.0 / 3.0, 1.5


def gauge_from_legs(
    pairs: list[tuple[np.ndarray, Cut]],
    sight: Sight,
    shading: tuple[Shading, Shading],
    about_px: float,
    plate_px: float,
    half_gap_px: float,
    strand_px: float,
) -> Witness | None:
    """What the legs in all (picture, cut) of two strings tell; None where they tell nothing.

    about_px: s of the holes' exits, half of S as `half_gap_px`, plate_px: of the plate's visible
    edge (NaN: not seen); strand_px: a string's stated diameter.
    """
    if not (strand_px > BLURS * shading[0].blur_px and np.isfinite(about_px + half_gap_px)):
        return None
    seen_px = []
    for picture, cut in pairs:
        legs = legs_of(picture, cut, sight, about_px, plate_px, half_gap_px, None)
        if legs is None:
            continue
        # Both, which lie mirrored about the axis: what either's slope changes of its light is
        # made up for by the other's.
        widths = [
            _width_px(picture, sight, leg, shading, strand_px) for leg in (legs.upper, legs.lower)
        ]
        seen_px.append(float(np.mean(widths)))
    alone = np.array([w for w in seen_px if THINNEST * strand_px < w < THICKEST * strand_px])
    if alone.size == 0:
        return None
    wide = float(np.median(alone)) - strand_px
    apart = deviation(alone) if alone.size > 1 else ALONE_SHARE * strand_px
    parts = TRANSFER_PX, TRANSFER_SHARE * wide, STRAND_SHARE * strand_px, apart
    return Witness(wide, float(np.linalg.norm(parts)))


def _width_px(
    picture: np.ndarray,
    sight: Sight,
    leg: np.ndarray,
    shading: tuple[Shading, Shading],
    strand_px: float,
) -> float:
    """Of a leg, columns and middles (2, M), px; NaN where too little of it is told."""
    constant, slope = line_through(*leg)
    if abs(slope) > STEEPEST:
        return float("nan")
    s = np.array([leg[0].min(), leg[0].max()])
    along = sight.axis.tangent(s)
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    ends = sight.axis.at(s) + (slope * s + constant)[:, None] * across
    axis = straight_axis(*ends)
    here = replace(sight, axis=axis, start_px=0.0, end_px=axis.length_px, width_px=strand_px)
    cut = cut_frame(picture, here, strand_px, int(2.5 * strand_px) + 6)
    if cut is None:
        return float("nan")
    edges = find_edges(cut, shading)
    told = (edges.upper_weight > MATCHED) & (edges.lower_weight > MATCHED)
    if np.count_nonzero(told) < FEWEST:
        return float("nan")
    return float(np.median((edges.upper_px - edges.lower_px)[told]))
