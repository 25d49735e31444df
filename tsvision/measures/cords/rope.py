"""A rope or yarn of any make along a curved axis: its core without its fuzz, and its stripes.

Where the section is not known no helix can be fitted; what any rope shows is measured instead. An
edge is where the brightness falls most steeply: shading of round strands does not move that place,
and fuzz beside the core, which is thin and dim, falls less steeply and is weighted down. D is the
envelope over stretches of two diameters, from the 94th percentile of each side's distance to the
centre line: lobes count, a single hair does not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d, grey_opening, median_filter

from tsvision.images.colour import log_chromaticity
from tsvision.images.cord import cord_contrast, core_mask
from tsvision.images.curve import Curve
from tsvision.images.linear import LUMA_BGR, project, to_linear
from tsvision.images.sight import Sight
from tsvision.images.spline import KNOT_WIDTHS, smooth
from tsvision.images.strip import cut_strip
from tsvision.measures.cords.stripes import Stripes, coarse_slope, find_stripes

PERCENTILE = 94.0
WINDOW_DIAMETERS = 2.0
TUFT = 0.2  # of the width


@dataclass(frozen=True)
class Rope:
    """What one picture shows of a rope.

    s_px (M,); upper_px, lower_px (M,) n of its edges and their common weight 0..1; envelope_px
    (M,) local outer diameter; coarse: slope of the coarse bands of coloured strands, NaN without
    colour; fuzzy: share of columns with hairs.
    """

    s_px: np.ndarray
    upper_px: np.ndarray
    lower_px: np.ndarray
    weight: np.ndarray
    envelope_px: np.ndarray
    diameter_px: float
    diameter_px_sd: float
    stripes: Stripes | None
    coarse: float
    fuzzy: float


def measure_rope(
    pixels: np.ndarray, curve: Curve, sight: Sight, count: int | None = None
) -> Rope | None:
    """One picture (uint8/uint16, grey or BGR) along the found curve; None when too little of the
    rope's edges is seen. count: number of strands, when known."""
    linear = to_linear(pixels, sight.gamma)
    half = int(np.ceil(2.2 * curve.width_px)) + 6
    strip = cut_strip(linear, curve.axis, (curve.start_px, curve.end_px), half)
    contrast = cord_contrast(strip.values, sight.signal.weights, curve.ground, curve.width_px)
    width, coloured = curve.width_px, curve.ground is not None
    upper, upper_weight = _edge(contrast, half, width, coloured)
    lower, lower_weight = _edge(contrast[::-1], half, width, coloured)
    lower = -lower
    weight = np.minimum(upper_weight, lower_weight)
    weight = np.where(_proper(upper, lower, weight, width), weight, 0.0)
    good = weight > 0.3
    if good.sum() < 2.0 * width:
        return None
    s = strip.s_px
    middle = smooth(s[good], 0.5 * (upper + lower)[good], weight[good], KNOT_WIDTHS * width)
    centre = middle(np.clip(s, s[good][0], s[good][-1]))
    size = np.median((upper - lower)[good])
    window = max(int(WINDOW_DIAMETERS * size), 5)
    sides = [_without_tufts(d, good, size) for d in (upper - centre, centre - lower)]
    envelope = _envelope(sides[0], sides[1], good, window, PERCENTILE)
    if not np.isfinite(envelope).any():
        return None  # edges here and there, but nowhere enough of them side by side
    diameter = float(np.nanmedian(envelope))
    sd = _diameter_sd(sides[0], sides[1], good, window, envelope, diameter, coloured)
    inside = np.flatnonzero(good)
    part = slice(inside[0], inside[-1] + 1)
    beside = _beside(half, upper, lower, 0.04 * diameter)
    channels = _channels(strip.values, half, diameter)
    shown = [np.where(beside, np.nan, c)[:, part] for c in channels]
    row = centre[part] + half
    stripes = find_stripes(shown, row, 0.5 * diameter, count)
    coarse = coarse_slope(shown[-1], row, 0.5 * diameter) if coloured else float("nan")
    hairs = _fuzz(contrast, half, upper, lower)
    return Rope(s, upper, lower, weight, envelope, diameter, sd, stripes, coarse, hairs)


def _edge(
    contrast: np.ndarray, half: int, width: float, coloured: bool
) -> tuple[np.ndarray, np.ndarray]:
    """n of the steepest fall outwards (towards larger n) in every column (M,), and its weight.

    Hairs are opened away before the core's run is followed outwards, and the picture is smoothed a
    little along the rope, across which hairs run and edges do not.
    """
    known = np.nan_to_num(contrast.astype(np.float32))
    mask = core_mask(known, width, coloured)
    outer = mask[half:]
    start = np.argmax(outer > 0, axis=0)
    ended = (outer == 0) & (np.arange(outer.shape[0])[:, None] >= start[None, :])
    rough = np.where(ended.any(axis=0) & (outer > 0).any(axis=0), np.argmax(ended, axis=0), 0)
    soft = gaussian_filter1d(known, max(0.06 * width, 0.5), axis=1)
    fall = -np.gradient(gaussian_filter1d(soft, max(0.015 * width, 0.7), axis=0), axis=0)
    reach = max(int(0.06 * width), 2)
    rows = half + rough[None, :] + np.arange(-reach, reach + 1)[:, None]
    fits = (rough > 0) & (rows.min(axis=0) > 0) & (rows.max(axis=0) < contrast.shape[0] - 1)
    rows = np.clip(rows, 0, contrast.shape[0] - 1)
    column = np.arange(contrast.shape[1])
    falls = fall[rows, column[None, :]]
    best = np.argmax(falls, axis=0)
    inner = np.clip(best, 1, falls.shape[0] - 2)
    a, b, c = (falls[inner + i, column] for i in (-1, 0, 1))
    bend = a - 2.0 * b + c
    with np.errstate(divide="ignore", invalid="ignore"):
        shift = np.where(bend < 0, 0.5 * (a - c) / bend, 0.0)
    edge = rows[inner, column] - half + np.clip(shift, -1.0, 1.0)
    typical = float(np.median(b[fits])) if fits.any() else 1.0
    steep = np.clip(b / max(typical, 1e-9), 0.0, 1.0) ** 2
    weight = np.where(fits & ~np.isnan(contrast[rows, column[None, :]]).any(axis=0), steep, 0.0)
    return edge, weight


