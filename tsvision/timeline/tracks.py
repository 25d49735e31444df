"""Knots keep their identity: sightings of neighbouring frames joined into tracks.

Lengths are compared in units of the bundle's D, so that recordings without a scale are tracked
just the same. Each track predicts where its knot will be (knots drift as string is drawn in, and
all by much the same amount, and a bumped camera moves all at once); sightings are assigned to
predictions at the least total cost. A track outlives a few frames without a sighting. A sighting
that nothing before or after supports is not a knot, and says so; each that shows again at the same
place counts for more than it does alone.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd
from scipy.optimize import linear_sum_assignment

from tsvision.timeline.background import chances
from tsvision.timeline.evidence import measured
from tsvision.timeline.lengths import UNITS, in_diameters, medians
from tsvision.timeline.order import Order, numbers
from tsvision.timeline.places import places_in_diameters, rows_of_steps
from tsvision.timeline.repeats import extent_in_diameters, repeat_odds

GAP_FRAMES = 3  # a track outlives this many measured frames without a sighting
GATE_D = 1.0  # how far from its prediction a knot may turn up, in D, …
GATE_LENGTH = 0.35  # … beside this share of its own length
GATE_D_PER_TURN = 0.25
MERGE_D = 3.0  # a track that ends this near to another one merged into it
MISS_COST = 1.5  # log-odds that a frame without a sighting takes from a track
CONFIRMED = 2.5  # log-odds from which a track counts
ARTEFACT_TURNS = 5.0  # what stands out below this turn count, before anything can coil, …
ARTEFACT_REACH_D = 1.5  # … makes all that stands out at the same place …
ARTEFACT_SHARE = 0.4  # … if it shows in this share of the first frames, …
BEYOND_D = 0.5  # … as is what lies farther than this beyond the connector's face
HUGE_D = 5.0  # … or is larger than any coil of the bundle can be
ARTEFACT_GROWTH = 1.3  # … and is not larger than this many times: hardware, dirt, a fibre


@dataclass
class Track:
    """One knot over time. `steps` (places in time order), `rows` (rows of the knot table),
    `repeats` (what each gains by the one before it, in log-odds)."""

    number: int
    steps: list[int] = field(default_factory=list)
    rows: list[int] = field(default_factory=list)
    places: list[float] = field(default_factory=list)
    repeats: list[float] = field(default_factory=list)
    drift: float = 0.0
    missed: int = 0
    log_odds: float = 0.0
    split_from: Track | None = None
    merged_into: Track | None = None


@dataclass(frozen=True)
class Tracking:
    """`number` (rows of the knot table,) track of each sighting; `tracks` one row a track;
    `artefact` (rows,) True for what was there all along and is no knot; `chance` (rows,) that a
    sighting is a knot, its neighbours in time considered."""

    number: np.ndarray
    tracks: pd.DataFrame
    confirmed: np.ndarray
    artefact: np.ndarray
    chance: np.ndarray

    def disbelieved(self) -> Tracking:
        """The same with no track that counts."""
        none = np.zeros(len(self.confirmed), dtype=bool)
        return replace(self, confirmed=none, tracks=self.tracks.assign(confirmed=False))


def track_knots(
    frames: pd.DataFrame, knots: pd.DataFrame, order: Order, zone_mm: float = float("nan")
) -> Tracking:
    """Join the sightings in `knots` (columns frame, centre_mm or centre_x_px …) into tracks.

    `zone_mm`: the twisting zone's length; what lies beyond its end is no knot."""
    number = np.full(len(knots), -1)
    place, length = places_in_diameters(frames, knots)
    odds = _log_odds(chances(frames, knots, order))
    rows_at = rows_of_steps(frames, knots, order)
    extent = extent_in_diameters(frames)
    good = measured(frames)[order.rows]
    live: list[Track] = []
    done: list[Track] = []
    for step, rows in enumerate(rows_at):
        if not good[step] and not len(rows):
            continue
        live = _retire_doubtful(live, done)
        turned = _turned_since(order, live, step)
        gate = _gate(length[rows], turned)
        pairs = _assign(live, place[rows], turned, gate)
        again = {(t, k): repeat_odds(len(rows), gate[t, k], extent) for t, k in pairs}
        _extend(live, again, rows, place, odds, step)
        _start_new(live, done, pairs, rows, place, length, odds, step)
        live = _retire(live, done)
    tracks = done + live
    steps_of = np.array([step for step, rows in enumerate(rows_at) for _ in rows], dtype=int)
    step_of_row = np.zeros(len(knots), dtype=int)
    step_of_row[np.concatenate([*rows_at, np.zeros(0, dtype=int)])] = steps_of
    size = in_diameters(knots, "max_diameter", frames)
    artefact = _artefacts(tracks, place, size, step_of_row, good, order)
    artefact |= beyond(knots, zone_mm, medians(frames)[0]) | (size > HUGE_D)
    tracks = _number(tracks, artefact, len(order.rows) - 1)
    supported = odds.copy()
    for track in tracks:
        number[track.rows] = track.number
        gained = np.array([*track.repeats, 0.0])
        repeated = odds[track.rows] + 0.5 * (gained[:-1] + gained[1:])
        supported[track.rows] = np.minimum(repeated, _net_odds(track, order))
    table = _describe(tracks, frames, knots, size, order, artefact)
    confirmed = np.isin(number, table.loc[table["confirmed"], "track"])
    return Tracking(number, table, confirmed, artefact, 1 / (1 + np.exp(-supported)))


