"""The whole account of one recording: rows and sightings in, tracks, phases and onsets out.

order of the frames → tracks of knots → evidence per frame → hidden chain per phase → onsets,
phases, and what follows from them. Nothing here looks at a picture.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from tsvision.records import Onset, Rig
from tsvision.timeline import evidence as speak
from tsvision.timeline.chain import Histories, infer
from tsvision.timeline.criteria import LEVEL_OF_ONSET, Criteria
from tsvision.timeline.onset import beginnings, onset_of
from tsvision.timeline.order import Order, numbers, order_frames
from tsvision.timeline.phases import levels, names
from tsvision.timeline.tracks import Tracking, confidences, track_knots


@dataclass(frozen=True)
class Account:
    """What happened in a recording.

    `frames`: as given, with `phase` and `knot_count` smoothed and filled where the neighbours
    settle it (`knot_count_seen` keeps the raw count). `knots`: the sightings that count, with
    `track`. `rejected`: the others, with the reason. `tracks`: one row a knot. `onsets`: by the
    names of summary.json. `reasons`: why an onset is not observed. `notes`: for people.
    """

    frames: pd.DataFrame
    knots: pd.DataFrame
    rejected: pd.DataFrame
    tracks: pd.DataFrame
    onsets: dict[str, Onset]
    reasons: dict[str, str]
    notes: tuple[str, ...] = ()
    extras: dict[str, object] = field(default_factory=dict)


def account(
    frames: pd.DataFrame, knots: pd.DataFrame, rig: Rig = Rig(), criteria: Criteria = Criteria()
) -> Account:
    """Tracks, phases and onsets of one recording.

    `frames`: FrameRow's columns, one row a frame. `knots`: `frame` and KnotSighting's columns,
    maybe empty. Lengths in mm; without a scale the px columns are used where they do.
    """
    order = order_frames(frames)
    tracking = track_knots(frames, knots, order)
    certainty, largest_mm = _by_frame(frames, knots, tracking)
    spoken = _evidence(frames, certainty, largest_mm, rig, criteria)
    histories = _infer_all(spoken, order)
    seen = speak.measured(frames)[order.rows]
    onsets, reasons = _onsets(histories, order, seen, criteria)
    if not np.isfinite(rig.actuator.hole_diameter_mm):
        onsets["irreversible_onset"], reasons["irreversible_onset"] = _no_hole(onsets)
    told = _tell_frames(frames, knots, tracking, histories, order, seen, criteria)
    kept, rejected = _split_sightings(knots, tracking)
    return Account(told, kept, rejected, tracking.tracks, onsets, reasons, _notes(order, tracking))


def _by_frame(
    frames: pd.DataFrame, knots: pd.DataFrame, tracking: Tracking
) -> tuple[np.ndarray, np.ndarray]:
    """(n,) certainty that a frame shows a knot, NaN if nothing was seen; (n,) largest in mm."""
    row_of = {name: i for i, name in enumerate(frames["frame"].to_numpy())}
    none = np.full(len(frames), np.nan)
    against, largest = np.ones(len(frames)), none.copy()
    any_seen = np.zeros(len(frames), dtype=bool)
    chance, size = confidences(knots), numbers(knots, "max_diameter_mm")
    for k, name in enumerate(knots["frame"].to_numpy() if len(knots) else ()):
        i = row_of.get(name)
        if i is None or tracking.artefact[k]:
            continue
        any_seen[i] = True
        against[i] *= 1 - chance[k]
        largest[i] = np.fmax(largest[i], size[k])
    return np.where(any_seen, 1 - against, none), largest


def _evidence(
    frames: pd.DataFrame,
    certainty: np.ndarray,
    largest_mm: np.ndarray,
    rig: Rig,
    criteria: Criteria,
) -> dict[int, np.ndarray]:
    """Evidence (n,) per level, in the table's order."""
    hole = rig.actuator.hole_diameter_mm
    return {
        1: speak.coil_evidence(frames, criteria),
        2: speak.uneven_evidence(frames, criteria),
        3: speak.knot_evidence(frames, certainty, criteria),
        4: speak.larger_evidence(frames, certainty, largest_mm, hole),
    }


def _infer_all(spoken: dict[int, np.ndarray], order: Order) -> dict[int, Histories]:
    """Histories per level; a level holds where its own evidence or a higher level holds."""
    alone = {k: infer(v[order.rows], order, can_hide=k >= 3) for k, v in spoken.items()}
    return nested(alone)


