"""Where the legs leave the separator: s = 0 from the legs themselves.

The plate's edge that a camera sees is the near one, and the connector's face is L away through a
scale that changes along the axis. The legs run straight from the holes, S apart, to where they
meet: every picture's two lines, continued until they are S apart, cross the exits, whatever hides
them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from tsvision.images.linear import to_linear
from tsvision.images.sight import Sight, raw_contrast
from tsvision.images.strip import cut_strip
from tsvision.measures.cut import Cut

NEAR = 0.3  # of S/2: how far from the straight line hole - apex a leg is looked for
FREE = 0.35  # of the way from apex to plate next to the apex is left out: the legs touch there
CLEAR = 0.35  # of the bundle's contrast
FEWEST = 6  # columns of either leg
HOLE_SD_MM = 0.08  # by which a string lies off the middle of its hole
LEAST_SLOPE = 0.1  # legs that hardly open tell nothing of where they come from


@dataclass(frozen=True)
class Face:
    """s of the hole exits, px, and its standard uncertainty."""

    s_px: float
    sd_px: float


@dataclass(frozen=True)
class _Legs:
    """Columns and middles of both legs in one picture, px, upper (+1) and lower (-1)."""

    apex_px: float
    upper: np.ndarray
    lower: np.ndarray


def face_from_legs(
    pairs: list[tuple[np.ndarray, Cut]],
    sight: Sight,
    about_px: float,
    plate_px: float,
    half_gap_px: float,
    mm_per_px: float,
) -> Face | None:
    """The exits from all (picture, cut) that show two legs; None where none does.

    about_px: s of the face roughly; plate_px: of the plate's visible edge (NaN: not seen), half of
    S as `half_gap_px`. Assumes two holes, or two groups of them, in the picture's plane.
    """
    if not (np.isfinite(about_px) and np.isfinite(half_gap_px) and half_gap_px > sight.width_px):
        return None
    found = [_legs(p, c, sight, about_px, plate_px, half_gap_px) for p, c in pairs]
    legs = [f for f in found if f is not None]
    if not legs:
        return None
    hole_sd = HOLE_SD_MM / mm_per_px

    def residuals(u: np.ndarray) -> np.ndarray:
        face, middle, half = u[:3]
        out = [np.array([(half - half_gap_px) / hole_sd])]
        for leg, apex in zip(legs, u[3:], strict=True):
            opening = half / max(apex - face, 1.0)
            for sign, (s, y) in ((1.0, leg.upper), (-1.0, leg.lower)):
                out.append((middle + sign * opening * (apex - s) - y) / np.sqrt(s.size))
        return np.concatenate(out)

    start = [about_px, 0.0, half_gap_px, *(leg.apex_px for leg in legs)]
    fit = least_squares(residuals, start, loss="soft_l1", f_scale=0.3)
    apexes = fit.x[3:]
    if fit.x[2] / max(float(np.min(apexes)) - fit.x[0], 1.0) < LEAST_SLOPE:
        return None
    rms2 = 2.0 * fit.cost / (2 * len(legs))
    covariance = np.linalg.pinv(fit.jac.T @ fit.jac) * max(rms2, 0.01)
    return Face(float(fit.x[0]), float(np.sqrt(covariance[0, 0])))


def _legs(
    picture: np.ndarray, cut: Cut, sight: Sight, about_px: float, plate_px: float, half_gap: float
) -> _Legs | None:
    first = cut.silhouette.apex_column
    if not np.isfinite(first):
        return None
    apex = float(cut.s_px[int(first)])
    low = float(np.fmax(plate_px, about_px)) + 2.0
    high = apex - FREE * (apex - about_px)
    if high - low < FEWEST:
        return None
    half = int(1.3 * half_gap) + 4
    strip = cut_strip(to_linear(picture, sight.gamma), sight.axis, (low, high), half)
    contrast = raw_contrast(strip.values, sight.weights, sight.by_distance, 0.0)
    contrast = contrast[:, ~np.isnan(contrast).any(axis=0)]
    s = strip.s_px[: contrast.shape[1]]
    if s.size != strip.s_px.size:  # a leg that leaves the view
        return None
    if not sight.by_distance:
        contrast = contrast - np.median(contrast, axis=0)
    contrast = contrast / (abs(cut.core_level) if sight.by_distance else cut.core_level)
    n = np.arange(-half, half + 1)[:, None]
    sides = []
    for sign in (1.0, -1.0):
        line = sign * half_gap * (apex - s) / (apex - about_px)
        near = np.abs(n - line) < NEAR * half_gap
        weight = np.where(near & (contrast > CLEAR), np.minimum(contrast, 1.0), 0.0)
        total = weight.sum(axis=0)
        middle = (weight * n).sum(axis=0) / np.maximum(total, 1e-9)
        clear = (total > 0.12 * sight.width_px) & (np.abs(middle) > 0.35 * sight.width_px)
        if clear.sum() < FEWEST:
            return None
        sides.append(np.stack([s[clear], middle[clear]]))
    return _Legs(apex, sides[0], sides[1])
