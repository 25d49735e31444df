"""Cords that hang or bow: the same frame results, along a curved axis.

learn what stands still (curve, scale) → per picture: rope (any make), and the helix along the
curve where N is known → the row. The helix counts where it agrees with what the rope shows by
itself; else the envelope and the stripes stand, flagged.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tsvision.flags import Flag, flags_from_text, flags_to_text
from tsvision.images.curve import Curve, find_curve
from tsvision.images.sight import Sight
from tsvision.measures.alone import is_described
from tsvision.measures.cords.rope import Rope, measure_rope
from tsvision.measures.frame import Warm, measure_frame
from tsvision.measures.helix.uncertainty import angle_sd
from tsvision.measures.looks import Looks, learn_looks, possible_px, sight_of
from tsvision.measures.scale import needs_curve, scale_from_length
from tsvision.measures.zone.envelope import baseline_px, unevenness_of
from tsvision.measures.zone.knots import find_knots, in_mm
from tsvision.records import Frame, FrameResult, FrameRow, KnotSighting, Profile, Rig, Scale

NAN = float("nan")
FUZZY = 0.1  # share of columns with hairs from which the frame is flagged
AGREE = 0.12  # relative difference of D and strand repeat between helix and rope
TOLD = 0.9  # confidence from which a number of strands is as good as given
GUESSED_RMS = 0.015  # of D: how well an outline must follow a section that nobody told
OF_BUNDLE = 0.6  # of the diameter of twisted strands: none is as wide
END_DIAMETERS = 1.5  # knots are not sought so near to a cord's ends
BANDED = 0.4  # slope of coarse bands from which they tell the bundle's sense
SURE = 0.3  # confidence of the stripes below which they tell nothing


@dataclass(frozen=True)
class Bowed:
    """What stays the same: the curve and the sight along it, scale, N when given, and the helix'
    looks where a helix may be tried."""

    curve: Curve
    sight: Sight
    scale: Scale
    count: int | None
    looks: Looks | None


def learn_bowed(
    pictures: list[np.ndarray], looks: Looks | None, rig: Rig, scale: Scale
) -> tuple[Bowed | None, Looks | None]:
    """(Bowed, looks) from some pictures of one size.

    Bowed is None where the rig states the axis and for a taut bundle of known N or with its legs
    in view, whose looks come back as they are, but for a scale taken from its length. The curve is
    also used where the straight search followed a shadow beside coloured strings.
    """
    if rig.view.axis_px:
        return None, looks
    sight = looks.sight if looks is not None else sight_of(pictures, rig, scale)
    if sight is None:
        return None, looks
    few = [pictures[i] for i in sorted({len(pictures) * k // 4 for k in (1, 2, 3)})]
    count, by_length = rig.strings.count, needs_curve(rig)
    told = count is not None or (looks is not None and looks.strand_count_confidence > TOLD)
    taut = count is not None and not by_length
    if taut and looks is not None and _held(looks, len(pictures)):
        return None, looks
    curve = find_curve(few, sight, rig.view.roi_px, closely=not taut)
    least_px, most_px = possible_px(rig, scale)
    if curve is None or not least_px <= curve.width_px <= most_px:
        return None, looks
    if told and not by_length and looks is not None and _is_strand(curve, looks, pictures[0]):
        return None, looks
    if by_length:
        scale = scale_from_length(rig, curve.end_px - curve.start_px, curve.width_px)
    # A straight search may follow the shadow beside coloured strings, never a bundle with legs.
    astray = curve.ground is not None and not (curve.alike or curve.legs)
    if not curve.bowed and looks is not None:
        if by_length:
            looks = learn_looks(pictures, rig, scale)
        if curve.legs or (told and not astray):
            return None, looks
    sight = curve.sight
    if curve.bowed or astray:
        sight = _along(sight, curve)
        # A section that nobody told is not guessed at along a curve.
        looks = learn_looks(pictures, rig, scale, sight) if count is not None else None
    return Bowed(curve, sight, scale, count, looks), looks


def _held(looks: Looks, pictures: int) -> bool:
    """Whether a separator, legs or a connector are in view, or a film was taken: then the strings
    are under load and the axis is straight, whatever its coils and knots look like."""
    ends = looks.ends
    hardware = looks.sight.legs_seen or np.isfinite(ends.plate_px) or np.isfinite(ends.connector_px)
    return bool(hardware or pictures >= 4)


def _is_strand(curve: Curve, looks: Looks, picture: np.ndarray) -> bool:
    """Whether a curve winds along one strand of a straight bundle that a helix describes."""
    return curve.width_px < OF_BUNDLE * looks.diameter_px and is_described(looks, picture)


def _along(sight: Sight, curve: Curve) -> Sight:
    return replace(
        sight,
        axis=curve.axis,
        width_px=curve.width_px,
        start_px=curve.start_px + 2.0,  # whole columns of the picture only
        end_px=curve.end_px - 2.0,
        connector_px=NAN,
        legs_seen=False,
    )


def measure_bowed(frame: Frame, bowed: Bowed, turns: float, warm: Warm) -> tuple[FrameResult, Warm]:
    """Measure one decoded picture of the size that `bowed` was learnt on."""
    assert frame.pixels is not None
    rope = measure_rope(frame.pixels, bowed.curve, bowed.sight, bowed.count)
    if rope is None:
        flags = Flag.NO_BUNDLE | _not_known(bowed, turns)
        return FrameResult(replace(_known(frame, bowed, turns), flags=flags_to_text(flags))), warm
    if bowed.looks is not None:
        result, warm = measure_frame(frame, bowed.looks, turns, warm)
        if _agrees(result.row, rope, bowed.count is not None):
            flags = flags_from_text(result.row.flags) | _curved(bowed)
            return replace(result, row=replace(result.row, flags=flags_to_text(flags))), warm
    return _rope_result(frame, bowed, turns, rope), warm


def _curved(bowed: Bowed) -> Flag:
    return Flag.CURVED_AXIS if bowed.curve.bowed else Flag(0)


def _not_known(bowed: Bowed, turns: float) -> Flag:
    """What a rope lacks in every picture, and this frame's turns."""
    flags = _curved(bowed) | Flag.NO_SEPARATOR
    if not np.isfinite(bowed.scale.mm_per_px):
        flags |= Flag.NO_SCALE
    if not np.isfinite(turns):
        flags |= Flag.NO_TURNS
    return flags


