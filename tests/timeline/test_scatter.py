"""Uncertainties widened by what neighbouring frames differ by."""

import numpy as np
import pandas as pd

from tsvision.timeline.scatter import with_scatter


def rows(turns: np.ndarray, pitch_px: np.ndarray, coiled: bool = False) -> pd.DataFrame:
    d = np.full(turns.size, 20.0)
    beta = np.arctan(np.pi * d / pitch_px)
    return pd.DataFrame(
        {
            "frame": np.arange(turns.size),
            "turns": turns,
            "diameter_px": d,
            "diameter_px_sd": 0.2,
            "pitch_px": pitch_px,
            "pitch_px_sd": 0.1,
            "pitch_mm": 0.03 * pitch_px,
            "pitch_mm_sd": 0.003,
            "helix_angle_rad": beta,
            "helix_angle_rad_sd": 0.01,
            "coil_pitch_mm": 0.9 if coiled else np.nan,
        }
    )


def widened(frames: pd.DataFrame) -> pd.DataFrame:
    return with_scatter(frames)


def test_a_pitch_that_falls_with_the_turns_is_no_scatter() -> None:
    turns = np.linspace(3.0, 20.0, 30)
    frames = rows(turns, 750.0 / turns)
    told = widened(frames)
    # The first frames have neighbours to one side only; 1 / p is a line all the same.
    assert np.allclose(told["pitch_px_sd"], 0.1, rtol=1e-6)
    assert np.allclose(told["helix_angle_rad_sd"], 0.01, rtol=1e-6)


def test_fits_that_jump_between_hollows_are_told_by_their_uncertainty() -> None:
    turns = np.linspace(20.0, 40.0, 60)
    jumps = np.random.default_rng(4).normal(1.0, 0.08, turns.size)
    frames = rows(turns, 30.0 * jumps, coiled=True)
    held = np.abs(frames["pitch_px"] - 30.0) < 1.96 * frames["pitch_px_sd"]
    assert held.mean() < 0.2
    told = widened(frames)
    held = np.abs(told["pitch_px"] - 30.0) < 1.96 * told["pitch_px_sd"]
    assert 0.9 <= held.mean() <= 1.0
    assert told["pitch_px_sd"].median() < 4.0  # 8 % of 30 px are 2.4
    assert np.allclose(told["pitch_mm_sd"], 0.03 * told["pitch_px_sd"], rtol=1e-3)
    off = np.abs(told["helix_angle_rad"] - np.arctan(np.pi * 20.0 / 30.0))
    assert (off < 1.96 * told["helix_angle_rad_sd"]).mean() >= 0.9


def test_the_lay_angle_is_widened_by_what_its_own_tangent_scatters() -> None:
    turns = np.linspace(3.0, 20.0, 40)
    beta = np.deg2rad(50.0)
    jumps = np.random.default_rng(2).normal(1.0, 0.03, turns.size)
    frames = rows(turns, np.pi * 20.0 / np.tan(beta) * jumps)
    lay = np.arctan(0.5 * np.tan(frames["helix_angle_rad"]))  # two strands
    told = widened(frames.assign(lay_angle_rad=lay, lay_angle_rad_sd=0.0))
    tan_share = np.hypot(0.0, told["pitch_px_sd"] / told["pitch_px"])
    # The pitch's own 0.1 px of 53 adds 0.2 % to what scatters by 3 %.
    assert np.allclose(told["lay_angle_rad_sd"], 0.5 * np.sin(2 * lay) * tan_share, rtol=0.01)


def test_a_single_frame_far_off_is_told_and_its_neighbours_are_not() -> None:
    turns = np.linspace(3.0, 20.0, 30)
    pitch = 750.0 / turns
    pitch[12] *= 1.3
    told = widened(rows(turns, pitch))
    assert told["pitch_px_sd"][12] > 0.3 * abs(pitch[12] - 750.0 / turns[12])
    beside = [8, 9, 10, 11, 13, 14, 15, 16]
    assert (told["pitch_px_sd"][beside] < 0.5).all()


def test_a_coil_is_not_compared_with_the_straight_bundle_before_it() -> None:
    turns = np.linspace(3.0, 20.0, 40)
    frames = rows(turns, np.where(turns < 12.0, 750.0 / turns, 80.0))
    frames["coil_pitch_mm"] = np.where(turns < 12.0, np.nan, 2.0)
    assert np.allclose(widened(frames)["pitch_px_sd"], 0.1, rtol=1e-6)


def test_rows_without_a_value_and_short_recordings_stay_as_they_are() -> None:
    turns = np.linspace(3.0, 20.0, 30)
    frames = rows(turns, 750.0 / turns)
    frames.loc[5, ["pitch_px", "pitch_px_sd", "helix_angle_rad"]] = np.nan
    told = widened(frames)
    assert np.isnan(told["pitch_px_sd"][5])
    assert told["diameter_px_sd"][5] == 0.2
    assert np.isfinite(told["pitch_px_sd"].drop(5)).all()
    short = rows(turns[:3], np.array([40.0, 10.0, 90.0]))
    assert widened(short).equals(short)
    unturned = rows(np.full(30, np.nan), np.full(30, 40.0))
    assert np.allclose(widened(unturned)["pitch_px_sd"], 0.1)


def test_turns_and_string_seen_are_compared_with_their_neighbours_too() -> None:
    turns = np.linspace(20.0, 40.0, 60)
    frames = rows(turns, np.full(60, 30.0), coiled=True)
    noise = np.random.default_rng(6).normal(0.0, 1.0, 60)
    frames["turns_seen"], frames["turns_seen_sd"] = turns + noise, 0.15
    frames["string_length_mm"], frames["string_length_mm_sd"] = 30.0 + 0.2 * turns, 0.1
    frames.loc[0, "turns_seen"] = 0.0
    told = widened(frames)
    held = np.abs(noise) < 1.96 * told["turns_seen_sd"]
    assert held[1:].mean() >= 0.9
    assert told["turns_seen_sd"].notna().all()
    assert np.allclose(told["string_length_mm_sd"], 0.1, rtol=1e-6)
