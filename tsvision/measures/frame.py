"""One frame in, one row out.

cut the strip → edges → helix beside the separator and in mid-span → envelope, knots → row.
Whatever cannot be measured stays NaN and a flag says why.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tsvision.flags import Flag, flags_to_text
from tsvision.measures.bundle import BundleFit, fit_window, swing_px
from tsvision.measures.cut import Cut, cut_frame, find_edges
from tsvision.measures.envelope import (
    baseline_px,
    envelope_px,
    find_knots,
    middle_swing,
    unevenness_of,
)
from tsvision.measures.handedness import handedness_of, ridge_slope
from tsvision.measures.helix import KC, RC, Edges, K
from tsvision.measures.looks import Looks
from tsvision.measures.uncertainty import angle_sd, diameter_sd_px, pitch_sd_px
from tsvision.measures.windows import even_stretches
from tsvision.records import Frame, FrameResult, FrameRow, Profile

NAN = float("nan")


@dataclass(frozen=True)
class Warm:
    """What the next frame may start from."""

    near: BundleFit | None = None
    mid: BundleFit | None = None
    slope_sum: float = 0.0


def measure_frame(frame: Frame, looks: Looks, turns: float, warm: Warm) -> tuple[FrameResult, Warm]:
    """Measure one decoded picture of the size that `looks` were learnt on."""
    flags = Flag(0)
    row = _known(frame, looks, turns)
    assert frame.pixels is not None
    strand_px = looks.diameter_px / looks.section.diameter_d
    cut = cut_frame(frame.pixels, looks.sight, strand_px, looks.half_px)
    if cut is None:
        return _failed(row, Flag.BLANK), warm
    if cut.silhouette.bundle.sum() < 1.5 * looks.diameter_px:
        few = np.isfinite(turns) and abs(turns) < 3
        return _failed(row, Flag.TOO_FEW_TURNS if few else Flag.NO_BUNDLE), warm
    if cut.saturated > 0.02:
        flags |= Flag.OVEREXPOSED
    if cut.silhouette.cut.any():
        flags |= Flag.FIBRES
    edges = _within(find_edges(cut, looks.shading), cut, looks)
    apex_px = _apex(cut, looks)
    near, mid = _fits(edges, looks, turns, warm, apex_px)
    row, flags = _bundle_values(row, flags, near, mid, edges, cut, looks)
    slope, warm_slope = _handedness(cut, edges, looks, warm)
    row = replace(row, handedness=slope[0], handedness_confidence=slope[1])
    if not slope[0]:
        flags |= Flag.NO_HANDEDNESS
    row, profile, knots = _envelope_values(row, edges, cut, looks, near, mid, apex_px)
    row = _budgets(row, looks, near, mid, apex_px, edges)
    if not looks.zero_known:
        flags |= Flag.NO_SEPARATOR
    if not np.isfinite(looks.scale.mm_per_px):
        flags |= Flag.NO_SCALE
    if not np.isfinite(turns):
        flags |= Flag.NO_TURNS
    if not looks.strand_count_given:
        flags |= Flag.STRAND_COUNT_GUESSED
    row = replace(row, flags=flags_to_text(flags))
    return FrameResult(row, profile, tuple(knots)), Warm(
        near or warm.near, mid or warm.mid, warm_slope
    )


def _known(frame: Frame, looks: Looks, turns: float) -> FrameRow:
    axis = looks.sight.axis
    ends = np.array([looks.zero_px, looks.sight.end_px])
    (x0, y0), (x1, y1) = axis.at(ends)
    return FrameRow(
        frame=frame.index,
        file=frame.file,
        turns=turns,
        mm_per_px=looks.scale.mm_per_px,
        mm_per_px_sd=looks.scale.mm_per_px_sd,
        axis_x0_px=float(x0),
        axis_y0_px=float(y0),
        axis_x1_px=float(x1),
        axis_y1_px=float(y1),
        separator_x_px=float(x0) if looks.zero_known else NAN,
        separator_y_px=float(y0) if looks.zero_known else NAN,
        strand_count=float(looks.strand_count),
        strand_count_confidence=looks.strand_count_confidence,
        blur_px=looks.shading[0].blur_px,
    )


def _failed(row: FrameRow, flag: Flag) -> FrameResult:
    return FrameResult(replace(row, flags=flags_to_text(flag)))


def _within(edges: Edges, cut: Cut, looks: Looks) -> Edges:
    """Edges between apex and connector only."""
    end = looks.ends.connector_px
    inside = cut.silhouette.bundle & (cut.s_px < (end - 1.0 if np.isfinite(end) else np.inf))
    return Edges(
        edges.s_px,
        edges.upper_px,
        edges.lower_px,
        np.where(inside, edges.upper_weight, 0.0),
        np.where(inside, edges.lower_weight, 0.0),
    )


def _apex(cut: Cut, looks: Looks) -> float:
    """s (px) where the legs meet; NaN when the bundle starts at the strip's end or plate."""
    first = cut.silhouette.apex_column
    if not np.isfinite(first):
        return NAN
    s = float(cut.s_px[int(first)])
    plate = looks.ends.plate_px
    seen = first > 3 and not (np.isfinite(plate) and s < plate + 0.3 * looks.diameter_px)
    return s if seen else NAN


