"""The page of a verdict: every drawing holds its readings, and the signatures add up."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import numpy as np
import pytest

from cli.main import run
from tests.hidden import planted
from tsvision.diagnosis.diagnose import diagnose
from tsvision.diagnosis.drawing import Panel, bars, panel
from tsvision.diagnosis.page import page
from tsvision.diagnosis.table import table_from_rows
from tsvision.diagnosis.verdict import Verdict
from tsvision.records import Rig


@pytest.fixture(scope="module")
def verdict() -> Verdict:
    setting = planted.Setting(count=4, levels=7, outliers=0.0)
    rows = planted.pair_case("radius_bias", "backlash", 960_001, setting).rows
    return diagnose(table_from_rows(list(rows[0]), rows, Rig()))


def test_each_drawing_holds_each_reading(verdict: Verdict) -> None:
    text = page(verdict.to_json())
    drawings = re.findall(r"<svg.*?</svg>", text, re.S)
    scatter = [d for d in drawings if "<circle" in d]
    assert len(scatter) == 2 * len(verdict.data["observables"])
    assert sum(d.count("<circle") for d in scatter) == 2 * verdict.data["rows"]
    named = {cause.title.lower() for cause in verdict.causes}
    assert named and all(sum(name in d for d in drawings) >= 3 for name in named)
    assert "leave-one-load-out" in text and "<script" not in text


def test_backlash_shows_on_the_way_back_only(verdict: Verdict) -> None:
    moved = [
        (row["branch"], row["effects"]["backlash"])
        for row in verdict.rows
        if row["observable"] == "displacement_mm"
    ]
    assert all(change == 0.0 for branch, change in moved if branch == "wind")
    assert max(change for branch, change in moved if branch == "unwind") > 0.2


def test_rms_by_load_and_branch_is_that_of_the_rows(verdict: Verdict) -> None:
    off = [
        row["value"] - row["extended"]
        for row in verdict.rows
        if row["observable"] == "displacement_mm"
        and row["branch"] == "unwind"
        and row["load_N"] < 10
        and row["weight"] > 0.2
    ]
    assert f"{np.sqrt(np.mean(np.square(off))):.3g} mm" in page(verdict.to_json())


def test_a_panel_by_hand() -> None:
    drawn = Panel(
        title="x < y",
        x=np.array([0.0, 10.0]),
        y=np.array([0.0, 1.0]),
        group=("a", "a"),
        open=np.array([False, True]),
        run=("r", "r"),
    )
    text = panel(drawn, {"a": "#123456"})
    assert "x &lt; y" in text
    assert 'cx="52.0" cy="196.0"' in text  # the origin: lower left corner of the axes
    assert 'cx="330.0" cy="26.0"' in text  # the largest of both: upper right
    assert text.count('fill="none"') == 1
    assert 'width="620.0"' in bars([("whole", 4.0), ("none", -1.0)])


def test_the_command_writes_it(tmp_path: Path) -> None:
    data = tmp_path / "diameters.csv"
    with open(data, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["strings", "observable", "value", "string_diameter_mm"])
        for n, d in enumerate((0.24, 0.47, 0.60, 0.70, 0.79, 0.86, 0.95, 0.99), start=1):
            writer.writerow([n, "diameter_mm", d, 0.24])
    out = tmp_path / "page.html"
    assert run(["diagnose", str(data), "--page", str(out)]) == 0
    assert out.read_text(encoding="utf-8").count("<circle") == 16
