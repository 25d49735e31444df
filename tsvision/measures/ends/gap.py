"""How far apart the strings leave the separator, from the legs of several pictures alone.

A leg tells a line; legs that meet at different places tell where the lines come from. The face in
`legs` leans on the rig's S, so that one picture is enough. Here S itself is asked for, without its
stated value but as a place to start from: the stated one may be what is wrong. Where no scale says
how many px S has, every place is started from: lines that are found do not depend on where.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from tsvision.images.sight import Sight
from tsvision.measures.edges.cut import Cut
from tsvision.measures.ends.legs import LEAST_SLOPE, Legs, legs_of

ROUNDS = 3  # the legs are looked for again about the lines found before
FEWEST_PICTURES = 3
STRAIGHT_PX = 0.6  # rms about straight lines of what are two legs
ODD = 3.0  # times the median picture's rms: no legs, or not yet straight
MIDDLE_SD_PX = 0.2  # by which the middle of a leg that is lit from one side is misread
MISSTATED = 3.0  # times: no rig is this far off what its file says
WORST = 0.1  # of the gap: a wider uncertainty tells nothing
STARTS = np.geomspace(1.1, 16.0, 12)  # of the bundle's width: half gaps to start from


@dataclass(frozen=True)
class Gap:
    """Half the distance of the strings at the exits and its standard uncertainty, px."""

    half_px: float
    sd_px: float


@dataclass(frozen=True)
class _Lines:
    """Lines through the legs of some pictures: face, middle, half gap and the apexes (px); their
    covariance for residuals of 1 px; rms px of each picture's columns."""

    found: np.ndarray
    covariance: np.ndarray
    off_px: np.ndarray


def gap_from_legs(
    pairs: list[tuple[np.ndarray, Cut]],
    sight: Sight,
    about_px: float,
    plate_px: float,
    half_gap_px: float,
) -> Gap | None:
    """Half of S from all (picture, cut) that show two legs; None where they do not tell it.

    about_px: s of the exits roughly; plate_px: of the plate's visible edge (NaN: not seen), half of
    S as stated `half_gap_px`. Assumes two holes, or two groups of them, in the picture's plane.
    """
    if not (np.isfinite(about_px) and np.isfinite(half_gap_px) and half_gap_px > sight.width_px):
        return None
    face, half = about_px, half_gap_px
    lines = None
    for _ in range(ROUNDS):
        seen = [legs_of(p, c, sight, face, plate_px, half, None) for p, c in pairs]
        lines = _straight([legs for legs in seen if legs is not None], face, half)
        if lines is None or not lines.found[2] > 0.5 * sight.width_px:
            return None
        face, half = float(lines.found[0]), float(lines.found[2])
        if not half_gap_px / MISSTATED < half < MISSTATED * half_gap_px:
            return None  # lines that all meet at one place run away along themselves
    assert lines is not None
    rms = float(np.sqrt(np.mean(lines.off_px**2)))
    if rms > STRAIGHT_PX or half / max(float(np.min(lines.found[3:])) - face, 1.0) < LEAST_SLOPE:
        return None
    sd = float(np.sqrt(lines.covariance[2, 2])) * max(rms, MIDDLE_SD_PX)
    return Gap(half, sd) if sd < WORST * half else None


def gap_without_scale(
    pairs: list[tuple[np.ndarray, Cut]], sight: Sight, about_px: float, plate_px: float
) -> Gap | None:
    """The same where nothing tells how far apart the holes are: the surest found from any start."""
    starts = (float(start) * sight.width_px for start in STARTS)
    found = [gap_from_legs(pairs, sight, about_px, plate_px, half) for half in starts]
    return min((gap for gap in found if gap is not None), key=lambda g: g.sd_px, default=None)


def _straight(legs: list[Legs], face_px: float, half_px: float) -> _Lines | None:
    """The lines through all legs but those of pictures that no lines fit; None for too few."""
    while len(legs) >= FEWEST_PICTURES:
        lines = _through(legs, face_px, half_px)
        worst = int(np.argmax(lines.off_px))
        if lines.off_px[worst] < max(ODD * float(np.median(lines.off_px)), STRAIGHT_PX):
            return lines
        legs = [*legs[:worst], *legs[worst + 1 :]]
    return None


def _through(legs: list[Legs], face_px: float, half_px: float) -> _Lines:
    sizes = [each.upper.shape[1] + each.lower.shape[1] for each in legs]
    heavy = np.repeat([1.0 / np.sqrt(0.5 * size) for size in sizes], sizes)

    def residuals(u: np.ndarray) -> np.ndarray:
        face, middle, half = u[:3]
        out = []
        for leg, apex in zip(legs, u[3:], strict=True):
            opening = half / max(apex - face, 1.0)
            for sign, (s, y) in ((1.0, leg.upper), (-1.0, leg.lower)):
                out.append(middle + sign * opening * (apex - s) - y)
        return np.concatenate(out) * heavy

    start = [face_px, 0.0, half_px, *(leg.apex_px for leg in legs)]
    fit = least_squares(residuals, start, loss="soft_l1", f_scale=0.3)
    off = residuals(fit.x) / heavy
    each = np.split(off, np.cumsum(sizes)[:-1])
    # A leg is misread alike along its columns: all of them together count as one reading.
    covariance = np.linalg.pinv(fit.jac.T @ fit.jac)
    return _Lines(fit.x, covariance, np.array([np.sqrt(np.mean(part**2)) for part in each]))
