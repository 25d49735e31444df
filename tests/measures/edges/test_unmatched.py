"""A side that the learnt profile did not match is taken from the outline, the other stays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from tsvision.images.sight import Sight
from tsvision.images.signal import LUMA
from tsvision.images.strip import straight_axis
from tsvision.measures.edges.cut import Cut
from tsvision.measures.edges.edges import Edges
from tsvision.measures.edges.find import find_edges
from tsvision.measures.edges.shading import LAMPS_RAD, Shading, plain_shading
from tsvision.measures.edges.strands import Silhouette
from tsvision.measures.edges.unmatched import with_outline

COLUMNS, HALF = 200, 30


def a_cut(reach: int) -> Cut:
    """A bar of 2 `reach` + 1 rows about the axis, with full contrast."""
    n = np.arange(-HALF, HALF + 1)
    contrast = np.repeat((np.abs(n) <= reach)[:, None].astype(float), COLUMNS, axis=1)
    bundle = np.arange(COLUMNS) >= 20
    limit = np.where(bundle, float(reach), np.nan)
    outline = Silhouette(-limit, limit, bundle, 20.0, np.zeros(COLUMNS, bool))
    s = np.arange(COLUMNS, dtype=float)
    none = np.full(COLUMNS, np.nan)
    line = straight_axis(np.array([0.0, HALF]), np.array([COLUMNS - 1.0, HALF]))
    sight = Sight(line, LUMA, 1, 2.0 * reach, 0.0, s[-1], np.nan, False, 9.0, np.nan)
    return Cut(
        contrast,
        contrast,
        s,
        HALF,
        outline,
        core_level=1.0,
        mask_levels=(0.5, 0.5),
        noise=0.01,
        saturated=0.0,
        dim=(none, none),
        sunk=0,
        in_colour=False,
        sampled=contrast[:, ::8],
        sight=sight,
        core_share=1.0,
    )


def edges(matched: int) -> Edges:
    """Upper edge matched everywhere, the lower one in the first `matched` columns of the bundle."""
    s = np.arange(COLUMNS, dtype=float)
    seen = (s >= 20) & (s < 20 + matched)
    return Edges(s, np.full(COLUMNS, 9.0), np.where(seen, -9.3, 0.0), np.ones(COLUMNS), 0.8 * seen)


def test_a_side_hardly_matched_is_filled_in_as_far_off_as_where_it_was() -> None:
    filled = with_outline(edges(30), a_cut(8))
    np.testing.assert_array_equal(filled.upper_px, 9.0)
    np.testing.assert_allclose(filled.lower_px[20:], -9.3, atol=0.01)
    assert (filled.lower_weight[20:] > 0.2).all() and (filled.lower_weight[50:] < 0.3).all()
    assert (filled.lower_weight[:20] == 0.0).all()


def test_without_any_match_the_outline_stands() -> None:
    filled = with_outline(edges(0), a_cut(8))
    np.testing.assert_allclose(filled.lower_px[20:], -8.5, atol=0.01)


def test_a_side_matched_well_keeps_its_gaps() -> None:
    given = edges(150)
    filled = with_outline(given, a_cut(8))
    np.testing.assert_array_equal(filled.lower_px, given.lower_px)
    np.testing.assert_array_equal(filled.lower_weight, given.lower_weight)


def test_a_side_whose_light_was_not_learnt_is_read_by_the_other_sides() -> None:
    cut = a_cut(8)
    cut = replace(cut, contrast=gaussian_filter1d(cut.contrast, 1.0, axis=0))
    plain = plain_shading(5.0)
    falling = Shading(5.0, 1.0, 0.0, np.full(LAMPS_RAD.size, -0.02))
    found, both = find_edges(cut, (falling, plain)), find_edges(cut, (plain, plain))
    assert (found.upper_weight[20:] > 0.5).all() and (found.lower_weight[20:] > 0.5).all()
    np.testing.assert_array_equal(found.upper_px, both.upper_px)


def test_the_lit_border_of_a_sunk_limb_is_no_edge() -> None:
    """Of a frame that shows none of a limb which all others show darker than the ground."""
    shading = plain_shading(8.0)
    lit = find_edges(a_cut(8), (shading, shading))
    sunk = find_edges(replace(a_cut(8), sunk=1), (shading, shading))
    assert (lit.upper_weight[25:-5] > 0.2).all()
    assert (sunk.upper_weight == 0.0).all()
    np.testing.assert_array_equal(sunk.lower_weight, lit.lower_weight)