def _agrees(row: FrameRow, rope: Rope, count_known: bool) -> bool:
    """Whether the helix found what the rope shows without any model of its section; where N is a
    guess, the outline must also follow that section closely, and tell D as well as without."""
    close = row.fit_rms_px < GUESSED_RMS * row.diameter_px
    if not count_known and not (close and row.diameter_px_sd < rope.diameter_px_sd):
        return False
    if Flag.ENVELOPE_ONLY in flags_from_text(row.flags) or not np.isfinite(row.strand_repeat_px):
        return False
    if abs(row.diameter_px / rope.diameter_px - 1.0) > AGREE:
        return False
    if rope.stripes is None or rope.stripes.confidence < SURE:
        return True
    return abs(row.strand_repeat_px / rope.stripes.repeat_px - 1.0) < AGREE


def _rope_result(frame: Frame, bowed: Bowed, turns: float, rope: Rope) -> FrameResult:
    flags = Flag.ENVELOPE_ONLY | _not_known(bowed, turns)
    if rope.fuzzy > FUZZY:
        flags |= Flag.FIBRES
    row = _lengths(_known(frame, bowed, turns), bowed, rope)
    row = _stripes(row, bowed, rope)
    if not row.handedness:
        flags |= Flag.NO_HANDEDNESS
    if not np.isfinite(row.pitch_px):
        flags |= Flag.NO_PITCH
    knots = _knots(bowed, rope)
    sought = np.isfinite(row.baseline_envelope_px)  # else nowhere is there enough to look at
    count = float(len(knots)) if sought else NAN
    row = replace(row, knot_count=count, flags=flags_to_text(flags))
    return FrameResult(row, _profile(bowed, rope), tuple(knots))


def _known(frame: Frame, bowed: Bowed, turns: float) -> FrameRow:
    curve = bowed.curve
    (x0, y0), (x1, y1) = curve.axis.at(np.array([curve.start_px, curve.end_px]))
    return FrameRow(
        frame=frame.index,
        file=frame.file,
        turns=turns,
        mm_per_px=bowed.scale.mm_per_px,
        mm_per_px_sd=bowed.scale.mm_per_px_sd,
        axis_x0_px=float(x0),
        axis_y0_px=float(y0),
        axis_x1_px=float(x1),
        axis_y1_px=float(y1),
        strand_count=NAN if bowed.count is None else float(bowed.count),
        strand_count_confidence=NAN if bowed.count is None else 1.0,
    )


