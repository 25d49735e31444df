"""Knots that were seen apart and now look like one.

Between two knots that lie near each other E(s) dips for less than a coil, and whether one view
shows the dip is up to the lobes that happen to point sideways. Knots drift slowly and do not turn
into one within a frame: a sighting over the places of two that were seen apart just before is cut
between them, for as many frames as a knot may hide. What stays one for longer has merged.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from tsvision.timeline.lengths import in_diameters, medians
from tsvision.timeline.order import Order
from tsvision.timeline.places import axis_unit, places_in_diameters, rows_of_steps

HELD_FRAMES = 3  # for which two stay two without being seen apart
SEEN_OFTEN = 2  # sightings after which a knot is held
NEAR_D = 1.0  # how far a knot moves from frame to frame, in D
INSIDE_D = 0.3  # how far within a sighting's ends a place must lie


@dataclass(frozen=True)
class _Held:
    """A knot as seen last: place and size over D, its largest length, how often, and how many
    frames ago apart."""

    place: float
    size: float
    length: float
    seen: int = 1
    ago: int = 0


def told_apart(frames: pd.DataFrame, knots: pd.DataFrame, order: Order) -> pd.DataFrame:
    """`knots` with such sightings cut: as many rows, each its part of the length; the larger of the
    knots keeps the size of the whole, the others that of their last sighting."""
    if not len(knots):
        return knots
    place, length = places_in_diameters(frames, knots)
    size = in_diameters(knots, "max_diameter", frames)
    held: list[_Held] = []
    cuts: dict[int, list[tuple[float, float, float]]] = {}
    for rows in rows_of_steps(frames, knots, order):
        seen: list[_Held] = []
        for row in rows:
            low, high = place[row] - 0.5 * length[row], place[row] + 0.5 * length[row]
            inside = _within(held, float(low), float(high))
            if len(inside) < 2:
                one = _Held(float(place[row]), float(size[row]), float(length[row]))
                seen.append(_known_before(one, held, place[rows]))
                continue
            parts = _parts(inside, float(low), float(high), float(size[row]))
            cuts[int(row)] = parts
            seen += [
                replace(h, place=p[0], size=p[2], ago=h.ago + 1)
                for h, p in zip(inside, parts, strict=True)
            ]
        missing = [h for h in held if all(abs(h.place - s.place) > NEAR_D for s in seen)]
        held = seen + [replace(h, ago=h.ago + 1) for h in missing]
        held = [h for h in held if h.ago < HELD_FRAMES]
    return _with_parts(frames, knots, place, cuts) if cuts else knots


def _within(held: list[_Held], low: float, high: float) -> list[_Held]:
    """The knots between two places, along the axis: those seen often enough; or one of these and
    what showed beside it but once, where both together are no longer than what shows now: the
    parts of a single knot that was seen parted by chance are as long as itself and more."""
    inside = [h for h in held if low + INSIDE_D < h.place < high - INSIDE_D]
    inside.sort(key=lambda h: h.place)
    known = [h for h in inside if h.seen >= SEEN_OFTEN]
    fit = sum(h.length for h in inside) <= high - low
    return inside if len(known) == 1 and fit else known


def _known_before(one: _Held, held: list[_Held], places: np.ndarray) -> _Held:
    """A sighting with what is held of its knot; of several the nearest is the knot's own."""
    near = min(held, key=lambda h: abs(h.place - one.place), default=None)
    if near is None or abs(near.place - one.place) > NEAR_D:
        return one
    if np.abs(places - near.place).min() < abs(one.place - near.place):
        return one
    return replace(one, length=max(one.length, near.length), seen=near.seen + 1)


def _parts(
    inside: list[_Held], low: float, high: float, size: float
) -> list[tuple[float, float, float]]:
    """(place, length, size) of each: where it was, cut midway to its neighbours."""
    places = np.array([h.place for h in inside])
    ends = np.concatenate([[low], 0.5 * (places[1:] + places[:-1]), [high]])
    largest = int(np.nanargmax([np.nan_to_num(h.size) for h in inside]))
    sizes = [size if i == largest else float(np.fmin(h.size, size)) for i, h in enumerate(inside)]
    return [
        (h.place, float(b - a), s)
        for h, a, b, s in zip(inside, ends[:-1], ends[1:], sizes, strict=True)
    ]


def _with_parts(
    frames: pd.DataFrame,
    knots: pd.DataFrame,
    place: np.ndarray,
    cuts: dict[int, list[tuple[float, float, float]]],
) -> pd.DataFrame:
    unit_mm, unit_px = medians(frames)
    along = axis_unit(frames)
    rows = []
    for row, parts in cuts.items():
        whole = knots.iloc[row].to_dict()
        for at, length, size in parts:
            part, moved = dict(whole), at - float(place[row])
            for unit, name in ((unit_mm, "mm"), (unit_px, "px")):
                for column, value in (
                    (f"centre_{name}", whole.get(f"centre_{name}", np.nan) + moved * unit),
                    (f"length_{name}", length * unit),
                    (f"max_diameter_{name}", size * unit),
                ):
                    if column in part:
                        part[column] = value
            for column, step in zip(("centre_x_px", "centre_y_px"), along, strict=True):
                if column in part:
                    part[column] = whole[column] + moved * unit_px * step
            rows.append(part)
    kept = knots.drop(index=knots.index[list(cuts)])
    cut = pd.DataFrame(rows).astype(knots.dtypes.to_dict(), errors="ignore")
    return pd.concat([kept, cut]).sort_values("frame", kind="stable").reset_index(drop=True)
