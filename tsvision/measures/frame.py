"""One frame in, one row out.

cut the strip → edges → helix beside the separator and in mid-span → envelope, knots → row.
Whatever cannot be measured stays NaN and a flag says why.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tsvision.flags import Flag, flags_to_text
from tsvision.measures.edges.cut import BURNT_OUT, cut_frame
from tsvision.measures.edges.edges import Edges
from tsvision.measures.edges.find import find_edges
from tsvision.measures.edges.unmatched import with_outline
from tsvision.measures.ends.legs import apex_from_legs
from tsvision.measures.helix.bundle import BundleFit, is_aslant
from tsvision.measures.helix.silhouette import KC, RHO, passing
from tsvision.measures.helix.uncertainty import (
    angle_sd,
    diameter_sd_px,
    diameter_sources,
    pitch_sd_px,
    rests_on_shape,
)
from tsvision.measures.helix.untwisted import is_leg, is_smooth
from tsvision.measures.helix.weigh import unsure
from tsvision.measures.light.blur import shading_of
from tsvision.measures.looks import Looks
from tsvision.measures.scale import HOLES
from tsvision.measures.sense import NO_RIDGES, UNKNOWN, Ridges, Sense, sense_by_others, sense_of
from tsvision.measures.zone.along import along_sd_share, scale_is_local
from tsvision.measures.zone.budgets import add_budgets, connector_px
from tsvision.measures.zone.doubts import (
    clipped,
    edges_poor,
    knots_unsure,
    less_sure_of_pitch,
    stands_alone,
    turns_disagree,
    without_pitch,
)
from tsvision.measures.zone.fits import (
    apex_of,
    as_uneven,
    best_known,
    fit_bundle,
    within_zone,
)
from tsvision.measures.zone.outline import add_outline
from tsvision.measures.zone.width import width_between_knots, width_sd_px
from tsvision.records import Frame, FrameResult, FrameRow

NAN = float("nan")
NO_WIDTH = 0.25  # of D: what is less sure than that is no measurement of it
NO_TWIST = 0.5  # of the pitch: strands that may as well not turn at all have none
LEGS_TURNS = 0.25  # turns that the legs hold between holes and apex: below, nothing is twisted


@dataclass(frozen=True)
class Warm:
    """What the next frame may start from."""

    near: BundleFit | None = None
    mid: BundleFit | None = None
    best: BundleFit | None = None
    ridges: Ridges = NO_RIDGES


def measure_frame(frame: Frame, looks: Looks, turns: float, warm: Warm) -> tuple[FrameResult, Warm]:
    """Measure one decoded picture of the size that `looks` were learnt on."""
    flags = _not_known(looks, turns)
    row = _known(frame, looks, turns)
    assert frame.pixels is not None
    if abs(turns) < LEGS_TURNS:
        return _failed(row, flags | Flag.TOO_FEW_TURNS), warm
    strand_px = looks.diameter_px / looks.section.diameter_d
    cut = cut_frame(frame.pixels, looks.sight, strand_px, looks.half_px)
    # Before the legs have met in view there is nothing on the axis but ground.
    if cut is None or cut.silhouette.bundle.sum() < 1.5 * looks.diameter_px:
        few = np.isfinite(turns) and abs(turns) < 3
        sense = UNKNOWN if cut is None else sense_by_others(looks, turns, warm.ridges)
        lacking = Flag.TOO_FEW_TURNS if few else Flag.NO_BUNDLE
        return _failed(row, flags | lacking, sense), warm
    # Of a picture that is decoded as luma alone no channel shows that it was full.
    luma_alone = frame.pixels.ndim == 2
    if max(cut.saturated, looks.saturated if luma_alone else 0.0) > BURNT_OUT:
        flags |= Flag.OVEREXPOSED
    if cut.silhouette.cut.any():
        flags |= Flag.FIBRES
    found = find_edges(cut, looks.shading)
    edges = within_zone(found, cut, looks)
    apex_px = apex_of(cut, looks)
    near, mid = fit_bundle(edges, looks, turns, apex_px, warm.near, warm.mid, warm.best)
    if near is not None and not looks.steady:
        looks = replace(looks, shading=shading_of(cut, near, looks.shading))
        found = find_edges(cut, looks.shading)
        edges = within_zone(found, cut, looks)
        near, mid = fit_bundle(edges, looks, turns, apex_px, near, mid, warm.best)
        row = replace(row, blur_px=looks.shading[0].blur_px)
    smooth = False
    if near is not None:
        aslant = is_aslant(near.fit)
        smooth = not aslant and is_smooth(edges, near)
        if aslant or (smooth and is_leg(edges, near, looks.possible_px[0])):
            sense = sense_by_others(looks, turns, warm.ridges)
            return _failed(row, flags | Flag.NO_BUNDLE, sense), warm
    if smooth:
        near, mid, flags = None, None, flags | Flag.TOO_FEW_TURNS
    best = best_known(warm.best, near, mid)
    after = near or warm.near, mid or warm.mid
    near, mid = (as_uneven(edges, found, warm.best) for found in (near, mid))
    row, flags = _bundle_values(row, flags, near, mid, edges, looks)
    sense, ridges = sense_of(cut, edges, looks, turns, warm.ridges)
    if not sense.handedness:
        flags |= Flag.NO_HANDEDNESS
    outer = within_zone(with_outline(found, cut), cut, looks)
    outlined = add_outline(row, outer, looks, near, mid, apex_px)
    meet_px = NAN
    if looks.face is not None:
        meet_px = apex_from_legs(frame.pixels, cut, looks.sight, looks.face, looks.ends.plate_px)
    meet_px = meet_px if np.isfinite(meet_px) else apex_px
    row = add_budgets(
        outlined.row, looks, near, mid, meet_px, outer, outlined.knot_ends_px, outlined.tight
    )
    if edges_poor(edges) or stands_alone(edges, looks.ends.plate_px):
        flags |= Flag.EDGE_POOR
    if turns_disagree(row, near):
        flags |= Flag.TURNS_DISAGREE
        row = less_sure_of_pitch(row, near)
        # Of a coil it is the turns that may be lost, in knots not least.
        if near is not None and not near.fit.coiled and row.pitch_px_sd >= NO_TWIST * row.pitch_px:
            row, flags = without_pitch(row), flags | Flag.NO_PITCH
    if not np.isfinite(meet_px):
        flags |= Flag.NO_APEX
    if knots_unsure(outlined.knots):
        flags |= Flag.KNOT_UNSURE
    if clipped(outer, looks.sight.axis, frame.pixels.shape, looks.diameter_px):
        flags |= Flag.CLIPPED
    row = replace(
        row,
        handedness=sense.handedness,
        handedness_confidence=sense.confidence,
        flags=flags_to_text(flags),
    )
    result = FrameResult(row, outlined.profile, outlined.knots, outlined.lobes)
    return result, Warm(*after, best, ridges)


def _known(frame: Frame, looks: Looks, turns: float) -> FrameRow:
    axis = looks.sight.axis
    gap_mm, gap_mm_sd = _gap_mm(looks)
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
        hole_distance_mm=gap_mm,
        hole_distance_mm_sd=gap_mm_sd,
        strand_count=float(looks.strand_count),
        strand_count_confidence=looks.strand_count_confidence,
        blur_px=looks.shading[0].blur_px,
    )


def _not_known(looks: Looks, turns: float) -> Flag:
    """What the whole recording lacks, and this frame's turns."""
    lacking = {
        Flag.NO_SEPARATOR: not looks.zero_known,
        Flag.NO_CONNECTOR: not np.isfinite(connector_px(looks)),
        Flag.NO_SCALE: not np.isfinite(looks.scale.mm_per_px),
        Flag.SCALE_LOCAL: scale_is_local(looks),
        Flag.NO_TURNS: not np.isfinite(turns),
        Flag.STRAND_COUNT_GUESSED: not looks.strand_count_given,
    }
    flags = Flag(0)
    for flag, is_so in lacking.items():
        flags |= flag if is_so else Flag(0)
    return flags