def _artefacts(
    tracks: list[Track],
    place: np.ndarray,
    size: np.ndarray,
    step_of_row: np.ndarray,
    good: np.ndarray,
    order: Order,
) -> np.ndarray:
    """(rows,) sightings of what was there before anything could knot, and did not grow.

    It must have shown in a good part of the untwisted frames: strands that do not touch yet throw
    up a chance sighting here and there, and that must not blind a place for the rest of the film.
    """
    found = np.zeros(len(place), dtype=bool)
    for track in tracks:
        wind = order.wind[track.steps]
        early = np.array(track.rows)[(wind < ARTEFACT_TURNS) & (order.direction[track.steps] > 0)]
        if order.run[track.steps[0]] != 0 or not len(early) or len(track.rows) < 2:
            continue
        here = np.abs(place - np.median(place[early])) < ARTEFACT_REACH_D
        first = size[early][np.isfinite(size[early])]
        here &= ~(size > (ARTEFACT_GROWTH * float(np.median(first)) if len(first) else np.inf))
        before = good & (order.wind < 2 * ARTEFACT_TURNS) & (order.run == 0)
        shown = np.isin(np.flatnonzero(before), step_of_row[here])
        if len(shown) and shown.mean() >= ARTEFACT_SHARE:
            found |= here
    return found


def beyond(knots: pd.DataFrame, zone_mm: float, diameter_mm: float) -> np.ndarray:
    """(rows,) sightings on the connector; none where zone or D is not known."""
    return numbers(knots, "centre_mm") > zone_mm + BEYOND_D * diameter_mm


def _net_odds(track: Track, order: Order) -> float:
    """Log-odds of a whole track: a knot does not show once and then not again, so the frames
    after its last sighting count against it while the winding goes on."""
    unwinds = order.direction[track.steps[-1]] < 0
    return track.log_odds - (0.0 if unwinds else MISS_COST * min(track.missed, GAP_FRAMES))


def _log_odds(chance: np.ndarray) -> np.ndarray:
    chance = np.clip(chance, 0.02, 0.98)
    return np.log(chance / (1 - chance))


def _turned_since(order: Order, live: list[Track], step: int) -> np.ndarray:
    turned = np.array([abs(order.wind[step] - order.wind[t.steps[-1]]) for t in live])
    return np.nan_to_num(turned, nan=1.0)


