"""Where the strings leave the separator, as plate, connector, legs or a person tell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tsvision.measures.edges.cut import Cut
from tsvision.measures.ends.ends import NEAR_SHARE, Ends
from tsvision.measures.ends.gap import Gap, gap_from_legs, gap_without_scale
from tsvision.measures.ends.legs import Face, face_from_legs
from tsvision.measures.light.learnt import Learnt
from tsvision.records import Rig, Scale


@dataclass(frozen=True)
class Start:
    """Where the strings leave the separator: zero_px, s of its face, and whether that is known;
    half_gap_px: half of S as the legs tell it together with the face, else as stated; face and gap:
    the same and S as the legs tell them, None where they do not."""

    zero_px: float
    known: bool
    half_gap_px: float
    face: Face | None = None
    gap: Gap | None = None


def needs_holes(rig: Rig) -> bool:
    """Whether the scale is to come from S, which the legs must show in px first."""
    camera = rig.camera
    wanted = camera.scale_from == "hole_distance" and np.isnan(camera.mm_per_px)
    return bool(wanted and rig.actuator.hole_distance_mm > 0)


def find_start(learnt: Learnt, ends: Ends, rig: Rig, scale: Scale) -> Start:
    """Where s = 0 lies along the axis of what was learnt."""
    zone_px = rig.actuator.twisting_zone_mm / scale.mm_per_px
    half_gap_px = 0.5 * rig.actuator.hole_distance_mm / scale.mm_per_px
    sight, pairs = learnt.sight, learnt.pairs
    if rig.view.axis_px:
        away = np.subtract(rig.view.axis_px[0], sight.axis.at(np.array(0.0)))
        return Start(float(away @ sight.axis.tangent(np.array(0.0))), True, half_gap_px)
    zero, known = _separator_face(ends, zone_px, learnt.cuts)
    if not known:
        return Start(zero, False, half_gap_px)
    if np.isnan(scale.mm_per_px) and needs_holes(rig):
        gap = gap_without_scale(pairs, sight, zero, ends.plate_px)
        return Start(zero, True, half_gap_px, gap=gap)
    face = face_from_legs(pairs, sight, zero, ends.plate_px, half_gap_px, scale.mm_per_px)
    gap = gap_from_legs(pairs, sight, zero, ends.plate_px, half_gap_px)
    # Holes that do not lie in the picture's plane would seem nearer to the apex.
    if face is not None and abs(face.s_px - zero) > NEAR_SHARE * zone_px:
        face = None
    if face is None:
        return Start(zero, True, half_gap_px, gap=gap)
    return Start(face.s_px, True, face.half_gap_px, face, gap)


def _separator_face(ends: Ends, zone_px: float, cuts: list[Cut]) -> tuple[float, bool]:
    """s (px) where s_mm is zero: the mean of the plate's edge and of the connector minus L, where
    they agree. The hole exits are usually hidden by the plate, whose edge nearest the camera is
    seen; the other way suffers from a scale that changes along the axis. The plate's edge where the
    two contradict each other."""
    from_connector = ends.connector_px - zone_px
    if np.isfinite(from_connector):
        if not np.isfinite(ends.plate_px):
            return from_connector, True
        if abs(from_connector - ends.plate_px) < NEAR_SHARE * zone_px:
            return 0.5 * (from_connector + ends.plate_px), True
    if np.isfinite(ends.plate_px):
        return ends.plate_px, True
    first = [c.s_px[0] + c.silhouette.apex_column for c in cuts]
    return float(np.nanmin(first)) if np.isfinite(first).any() else float(cuts[0].s_px[0]), False
