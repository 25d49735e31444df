"""Where the strings end: the motor connector's face and the separator's plate.

Strands move from frame to frame, hardware does not: along the axis, motion ends at the connector's
face. The plate is a block that stands across the axis: its edges are steps that lie at the same s
beside the strings on both sides. Where the rig tells L and the scale, one end says where to look
for the other; what is found still decides.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter

from tsvision.images.linear import to_linear
from tsvision.images.motion import FEWEST
from tsvision.images.sight import Sight
from tsvision.images.strip import Axis, cut_strip
from tsvision.measures.edges.cut import Cut

LONG_PX = 1600  # long side of the pictures in which ends are sought
LIVE = (
    0.05,
    0.08,
    0.12,
    0.2,
    0.3,
    0.4,
    0.5,
    0.6,
)  # of the bundle's motion, beyond twice the still places'
TOO_NEAR = 0.6  # of L: nearer to the plate nothing can be the connector
CLEAREST = 10.0  # times less motion: more tells no more, and before burnt-out metal there is none
CLEAR = 0.8  # of the clearest end of motion: others that may be the connector's face
# An outline that differs less from frame to frame, px and widths, and is so many widths wide, for
# half of one at least, is hardware's.
STILL_PX, STILL_SHARE, WIDER, LONG = 1.0, 0.04, 1.5, 0.5
LAG = 3  # px on either side of a step
STRONG = 0.35  # of the strongest step beside the axis
LEAST_STEP = 0.03  # square root of linear light
NEAR_SHARE = 0.04  # of L: how far an end may lie from where the other one puts it
LENGTH_SD = 0.0165  # of L, by the scale: a tilted axis is foreshortened by so much
NAN = float("nan")


@dataclass(frozen=True)
class Ends:
    """s in px of the connector's face and of the separator plate's visible edge; NaN: not seen.
    connector_seen: the face was seen, not put where L from the plate leads to."""

    connector_px: float
    plate_px: float
    connector_seen: bool = True


def find_ends(
    pictures: list[np.ndarray],
    cuts: list[Cut],
    sight: Sight,
    zone_px: float = NAN,
    gap_px: float = NAN,
) -> Ends:
    """Both ends from the sampled pictures, `cuts` of them on `sight`.

    zone_px, gap_px: L and the distance between the separator's holes where the rig tells.
    """
    factor = min(1.0, LONG_PX / max(pictures[0].shape[:2]))
    axis = Axis((sight.axis.points_px + 0.5) * factor - 0.5, sight.axis.arc_px * factor)
    width = sight.width_px * factor
    half = int(max(5.0 * width, 0.7 * np.nan_to_num(gap_px) * factor)) + 1
    strips = np.stack([_light(p, factor, sight.gamma, axis, half) for p in pictures])
    middle = _middle(cuts, sight) * factor
    known = np.isfinite(strips).all(axis=0)
    still = np.median(np.nan_to_num(strips), axis=0)
    still = np.where(known, np.sqrt(np.clip(still, 0.0, 1.0)), NAN)
    zone = zone_px * factor
    plates = _plates(still, width, middle, NEAR_SHARE * zone if np.isfinite(zone) else 0.6 * width)
    if len(pictures) >= FEWEST:
        connectors = _ends_of_motion(strips, middle, width)
    else:
        connectors = {}
    stands = _still_outline(cuts, sight.width_px, middle / factor)
    if np.isfinite(stands):
        connectors.setdefault(stands * factor, CLEAREST)
    if np.isfinite(sight.connector_px):
        connectors.setdefault(sight.connector_px * factor, 1.0)
    plate, connector = _pair(plates, connectors, zone, _nearest_apex(cuts) * factor)
    told = _by_length(connector, plate + zone, NEAR_SHARE * zone, axis.length_px)
    return Ends(told / factor, plate / factor, told == connector)


def _nearest_apex(cuts: list[Cut]) -> float:
    """s where the legs meet in the frame where they do so nearest to the separator; NaN: unseen."""
    met = [c.s_px[0] + c.silhouette.apex_column for c in cuts if c.silhouette.apex_column > 3]
    return float(min(met, default=NAN))


def _pair(
    plates: list[float], connectors: dict[float, float], zone: float, apex: float
) -> tuple[float, float]:
    """Of several candidates those that lie about L apart, the clearest connector among them; the
    last plate and the first of the clear connectors where none do or L is unknown."""
    near = NEAR_SHARE * zone
    apart = {
        (p, c): min(clear, CLEAREST)
        * float(np.exp(-0.5 * ((c - p - zone) / (LENGTH_SD * zone)) ** 2))
        for p in plates
        for c, clear in connectors.items()
        if abs(c - p - zone) < near
    }
    if apart:
        return max(apart, key=apart.__getitem__)
    clear = [c for c in connectors if connectors[c] > CLEAR * max(connectors.values())]
    plate, connector = plates[-1] if plates else NAN, min(clear, default=NAN)
    # A close-up holds the plate and never the connector: what ended the motion there is the view.
    begins = plate if np.isfinite(plate) else apex
    return plate, NAN if connector - begins < TOO_NEAR * zone else connector


def _light(picture: np.ndarray, factor: float, gamma: float, axis: Axis, half: int) -> np.ndarray:
    """Linear strip (R, M, C) of a picture made smaller by `factor`."""
    if factor < 1.0:
        picture = cv2.resize(picture, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
    values = cut_strip(to_linear(picture, gamma), axis, (0.0, axis.length_px), half).values
    return values[..., None] if values.ndim == 2 else values


def _middle(cuts: list[Cut], sight: Sight) -> float:
    """s in the middle of what was outlined as twisted."""
    found = [np.median(c.s_px[c.silhouette.bundle]) for c in cuts if c.silhouette.bundle.any()]
    return float(np.median(found)) if found else 0.5 * (sight.start_px + sight.end_px)


def _ends_of_motion(strips: np.ndarray, middle: float, width: float) -> dict[float, float]:
    """s beyond which hardly anything moves on the axis, each with how many times less moves there;
    none where motion goes on to the view's end. strips (F, R, M, C).

    Matt metal stands still, polished metal glitters: several shares of the bundle's motion are
    tried. Blur carries each end about a pixel too far.
    """
    n = np.abs(np.arange(strips.shape[1]) - strips.shape[1] // 2)
    known = np.isfinite(strips).all(axis=(0, -1))
    moves = np.sqrt(np.nan_to_num(strips).var(axis=0).sum(axis=-1))
    moves = gaussian_filter(np.where(known, moves, 0.0), 0.7)
    beside = moves[n > 1.5 * width][known[n > 1.5 * width]]
    still = float(np.median(beside)) if beside.size else 0.0
    view = np.flatnonzero(known[n <= 1].all(axis=0))
    if view.size == 0:
        return {}
    found: dict[float, float] = {}
    core = moves[n <= max(0.6 * width, 1.0)]
    for share in (80.0, 50.0, 30.0):
        on_axis = np.percentile(core, share, axis=0)
        start = int(np.clip(middle, 0, on_axis.size - 1))
        reach = slice(max(int(start - 4 * width), 0), int(start + 4 * width) + 1)
        typical = float(np.median(on_axis[reach]))
        if typical < 4.0 * still:
            continue
        for least in LIVE:
            last = _last_live(on_axis > 2.0 * still + least * typical, start, 1.2 * width)
            if last < view[-1] - 0.8 * width:
                found[float(last)] = max(_fall(on_axis, last, width), found.get(float(last), 0.0))
    return found


def _still_outline(cuts: list[Cut], width: float, middle: float) -> float:
    """s beyond `middle` where an outline begins that is the same in all frames and wider than the
    bundle: a polished spigot mirrors the strings and glitters as much as they move, but its outline
    stands still. NaN where none does."""
    if len(cuts) < FEWEST:
        return NAN
    columns = min(cut.s_px.size for cut in cuts)
    high, low = (
        np.array([getattr(cut.silhouette, side)[:columns] for cut in cuts])
        for side in ("high", "low")
    )
    limit = max(STILL_PX, STILL_SHARE * width)
    with np.errstate(invalid="ignore"):
        still = (np.ptp(high, axis=0) <= 2.0 * limit) & (np.ptp(low, axis=0) <= 2.0 * limit)
        still &= (high - low).mean(axis=0) + 1.0 > WIDER * width
    still &= cuts[0].s_px[:columns] > middle
    long = max(int(LONG * width), 3)
    begins = np.flatnonzero(np.convolve(still, np.ones(long), "valid") == long)
    return float(cuts[0].s_px[begins[0]]) if begins.size else NAN


def _last_live(live: np.ndarray, start: int, gap: float) -> int:
    """Last live column from `start` on, gaps bridged."""
    last = start
    for s in range(start, live.size):
        if live[s]:
            last = s
        elif s - last > gap:
            break
    return last


def _fall(on_axis: np.ndarray, last: int, width: float) -> float:
    """How many times less moves after a column than before it."""
    reach = max(int(width), 4)
    before = np.median(on_axis[max(last - reach, 0) : max(last - 1, 1)])
    after = np.percentile(on_axis[last + 3 : last + 3 + reach], 70.0)
    return float(before / max(after, 1e-9))


def _plates(still: np.ndarray, width: float, middle: float, apart: float) -> list[float]:
    """s of edges that may be the plate's face in a still picture (R, M, C), before `middle`.

    Seen from a little aside the face shows two edges less than `apart` px apart, the near and the
    far one: it lies between.
    """
    steps = _steps_across(still, width)
    if steps.size < 8:
        return []
    noise = float(np.median(steps))
    s = np.arange(steps.size) + LAG - 0.5
    peak = np.zeros(steps.size, dtype=bool)
    peak[2:-2] = [steps[i] == steps[i - 2 : i + 3].max() for i in range(2, steps.size - 2)]
    peak &= (steps > max(4.0 * noise, LEAST_STEP)) & (s < middle)
    if not peak.any():
        return []
    peak &= steps > STRONG * steps[peak].max()
    groups: list[list[float]] = []
    for at in s[peak]:
        if groups and at - groups[-1][0] < apart:
            groups[-1].append(float(at))
        else:
            groups.append([float(at)])
    return [float(np.mean(g)) for g in groups]


def _steps_across(still: np.ndarray, width: float) -> np.ndarray:
    """Steps along s that more than half of the rows beside the strings share, (M - 2 LAG + 1,)."""
    n = np.abs(np.arange(still.shape[0]) - still.shape[0] // 2)
    beside = still[n > 1.2 * width]
    total = np.cumsum(np.pad(np.nan_to_num(beside), ((0, 0), (1, 0), (0, 0))), axis=1)
    means = (total[:, LAG:] - total[:, :-LAG]) / LAG
    step = np.sqrt(((means[:, LAG:] - means[:, :-LAG]) ** 2).sum(axis=-1))
    dark = np.cumsum(np.pad(np.isnan(beside[..., 0]), ((0, 0), (1, 0))), axis=1)
    step[dark[:, 2 * LAG :] > dark[:, : -2 * LAG]] = NAN  # beyond the picture
    known = np.isfinite(step).mean(axis=0) > 0.5
    out = np.zeros(step.shape[1])
    if known.any():
        out[known] = np.nanpercentile(step[:, known], 40.0, axis=0)
    return out


def _by_length(seen: float, told: float, apart: float, length: float) -> float:
    """The connector's face where L puts it unless it is seen there: a spigot is easily taken for
    strings. What is seen well before that place must be it."""
    if not np.isfinite(told) or told > length or abs(seen - told) < apart:
        return seen
    return seen if seen < told else told