def _gate(length: np.ndarray, turned: np.ndarray) -> np.ndarray:
    """(live tracks, sightings) how far from its prediction each may turn up, in D."""
    wider: np.ndarray = np.minimum(GATE_D_PER_TURN * turned, 2.0)[:, None]
    return GATE_D + GATE_LENGTH * length[None, :] + wider


def _assign(
    live: list[Track], place: np.ndarray, turned: np.ndarray, gate: np.ndarray
) -> list[tuple[int, int]]:
    """Pairs (live track, sighting) at the least total distance, within the gate."""
    if not live or not len(place):
        return []
    predicted = np.array([t.places[-1] for t in live]) + turned * [t.drift for t in live]
    shift = _common_shift(predicted, place, gate)
    distance = np.abs(predicted[:, None] + shift - place[None, :]) / gate
    rows, columns = linear_sum_assignment(np.minimum(distance, 10.0))
    return [(int(r), int(c)) for r, c in zip(rows, columns, strict=True) if distance[r, c] <= 1]


def _common_shift(predicted: np.ndarray, place: np.ndarray, gate: np.ndarray) -> float:
    """A move that all knots share (a bumped camera), where two or more of them show the same."""
    if len(predicted) < 2 or len(predicted) != len(place):
        return 0.0
    moves = np.sort(place) - np.sort(predicted)
    alike = np.ptp(moves) < 1.0
    return float(np.median(moves)) if alike and np.abs(moves).min() > 0.5 * gate.min() else 0.0


def _extend(
    live: list[Track],
    again: dict[tuple[int, int], float],
    rows: np.ndarray,
    place: np.ndarray,
    odds: np.ndarray,
    step: int,
) -> None:
    """Lengthen the tracks by their sightings; `again`: what each pair gains by the repeat. Doubts
    from before are not held against a track that goes on: what it is shows from here."""
    matched = dict(again.keys())
    for i, track in enumerate(live):
        if i not in matched:
            track.missed += 1
            continue
        row = int(rows[matched[i]])
        repeat = again[i, matched[i]] if track.missed == 0 else 0.0
        moved = place[row] - track.places[-1]
        track.drift = 0.7 * track.drift + 0.3 * float(np.clip(moved, -1.0, 1.0)) * 0.5
        so_far = max(track.log_odds - MISS_COST * track.missed, 0.0)
        track.log_odds = so_far + float(odds[row]) + repeat
        track.repeats.append(repeat)
        track.missed = 0
        track.steps.append(step)
        track.rows.append(row)
        track.places.append(float(place[row]))


def _start_new(
    live: list[Track],
    done: list[Track],
    pairs: list[tuple[int, int]],
    rows: np.ndarray,
    place: np.ndarray,
    length: np.ndarray,
    odds: np.ndarray,
    step: int,
) -> None:
    taken = {sighting for _, sighting in pairs}
    older = [t for t in live if len(t.steps) > 1 and t.steps[-1] == step]
    for i, row in enumerate(rows):
        if i in taken:
            continue
        reach = 1.0 + 0.5 * length[i]
        near = [t for t in older if np.abs(np.array(t.places[-2:]) - place[row]).min() < reach]
        new = Track(len(live) + len(done), [step], [int(row)], [float(place[row])], [0.0])
        new.log_odds, new.split_from = float(odds[row]), near[0] if near else None
        live.append(new)


def _retire_doubtful(live: list[Track], done: list[Track]) -> list[Track]:
    """A track that is rather no knot and was not seen in the last frame must not hand its doubts
    on to one that begins here."""
    kept: list[Track] = []
    for track in live:
        doubtful = track.missed > 0 and track.log_odds < MISS_COST * track.missed
        (done if doubtful else kept).append(track)
    return kept


def _retire(live: list[Track], done: list[Track]) -> list[Track]:
    """Close tracks that stayed unseen; where another knot now lies, they merged into it."""
    kept: list[Track] = []
    for track in live:
        if track.missed <= GAP_FRAMES:
            kept.append(track)
            continue
        near = [t for t in live if t.missed == 0 and abs(t.places[-1] - track.places[-1]) < MERGE_D]
        track.merged_into = near[0] if near else None
        done.append(track)
    return kept


