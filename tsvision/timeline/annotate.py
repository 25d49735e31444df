"""What was inferred, written back into the frame table and the knot table."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pandas as pd

from tsvision.timeline import evidence as speak
from tsvision.timeline.chain import Histories
from tsvision.timeline.criteria import Criteria
from tsvision.timeline.order import Order, numbers
from tsvision.timeline.phases import levels, names
from tsvision.timeline.tracks import GAP_FRAMES, Tracking

CENTRES = ("centre_mm", "centre_px", "centre_x_px", "centre_y_px")
EVENED = 5  # frames over which a knot's place is told by the middle one
PLACED = (*CENTRES, "length_mm", "length_px", "max_diameter_mm", "max_diameter_px")


def tell_frames(
    frames: pd.DataFrame,
    tracking: Tracking,
    histories: dict[int, Histories],
    order: Order,
    criteria: Criteria,
) -> pd.DataFrame:
    """The frame table with smoothed `phase` and `knot_count`; `knot_count_seen` is the raw one.
    A frame in which nothing was measured may have a phase from its neighbours, but no count."""
    seen = speak.measured(frames)[order.rows]
    level = levels(histories, order, criteria)
    phase = np.full(len(frames), "", dtype=object)
    phase[order.rows] = names(level, histories, seen)
    knotted = np.zeros(len(frames), dtype=bool)
    knotted[order.rows] = level >= 3
    count = np.where(knotted, np.maximum(_live(frames, tracking, order), 1), 0).astype(float)
    count[~speak.measured(frames)] = np.nan
    raw = numbers(frames, "knot_count")
    return frames.assign(phase=phase, knot_count=count, knot_count_seen=raw)


def _live(frames: pd.DataFrame, tracking: Tracking, order: Order) -> np.ndarray:
    """(n,) confirmed tracks alive in each frame of the table, gaps counted."""
    step_of = {name: i for i, name in enumerate(frames["frame"].to_numpy()[order.rows])}
    live = np.zeros(len(order.rows))
    for track in tracking.tracks.itertuples():
        if track.confirmed and not track.artefact:
            live[step_of[track.first_frame] : step_of[track.last_frame] + 1] += 1
    result = np.zeros(len(frames))
    result[order.rows] = live
    return result


def split_sightings(
    frames: pd.DataFrame,
    knots: pd.DataFrame,
    tracking: Tracking,
    order: Order,
    knotted: Histories,
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """(kept, rejected): sightings that belong to a real knot, with `track` and `seen`, the gaps
    of a track bridged by rows with `seen` False; and the others with the reason. A sighting in a
    frame that the whole series says is not knotted is none."""
    tracked = knots.assign(track=tracking.number, seen=True)
    believed = set(frames["frame"].to_numpy()[order.rows[knotted.there > 0.5]])
    good = tracking.confirmed & ~tracking.artefact & knots["frame"].isin(believed).to_numpy()
    reason = np.where(tracking.artefact[~good], "there from the start", "unsupported")
    rejected = tracked.loc[~good].assign(reason=reason).reset_index(drop=True)
    kept = tracked.loc[good]
    bridges = _bridges(frames, kept, order)
    if bridges:
        kept = pd.concat([kept, pd.DataFrame(bridges)[list(kept.columns)]])
    kept = _evened(kept, frames, order)
    return kept.sort_values(["frame", "track"], kind="stable").reset_index(drop=True), rejected


def _evened(kept: pd.DataFrame, frames: pd.DataFrame, order: Order) -> pd.DataFrame:
    """`kept` with the places of each track evened out over neighbouring frames: a knot drifts, but
    which of its lobes one view shows, and hence where it seems to lie, changes with every frame."""
    step_of = {name: i for i, name in enumerate(frames["frame"].to_numpy()[order.rows])}
    in_time = kept["frame"].map(step_of).argsort(kind="stable")
    even = kept.iloc[in_time].reset_index(drop=True)
    for name in [c for c in CENTRES if c in even]:
        place = even[name].astype(float)
        for _, one in place.groupby(even["track"]):
            place.loc[one.index] = _evened_out(one.to_numpy())
        even[name] = place
    return even


def _evened_out(places: np.ndarray) -> np.ndarray:
    """Each the median of as many on either side: of fewer towards the ends, lest drift be lost."""
    last, half = len(places) - 1, EVENED // 2
    reach = [min(i, last - i, half) for i in range(last + 1)]
    return np.array([np.median(places[i - r : i + r + 1]) for i, r in enumerate(reach)])


def _bridges(frames: pd.DataFrame, kept: pd.DataFrame, order: Order) -> list[dict[str, object]]:
    """Rows for measured frames within a track at which its knot was hidden from view."""
    name = frames["frame"].to_numpy()[order.rows]
    turns = numbers(frames, "turns")[order.rows]
    good = speak.measured(frames)[order.rows]
    step_of = {value: i for i, value in enumerate(name)}
    rows: list[dict[str, object]] = []
    for track, sightings in kept.groupby("track"):
        steps = np.sort([step_of[f] for f in sightings["frame"]])
        by_step = sightings.set_index(sightings["frame"].map(step_of)).sort_index()
        for before, after in pairwise(steps.tolist()):
            hidden = [i for i in range(before + 1, after) if good[i]]
            if not 0 < len(hidden) <= GAP_FRAMES:
                continue
            ends = by_step.loc[[before, after]]
            for i in hidden:
                share = (i - before) / (after - before)
                row: dict[str, object] = {
                    c: _between(ends[c].to_numpy(dtype=float), share) for c in PLACED if c in ends
                }
                row |= {"frame": name[i], "turns": turns[i], "track": track, "seen": False}
                rows.append({c: row.get(c, np.nan) for c in kept.columns})
    return rows


def _between(ends: np.ndarray, share: float) -> float:
    return float(ends[0] + share * (ends[-1] - ends[0]))
