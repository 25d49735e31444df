"""The whole account of one recording: rows and sightings in, tracks, phases and onsets out.

order of the frames → tracks of knots → evidence per frame → hidden chain per phase → onsets,
phases, and what follows from them. Nothing here looks at a picture.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field

import numpy as np
import pandas as pd

from tsvision.errors import InputError
from tsvision.records import Onset, Rig
from tsvision.timeline import evidence as speak
from tsvision.timeline.annotate import split_sightings, tell_frames
from tsvision.timeline.apart import told_apart
from tsvision.timeline.background import least_believed, sets_top, without_lone_lobes
from tsvision.timeline.chain import Histories, infer
from tsvision.timeline.consistency import (
    MOST_AGAINST,
    disorder,
    miscounted,
    mismatch,
    not_the_strings,
    too_early,
)
from tsvision.timeline.constancy import near_separator
from tsvision.timeline.criteria import LEVEL_OF_ONSET, Criteria
from tsvision.timeline.cycles import onsets_by_cycle, repeatability
from tsvision.timeline.lengths import UNITS, in_diameters
from tsvision.timeline.onset import beginnings, onset_of
from tsvision.timeline.order import Order, numbers, order_frames
from tsvision.timeline.phases import spells
from tsvision.timeline.safety import largest_safe, near_misses
from tsvision.timeline.tracks import Tracking, track_knots
from tsvision.timeline.unknown import (
    camera_moves,
    without_near_misses,
    without_what_is_unknown,
    without_what_noise_hides,
)
from tsvision.timeline.unwinding import all_runs, ways_back
from tsvision.timeline.young import with_young


@dataclass(frozen=True)
class Account:
    """What happened in a recording.

    `frames`: as given, with `phase` and `knot_count` smoothed and filled where the neighbours
    settle it (`knot_count_seen` keeps the raw count). `knots`: the sightings that count, with
    `track`, and `seen` False where a track's gap was bridged. `rejected`: the other sightings,
    with the reason. `tracks`: one row a knot. `onsets`: by the names of summary.json.
    `reasons`: why an onset is not observed. `notes`: for people. `extras`: plain values: `safe`,
    `near_misses`, `unwinding`, `cycles`, `near_separator`.
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
    maybe empty. Lengths in mm and px; in px alone without a scale. Raises InputError on
    a frame table without `frame` or with a frame number twice.
    """
    _check(frames)
    knots = knots if "frame" in knots else pd.DataFrame({"frame": pd.Series(dtype=int)})
    knots = knots.reset_index(drop=True)
    order = order_frames(frames)
    zone_mm = rig.actuator.twisting_zone_mm
    plain = without_lone_lobes(frames, knots)
    knots = told_apart(frames, with_young(plain, knots, order, zone_mm), order)
    tracking = track_knots(plain, knots, order, zone_mm)
    spoken = _evidence(frames, knots, tracking, rig, criteria)
    histories = infer_all(spoken, order, speak.ready_to_knot(frames))
    seen = speak.measured(frames)[order.rows]
    onsets, reasons = _onsets(histories, order, seen, criteria)
    onsets, reasons = _checked(onsets, reasons, frames, rig, histories, spoken, order, seen)
    least = least_believed(plain, knots, order)
    onsets, reasons = without_what_noise_hides(onsets, reasons, least)
    onsets, reasons = without_what_is_unknown(onsets, reasons, frames, rig)
    unseen = not_the_strings(frames, order, rig)
    if unseen:
        tracking = tracking.disbelieved()
    near = near_misses(tracking.tracks, rig)
    onsets, reasons = without_near_misses(onsets, reasons, near)
    kept, rejected = split_sightings(frames, knots, tracking, order, histories[3])
    by_cycle = onsets_by_cycle(frames, histories[3], order, seen, criteria)
    extras: dict[str, object] = {
        "safe": asdict(largest_safe(frames, order, onsets, rig)),
        "near_misses": near,
        "unwinding": ways_back(histories, order, criteria),
        "cycles": repeatability(by_cycle, criteria.level),
    }
    told = tell_frames(frames, tracking, histories, order, criteria)
    if unseen:  # neither a phase nor a count of none may stand for what was not looked at
        told = told.assign(phase="", knot_count=np.nan)
    extras["near_separator"] = near_separator(told)
    notes = _notes(order, tracking) + camera_moves(frames)
    notes += tuple(filter(None, [miscounted(frames, order, criteria)]))
    notes += passing(histories[3], order, onsets["knot_onset"])
    return Account(told, kept, rejected, tracking.tracks, onsets, reasons, notes, extras)


def _check(frames: pd.DataFrame) -> None:
    if "frame" not in frames:
        raise InputError("the frame table has no column 'frame'; measure the recording anew")
    if frames["frame"].duplicated().any():
        twice = frames.loc[frames["frame"].duplicated(), "frame"].iloc[0]
        raise InputError(f"frame {twice} stands twice in the frame table; give each frame one row")


def _by_frame(
    frames: pd.DataFrame, knots: pd.DataFrame, tracking: Tracking
) -> tuple[np.ndarray, np.ndarray]:
    """(n,) certainty that a frame shows a knot, NaN if nothing was seen; (n,) largest in mm."""
    row_of = {name: i for i, name in enumerate(frames["frame"].to_numpy())}
    against = np.full(len(frames), np.nan)
    largest = np.full(len(frames), np.nan)
    chance, size = tracking.chance, numbers(knots, "max_diameter_mm")
    for k, name in enumerate(knots["frame"].to_numpy()):
        i = row_of.get(name)
        if i is None or tracking.artefact[k]:
            continue
        against[i] = (1.0 if np.isnan(against[i]) else against[i]) * (1 - chance[k])
        largest[i] = np.fmax(largest[i], size[k])
    return 1 - against, largest


def _with_hardware(frames: pd.DataFrame, knots: pd.DataFrame, tracking: Tracking) -> np.ndarray:
    """(n,) frames whose E(s) takes in hardware or dirt: their unevenness says nothing."""
    taken_in = knots["frame"].to_numpy()[tracking.artefact]
    return np.isin(frames["frame"].to_numpy(), taken_in)


def _bundle_alone(frames: pd.DataFrame, knots: pd.DataFrame, tracking: Tracking) -> pd.DataFrame:
    """`frames` with a largest E that is not that of hardware or dirt: else every frame in which a
    spigot is seen would pass for one in which a knot might just have been missed."""
    if not tracking.artefact.any():
        return frames
    top = in_diameters(frames, "max_envelope", frames)
    size, name = in_diameters(knots, "max_diameter", frames), knots["frame"].to_numpy()
    tops = {unit: numbers(frames, f"max_envelope_{unit}").copy() for unit in UNITS}
    for i, frame in enumerate(frames["frame"].to_numpy()):
        here = name == frame
        wrong = size[here & tracking.artefact]
        if len(wrong) and sets_top(np.nanmax(wrong, initial=0.0), top[i]):
            for unit, known in tops.items():
                sizes = numbers(knots, f"max_diameter_{unit}")[here & ~tracking.artefact]
                known[i] = np.nanmax(sizes, initial=0.0) if np.isfinite(known[i]) else np.nan
    return frames.assign(**{f"max_envelope_{unit}": known for unit, known in tops.items()})


def _evidence(
    frames: pd.DataFrame, knots: pd.DataFrame, tracking: Tracking, rig: Rig, criteria: Criteria
) -> dict[int, np.ndarray]:
    """Evidence (n,) per level, in the table's order."""
    certainty, largest_mm = _by_frame(frames, knots, tracking)
    hole = rig.actuator.hole_diameter_mm
    uneven = speak.uneven_evidence(frames, criteria)
    return {
        1: speak.coil_evidence(frames, criteria),
        2: np.where(_with_hardware(frames, knots, tracking), 0.0, uneven),
        3: speak.knot_evidence(_bundle_alone(frames, knots, tracking), certainty, criteria),
        4: speak.larger_evidence(frames, certainty, largest_mm, hole),
    }


