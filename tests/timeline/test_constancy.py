"""Does D beside the separator stay as it is? Tables whose truth is known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest

from tsvision.timeline.constancy import constancy_in_words, near_separator

BETA_DEG = 50.0


def table(
    grows_percent: float = 0.0,
    noise_percent: float = 0.3,
    seed: int = 0,
    alike: float = 0.0,
    strings: int = 2,
    frames: int = 30,
) -> pd.DataFrame:
    """Frames of which the last two thirds overtwist; D grows by so much through these, beta with
    it at the same pitch, and scatters, each frame as far off as the one before by `alike`."""
    turns = np.linspace(2.0, 32.0, frames)
    coiled = turns >= 12.0
    random = np.random.default_rng(seed)
    noise = random.standard_normal(frames)
    for i in range(1, frames):
        noise[i] = alike * noise[i - 1] + np.sqrt(1.0 - alike**2) * noise[i]
    past = np.clip((turns - turns[coiled][0]) / np.ptp(turns[coiled]), 0.0, 1.0)
    share = np.exp(0.01 * (grows_percent * past + noise_percent * noise))
    return pd.DataFrame(
        {
            "frame": np.arange(frames),
            "turns": turns,
            "phase": np.where(coiled, "overtwist", "twist"),
            "strand_count": float(strings),
            "diameter_px": 40.0 * share,
            "helix_angle_rad": np.arctan(np.tan(np.radians(BETA_DEG)) * share),
            "flags": "",
        }
    )


def told(frames: pd.DataFrame, quantity: str = "diameter") -> Any:
    return near_separator(frames)[quantity]


def test_what_stays_is_constant_and_says_what_it_would_have_seen() -> None:
    found = told(table())
    assert found["status"] == "constant"
    assert found["low"] < 0.0 < found["high"]
    assert 6.0 < found["detectable"] < 9.0
    assert (found["first_turns"], found["last_turns"]) == pytest.approx((12.0, 32.0), abs=1.1)
    assert told(table(), "helix_angle")["status"] == "constant"


@pytest.mark.parametrize("grows", [-12.0, 8.0])
def test_what_changes_by_more_than_the_margin_is_told_by_how_much(grows: float) -> None:
    found = told(table(grows))
    assert found["status"] == "changes"
    assert found["low"] < grows < found["high"]
    beta = told(table(grows), "helix_angle")
    slope = np.degrees(0.5 * np.sin(2.0 * np.radians(BETA_DEG)))
    assert beta["low"] < 0.01 * grows * slope < beta["high"]


def test_what_may_be_the_coils_own_is_not_called_a_change() -> None:
    assert told(table(0.5))["status"] == "constant"
    assert told(table(3.0))["status"] == "undetermined"


def test_noise_that_hides_the_margin_proves_nothing() -> None:
    found = told(table(noise_percent=8.0))
    assert found["status"] == "undetermined"
    assert found["detectable"] > found["margin"]


@pytest.mark.parametrize("alike", [0.0, 0.6])
def test_the_interval_holds_and_equivalence_is_not_claimed_at_the_margin(alike: float) -> None:
    """Of many recordings that change by just the margin few may be called constant."""
    grows, held, constant = 5.0, 0, 0
    for seed in range(200):
        found = told(table(grows, 1.2, seed, alike))
        held += found["low"] < grows < found["high"]
        constant += found["status"] == "constant"
    assert held >= 0.9 * 200
    assert constant <= 0.1 * 200


def test_frames_that_tell_nothing_of_their_own_are_left_out() -> None:
    frames = table()
    frames.loc[20:, "flags"] = "COIL_UNEVEN|FIBRES"
    frames.loc[20:, "diameter_px"] *= 1.3
    found = told(frames)
    assert found["status"] == "constant" and found["last_turns"] < 23.0


def test_few_frames_or_none_are_too_few() -> None:
    for frames in (table().iloc[:12], table().assign(phase="twist"), table().iloc[:0]):
        found = told(frames)
        assert found["status"] == "undetermined" and found["change"] is None
    assert constancy_in_words(near_separator(table().iloc[:12])) == []


def test_more_than_two_strands_bend_and_are_less_sure() -> None:
    two, six = told(table()), told(table(strings=6))
    assert six["detectable"] > two["detectable"] + 0.5


def test_in_words() -> None:
    lines = constancy_in_words(near_separator(table(8.0)))
    assert len(lines) == 2
    assert (
        lines[0].startswith("D beside the separator changes by +8") and "not constant" in lines[0]
    )
    assert "would have been seen" in lines[1]
    falls = constancy_in_words(near_separator(table(-8.0)))[0]
    assert "changes by \u2212" in falls and "-" not in falls
