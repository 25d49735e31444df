"""Turns and string length that one frame shows: what slips or stretches is missing from them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tsvision.measures.edges.edges import Edges
from tsvision.measures.ends.ends import NEAR_SHARE
from tsvision.measures.helix.bundle import BundleFit
from tsvision.measures.helix.fit import HelixFit
from tsvision.measures.helix.followed import follow
from tsvision.measures.helix.weigh import weighed
from tsvision.measures.looks import Looks
from tsvision.measures.zone.along import along_sd_share
from tsvision.measures.zone.envelope import Envelope
from tsvision.measures.zone.laid import expected_along, laid_between
from tsvision.records import FrameRow

NAN = float("nan")
ENDS_SD = 0.12  # turns: what lies between where apex and connector are seen and where they are
# Of more than two strands each leg holds several, side by side: in a blurred picture the middle of
# what is seen of them is not the middle of them.
LEGS_SD = 0.2
RATE_SD = 0.007  # of the turns and the string between them, ...
COIL_RATE_SD = 0.02  # ... and where they coil: the pitch's own share there; of the turns, ...
FOLLOWED_RATE_SD = 0.01  # ... where the coil could be followed all along, ...
UNTOLD_SD = 0.1  # ... and of those where it could not
ENDS_D = 4.0  # from apex and connector, that a coil followed all along may leave untold
LEAST_COST = 0.01  # of a fit: less is noise
KNOT_SD = 0.06  # of the turns and the string that knots hold
UNSEEN_SD = 0.2  # of the turns and the string beyond the view


def add_budgets(
    row: FrameRow,
    looks: Looks,
    near: BundleFit | None,
    mid: BundleFit | None,
    apex_px: float,
    edges: Edges,
    knot_ends_px: tuple[tuple[float, float], ...],
    envelope: Envelope,
) -> FrameRow:
    """The apex, and turns and string length seen from there to the connector, where that is known,
    by the fits beside the separator and in mid-span. knot_ends_px: first and last s of each;
    envelope: E(s) at the edges' s."""
    if not np.isfinite(apex_px):
        return row
    scale = looks.scale.mm_per_px
    apex_mm = (apex_px - looks.zero_px) * scale
    x_px, y_px = looks.sight.axis.at(np.array(apex_px))
    row = replace(row, apex_mm=apex_mm, apex_x_px=float(x_px), apex_y_px=float(y_px))
    known = np.flatnonzero((edges.upper_weight > 0) & (edges.lower_weight > 0))
    end = connector_px(looks)
    if known.size < 10 or not np.isfinite(end):
        return row
    fits = [f for f in (near, mid) if f is not None]
    if not fits:
        return row
    coiled = [f for f in fits if f.fit.coiled]
    # Knots form of coils: what stands out of a bundle that coils nowhere is none, or hardly ever.
    ends = list(knot_ends_px) if coiled else []
    best = min(coiled, key=lambda f: weighed(f.fit, NAN), default=fits[0])
    of_best = expected_along(best, edges, envelope, ends, apex_px, end)
    followed = follow(best, edges, of_best, apex_px, end) if coiled else None
    rate = COIL_RATE_SD if coiled else RATE_SD
    turn_rate = rate
    if followed is not None and followed.unbroken(apex_px, end, ENDS_D * looks.diameter_px):
        # Nothing but the ends is left to what either fit would carry over.
        found = [laid_between(of_best, ends, apex_px, end, followed)] * len(fits)
        turn_rate = FOLLOWED_RATE_SD
    else:
        expected = [
            of_best if f is best else expected_along(f, edges, envelope, ends, apex_px, end)
            for f in fits
        ]
        found = [laid_between(each, ends, apex_px, end, followed) for each in expected]
    turns = [each.turns for each in found]
    # Of two stretches the one that its helix describes better tells more.
    trust = [1.0 / max(weighed(f.fit, NAN), LEAST_COST) ** 2 for f in fits]
    turns_seen = 0.25 + float(np.average(turns, weights=trust))
    held = float(np.mean([each.knot_turns for each in found]))
    apart = float(np.hypot(ENDS_SD, LEGS_SD)) if looks.strand_count > 2 else ENDS_SD
    sd = float(np.hypot(apart, turn_rate * turns_seen) + 0.5 * np.ptp(turns) + KNOT_SD * held)
    if knot_ends_px and not coiled:
        lone = list(knot_ends_px)
        coils = expected_along(best, edges, envelope, lone, apex_px, end)
        sd += 0.5 * abs(0.25 + laid_between(coils, lone, apex_px, end).turns - turns_seen)
    if followed is not None:
        untold = 1.0 - float(followed.told(np.arange(np.ceil(apex_px), end)).mean())
        sd += UNTOLD_SD * untold * turns_seen
    unseen = max(end - looks.sight.end_px, 0.0) / (end - apex_px)
    sd += UNSEEN_SD * unseen * turns_seen
    lay = [_lay(f.fit) for f in fits]
    string = [each.bundle_px * x for each, x in zip(found, lay, strict=True)]
    knotted = float(np.mean([each.knot_bundle_px * x for each, x in zip(found, lay, strict=True)]))
    string_mm = string_mm_sd = NAN
    if np.isfinite(apex_mm) and looks.zero_known:
        leg = float(np.hypot(apex_mm, 0.5 * looks.hole_distance_mm))
        bundle = float(np.average(string, weights=trust)) * scale
        string_mm = leg + bundle
        string_mm_sd = rate * bundle
        string_mm_sd += (0.5 * float(np.ptp(string)) + KNOT_SD * knotted) * scale
        string_mm_sd += UNSEEN_SD * unseen * bundle
        if end != told_by_zone_px(looks):
            # Between ends that are seen both parts go with the scale. An end that L tells goes the
            # other way: what a larger scale adds before the apex it takes behind it. Where L had a
            # part in placing s = 0 as well, this is somewhat more than the scale does.
            by_scale = bundle + apex_mm**2 / leg
            string_mm_sd = float(np.hypot(string_mm_sd, by_scale * along_sd_share(looks)))
    return replace(
        row,
        turns_seen=turns_seen,
        turns_seen_sd=sd,
        turn_budget_error=(turns_seen - abs(row.turns)) if np.isfinite(row.turns) else NAN,
        string_length_mm=string_mm,
        string_length_mm_sd=string_mm_sd,
    )


def connector_px(looks: Looks) -> float:
    """s of the connector's face: L from where the legs leave the plate, unless it is seen well
    before that. Motion ends a little before the face in blur, and beyond a spigot that glitters.
    A face that is not seen may lie that little beyond the view; NaN farther off."""
    seen, told = looks.ends.connector_px, told_by_zone_px(looks)
    little = NEAR_SHARE * looks.zone_px
    if looks.face is None:
        return seen
    if np.isnan(seen):
        return told if told < looks.sight.end_px + little else NAN
    return told if seen > told - little else seen


def told_by_zone_px(looks: Looks) -> float:
    """s of the connector's face as L tells it."""
    return looks.zero_px + looks.zone_px


def _lay(fit: HelixFit) -> float:
    """Length of string per length of bundle, rms over the strands."""
    away = np.sqrt(np.mean(fit.strands_off_px**2))
    return float(np.sqrt(1.0 + (2 * np.pi * away / fit.pitch_px) ** 2))