def infer_all(
    spoken: dict[int, np.ndarray], order: Order, ready: np.ndarray
) -> dict[int, Histories]:
    """Histories per level, each including the later phases: a knotted bundle is overtwisted too.
    Uneven counts only where coiled or knotted, irreversible only where knotted. `ready` (n,):
    frames in which knots begin the more readily."""
    alone = {
        k: infer(v[order.rows], order, k >= 3, ready=ready[order.rows] if k == 3 else None).drawn
        for k, v in spoken.items()
    }
    coiled = alone[1] | alone[3]
    drawn = {1: coiled, 2: (alone[2] & coiled) | alone[3], 3: alone[3], 4: alone[4] & alone[3]}
    return {level: Histories(some.mean(axis=0), some) for level, some in drawn.items()}


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
    runs = all_runs(order)
    winding = [run for run in runs if run[2] > 0] or runs
    answers = []
    for first, stop, _ in winding:
        found = beginnings(histories, order, first, stop, criteria)
        answer = onset_of(found, order, seen, criteria)
        if answer[0].status == "observed":
            return answer
        answers.append(answer)
    if not answers:
        nothing = float("nan")
        return Onset("undetermined", None, None, None, nothing), "there are no frames"
    return max(answers, key=lambda a: np.nan_to_num(abs(a[0].last_turns), nan=-1.0))