def _describe(
    tracks: list[Track],
    frames: pd.DataFrame,
    knots: pd.DataFrame,
    size_d: np.ndarray,
    order: Order,
    artefact: np.ndarray,
) -> pd.DataFrame:
    names = frames["frame"].to_numpy()[order.rows]
    size = {unit: numbers(knots, f"max_diameter_{unit}") for unit in UNITS}
    centre = {unit: numbers(knots, f"centre_{unit}") for unit in UNITS}
    last_step = len(order.rows) - 1
    rows = []
    for track in tracks:
        ends_open, into = _ends_open(track, last_step), track.merged_into
        rows.append(
            {
                "track": track.number,
                "first_frame": int(names[track.steps[0]]),
                "last_frame": int(names[track.steps[-1]]),
                "first_turns": order.sign * order.wind[track.steps[0]],
                "last_turns": order.sign * order.wind[track.steps[-1]],
                "sightings": len(track.rows),
                "first_centre_mm": centre["mm"][track.rows[0]],
                "last_centre_mm": centre["mm"][track.rows[-1]],
                "max_diameter_mm": _largest(size["mm"][track.rows]),
                "growth": _growth(size_d[track.rows]),
                "confidence": 1 / (1 + np.exp(-np.clip(track.log_odds, -30, 30))),
                "confirmed": _is_confirmed(track, last_step),
                "artefact": bool(artefact[track.rows].mean() > 0.5),
                "origin": _said("split from", track.split_from, "nucleated"),
                "end": "lasts" if ends_open else _said("merged into", into, "vanished"),
                "first_centre_px": centre["px"][track.rows[0]],
                "last_centre_px": centre["px"][track.rows[-1]],
                "max_diameter_px": _largest(size["px"][track.rows]),
            }
        )
    return pd.DataFrame(rows, columns=TRACK_COLUMNS)


def _said(how: str, other: Track | None, alone: str) -> str:
    return alone if other is None else f"{how} {other.number}"


def _ends_open(track: Track, last_step: int) -> bool:
    return last_step - track.steps[-1] <= GAP_FRAMES


def _is_confirmed(track: Track, last_step: int) -> bool:
    seen_enough = len(track.rows) > 1 or _ends_open(track, last_step)
    return bool(track.log_odds >= CONFIRMED and seen_enough)


def _number(tracks: list[Track], artefact: np.ndarray, last_step: int) -> list[Track]:
    """Knots first, from 0 in the order in which they appeared, then what was taken for none."""

    def rank(track: Track) -> tuple[bool, int, int]:
        real = _is_confirmed(track, last_step) and not artefact[track.rows].mean() > 0.5
        return not real, track.steps[0], track.number

    tracks = sorted(tracks, key=rank)
    for number, track in enumerate(tracks):
        track.number = number
    return tracks


TRACK_COLUMNS = [
    "track",
    "first_frame",
    "last_frame",
    "first_turns",
    "last_turns",
    "sightings",
    "first_centre_mm",
    "last_centre_mm",
    "max_diameter_mm",
    "growth",
    "confidence",
    "confirmed",
    "artefact",
    "origin",
    "end",
    "first_centre_px",
    "last_centre_px",
    "max_diameter_px",
]


def _largest(sizes: np.ndarray) -> float:
    """The largest diameter, from the upper quartile's side, so that one slip does not set it."""
    sizes = sizes[np.isfinite(sizes)]
    if not len(sizes):
        return float("nan")
    smooth = pd.Series(sizes).rolling(3, center=True, min_periods=1).median()
    return float(smooth.max())


def _growth(sizes: np.ndarray) -> float:
    """Relative change of the diameter from the first to the last third of the sightings."""
    sizes = sizes[np.isfinite(sizes)]
    if len(sizes) < 3:
        return float("nan")
    third = max(1, len(sizes) // 3)
    return float(np.median(sizes[-third:]) / np.median(sizes[:third]) - 1.0)
