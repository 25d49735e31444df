"""The bundle's outline along the zone: envelope, coiling, knots, and the profile that is stored."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tsvision.measures.bundle import BundleFit
from tsvision.measures.envelope import (
    baseline_px,
    envelope_px,
    find_knots,
    middle_swing,
    unevenness_of,
)
from tsvision.measures.helix import KC, RC, Edges
from tsvision.measures.laid import coil_rate
from tsvision.measures.looks import Looks
from tsvision.records import FrameRow, KnotSighting, Profile

NAN = float("nan")
# One view shows E only where a lobe of the coil happens to point sideways: either end of a knot
# comes out short by up to half a lobe, both together by this part of D on average.
COMES_SHORT = 0.3
# Lobes of the strands meet those of the coil now here, now there: closed over one coil alone, the
# lower quartile of an even coil comes out a tenth low, and stretches seen better look like knots.
BEATS = 1.4  # coils over which the envelope is closed where its baseline is read
BEYOND = 0.1  # of D: how much farther than the outline a fitted coil may reach
JOINED = 0.4  # of a coil: what stands out so near to each other is one
OWN_COIL = 0.7  # of a knot's own coil, over which it is closed to tell it from its neighbour
COILS = 0.05  # rms swing over D from which a bundle coils


class Outlined(NamedTuple):
    """envelope_px (M,): E(s) at the edges' s, closed over no more than a knot's coil."""

    row: FrameRow
    profile: Profile
    knots: tuple[KnotSighting, ...]
    envelope_px: np.ndarray


def add_outline(
    row: FrameRow,
    edges: Edges,
    looks: Looks,
    near: BundleFit | None,
    mid: BundleFit | None,
    apex_px: float,
) -> Outlined:
    """Row with amplitude, envelope and knots filled in, the profile, the knots, and E(s).

    Without a scale the knots' lengths are px.
    """
    mm = looks.scale.mm_per_px
    known = (edges.upper_weight > 0.1) | (edges.lower_weight > 0.1)
    if np.isfinite(apex_px):
        known &= edges.s_px > apex_px + 0.5 * looks.diameter_px
    line = centre_line(edges)
    # An edge that is exactly 0 counts as not seen.
    upper = np.where(edges.upper_weight > 0.1, edges.upper_px - line, 0.0)
    lower = np.where(edges.lower_weight > 0.1, edges.lower_px - line, 0.0)
    diameter = row.diameter_px if np.isfinite(row.diameter_px) else looks.diameter_px
    swing, coil_period = middle_swing(upper, lower, diameter)
    period = _period(near, mid, coil_period, looks.diameter_px)
    envelope = envelope_px(upper, lower, known, period, diameter)
    # A knot coils more tightly than the bundle beside it, and the dips of an uneven bundle are
    # about one coil wide: closed over the bundle's own period the dips would vanish, and two knots
    # that lie near each other run together. What looks like one is looked at again, closed over
    # little more than the half coil after which the next lobe shows on the other side.
    tight = envelope_px(upper, lower, known, max(0.5 * period, 1.2 * diameter), diameter)
    base = baseline_px(envelope_px(upper, lower, known, BEATS * period, diameter))
    s_px = edges.s_px - looks.zero_px
    sd = row.diameter_px_sd if np.isfinite(row.diameter_px_sd) else 0.05 * diameter
    unit = mm if np.isfinite(mm) else 1.0

    def sought(closed_px: np.ndarray, gap_px: float) -> list[KnotSighting]:
        return find_knots(
            s_px * unit,
            closed_px * unit,
            diameter * unit,
            base * unit,
            looks.sight.axis.at(edges.s_px),
            period * unit,
            sd * unit,
            COMES_SHORT * diameter * unit if swing > COILS * diameter else 0.0,
            gap_px * unit,
        )

    knots: list[KnotSighting] = []
    for knot in sought(tight, JOINED * period) if np.isfinite(base) else []:
        low, high = (end / unit for end in knot.ends_mm)
        rate = coil_rate(edges, looks.zero_px + low, looks.zero_px + high, diameter)
        parts: list[KnotSighting] = []
        if np.isfinite(rate):
            own = envelope_px(upper, lower, known, OWN_COIL * 2.0 * np.pi / rate, diameter)
            inside = (s_px >= low) & (s_px <= high)
            parts = sought(np.where(inside, own, np.nan), 0.0)
        knots += parts if len(parts) > 1 else [knot]
    top = float(np.nanmax(envelope)) if np.isfinite(base) else NAN
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
        unevenness=unevenness_of(tight),
        baseline_envelope_px=base,
        baseline_envelope_mm=base * mm,
        max_envelope_px=top,
        max_envelope_mm=top * mm,
        knot_count=float(len(knots)),
    )
    return Outlined(row, _profile(edges, looks, envelope), tuple(knots), tight)


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
    place = axis.at(edges.s_px[keep])
    return Profile(
        s_mm=s_px * mm,
        s_px=s_px,
        upper_px=edges.upper_px[keep],
        lower_px=edges.lower_px[keep],
        width_mm=((edges.upper_px - edges.lower_px) * mm)[keep],
        envelope_mm=envelope[keep] * mm,
        axis_x_px=None if axis.is_straight else place[:, 0],
        axis_y_px=None if axis.is_straight else place[:, 1],
    )


def centre_line(edges: Edges) -> np.ndarray:
    """Straight line (M,) through the middles: this frame's axis, in n."""
    known = (edges.upper_weight > 0.2) & (edges.lower_weight > 0.2)
    if known.sum() < 10:
        return np.zeros(edges.s_px.size)
    s = edges.s_px[known]
    c = 0.5 * (edges.upper_px + edges.lower_px)[known]
    line = np.polyfit(s, c, 1)
    for _ in range(4):
        r = c - np.polyval(line, s)
        line = np.polyfit(s, c, 1, w=1.0 / (1.0 + (r / (1.5 * np.std(r) + 1e-6)) ** 2))
    return np.polyval(line, edges.s_px)