def nested(alone: dict[int, Histories]) -> dict[int, Histories]:
    """Each phase includes the later ones: a knotted bundle is overtwisted too. Uneven counts
    only where coiled or knotted, irreversible only where knotted."""
    knot = alone[3].drawn
    never_smaller = {
        3: knot,
        4: alone[4].drawn & knot,
        1: alone[1].drawn | knot,
    }
    never_smaller[2] = (alone[2].drawn & never_smaller[1]) | knot
    return {k: Histories(v.mean(axis=0), v) for k, v in sorted(never_smaller.items())}


def _onsets(
    histories: dict[int, Histories], order: Order, seen: np.ndarray, criteria: Criteria
) -> tuple[dict[str, Onset], dict[str, str]]:
    onsets: dict[str, Onset] = {}
    reasons: dict[str, str] = {}
    for name, level in LEVEL_OF_ONSET.items():
        onsets[name], reasons[name] = first_onset(histories[level], order, seen, criteria)
    return onsets, reasons


def first_onset(
    histories: Histories, order: Order, seen: np.ndarray, criteria: Criteria
) -> tuple[Onset, str]:
    """The first run that winds and shows the phase; else what the farthest run says."""
    answers = []
    for first, stop in winding_runs(order):
        found = beginnings(histories, order, first, stop, criteria)
        answer = onset_of(found, order, seen, criteria)
        if answer[0].status == "observed":
            return answer
        answers.append(answer)
    if not answers:
        nothing = float("nan")
        return Onset("undetermined", None, None, None, nothing), "there are no frames"
    return max(answers, key=lambda a: np.nan_to_num(abs(a[0].last_turns), nan=-1.0))


def winding_runs(order: Order) -> list[tuple[int, int]]:
    """[first, stop) of every run that winds, or, if none does, of all runs."""
    bounds = []
    for number in np.unique(order.run):
        place = np.flatnonzero(order.run == number)
        bounds.append((int(place[0]), int(place[-1]) + 1, int(order.direction[place[0]])))
    winding = [(a, b) for a, b, way in bounds if way > 0]
    return winding or [(a, b) for a, b, _ in bounds]


def _no_hole(onsets: dict[str, Onset]) -> tuple[Onset, str]:
    knot = onsets["knot_onset"]
    if knot.status == "not_observed":
        return knot, "no knot, hence none larger than the hole"
    nothing = Onset("undetermined", None, None, None, knot.last_turns, knot.level)
    return nothing, "the hole's diameter is not known (actuator.hole_diameter_mm)"


def _tell_frames(
    frames: pd.DataFrame,
    knots: pd.DataFrame,
    tracking: Tracking,
    histories: dict[int, Histories],
    order: Order,
    seen: np.ndarray,
    criteria: Criteria,
) -> pd.DataFrame:
    """The frame table with smoothed `phase` and `knot_count`."""
    level = levels(histories, order, criteria)
    phase = np.full(len(frames), "", dtype=object)
    phase[order.rows] = names(level, histories, seen)
    knotted = np.zeros(len(frames), dtype=bool)
    knotted[order.rows] = level >= 3
    live = _live_tracks(frames, tracking, order)
    count = np.where(knotted, np.maximum(live, 1), 0).astype(float)
    count[phase == ""] = np.nan
    raw = numbers(frames, "knot_count")
    return frames.assign(phase=phase, knot_count=count, knot_count_seen=raw)


def _live_tracks(frames: pd.DataFrame, tracking: Tracking, order: Order) -> np.ndarray:
    """(n,) confirmed tracks alive in each frame, gaps counted."""
    step_of = {name: i for i, name in enumerate(frames["frame"].to_numpy()[order.rows])}
    live = np.zeros(len(order.rows))
    for track in tracking.tracks.itertuples():
        if track.confirmed and not track.artefact:
            live[step_of[track.first_frame] : step_of[track.last_frame] + 1] += 1
    result = np.zeros(len(frames))
    result[order.rows] = live
    return result


def _split_sightings(knots: pd.DataFrame, tracking: Tracking) -> tuple[pd.DataFrame, pd.DataFrame]:
    tracked = knots.assign(track=tracking.number)
    good = tracking.confirmed & ~tracking.artefact
    reason = np.where(tracking.artefact[~good], "there from the start", "unsupported")
    kept = tracked.loc[good].reset_index(drop=True)
    return kept, tracked.loc[~good].assign(reason=reason).reset_index(drop=True)


def _notes(order: Order, tracking: Tracking) -> tuple[str, ...]:
    notes = list(order.notes)
    for track in tracking.tracks.itertuples():
        if track.artefact:
            where = f"{track.first_centre_mm:.4g} mm"
            notes.append(f"what stands out at {where} from the start never changed: no knot")
    return tuple(notes)