def _gap_mm(looks: Looks) -> tuple[float, float]:
    """S as the legs of the recording tell it, with its uncertainty and the scale's; mm. Where the
    scale is S as stated over the same legs they tell nothing of it."""
    scale = looks.scale
    if looks.gap is None or not np.isfinite(scale.mm_per_px) or scale.source == HOLES:
        return NAN, NAN
    gap_mm = 2.0 * looks.gap.half_px * scale.mm_per_px
    relative = np.hypot(looks.gap.sd_px / looks.gap.half_px, scale.mm_per_px_sd / scale.mm_per_px)
    return gap_mm, gap_mm * float(relative)


def _failed(row: FrameRow, flags: Flag, sense: Sense = UNKNOWN) -> FrameResult:
    return FrameResult(
        replace(
            row,
            handedness=sense.handedness,
            handedness_confidence=sense.confidence,
            flags=flags_to_text(flags),
        )
    )


def _bundle_values(
    row: FrameRow,
    flags: Flag,
    near: BundleFit | None,
    mid: BundleFit | None,
    edges: Edges,
    looks: Looks,
) -> tuple[FrameRow, Flag]:
    scale = looks.scale.mm_per_px
    if near is not None and near.lobes_seen < 1.0:
        # Less than one swell of the outline is that of many bundles, thick and thin.
        return row, flags | Flag.FEW_LOBES | Flag.NO_PITCH
    if near is None or not _tells(near, looks):
        flags |= Flag.ENVELOPE_ONLY | Flag.NO_PITCH
        width = width_between_knots(edges, looks.diameter_px)
        width = width if _is_possible(width, looks) else NAN
        sd = width_sd_px(edges, width, looks.diameter_px)
        return replace(
            row,
            diameter_px=width,
            diameter_px_sd=sd,
            diameter_mm=width * scale,
            diameter_mm_sd=sd * scale,
        ), flags
    fit = near.fit
    (d, pitch, tan_beta), _ = fit.derived
    sources = diameter_sources(fit, looks.shading)
    d_sd = sources.total_px
    p_sd = pitch_sd_px(fit, looks.shading[0].blur_px)
    beta = float(np.arctan(tan_beta))
    if unsure(fit):
        flags |= Flag.COIL_UNSURE
    if fit.uneven:
        flags |= Flag.COIL_UNEVEN
    if rests_on_shape(looks.shading, d):
        flags |= Flag.LIMB_UNSEEN
    outer = 1.0 - 2.0 * float(fit.p[RHO]) / d  # a strand's centre, of the bundle's radius
    lay = float(np.arctan(tan_beta * outer))
    relative_scale = looks.scale.mm_per_px_sd / scale if scale == scale else NAN
    d_mm_sd = float(np.hypot(d_sd * scale, d * scale * relative_scale))
    p_mm_sd = float(np.hypot(p_sd * scale, pitch * scale * along_sd_share(looks)))
    beta_sd = angle_sd(d, d_sd, pitch, p_sd)
    if near.shows_few_lobes:
        flags |= Flag.FEW_LOBES
    values = {
        "diameter_px": d,
        "diameter_px_sd": d_sd,
        "diameter_mm": d * scale,
        "diameter_mm_sd": d_mm_sd,
        "fit_rms_px": fit.rms_px,
        "diameter_px_sd_noise": sources.noise_px,
        "diameter_px_sd_light": sources.light_px,
        "diameter_px_sd_blur": sources.blur_px,
        "diameter_px_sd_section": sources.section_px,
    }
    if p_sd < NO_TWIST * pitch:
        values |= {
            "pitch_px": pitch,
            "pitch_px_sd": p_sd,
            "pitch_mm": pitch * scale,
            "pitch_mm_sd": p_mm_sd,
            "strand_repeat_px": _strand_repeat(fit),
            "helix_angle_rad": beta,
            "helix_angle_rad_sd": beta_sd,
            "lay_angle_rad": lay,
            "lay_angle_rad_sd": angle_sd(d * outer, d_sd * outer, pitch, p_sd),
            "coil_pitch_mm": float(2 * np.pi / fit.p[KC]) * scale if fit.coiled else NAN,
        }
    else:
        flags |= Flag.NO_PITCH
    if mid is not None and _describes(mid, looks):
        (md, _, mt), _ = mid.fit.derived
        values |= {
            "midspan_diameter_mm": md * scale,
            "midspan_diameter_mm_sd": float(
                np.hypot(
                    diameter_sd_px(mid.fit, looks.shading) * scale, md * scale * relative_scale
                )
            ),
            "midspan_helix_angle_rad": float(np.arctan(mt)),
        }
    return replace(row, **values), flags


def _describes(found: BundleFit, looks: Looks) -> bool:
    """Whether a fit runs along its edges."""
    return found.fit.rms_px < max(0.9, 0.05 * looks.diameter_px)


def _tells(found: BundleFit, looks: Looks) -> bool:
    """Whether it does, and the edges tell the diameter at all: any wave of noise is some helix."""
    d_px, sd_px = found.fit.diameter_px, diameter_sd_px(found.fit, looks.shading)
    return _describes(found, looks) and sd_px < NO_WIDTH * d_px and _is_possible(d_px, looks)


def _is_possible(width_px: float, looks: Looks) -> bool:
    """Whether a bundle of the stated strands may be so wide."""
    least_px, most_px = looks.possible_px
    return least_px <= width_px <= most_px


def _strand_repeat(fit) -> float:
    """Distance along the axis between neighbouring outer strands where they cross it, px."""
    outer = int((fit.section.radius_d > fit.section.radius_d.max() - 1e-6).sum())
    return float(2 * np.pi / passing(fit.p) / max(outer, 1))