def expected_rate(looks: Looks, turns: float, start_px: float) -> float:
    """Rate of strands and coiling together (rad/px) that the motor's turns lead one to expect
    between the apex at `start_px` and the connector; the two legs hold a quarter turn."""
    end = looks.ends.connector_px
    if not np.isfinite(end) and looks.zero_known:
        end = looks.zero_px + looks.zone_px
    if not (np.isfinite(turns) and np.isfinite(end)) or end <= start_px:
        return NAN
    return 2.0 * np.pi * max(abs(turns) - 0.25, 0.0) / (end - start_px)


def _fits(
    edges: Edges, looks: Looks, turns: float, warm: Warm, apex_px: float
) -> tuple[BundleFit | None, BundleFit | None]:
    """Fits beside the separator and in mid-span.

    A straight bundle is fitted from 0.6 D after the apex on; coiling takes 2.4 D to reach its full
    radius, and starting earlier costs 2-6 % of pitch.
    """
    d = looks.diameter_px
    known = np.flatnonzero((edges.upper_weight > 0) & (edges.lower_weight > 0))
    if known.size < 1.5 * d:
        return None, None
    first, last = float(edges.s_px[known[0]]), float(edges.s_px[known[-1]]) - 0.3 * d
    start = apex_px if np.isfinite(apex_px) else first
    skip = 1.0 if np.isfinite(apex_px) else 0.25
    rate = expected_rate(looks, turns, start)
    beyond = edges.window(min(start + 2.4 * d * skip, last - 4.0 * d), start + 10.0 * d)
    swings = swing_px(beyond) > 0.03 * d
    near: BundleFit | None = None
    if not swings:
        low = start + 0.6 * d * skip
        near = fit_window(
            edges, looks.section, low, min(low + 7.0 * d, last), d, rate, warm.near, coil=False
        )
        if near is not None and near.fit.cost < 0.5:
            high = min(start + max(2.0 * near.fit.pitch_px, 4.0 * d), last)
            if abs(high - near.s_high_px) > 0.5 * d and high - low > 2.0 * d:
                again = fit_window(edges, looks.section, low, high, d, rate, near, coil=False)
                near = again or near
    poor = near is None or near.fit.cost > 0.3
    if swings or poor:
        low = min(start + 2.4 * d * skip, max(last - 7.0 * d, start + 0.6 * d * skip))
        low, high = even_stretches(edges, low, last, d)[0]
        coiled = fit_window(edges, looks.section, low, min(low + 8.0 * d, high), d, rate, warm.near)
        if near is None or (coiled is not None and coiled.fit.cost < 0.9 * near.fit.cost):
            near = coiled or near
    mid = None
    middle = 0.5 * (first + last)
    if last - first > 12.0 * d:
        pitch = near.fit.pitch_px if near is not None else 2.0 * d
        span = max(3.5 * d, min(pitch, 0.25 * (last - first)))
        stretches = even_stretches(edges, start + 2.4 * d * skip, last, d)
        low, high = min(stretches, key=lambda w: max(w[0] - middle, middle - w[1], 0.0))
        centre = float(np.clip(middle, low + span, max(high - span, low + span)))
        low, high = max(low, centre - span), min(high, centre + span)
        mid = fit_window(edges, looks.section, low, high, d, rate, warm.mid or near)
    return near, mid


