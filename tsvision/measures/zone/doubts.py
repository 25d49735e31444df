"""When a frame's numbers are to be doubted although something fitted."""

from __future__ import annotations

from dataclasses import replace

import numba
import numpy as np

from tsvision.images.strip import Axis
from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.bundle import BundleFit
from tsvision.measures.helix.silhouette import passing
from tsvision.measures.helix.weigh import doubt
from tsvision.records import FrameRow, KnotSighting

NAN = float("nan")
POOR_WEIGHT = 0.55  # of the edges along the bundle, in the mean: films show 0.7 and more
LITTLE = 0.3  # of its strip, that a bundle without a separator in view fills at least
GROSSLY = 1.2  # by how much a fit counts less for its rate: 1.75 times the motor's, or a third
SURE = 0.9  # confidence of a knot below which it may be none
BORDER_PX = 1.5  # of the picture: an edge this near to it is the picture's own
LOST_TURNS, LOST_SHARE = 2.0, 0.25  # of the motor's turns, that slip, a dead zone or knots may hide


def edges_poor(edges: Edges) -> bool:
    """Whether along much of the bundle no edge matched, or badly: so it is where there is no ground
    beside it to end at."""
    matched = np.minimum(edges.upper_weight, edges.lower_weight)
    seen = np.flatnonzero((edges.upper_weight > 0) | (edges.lower_weight > 0))
    return bool(seen.size and matched[seen[0] : seen[-1] + 1].mean() < POOR_WEIGHT)


def stands_alone(edges: Edges, plate_px: float) -> bool:
    """Whether edges are seen along little of the strip, and no separator tells why: so it is where
    some stretch of what looks alike all over is taken for a bundle."""
    seen = np.flatnonzero((edges.upper_weight > 0) | (edges.lower_weight > 0))
    along = seen[-1] + 1 - seen[0] if seen.size else 0
    return bool(np.isnan(plate_px) and along < LITTLE * edges.s_px.size)


def turns_disagree(row: FrameRow, near: BundleFit | None) -> bool:
    """Whether the picture contradicts the motor by more than slip, lost turns and knots explain."""
    if near is not None and doubt(near.fit.p, near.expected_rate) > GROSSLY:
        return True
    allowed = max(LOST_TURNS, LOST_SHARE * abs(row.turns), 3.0 * row.turns_seen_sd)
    return bool(abs(row.turn_budget_error) > allowed)


def less_sure_of_pitch(row: FrameRow, near: BundleFit | None) -> FrameRow:
    """The row of a coil whose turns disagree with the motor's, less sure of its pitch, and of what
    follows from that, by as much: the outline of a coil repeats itself, and strands that turn more
    or less about it show nearly the same. Those of a straight bundle that fits do not, but where a
    stretch shows few of their lobes."""
    if near is None or not (near.fit.coiled or near.shows_few_lobes):
        return row
    counted = abs(row.turn_budget_error / row.turns) if row.turns else NAN
    led = passing(near.fit.p) / (near.expected_rate or NAN)
    known = [off for off in (counted, abs(led - 1.0)) if np.isfinite(off)]
    if not known:
        return row
    off = max(known)
    return replace(
        row,
        pitch_px_sd=float(np.hypot(row.pitch_px_sd, off * row.pitch_px)),
        pitch_mm_sd=float(np.hypot(row.pitch_mm_sd, off * row.pitch_mm)),
        helix_angle_rad_sd=_angle_sd(row.helix_angle_rad, row.helix_angle_rad_sd, off, led),
        lay_angle_rad_sd=_angle_sd(row.lay_angle_rad, row.lay_angle_rad_sd, off, led),
    )


def without_pitch(row: FrameRow) -> FrameRow:
    """The row without its pitch and what follows from that."""
    return replace(
        row,
        pitch_px=NAN,
        pitch_px_sd=NAN,
        pitch_mm=NAN,
        pitch_mm_sd=NAN,
        strand_repeat_px=NAN,
        helix_angle_rad=NAN,
        helix_angle_rad_sd=NAN,
        lay_angle_rad=NAN,
        lay_angle_rad_sd=NAN,
    )


def _angle_sd(angle: float, sd: float, off: float, led: float) -> float:
    """Of an angle whose pitch may be off by such a share, or `led` times the motor's in rate: by as
    far as it would then be another, for of long pitches that is far more than to first order."""
    first = 0.5 * np.sin(2.0 * angle) * off
    other = abs(np.arctan(np.tan(angle) / led) - angle) if np.isfinite(led) else 0.0
    return float(np.hypot(sd, max(first, other)))


def knots_unsure(knots: tuple[KnotSighting, ...]) -> bool:
    """Whether one of the knots hardly meets the criterion."""
    return any(knot.confidence < SURE for knot in knots)


def clipped(edges: Edges, axis: Axis, shape: tuple[int, ...], diameter_px: float) -> bool:
    """Whether over more than D of the axis an edge of the strings is the border of the picture
    itself, of this shape (H, W, ...). Along the axis the bundle may well go on beyond the view."""
    s_px = edges.s_px
    if _is_inside(edges, axis, shape):
        return False
    centre, along = axis.at(s_px), axis.tangent(s_px)
    upper = _at_border(centre, along, edges.upper_px, edges.upper_weight, shape[0], shape[1])
    lower = _at_border(centre, along, edges.lower_px, edges.lower_weight, shape[0], shape[1])
    return bool((upper | lower).sum() > diameter_px)


def _is_inside(edges: Edges, axis: Axis, shape: tuple[int, ...]) -> bool:
    """Whether the edges of the strings all lie well inside the picture, as they mostly do."""
    far = BORDER_PX + max(np.abs(edges.upper_px).max(), np.abs(edges.lower_px).max())
    points = axis.at(edges.s_px[[0, -1]]) if axis.is_straight else axis.at(edges.s_px)
    room = np.array([shape[1], shape[0]]) - 1.0 - points.max(axis=0)
    return bool(min(points.min(), room.min()) > far)


@numba.njit(cache=True)
def _at_border(centre, along, n_px, weight, height, width):  # pragma: no cover - compiled
    """Columns (M,) where an edge that is seen, n_px (M,) from the axis' points (M, 2) of direction
    `along` (M, 2), lies at the border of the picture."""
    out = np.zeros(n_px.size, np.bool_)
    for i in range(n_px.size):
        x, y = centre[i, 0] - n_px[i] * along[i, 1], centre[i, 1] + n_px[i] * along[i, 0]
        room = min(min(x, width - 1.0 - x), min(y, height - 1.0 - y))
        out[i] = weight[i] > 0.0 and room < BORDER_PX
    return out