def _proper(upper: np.ndarray, lower: np.ndarray, weight: np.ndarray, width: float) -> np.ndarray:
    """Columns of about the typical width, so that parted ends and hardware stay out."""
    size = upper - lower
    sure = weight > 0.3
    if not sure.any():
        return sure
    typical = float(np.median(size[sure]))
    return (size > 0.45 * typical) & (size < 1.6 * typical)


def _without_tufts(distance: np.ndarray, good: np.ndarray, width: float) -> np.ndarray:
    """Distance of an edge from the centre line (M,) with what stands out over less than a fifth of
    the width, a tuft of hairs, cut off; a strand's lobe is longer than that."""
    at = np.flatnonzero(good)
    filled = np.interp(np.arange(distance.size), at, distance[at])
    return grey_opening(filled, size=max(int(TUFT * width), 1), mode="nearest")


def _envelope(
    up: np.ndarray, down: np.ndarray, good: np.ndarray, window: int, percentile: float
) -> np.ndarray:
    """Local outer diameter (M,): each side's percentile over a sliding window, summed; NaN where
    less than a third of a window could be used."""
    out = np.full(up.size, np.nan)
    step = max(window // 8, 1)
    places = np.arange(0, up.size, step)
    values = np.full(places.size, np.nan)
    for i, at in enumerate(places):
        part = slice(max(at - window // 2, 0), at + window // 2 + 1)
        use = good[part]
        if use.sum() > window // 3:
            values[i] = np.percentile(up[part][use], percentile) + np.percentile(
                down[part][use], percentile
            )
    known = np.isfinite(values)
    if known.any():
        filled = median_filter(values[known], size=min(9, int(known.sum())), mode="nearest")
        out = np.interp(np.arange(up.size), places[known], filled)
        out[: places[known][0]] = np.nan
        out[places[known][-1] + 1 :] = np.nan
    return out


def _diameter_sd(
    up: np.ndarray,
    down: np.ndarray,
    good: np.ndarray,
    window: int,
    envelope: np.ndarray,
    diameter: float,
    coloured: bool,
) -> float:
    """Standard uncertainty of D: what the choice of percentile moves (fuzz and lobes), the edge
    model (a third of a px and a hundredth of D a side; three for edges in colour, which pictures
    store at half resolution), and the rope's own unevenness over the independent stretches."""
    low, high = (float(np.nanmedian(_envelope(up, down, good, window, p))) for p in (85.0, 98.0))
    spread = 1.4826 * float(np.nanmedian(np.abs(envelope - diameter)))
    stretches = max(np.isfinite(envelope).sum() / window, 1.0)
    edge = 0.33**2 + ((0.03 if coloured else 0.01) * diameter) ** 2
    return float(np.sqrt((0.5 * (high - low)) ** 2 + 2.0 * edge + spread**2 / stretches))


def _beside(half: int, upper: np.ndarray, lower: np.ndarray, margin: float) -> np.ndarray:
    """What is not surely the rope, (R, M) bool."""
    n = np.arange(-half, half + 1)[:, None]
    return (n > upper[None, :] - margin) | (n < lower[None, :] + margin)


def _channels(values: np.ndarray, half: int, diameter: float) -> list[np.ndarray]:
    """Pictures in which stripes may show: log luma, and for colour pictures the direction of
    colour in which the rope itself varies most (two-coloured plies)."""
    grey = project(values, LUMA_BGR)
    luma = np.log(np.maximum(np.nan_to_num(grey), 0.0) + 0.02)
    if values.ndim == 2:
        return [luma]
    colour = log_chromaticity(np.nan_to_num(values))
    inner = np.abs(np.arange(-half, half + 1)) < 0.35 * diameter
    samples = colour[inner].reshape(-1, 3)
    samples = samples[:: max(samples.shape[0] // 5000, 1)]
    direction = np.linalg.eigh(np.cov(samples.T))[1][:, -1]
    return [luma, colour @ direction]


def _fuzz(contrast: np.ndarray, half: int, upper: np.ndarray, lower: np.ndarray) -> float:
    """Share of columns in which something bright lies outside the core's edges, within a width."""
    n = np.arange(-half, half + 1)[:, None]
    size = (upper - lower)[None, :]
    outside = (n > upper + 0.08 * size) & (n < upper + 0.6 * size)
    outside |= (n < lower - 0.08 * size) & (n > lower - 0.6 * size)
    return float((outside & (np.nan_to_num(contrast) > 0.3)).any(axis=0).mean())
