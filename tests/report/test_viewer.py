"""What Rerun is given: every frame on both timelines, and strands that keep their numbers."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.report.fake_measurement import fake_frame, write_fake
from tsvision.errors import InputError
from tsvision.images.frames import open_recording
from tsvision.records import FrameRow
from tsvision.report import viewer
from tsvision.report.viewer import strand_lines, write_viewer_file

ROW = fake_frame(3, "x.png", 12.0, False)[0]


def test_strands_lie_at_the_strand_centre_radius_and_repeat_every_pitch() -> None:
    strands = strand_lines(replace(ROW, coil_amplitude_mm=0.0), 2, 0.24)
    assert len(strands.lines_mm) == 2
    assert strands.radius_mm == 0.12
    x, y, z = strands.lines_mm[0].T
    np.testing.assert_allclose(np.hypot(y, z), (ROW.diameter_mm - 0.24) / 2)
    turns = np.abs(np.unwrap(np.arctan2(z, y))[-1] - np.arctan2(z, y)[0]) / (2 * np.pi)
    assert turns == pytest.approx((x[-1] - x[0]) / ROW.pitch_mm, rel=1e-6)
    np.testing.assert_allclose(strands.lines_mm[1][:, 1:], -strands.lines_mm[0][:, 1:], atol=1e-12)


def test_handedness_mirrors_the_strands() -> None:
    left, right = (
        strand_lines(replace(ROW, handedness=h, coil_amplitude_mm=0.0), 2, 0.24) for h in "SZ"
    )
    np.testing.assert_allclose(left.lines_mm[0] * (1, 1, -1), right.lines_mm[0], atol=1e-12)


def test_coiling_swings_by_the_measured_rms() -> None:
    row = replace(ROW, coil_amplitude_mm=0.2, coil_pitch_mm=2.0)
    strands = strand_lines(row, 2, 0.24)
    centre = (strands.lines_mm[0] + strands.lines_mm[1]) / 2
    assert centre[:, 1].std() == pytest.approx(0.2, rel=0.05)


def test_nothing_known_gives_no_strands() -> None:
    assert strand_lines(FrameRow(0, "x.png"), 2).lines_mm == ()


def test_without_rerun_the_mend_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(InputError, match=r"tsvision\[viewer\]"):
        viewer._rerun()


@pytest.mark.skipif(importlib.util.find_spec("rerun") is None, reason="Rerun is not installed")
def test_every_frame_is_on_the_timelines(tmp_path: Path) -> None:
    made = write_fake(tmp_path, turns=np.linspace(0, 60, 7), unreadable=2)
    path = write_viewer_file(made.measure_dir, open_recording(made.recording_dir))
    command = [sys.executable, "-m", "rerun", "rrd", "stats", str(path)]
    environment = {**os.environ, "HOME": str(tmp_path)}
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=120, check=True, env=environment
    )
    table = pd.read_parquet(made.measure_dir / "frames.parquet")
    scalars = table[[column for column, _ in viewer._SCALARS.values()]].notna().to_numpy().sum()
    # 6 pictures, 7 frames of 5 kinds of lines and the strands, the scalars, the file's own line
    assert f"num_rows = {6 + 7 * 5 + 7 + scalars + 1}\n" in done.stdout
    for entity in ("/picture/edges", "/picture/knots", "/strands", "/measured/diameter"):
        assert f"{entity}:" in done.stdout
