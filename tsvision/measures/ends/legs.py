"""Where the legs leave the separator, and where they meet: s = 0 and the apex, from the legs.

The plate's edge that a camera sees is the near one, and the connector's face is L away through a
scale that changes along the axis. The legs run straight from the holes, S apart, to where they
meet: every picture's two lines, continued until they are S apart, cross the exits, whatever hides
them. With the exits known, the two lines of one picture cross where the strands meet: the outline
of many strands closes before that, and that of two behind it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from scipy.optimize import least_squares

from tsvision.images.contrast import raw_contrast
from tsvision.images.percentiles import median, row_medians
from tsvision.images.sight import Sight
from tsvision.measures.edges.cut import Cut, strip_of

NEAR = 0.3  # of S/2: how far from the straight line hole - apex a leg is looked for
FREE = 0.35  # of the way from apex to plate next to the apex is left out: the legs touch there
SOME = 3  # rows apart that tell what of a column is ground
MOST = 48  # columns of a leg, those next to the apex, that one frame's apex is read from
CLEAR = 0.35  # of the bundle's contrast
# The same of a leg of which so little is seen, and of the ground's spread: strands of two colours
# are told from their ground by unlike amounts, each leg being of one.
FAINT, SPREADS = 0.15, 5.0
FEWEST = 6  # columns of either leg
HOLE_SD_MM = 0.08  # by which a string lies off the middle of its hole
MOST_SD_MM = 0.25  # legs that tell the exits worse than this tell less than plate and connector do
LEAST_SLOPE = 0.1  # legs that hardly open tell nothing of where they come from


@dataclass(frozen=True)
class Face:
    """s of the hole exits and its standard uncertainty; how far the strings there lie from the
    middle between them, and that from the axis (upwards). All px."""

    s_px: float
    sd_px: float
    half_gap_px: float
    middle_px: float


@dataclass(frozen=True)
class Legs:
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
    """The exits from all (picture, cut) that show two legs; None where none does, or too vaguely.

    about_px: s of the face roughly; plate_px: of the plate's visible edge (NaN: not seen), half of
    S as `half_gap_px`. Assumes two holes, or two groups of them, in the picture's plane.
    """
    if not (np.isfinite(about_px) and np.isfinite(half_gap_px) and half_gap_px > sight.width_px):
        return None
    found = [legs_of(p, c, sight, about_px, plate_px, half_gap_px, None) for p, c in pairs]
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
    sd_px = _face_sd_px(fit.jac, max(rms2, 0.01))
    if not sd_px * mm_per_px < MOST_SD_MM:
        return None
    return Face(float(fit.x[0]), sd_px, float(fit.x[2]), float(fit.x[1]))


def _face_sd_px(jacobian: np.ndarray, legs_px2: float) -> float:
    """Of the face, by the first parameter of a fit whose first residual is that of S. The legs'
    residuals are px and tell their own variance, all columns of a leg as one reading, for it is
    misread alike along them; how far strings lie off their holes is stated, in its own sd, and is
    no less for legs that are straight."""
    holes, legs = jacobian[:1], jacobian[1:]
    turned = np.linalg.pinv(jacobian.T @ jacobian)[0]
    return float(np.sqrt(np.sum((holes @ turned) ** 2) + legs_px2 * np.sum((legs @ turned) ** 2)))


def apex_from_legs(
    picture: np.ndarray, cut: Cut, sight: Sight, face: Face, plate_px: float
) -> float:
    """s (px) where the middles of the two legs cross; NaN where they are not both seen.

    A leg at s lies half_gap (1 - (s - face) / (apex - face)) from the middle: linear in the
    inverse of what is sought.
    """
    legs = legs_of(picture, cut, sight, face.s_px, plate_px, face.half_gap_px, MOST)
    if legs is None:
        return float("nan")
    s = np.concatenate([legs.upper[0], legs.lower[0]]) - face.s_px
    away = np.concatenate([legs.upper[1] - face.middle_px, face.middle_px - legs.lower[1]])
    closed = 1.0 - away / face.half_gap_px
    each = closed / s
    typical = median(each)
    keep = np.abs(each - typical) < 0.1 * typical
    inverse = float((closed * s)[keep].sum() / (s[keep] ** 2).sum())
    return face.s_px + 1.0 / inverse if inverse > 0.0 else float("nan")


def legs_of(
    picture: np.ndarray,
    cut: Cut,
    sight: Sight,
    about_px: float,
    plate_px: float,
    half_gap: float,
    most: int | None,
) -> Legs | None:
    first = cut.silhouette.apex_column
    if not np.isfinite(first):
        return None
    apex = float(cut.s_px[int(first)])
    low = float(np.fmax(plate_px, about_px)) + 2.0
    high = apex - FREE * (apex - about_px)
    if high - low < FEWEST:
        return None
    if most is not None:
        low = max(low, high - most)
    half = int(1.3 * half_gap) + 4
    strip = strip_of(picture, sight, (low, high), half)
    contrast = raw_contrast(strip.values, sight.signal, 0.0)
    if np.isnan(contrast).any():  # beyond the view
        return None
    s = strip.s_px
    if not sight.signal.by_distance:
        contrast = contrast - row_medians(contrast[::SOME].T).astype(np.float32)
    contrast = contrast / (abs(cut.core_level) if sight.signal.by_distance else cut.core_level)
    sides = []
    for sign in (1.0, -1.0):
        line = sign * half_gap * (apex - s) / (apex - about_px)
        leg = _leg(contrast, line, NEAR * half_gap, CLEAR, sight.width_px)
        if leg.shape[1] < FEWEST:
            leg = _leg(contrast, line, NEAR * half_gap, _faint(contrast), sight.width_px)
        if leg.shape[1] < FEWEST:
            return None
        sides.append(np.stack([s[leg[0].astype(int)], leg[1]]))
    return Legs(apex, sides[0], sides[1])


def _leg(
    contrast: np.ndarray, line: np.ndarray, near: float, level: float, width: float
) -> np.ndarray:
    """Columns that show a leg near a line, and its middles there, (2, K)."""
    total, middle = _middles(contrast, line, near, level)
    least = 0.12 * width * level / CLEAR
    clear = np.flatnonzero((total > least) & (np.abs(middle) > 0.35 * width))
    return np.stack([clear, middle[clear]])


def _faint(contrast: np.ndarray) -> float:
    """Contrast from which on a leg is seen that has little of it."""
    some = contrast[::SOME, ::SOME].ravel()
    spread = 1.4826 * median(np.abs(some - median(some)))
    return float(np.clip(SPREADS * spread, FAINT, CLEAR))


@numba.njit(cache=True, error_model="numpy")
def _middles(contrast, line, near, level):  # pragma: no cover - compiled
    """How much of the strings (M,) is seen in a contrast (R, M) less than `near` from a line (M,),
    and its middle (M,), in n."""
    rows, columns = contrast.shape
    half = rows // 2
    total, moment = np.zeros(columns, contrast.dtype), np.zeros(columns)
    most = contrast.dtype.type(1.0)
    for r in range(rows):
        for c in range(columns):
            light = contrast[r, c]
            if abs(r - half - line[c]) < near and light > level:
                weight = min(light, most)
                total[c] += weight
                moment[c] += weight * float(r - half)
    return total, moment / np.maximum(total, 1e-9)
