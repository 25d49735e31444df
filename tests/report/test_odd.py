"""Measurements at their emptiest still give a page that draws without complaint."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.report.chromium import CHROMIUM, ask
from tests.report.fake_measurement import Fake, write_fake
from tsvision.images.frames import open_recording
from tsvision.report.many import write_overview
from tsvision.report.page import write_report
from tsvision.report.sheet import write_sheet

LOOK = """
const main = document.querySelector("main").innerHTML;
return { where: document.getElementById("where").textContent,
         bad: ["NaN", "undefined", "Infinity"].filter((word) => main.includes(word)) };
"""


def _one_frame(folder: Path) -> Fake:
    return write_fake(folder, turns=np.array([30.0]), unreadable=None)


def _nothing_measured(folder: Path) -> Fake:
    made = write_fake(folder, turns=np.linspace(0, 9, 3), unreadable=0)
    for table in ("profiles", "knots"):
        path = made.measure_dir / f"{table}.parquet"
        pd.read_parquet(path).iloc[:0].to_parquet(path, index=False)
    path = made.measure_dir / "frames.parquet"
    frames = pd.read_parquet(path)
    numbers = frames.select_dtypes("float").columns
    frames[numbers] = np.nan
    frames[["phase", "handedness", "flags"]] = ["", "", "NO_BUNDLE|NO_TURNS"]
    frames.to_parquet(path, index=False)
    return made


def _turns_unknown(folder: Path) -> Fake:
    made = write_fake(folder, turns=np.linspace(0, 60, 6))
    path = made.measure_dir / "frames.parquet"
    frames = pd.read_parquet(path)
    frames["turns"] = np.nan
    frames.to_parquet(path, index=False)
    return made


def _flags_of_a_newer_version(folder: Path) -> Fake:
    made = write_fake(folder, turns=np.linspace(0, 60, 6))
    path = made.measure_dir / "frames.parquet"
    frames = pd.read_parquet(path)
    frames["flags"] = "NEVER_HEARD_OF"
    frames["phase"] = "spaghetti"
    frames.to_parquet(path, index=False)
    return made


@pytest.mark.parametrize(
    "make", [_one_frame, _nothing_measured, _turns_unknown, _flags_of_a_newer_version]
)
def test_page_sheet_and_overview_stand(make, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    made = make(tmp_path)
    recording = open_recording(made.recording_dir)
    page = write_report(made.measure_dir, recording)
    write_sheet(made.measure_dir, recording, width_px=800)
    write_overview([made.measure_dir], tmp_path / "over.html")
    if CHROMIUM is None:
        pytest.skip("the page was written; no Chromium on this machine to draw it")
    seen, console = ask(page, LOOK, tmp_path)
    assert console == []
    assert seen["bad"] == []
    assert seen["where"]


@pytest.mark.parametrize(
    "name", ["a\nb_{:03d}.png", "ünï 漢字 {:03d}.png", "'\"&amp;</script>{:03d}.png"]
)
def test_any_file_name_is_text(name: str, tmp_path: Path) -> None:
    if "/" in name:
        name = name.replace("/", "\u2215")
    made = write_fake(tmp_path, turns=np.linspace(0, 30, 2), name=name, unreadable=None)
    page = write_report(made.measure_dir, open_recording(made.recording_dir))
    assert page.read_text("utf-8").count("</script>") == 3
