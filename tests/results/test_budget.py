"""The parts of an uncertainty, worked out by hand and added up."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tsvision.records import FrameRow
from tsvision.results.budget import budget_table, typical_budget, write_budget


def frames() -> pd.DataFrame:
    scaled = FrameRow(
        0,
        "a",
        diameter_px=20.0,
        diameter_px_sd=0.3,
        diameter_mm=0.4,
        diameter_mm_sd=np.hypot(0.3 * 0.02, 20 * 0.0002),
        pitch_px=50.0,
        pitch_px_sd=0.1,
        pitch_mm=1.0,
        pitch_mm_sd=np.hypot(0.1 * 0.02, 50 * 0.0002),
        helix_angle_rad=np.pi / 4,
        helix_angle_rad_sd=0.5 * np.hypot(0.3 / 20, 0.1 / 50),
        mm_per_px=0.02,
        mm_per_px_sd=0.0002,
    )
    unscaled = FrameRow(1, "b", diameter_px=20.0, diameter_px_sd=0.3)
    more = FrameRow(
        2, "c", diameter_px=10.0, diameter_px_sd=0.3, diameter_mm_sd=0.01, mm_per_px=0.02,
        mm_per_px_sd=0.0,
    )  # fmt: skip
    empty = FrameRow(3, "d")
    told = FrameRow(
        4, "e", diameter_px=20.0, diameter_px_sd=1.3, diameter_px_sd_noise=0.1,
        diameter_px_sd_light=0.3, diameter_px_sd_blur=0.3, diameter_px_sd_section=0.9,
        diameter_mm=0.4, diameter_mm_sd=0.026, mm_per_px=0.02, mm_per_px_sd=0.0,
    )  # fmt: skip
    return pd.DataFrame([asdict(row) for row in (scaled, unscaled, more, empty, told)])


def part(table: pd.DataFrame, frame: int, quantity: str) -> dict[str, float]:
    rows = table[(table["frame"] == frame) & (table["quantity"] == quantity)]
    return dict(zip(rows["source"].str.split(" ").str[0], rows["sd"], strict=True))


def test_parts_by_hand() -> None:
    table = budget_table(frames())
    assert part(table, 0, "bundle diameter") == pytest.approx({"picture": 0.006, "scale": 0.004})
    assert part(table, 0, "pitch") == pytest.approx({"picture": 0.002, "scale": 0.01})
    half = np.degrees(0.5)  # sin 45° cos 45°
    expected = {"diameter": half * 0.015, "pitch": half * 0.002}
    assert part(table, 0, "helix angle") == pytest.approx(expected)


def test_parts_add_up_and_a_remainder_is_told() -> None:
    table = budget_table(frames())
    first = table[table["frame"] == 0]
    for _, rows in first.groupby("quantity"):
        assert rows["share_percent"].sum() == pytest.approx(100)
    third = part(table, 2, "bundle diameter")
    assert third["other"] == pytest.approx(np.sqrt(0.01**2 - 0.006**2))


def test_what_in_the_picture_makes_a_diameter_unsure() -> None:
    table = budget_table(frames())
    rows = table[table["frame"] == 4]
    sds = dict(zip(rows["source"], 50.0 * rows["sd"], strict=True))
    scatter = np.sqrt(1.3**2 - 0.1**2 - 2 * 0.3**2 - 0.9**2)
    assert sds == pytest.approx(
        {
            "picture: noise of the edges": 0.1,
            "picture: light at the limbs": 0.3,
            "picture: blur at the limbs": 0.3,
            "picture: how the strands lie": 0.9,
            "picture: scatter about the frames beside it": scatter,
            "scale": 0.0,
        }
    )
    assert rows["share_percent"].sum() == pytest.approx(100)


def test_an_older_table_tells_the_picture_as_one() -> None:
    old = frames().drop(columns=[c for c in frames() if c.startswith("diameter_px_sd_")])
    assert part(budget_table(old), 0, "bundle diameter") == pytest.approx(
        {"picture": 0.006, "scale": 0.004}
    )


def test_without_a_scale_in_px_and_without_a_value_nothing() -> None:
    table = budget_table(frames())
    second = table[table["frame"] == 1]
    assert second["unit"].unique().tolist() == ["px"]
    assert second["sd"].tolist() == [0.3]
    assert 3 not in set(table["frame"])


def test_typical_and_file(tmp_path: Path) -> None:
    table = budget_table(frames())
    typical = typical_budget(table)
    assert set(typical["quantity"]) == {"bundle diameter", "pitch", "helix angle"}
    assert len(pd.read_csv(write_budget(tmp_path, frames()))) == len(table)
    assert typical_budget(table.iloc[:0]).empty
