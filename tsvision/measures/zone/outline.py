"""The bundle's outline along the zone: envelope, coiling, knots, and the profile that is stored."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numba
import numpy as np

from tsvision.measures.edges.edges import Edges
from tsvision.measures.edges.unmatched import MATCHED
from tsvision.measures.helix.bundle import BundleFit
from tsvision.measures.helix.silhouette import KC, RC
from tsvision.measures.looks import Looks
from tsvision.measures.numeric.line import line_through
from tsvision.measures.numeric.sums import deviation
from tsvision.measures.zone.along import mm_along
from tsvision.measures.zone.definitions import COIL_RATIO, KNOT_RATIO
from tsvision.measures.zone.envelope import Envelope, middle_swing, unevenness_of
from tsvision.measures.zone.knots import DENSE, Outline, baseline_along_px, in_mm, knots_along
from tsvision.records import FrameRow, KnotSighting, Profile

NAN = float("nan")
SAME_PERIOD = 0.05  # relative difference of two periods that are the same
BEATING = 0.075  # unevenness that one view shows of an even coil's crests
# Where strings are hardly seen, as before ground that is about as dark, the few edges that were
# found may be that ground's. Strings hang together: by no more than so much of D do their outermost
# edges jump, and what hangs together of a knot is longer than so much of it.
JUMP, SHORT = 0.5, 0.25
BEYOND = 0.1  # of D: how much farther than the outline a fitted coil may reach


class Outlined(NamedTuple):
    """lobes: what is too short for a knot by itself; knot_ends_px: first and last s of each knot;
    tight: E(s) at the edges' s, closed over no more than a knot's coil."""

    row: FrameRow
    profile: Profile
    knots: tuple[KnotSighting, ...]
    lobes: tuple[KnotSighting, ...]
    knot_ends_px: tuple[tuple[float, float], ...]
    tight: Envelope


def add_outline(
    row: FrameRow,
    edges: Edges,
    looks: Looks,
    near: BundleFit | None,
    mid: BundleFit | None,
    apex_px: float,
) -> Outlined:
    """Row with amplitude, envelope and knots filled in, the profile, the knots, and E(s)."""
    mm = looks.scale.mm_per_px
    known = (edges.upper_weight > MATCHED) | (edges.lower_weight > MATCHED)
    if np.isfinite(apex_px):
        known &= edges.s_px > apex_px + 0.5 * looks.diameter_px
    line = centre_line(edges)
    # An edge that is exactly 0 counts as not seen.
    upper = np.where(edges.upper_weight > MATCHED, edges.upper_px - line, 0.0)
    lower = np.where(edges.lower_weight > MATCHED, edges.lower_px - line, 0.0)
    diameter = row.diameter_px if np.isfinite(row.diameter_px) else looks.diameter_px
    astray = _astray(np.maximum(np.abs(upper), np.abs(lower)), known, diameter)
    known = known & ~astray
    upper[astray], lower[astray] = 0.0, 0.0
    swing, coil_period = middle_swing(upper, lower, diameter)
    if looks.sight.signal.by_distance and _is_of_strands(near, coil_period):
        swing = 0.0
    period = _period(near, mid, coil_period, looks.diameter_px)
    sd = row.diameter_px_sd if np.isfinite(row.diameter_px_sd) else 0.05 * diameter
    coils = swing > COIL_RATIO * diameter
    outline = Outline(edges, upper, lower, known, diameter, sd, period, coils)
    envelope, tight = outline.closed_px(period), outline.tight_px
    base = baseline_along_px(outline)
    found, lone = knots_along(outline, base, looks.sight.axis.at(edges.s_px))
    top = float(np.fmax.reduce(envelope)) if np.isfinite(base) else NAN
    fitted = near.fit.p[RC] if near is not None and np.isfinite(row.pitch_px) else NAN
    if fitted > 0.5 * (top - diameter) + BEYOND * diameter:
        fitted = NAN  # no centre line swings farther out than the strings are seen
    # The middle of the edges swings with the coil alone where the section is symmetric.
    even = looks.strand_count % 2 == 0
    amplitude = float(np.fmax(fitted, swing)) if even else float(fitted)
    row = replace(
        row,
        coil_amplitude_px=amplitude,
        coil_amplitude_mm=amplitude * mm,
        unevenness=_unevenness(outline, _coil_px(near, mid, coil_period)),
        baseline_envelope_px=base,
        baseline_envelope_mm=base * mm,
        max_envelope_px=top,
        max_envelope_mm=top * mm,
        knot_count=float(len(found)) if np.isfinite(base) else NAN,
    )
    knots = tuple(_told(knot, looks) for knot in found)
    lobes = tuple(_told(lobe, looks) for lobe in lone)
    ends = tuple(knot.ends_px for knot in found)
    seen = Envelope(tight, outline.tight_over_px)
    return Outlined(row, _profile(edges, looks, envelope), knots, lobes, ends, seen)


def _astray(reach_px: np.ndarray, known: np.ndarray, diameter_px: float) -> np.ndarray:
    """Columns (M,) in which strings would reach out as far as a knot's, on a piece of the outline
    that hangs together with no other and is short, or seen in few of its columns."""
    out = np.zeros(known.size, dtype=bool)
    at = np.flatnonzero(known)
    if at.size == 0:
        return out
    jumps = np.flatnonzero(np.abs(np.diff(reach_px[at])) > JUMP * diameter_px)
    for piece in np.split(at, jumps + 1):
        long = int(piece[-1] - piece[0]) + 1
        out[piece] = long < SHORT * diameter_px or piece.size < DENSE * long
    return out & (reach_px > 0.5 * KNOT_RATIO * diameter_px)


def _told(knot: KnotSighting, looks: Looks) -> KnotSighting:
    """A knot along the axis as it is told: from the separator, in px and in mm."""
    told = in_mm(knot, float(mm_along(looks, knot.centre_px)), looks.scale.mm_per_px)
    return replace(told, centre_px=knot.centre_px - looks.zero_px)


def _is_of_strands(near: BundleFit | None, swing_period_px: float) -> bool:
    """Whether the middle of the edges swings once a revolution of the strands of a straight bundle:
    of strands of several colours some are seen less well, and the bundle itself does not swing."""
    if near is None or near.fit.coiled:
        return False
    return abs(swing_period_px / near.fit.pitch_px - 1.0) < SAME_PERIOD


def _coil_px(near: BundleFit | None, mid: BundleFit | None, coil_period_px: float) -> float:
    """Pitch of the coil, fitted or from the middle of the edges; NaN where none is seen."""
    fits = (f.fit for f in (near, mid) if f is not None)
    return next((2 * np.pi / float(fit.p[KC]) for fit in fits if fit.coiled), coil_period_px)


def _unevenness(outline: Outline, coil_px: float) -> float:
    """Coefficient of variation of E(s), without what the beat of lobes and coil adds to it.

    Closed over half a coil, from one crest to the next, a dip shows as deep as it is; over more it
    fills up, and uneven coiling looks even.
    """
    d = outline.diameter_px
    if not (outline.coils and np.isfinite(coil_px)):
        return unevenness_of(outline.tight_px)
    shown = unevenness_of(outline.closed_px(float(np.clip(0.5 * coil_px, 0.6 * d, 2.0 * d))))
    return float(np.sqrt(max(shown**2 - BEATING**2, 0.0)))


def _period(
    near: BundleFit | None, mid: BundleFit | None, coil_period_px: float, diameter_px: float
) -> float:
    """Over how many px the envelope is closed: one lobe of the coil, else of the strands."""
    fits = [f.fit for f in (near, mid) if f is not None]
    coiled = next((fit for fit in fits if fit.coiled), None)
    if coiled is not None:
        period = 1.1 * 2 * np.pi / coiled.p[KC]
    else:
        period = 0.6 * near.fit.pitch_px if near is not None else diameter_px
    period = float(np.clip(period, 0.8 * diameter_px, 6.0 * diameter_px))
    return max(period, 2.2 * coil_period_px) if np.isfinite(coil_period_px) else period


def _profile(edges: Edges, looks: Looks, envelope: np.ndarray) -> Profile:
    keep = np.isfinite(envelope)
    mm = looks.scale.mm_per_px
    axis = looks.sight.axis
    s_px = edges.s_px[keep] - looks.zero_px  # from the separator, as s_mm
    place = None if axis.is_straight else axis.at(edges.s_px[keep])
    upper, lower = (
        np.where(weight > MATCHED, edge, np.nan)[keep]
        for edge, weight in (
            (edges.upper_px, edges.upper_weight),
            (edges.lower_px, edges.lower_weight),
        )
    )
    return Profile(
        s_mm=mm_along(looks, edges.s_px[keep]),
        s_px=s_px,
        upper_px=upper,
        lower_px=lower,
        width_mm=(upper - lower) * mm,
        envelope_mm=envelope[keep] * mm,
        axis_x_px=None if place is None else place[:, 0],
        axis_y_px=None if place is None else place[:, 1],
    )


def centre_line(edges: Edges) -> np.ndarray:
    """Straight line (M,) through the middles: this frame's axis, in n."""
    constant, slope = _axis_through(
        edges.s_px, edges.upper_px, edges.lower_px, edges.upper_weight, edges.lower_weight
    )
    return np.asarray(constant + slope * edges.s_px)


@numba.njit(cache=True)
def _axis_through(s_px, upper, lower, upper_weight, lower_weight):  # pragma: no cover - compiled
    """(constant, slope) of a line that few of the middles, far off, do not move."""
    known = np.minimum(upper_weight, lower_weight) > 0.2
    if np.count_nonzero(known) < 10:
        return 0.0, 0.0
    s, c = s_px[known], (0.5 * (upper + lower))[known]
    constant, slope = line_through(s, c)
    for _ in range(4):
        r = c - (constant + slope * s)
        weight = 1.0 / (1.0 + (r / (1.5 * deviation(r) + 1e-6)) ** 2)
        constant, slope = line_through(s, c, weight**2)
    return constant, slope