def _bundle_values(
    row: FrameRow,
    flags: Flag,
    near: BundleFit | None,
    mid: BundleFit | None,
    edges: Edges,
    cut: Cut,
    looks: Looks,
) -> tuple[FrameRow, Flag]:
    scale = looks.scale.mm_per_px
    good = near is not None and near.fit.rms_px < max(0.9, 0.05 * looks.diameter_px)
    if near is None or not good:
        flags |= Flag.ENVELOPE_ONLY | Flag.NO_PITCH
        width = _envelope_diameter(edges)
        return replace(
            row,
            diameter_px=width,
            diameter_px_sd=0.04 * width,
            diameter_mm=width * scale,
            diameter_mm_sd=0.04 * width * scale,
        ), flags
    fit = near.fit
    (d, pitch, tan_beta), _ = fit.derived()
    d_sd = diameter_sd_px(fit, looks.shading)
    p_sd = pitch_sd_px(fit)
    beta = float(np.arctan(tan_beta))
    section = looks.section
    outer = section.radius_d.max() / (0.5 * section.diameter_d)
    lay = float(np.arctan(tan_beta * outer))
    relative_scale = looks.scale.mm_per_px_sd / scale if scale == scale else NAN
    d_mm_sd = float(np.hypot(d_sd * scale, d * scale * relative_scale))
    p_mm_sd = float(np.hypot(p_sd * scale, pitch * scale * relative_scale))
    beta_sd = angle_sd(d, d_sd, pitch, p_sd)
    if (near.s_high_px - near.s_low_px) < 0.9 * pitch:
        flags |= Flag.FEW_LOBES
    row = replace(
        row,
        diameter_px=d,
        diameter_px_sd=d_sd,
        diameter_mm=d * scale,
        diameter_mm_sd=d_mm_sd,
        pitch_px=pitch,
        pitch_px_sd=p_sd,
        pitch_mm=pitch * scale,
        pitch_mm_sd=p_mm_sd,
        strand_repeat_px=_strand_repeat(fit),
        helix_angle_rad=beta,
        helix_angle_rad_sd=beta_sd,
        lay_angle_rad=lay,
        lay_angle_rad_sd=beta_sd * outer,
        coil_amplitude_mm=float(fit.p[RC]) * scale,
        coil_pitch_mm=float(2 * np.pi / fit.p[KC]) * scale if fit.coiled else NAN,
        fit_rms_px=fit.rms_px,
    )
    if mid is not None and mid.fit.rms_px < max(0.9, 0.05 * looks.diameter_px):
        (md, _, mt), _ = mid.fit.derived()
        row = replace(
            row,
            midspan_diameter_mm=md * scale,
            midspan_diameter_mm_sd=float(
                np.hypot(
                    diameter_sd_px(mid.fit, looks.shading) * scale, md * scale * relative_scale
                )
            ),
            midspan_helix_angle_rad=float(np.arctan(mt)),
        )
    return row, flags


def _strand_repeat(fit) -> float:
    """Distance along the axis between neighbouring outer strands where they cross it, px."""
    outer = int((fit.section.radius_d > fit.section.radius_d.max() - 1e-6).sum())
    rate = fit.p[K] + (fit.p[KC] if fit.coiled else 0.0)
    return float(2 * np.pi / rate / max(outer, 1))


def _envelope_diameter(edges: Edges) -> float:
    """Outermost upper minus outermost lower edge over the first stretch: what a caliper reads."""
    known = (edges.upper_weight > 0.2) & (edges.lower_weight > 0.2)
    if known.sum() < 10:
        return NAN
    return float(np.percentile(edges.upper_px[known], 95) - np.percentile(edges.lower_px[known], 5))


def _handedness(
    cut: Cut, edges: Edges, looks: Looks, warm: Warm
) -> tuple[tuple[str, float], float]:
    known = (edges.upper_weight > 0) & (edges.lower_weight > 0)
    if known.sum() < looks.diameter_px:
        return ("", NAN), warm.slope_sum
    s = np.arange(known.size)
    index = np.flatnonzero(known)
    first, last = index[0], index[-1] + 1
    centre = np.interp(s, index, 0.5 * (edges.upper_px + edges.lower_px)[index])[first:last]
    slope = ridge_slope(cut.light[:, first:last], centre + cut.half_px, 0.25 * looks.diameter_px)
    # One frame may be unsure; the sense of twist cannot change between frames of one recording.
    pooled = warm.slope_sum + slope
    decided = slope if abs(slope) > 0.08 or abs(pooled) < abs(slope) else pooled
    if abs(decided) < 0.01:
        return ("", 0.5), pooled
    return (handedness_of(decided), float(1.0 - 0.5 * np.exp(-abs(pooled) / 0.05))), pooled


def _centre_line(edges: Edges) -> np.ndarray:
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


def _two_fold(looks: Looks) -> bool:
    """Whether the bundle's section is symmetric: every even number of strings."""
    return looks.strand_count % 2 == 0


