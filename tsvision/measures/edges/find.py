"""The edges of one cut: rough where the contrast falls, then matched to what a recording taught."""

from __future__ import annotations

from dataclasses import replace

import numba
import numpy as np

from tsvision.images.percentiles import median
from tsvision.measures.edges.cut import Cut
from tsvision.measures.edges.edges import Edges
from tsvision.measures.edges.match import match_edges, rows_per_px
from tsvision.measures.edges.match_steep import match_steep
from tsvision.measures.edges.shading import Shading, inside_at
from tsvision.measures.numeric.line import slope_of

LEAST_RISE = 0.3  # of the core's contrast, from the ground to within a strand
FOUND_BACK_PX = 1.5  # from how far off a match comes to the edge, ...
SEARCHED_PX = 2.5  # ... and how far it may go
SLOPE_SD_PX = 1.5  # over which the slope of a rough edge is told
FLAT = 0.25  # slope from which on an edge is smeared across columns
FEWEST_COLUMNS = 10  # of an edge, that a cut teaches by
# Of the typical depth: what matches with less is a fibre. Told of fainter ones is up to 0.15 more
# than there is, for their step is held near the template's; but columns of a dark limb that hardly
# anything of the lamp reaches show no more than 0.4, and without them coils look full of knots.
LEAST_DEPTH, MOST_DEPTH = 0.33, 3.0


def rough_edges(cut: Cut) -> tuple[np.ndarray, np.ndarray]:
    """Rows of the outermost borders, upper and lower, (M,) each: of dim strands where there are."""
    both = zip(cut.dim, lit_edges(cut), strict=True)
    upper, lower = (np.where(np.isfinite(dim), dim, lit) for dim, lit in both)
    return upper, lower


def lit_edges(cut: Cut) -> tuple[np.ndarray, np.ndarray]:
    """Rows where the contrast falls through the mask level, upper and lower, (M,) each."""
    seen = cut.silhouette
    above, below = cut.mask_levels
    upper = _fallen(cut.contrast, seen.high + cut.half_px, 1, np.float32(above))
    lower = _fallen(cut.contrast, seen.low + cut.half_px, -1, np.float32(below))
    return upper, lower


def along_axis(cut: Cut, edge_row: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Slope (M,) of an edge, and the columns (M,) where it runs nearly along the axis and no fibre
    was cut off: these show what it looks like."""
    known = np.isfinite(edge_row)
    slope = slope_of(edge_row, known, SLOPE_SD_PX)
    return slope, known & (np.abs(slope) < FLAT) & ~cut.silhouette.cut


@numba.njit(cache=True)
def _fallen(contrast, limit, step, level):  # pragma: no cover - compiled
    """Rows (M,) between the outermost row of the strings (M,) and the next, a `step` further, where
    the contrast falls to a level; NaN where there are none."""
    rows, columns = contrast.shape
    out = np.full(columns, np.nan)
    for c in range(columns):
        if np.isnan(limit[c]):
            continue
        row = min(max(int(limit[c]), 1), rows - 2)
        inside, outside = abs(contrast[row, c]), abs(contrast[row + step, c])
        part = (inside - level) / max(inside - outside, np.float32(1e-3))
        out[c] = row + step * min(max(part, np.float32(0.0)), np.float32(1.0))
    return out


def find_edges(cut: Cut, shading: tuple[Shading, Shading]) -> Edges:
    """Sub-pixel edges of every column of the bundle, weighted by how well the model matched."""
    found = []
    shades = shading if cut.sunk else _rising(shading)
    if cut.in_colour:  # a hue fades at a limb for other reasons than that no lamp reaches it
        shades = replace(shades[0], undivided=True), replace(shades[1], undivided=True)
    sides = zip(lit_edges(cut), cut.dim, (1, -1), shades, cut.mask_levels, strict=True)
    for rough, dim, outward, shade, level in sides:
        # Under a wide blur the rough edge lies further out than a match finds back from, before a
        # limb without light further in. Not all the way: what lies between two strands is found
        # from outside.
        reached = inside_at(shade, level)
        back = float(np.sign(reached)) * max(abs(reached) - FOUND_BACK_PX, 0.0)
        edge, weight = _matched(cut, rough, rough + outward * back, outward, shade)
        if reached > shade.rho_px:  # a dark limb, or a level that this side hardly has
            here, well = _matched(cut, rough, rough, outward, shade)
            edge, weight = (here, well) if well.sum() > weight.sum() else (edge, weight)
        if cut.sunk == outward:  # of a sunk limb the lit border is none of the outline
            weight = np.zeros(weight.size)
        is_dim = np.isfinite(dim)
        if is_dim.any():
            # Where no edge matches near a dim border, what does further in is where light ends.
            further, well = _matched(cut, dim, dim, outward, shade)
            edge, weight = np.where(is_dim, further, edge), np.where(is_dim, well, weight)
        found.append((np.where(weight > 0, edge - cut.half_px, 0.0), weight))
    (upper, upper_weight), (lower, lower_weight) = found
    # Colour is coded in blocks: what smears it along the axis is not what a mean edge shows of it.
    blur_px = 0.0 if cut.in_colour else shading[0].blur_px
    light = cut.light if cut.in_colour or cut.sight.faint_tone < 1.0 else cut.contrast
    return Edges(
        cut.s_px,
        upper,
        lower,
        upper_weight,
        lower_weight,
        blur_px=blur_px,
        light=light,
        painted=cut.colours is not None,
    )


def _rising(shading: tuple[Shading, Shading]) -> tuple[Shading, Shading]:
    """The shading of either side, the other side's where one was not learnt: where a shadow touches
    the strings all along, what was fitted to that side may not even rise."""
    upper, lower = shading
    rises = [side.template.max(initial=0.0) > LEAST_RISE for side in shading]
    return (
        upper if rises[0] or not rises[1] else lower,
        lower if rises[1] or not rises[0] else upper,
    )


def _matched(
    cut: Cut, rough: np.ndarray, start: np.ndarray, outward: int, shade: Shading
) -> tuple[np.ndarray, np.ndarray]:
    """Rows of the edges matched about rough ones, and their weights, 0 where none was."""
    slope = slope_of(rough, np.isfinite(rough), SLOPE_SD_PX)
    edge, depth, residual = match_edges(cut.contrast, start, outward, shade, slope, SEARCHED_PX)
    typical = median(depth[np.isfinite(depth)])
    steep = match_steep(cut.contrast, rough, slope, outward, shade, SEARCHED_PX)
    if steep is not None:
        both = zip((edge, depth, residual), steep.matched, strict=True)
        edge, depth, residual = (np.where(steep.columns, new, old) for old, new in both)
    weight = _quality(depth, residual, typical)
    if shade.beyond_px:
        edge = edge + outward * shade.beyond_px * rows_per_px(slope)
    return edge, weight


@numba.njit(cache=True)
def _quality(depth, residual, typical):  # pragma: no cover - compiled
    """Weights (M,) of matches by what their profile left unexplained; 0 where there was none, or
    one of another depth than most."""
    out = np.zeros(depth.size)
    for m in range(depth.size):
        if LEAST_DEPTH * typical < depth[m] < MOST_DEPTH * typical:
            quality = 1.0 / (1.0 + (residual[m] / (0.12 * depth[m])) ** 2)
            out[m] = 0.0 if np.isnan(quality) else quality
    return out