def _lengths(row: FrameRow, bowed: Bowed, rope: Rope) -> FrameRow:
    """Diameter, its evenness, and the cord's middle third."""
    mm, mm_sd = bowed.scale.mm_per_px, bowed.scale.mm_per_px_sd
    d, d_sd = rope.diameter_px, rope.diameter_px_sd
    third = rope.envelope_px.size // 3
    middle = rope.envelope_px[third : 2 * third]
    mid = float(np.nanmedian(middle)) if np.isfinite(middle).any() else NAN
    known = rope.envelope_px[np.isfinite(rope.envelope_px)]
    return replace(
        row,
        diameter_px=d,
        diameter_px_sd=d_sd,
        diameter_mm=d * mm,
        diameter_mm_sd=float(np.hypot(d_sd * mm, d * mm_sd)),
        midspan_diameter_mm=mid * mm,
        midspan_diameter_mm_sd=float(np.hypot(d_sd * mm, mid * mm_sd)),
        unevenness=unevenness_of(rope.envelope_px),
        baseline_envelope_px=baseline_px(rope.envelope_px),
        baseline_envelope_mm=baseline_px(rope.envelope_px) * mm,
        max_envelope_px=float(known.max()),
        max_envelope_mm=float(known.max()) * mm,
    )


def _stripes(row: FrameRow, bowed: Bowed, rope: Rope) -> FrameRow:
    """Strand repeat, sense, and where N is known the pitch and helix angle that follow."""
    stripes = rope.stripes
    if stripes is None or stripes.confidence < SURE:
        return row
    if abs(rope.coarse) > BANDED and rope.coarse * stripes.slope < 0.0:
        # The stripes are those of plied strands; of the bundle only the sense is seen.
        sense = "Z" if rope.coarse > 0 else "S"
        confidence = 0.5 + 0.5 * abs(rope.coarse)
        return replace(row, handedness=sense, handedness_confidence=confidence)
    row = replace(
        row,
        strand_repeat_px=stripes.repeat_px,
        handedness="Z" if stripes.slope > 0 else "S",
        handedness_confidence=0.5 + 0.5 * stripes.confidence,
    )
    if bowed.count is None:
        return row
    pitch, sd = stripes.repeat_px * bowed.count, stripes.repeat_px_sd * bowed.count
    mm, mm_sd = bowed.scale.mm_per_px, bowed.scale.mm_per_px_sd
    return replace(
        row,
        pitch_px=pitch,
        pitch_px_sd=sd,
        pitch_mm=pitch * mm,
        pitch_mm_sd=float(np.hypot(sd * mm, pitch * mm_sd)),
        helix_angle_rad=float(np.arctan(np.pi * rope.diameter_px / pitch)),
        helix_angle_rad_sd=angle_sd(rope.diameter_px, rope.diameter_px_sd, pitch, sd),
    )


def _knots(bowed: Bowed, rope: Rope) -> list[KnotSighting]:
    base = baseline_px(rope.envelope_px)
    if not np.isfinite(base):
        return []
    found = find_knots(
        rope.s_px - bowed.curve.start_px,
        rope.envelope_px,
        rope.diameter_px,
        base,
        bowed.curve.axis.at(rope.s_px),
        rope.diameter_px_sd,
    )
    # Frayed ends and parted plies are wide without being knots.
    length = bowed.curve.end_px - bowed.curve.start_px
    clear = END_DIAMETERS * rope.diameter_px
    mm = bowed.scale.mm_per_px
    return [
        in_mm(k, k.centre_px * mm, mm)
        for k in found
        if clear < k.ends_px[0] and k.ends_px[1] < length - clear
    ]


def _profile(bowed: Bowed, rope: Rope) -> Profile:
    keep = np.isfinite(rope.envelope_px)
    mm = bowed.scale.mm_per_px
    s = rope.s_px[keep] - bowed.curve.start_px
    x, y = bowed.curve.axis.at(rope.s_px[keep]).T
    used = rope.weight > 0.0  # elsewhere what was found is no edge of the rope
    upper, lower = (np.where(used, edge, NAN) for edge in (rope.upper_px, rope.lower_px))
    return Profile(
        s_mm=s * mm,
        s_px=s,
        upper_px=upper[keep],
        lower_px=lower[keep],
        width_mm=(upper - lower)[keep] * mm,
        envelope_mm=rope.envelope_px[keep] * mm,
        axis_x_px=x,
        axis_y_px=y,
    )
