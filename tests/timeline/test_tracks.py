"""Tracks of knots: drift, gaps, neighbours, merging, splitting, vanishing."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tests.timeline.series import KNOT_COLUMNS, with_px, without_scale
from tsvision.timeline.annotate import split_sightings
from tsvision.timeline.chain import Histories
from tsvision.timeline.order import order_frames
from tsvision.timeline.tracks import Tracking, track_knots

D = 0.48


def tables(places: dict[int, list[float]], count: int) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Frames one turn apart from 40 turns on, and sightings at the given places (mm)."""
    rows = [
        (frame, 40.0 + frame, place, 0.8, 0.9, 100 + place / 0.0228, 270.0, 0.9, 2.0)
        for frame, some in places.items()
        for place in some
    ]
    frames = pd.DataFrame(
        {
            "frame": np.arange(count),
            "turns": 40.0 + np.arange(count),
            "diameter_mm": D,
            "knot_count": [float(len(places.get(i, []))) for i in range(count)],
            "flags": "",
        }
    )
    return frames, pd.DataFrame(rows, columns=KNOT_COLUMNS)


def track(places: dict[int, list[float]], count: int) -> Tracking:
    frames, knots = tables(places, count)
    return track_knots(frames, knots, order_frames(frames))


def test_two_drifting_neighbours_keep_their_identities() -> None:
    places = {i: [8 + 0.1 * i, 11 - 0.05 * i] for i in range(12)}
    told = track(places, 12)
    assert len(told.tracks) == 2
    assert told.number.tolist() == [0, 1] * 12


def test_sightings_in_any_order_give_the_same_tracks() -> None:
    places = {i: ([8, 12] if i % 2 else [12, 8]) for i in range(8)}
    told = track({k: [float(p) for p in v] for k, v in places.items()}, 8)
    assert len(told.tracks) == 2
    assert told.tracks["sightings"].tolist() == [8, 8]


def test_a_gap_is_part_of_the_track_and_is_bridged() -> None:
    places = {i: [8 + 0.1 * i] for i in range(10) if i not in (4, 5)}
    frames, knots = tables(places, 10)
    order = order_frames(frames)
    there = np.ones(len(frames))
    tracking = track_knots(frames, knots, order)
    kept, _ = split_sightings(frames, knots, tracking, order, Histories(there, there > 0))
    assert kept["frame"].tolist() == list(range(10))
    assert kept.loc[~kept["seen"], "frame"].tolist() == [4, 5]
    assert np.allclose(kept["centre_mm"], 8 + 0.1 * np.arange(10))
    assert kept["track"].nunique() == 1


def test_a_bridge_is_told_in_px_too_and_spoils_no_place_beside_it() -> None:
    places = {i: [8 + 0.1 * i] for i in range(10) if i not in (4, 5)}
    frames, knots = tables(places, 10)
    knots = with_px(knots, 0.0228)
    order = order_frames(frames)
    there = np.ones(len(frames))
    tracking = track_knots(frames, knots, order)
    kept, _ = split_sightings(frames, knots, tracking, order, Histories(there, there > 0))
    for name in ("centre", "length", "max_diameter"):
        assert np.allclose(kept[f"{name}_px"], kept[f"{name}_mm"] / 0.0228)


def test_places_are_evened_out_along_a_track_and_drift_stays() -> None:
    off = np.array([0.0, 0.4, 0.0, 0.0, -0.5, 0.0, 0.0, 0.3, 0.0, 0.0])  # lobes that happen to show
    places = {i: [8 + 0.1 * i + float(off[i])] for i in range(10)}
    frames, knots = tables(places, 10)
    order = order_frames(frames)
    there = np.ones(len(frames))
    tracking = track_knots(frames, knots, order)
    kept, _ = split_sightings(frames, knots, tracking, order, Histories(there, there > 0))
    error = kept["centre_mm"].to_numpy() - (8 + 0.1 * np.arange(10))
    assert np.abs(error).max() <= 0.25 and np.abs(error).mean() < 0.4 * np.abs(off).mean() + 0.05
    assert kept["centre_mm"].iloc[[0, -1]].tolist() == pytest.approx([8.0, 8.9])


def test_two_that_meet_merge_into_the_one_that_goes_on() -> None:
    apart = {i: [8.0 + 0.2 * i, 10.4 - 0.2 * i] for i in range(5)}
    told = track(apart | {i: [9.2] for i in range(5, 14)}, 14)
    assert len(told.tracks) == 2
    assert sorted(end.split()[0] for end in told.tracks["end"]) == ["lasts", "merged"]


def test_one_that_divides_splits() -> None:
    told = track({i: [9.0] for i in range(5)} | {i: [8.7, 9.6] for i in range(5, 10)}, 10)
    assert len(told.tracks) == 2
    assert told.tracks["origin"].tolist() == ["nucleated", "split from 0"]


def test_one_that_dissolves_vanishes_and_a_lone_sighting_is_not_confirmed() -> None:
    told = track({i: [9.0] for i in range(6)} | {12: [15.0]}, 20)
    assert told.tracks["end"].tolist() == ["vanished", "vanished"]
    assert told.tracks["confirmed"].tolist() == [True, False]


def test_without_a_scale_the_pixels_serve() -> None:
    frames, knots = tables({i: [8 + 0.1 * i, 12.0] for i in range(8)}, 8)
    knots["max_diameter_mm"] *= 1.0 + 0.05 * knots["frame"]
    in_px = [without_scale(table, 0.0228) for table in (frames, knots)]
    told = track_knots(*in_px, order_frames(frames)).tracks
    wanted = track_knots(with_px(frames, 0.0228), with_px(knots, 0.0228), order_frames(frames))
    assert told["sightings"].tolist() == [8, 8]
    assert told["growth"].tolist() == pytest.approx(wanted.tracks["growth"].tolist())
    assert told["growth"].min() > 0.2 and told["max_diameter_mm"].isna().all()
    in_px_alone = ["first_centre_px", "last_centre_px", "max_diameter_px"]
    assert np.allclose(told[in_px_alone], wanted.tracks[in_px_alone])


def test_what_is_larger_than_any_coil_is_none_without_a_scale_either() -> None:
    frames, knots = tables({i: [8.0] for i in range(8)}, 8)
    knots = knots.assign(max_diameter_mm=6.0 * D)
    for change in (with_px, without_scale):
        told = track_knots(change(frames, 0.0228), change(knots, 0.0228), order_frames(frames))
        assert told.artefact.all()
