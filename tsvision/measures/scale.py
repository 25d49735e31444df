"""mm per px of a recording: given, or from what the rig tells of the picture."""

from __future__ import annotations

import numpy as np

from tsvision.errors import InputError
from tsvision.measures.ends.gap import Gap
from tsvision.measures.ends.legs import HOLE_SD_MM
from tsvision.records import Rig, Scale

UNSTATED_SCALE_SD = 0.003  # relative: what perspective alone changes along a macro view
ENDS_WIDTHS = 0.25  # how well the end of a cord is known, in its widths
OUT_OF_PLANE = 0.01  # relative: how much longer a hanging cord is than its picture, or stated so
HOLES = "hole distance"  # the source of scales that S told: S itself is then no measurement
AT_THE_SEPARATOR = 0.01  # relative: how much perspective changes the scale from there to mid zone


def resolve_scale(rig: Rig) -> Scale:
    """The scale from the rig; unknown (NaN) when it tells none. Never a default.

    `mm_per_px` wins. `scale_from = "length"` with two `points_px` divides `length_mm` by their
    distance; scales from the holes' distance (`scale_between_holes`) or from a curve's length
    (`scale_from_length`) are set once the geometry is found. Raises InputError for a recipe that
    lacks its parts.
    """
    camera = rig.camera
    if np.isfinite(camera.mm_per_px):
        sd = camera.mm_per_px_sd
        if not np.isfinite(sd):
            sd = UNSTATED_SCALE_SD * camera.mm_per_px
        return Scale(camera.mm_per_px, sd, "given")
    if camera.scale_from == "length" and camera.points_px:
        if len(camera.points_px) < 2 or not camera.length_mm > 0:
            raise InputError(
                "camera.scale_from = 'length' needs length_mm > 0 and two points_px; "
                "without points the length is taken along the found axis"
            )
        points = np.array(camera.points_px, dtype=float)
        length_px = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
        scale = camera.length_mm / length_px
        return Scale(scale, scale * max(1.0 / length_px, UNSTATED_SCALE_SD), "two points")
    return Scale()


def needs_curve(rig: Rig) -> bool:
    """Whether the scale is to come from the cord's own length, which must be followed first."""
    camera = rig.camera
    given = np.isfinite(camera.mm_per_px) or bool(camera.points_px)
    return camera.scale_from == "length" and not given and camera.length_mm > 0


def scale_from_length(rig: Rig, length_px: float, width_px: float) -> Scale:
    """The scale from `camera.length_mm` over the length of the found curve, end to end.

    Its uncertainty holds both ends, known to a quarter of the cord's width, and what bows towards
    or away from the camera or the given length is off by.
    """
    scale = rig.camera.length_mm / length_px
    ends = np.sqrt(2.0) * ENDS_WIDTHS * width_px / length_px
    return Scale(scale, scale * float(np.hypot(ends, OUT_OF_PLANE)), "length along the cord")


def scale_between_holes(rig: Rig, gap: Gap | None) -> Scale:
    """The scale from S over the strings' distance at the holes' exits; unknown without legs.

    Its uncertainty holds the lines through the legs, how far strings lie off the middles of their
    holes, and that the separator is nearer to the camera, or farther off, than the zone's middle.
    """
    if gap is None:
        return Scale()
    scale = 0.5 * rig.actuator.hole_distance_mm / gap.half_px
    off = 2.0 * HOLE_SD_MM / rig.actuator.hole_distance_mm
    relative = np.linalg.norm([gap.sd_px / gap.half_px, off, AT_THE_SEPARATOR])
    return Scale(scale, scale * float(relative), HOLES)