def _checked(
    onsets: dict[str, Onset],
    reasons: dict[str, str],
    frames: pd.DataFrame,
    rig: Rig,
    histories: dict[int, Histories],
    spoken: dict[int, np.ndarray],
    order: Order,
    seen: np.ndarray,
) -> tuple[dict[str, Onset], dict[str, str]]:
    """No onset is told where the pictures contradict the turn counts or themselves."""
    reason = mismatch(frames, order, rig)
    wrong = disorder(histories[3], spoken[3][order.rows], seen)
    if not reason and wrong > MOST_AGAINST:
        reason = f"knots come and go without order ({wrong:.0%} of the frames contradict)"
    names = list(onsets)
    if not reason:
        names = ["overtwist_onset", "local_overtwist_onset"]
        reason = too_early(frames, onsets["overtwist_onset"])
    if not reason:
        return onsets, reasons
    doubtful = {
        name: Onset("undetermined", None, None, None, onsets[name].last_turns, onsets[name].level)
        for name in names
    }
    return onsets | doubtful, reasons | dict.fromkeys(names, reason)


def passing(knotted: Histories, order: Order, onset: Onset) -> tuple[str, ...]:
    """Notes on knots that showed while winding and were gone again before the onset."""
    notes = []
    for first, stop, way in all_runs(order):
        wind = order.wind[first:stop]
        for start, end in spells(knotted.there[first:stop] > 0.5):
            if way < 0 or end - start < 2 or end >= len(wind):
                continue
            if onset.turns is None or wind[end] < abs(onset.turns):
                bounds = f"from {wind[start]:.4g} to {wind[end - 1]:.4g} turns"
                notes.append(f"knots showed {bounds} and were gone again")
    return tuple(notes)


def _notes(order: Order, tracking: Tracking) -> tuple[str, ...]:
    notes = list(order.notes)
    for track in tracking.tracks.itertuples():
        if track.artefact:
            where = f"{track.first_centre_mm:.4g} mm"
            if not np.isfinite(track.first_centre_mm):
                where = f"{track.first_centre_px:.4g} px"
            notes.append(
                f"what stands out at {where} was there before anything could knot and did not "
                "grow, or lies beyond the connector: taken for hardware, dirt or a knot of an "
                "earlier winding"
            )
    return tuple(notes)