def _envelope_values(
    row: FrameRow,
    edges: Edges,
    cut: Cut,
    looks: Looks,
    near: BundleFit | None,
    mid: BundleFit | None,
    apex_px: float,
):
    scale = looks.scale.mm_per_px
    unit = scale if np.isfinite(scale) else 1.0
    known = (edges.upper_weight > 0.1) | (edges.lower_weight > 0.1)
    if np.isfinite(apex_px):
        known &= edges.s_px > apex_px + 0.5 * looks.diameter_px
    line = _centre_line(edges)
    upper = np.where(edges.upper_weight > 0.1, edges.upper_px - line, NAN)
    lower = np.where(edges.lower_weight > 0.1, edges.lower_px - line, NAN)
    fit = next((f.fit for f in (near, mid) if f is not None and f.fit.coiled), None)
    fit = fit or (near.fit if near is not None else None)
    if fit is None:
        period = looks.diameter_px
    elif fit.coiled:
        period = 1.1 * 2 * np.pi / fit.p[KC]
    else:
        period = 0.6 * fit.pitch_px
    period = float(np.clip(period, 0.8 * looks.diameter_px, 6.0 * looks.diameter_px))
    diameter = row.diameter_px if np.isfinite(row.diameter_px) else looks.diameter_px
    swing, coil_period = middle_swing(np.nan_to_num(upper), np.nan_to_num(lower), diameter)
    if np.isfinite(coil_period):
        period = max(period, 2.2 * coil_period)
    if _two_fold(looks):
        row = replace(row, coil_amplitude_mm=float(np.fmax(row.coil_amplitude_mm, swing * scale)))
    envelope = envelope_px(np.nan_to_num(upper), np.nan_to_num(lower), known, period, diameter)
    base = baseline_px(envelope)
    s_mm = (edges.s_px - looks.zero_px) * scale
    place = looks.sight.axis.at(edges.s_px)
    sd = row.diameter_px_sd if np.isfinite(row.diameter_px_sd) else 0.05 * diameter
    # A knot coils more tightly than the bundle beside it: closed over the bundle's own period two
    # knots that lie near each other would run together.
    tight = envelope_px(
        np.nan_to_num(upper),
        np.nan_to_num(lower),
        known,
        max(0.5 * period, 1.2 * diameter),
        diameter,
    )
    knots = (
        find_knots(
            (edges.s_px - looks.zero_px) * unit,
            tight * unit,
            diameter * unit,
            base * unit,
            place,
            period * unit,
            sd * unit,
        )
        if np.isfinite(base)
        else []
    )
    row = replace(
        row,
        unevenness=unevenness_of(envelope),
        baseline_envelope_mm=base * scale,
        max_envelope_mm=float(np.nanmax(envelope)) * scale if np.isfinite(base) else NAN,
        knot_count=float(len(knots)),
    )
    keep = np.isfinite(envelope)
    profile = Profile(
        s_mm=s_mm[keep],
        s_px=edges.s_px[keep] - looks.zero_px,  # from the separator, as s_mm
        upper_px=edges.upper_px[keep],
        lower_px=edges.lower_px[keep],
        width_mm=((edges.upper_px - edges.lower_px) * scale)[keep],
        envelope_mm=(envelope * scale)[keep],
    )
    return row, profile, knots


def _budgets(
    row: FrameRow,
    looks: Looks,
    near: BundleFit | None,
    mid: BundleFit | None,
    apex_px: float,
    edges: Edges,
) -> FrameRow:
    """Turns and string length seen, from the rates beside the separator and in mid-span."""
    known = np.flatnonzero((edges.upper_weight > 0) & (edges.lower_weight > 0))
    end = looks.ends.connector_px
    if known.size < 10 or not np.isfinite(apex_px) or not np.isfinite(end):
        return row
    fits = [f.fit for f in (near, mid) if f is not None]
    if not fits:
        return row
    length = end - apex_px
    rates = [(f.p[K] + (f.p[KC] if f.coiled else 0.0)) / (2 * np.pi) for f in fits]
    turns_seen = 0.25 + float(np.mean(rates)) * length
    sd = 0.01 * turns_seen + float(np.ptp(rates)) * length / 2
    scale = looks.scale.mm_per_px
    a = [np.sqrt(np.mean((2 * f.p[0] * f.section.radius_d) ** 2)) for f in fits]
    stretch = [
        f.stretch * np.sqrt(1.0 + (2 * np.pi * ai / f.pitch_px) ** 2)
        for f, ai in zip(fits, a, strict=True)
    ]
    leg = NAN
    row = replace(
        row,
        turns_seen=turns_seen,
        turns_seen_sd=sd,
        turn_budget_error=(turns_seen - abs(row.turns)) if np.isfinite(row.turns) else NAN,
        apex_mm=(apex_px - looks.zero_px) * scale,
        apex_x_px=float(looks.sight.axis.at(np.array(apex_px))[0]),
        apex_y_px=float(looks.sight.axis.at(np.array(apex_px))[1]),
    )
    apex_mm = row.apex_mm
    if np.isfinite(apex_mm) and looks.zero_known:
        leg = float(np.hypot(apex_mm, _half_gap_mm(looks)))
        bundle = float(np.mean(stretch)) * length * scale
        row = replace(
            row,
            string_length_mm=leg + bundle,
            string_length_mm_sd=0.01 * bundle + float(np.ptp(stretch)) * length * scale / 2,
        )
    return row


def _half_gap_mm(looks: Looks) -> float:
    return 0.5 * looks.hole_distance_mm
