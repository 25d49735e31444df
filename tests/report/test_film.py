"""The overlay film keeps the recording's length, the sheet shows every frame it was given."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import av
import cv2
import numpy as np
import pytest

from tests.report.fake_measurement import write_fake
from tsvision.errors import InputError
from tsvision.images.frames import open_recording
from tsvision.records import FrameRow
from tsvision.report.sheet import lay_out, write_sheet
from tsvision.report.video import own_rate, write_overlay_video


def test_one_picture_a_frame_even_where_the_first_are_broken(tmp_path: Path) -> None:
    made = write_fake(tmp_path, turns=np.linspace(0, 60, 6), unreadable=0)
    recording = open_recording(made.recording_dir)
    path = write_overlay_video(made.measure_dir, recording)
    with av.open(str(path)) as film:
        stream = film.streams.video[0]
        assert stream.codec_context.name == "h264"
        pictures = [f.to_ndarray(format="bgr24") for f in film.decode(stream)]
    assert len(pictures) == 6
    assert pictures[0][60:, :, :].std() < 3  # grey: it could not be decoded
    vermillion = np.abs(pictures[5].astype(int) - (0, 94, 213)).sum(axis=2) < 90
    assert vermillion.sum() > 200  # two knot boxes
    assert not list(made.measure_dir.glob(".*"))


def test_lines_are_drawn_after_a_large_picture_is_made_small(tmp_path: Path) -> None:
    made = write_fake(tmp_path, turns=np.linspace(30, 60, 2), unreadable=None)
    for file in made.recording_dir.glob("*.png"):
        picture = cv2.imread(str(file))
        below, beside = 3600 - picture.shape[0], 6000 - picture.shape[1]
        large = cv2.copyMakeBorder(picture, 0, below, 0, beside, cv2.BORDER_CONSTANT)
        cv2.imwrite(str(file), large)
    path = write_overlay_video(made.measure_dir, open_recording(made.recording_dir))
    with av.open(str(path)) as film:
        last = [f.to_ndarray(format="bgr24") for f in film.decode(video=0)][-1]
    assert last.shape[0] <= 1080
    assert last.shape[1] <= 1920
    green = np.abs(last.astype(int) - (115, 158, 0)).sum(axis=2) < 120  # the measured region
    assert green.sum() > 60


def test_film_runs_at_the_recording_s_own_rate() -> None:
    assert own_rate(np.full(4, np.nan)) == 8.0
    assert own_rate(np.array([0.0, 0.04, np.nan, 0.12])) == pytest.approx(1 / 0.06)


def test_film_runs_by_the_times_that_were_measured_with(tmp_path: Path) -> None:
    made = write_fake(tmp_path, turns=np.linspace(0, 60, 4))
    recording = open_recording(made.recording_dir)
    other = replace(recording, time_s=np.arange(4) / 25.0)
    rate = own_rate(np.array([row.time_s for row in made.rows]))
    with av.open(str(write_overlay_video(made.measure_dir, other))) as film:
        assert float(film.streams.video[0].average_rate) == pytest.approx(rate)
    assert rate < 25.0


def test_nothing_to_film_is_said(tmp_path: Path) -> None:
    made = write_fake(tmp_path, turns=np.linspace(0, 60, 2))
    recording = open_recording(made.recording_dir)
    for file in made.recording_dir.glob("*.png"):
        file.write_bytes(b"")
    with pytest.raises(InputError, match="decoded"):
        write_overlay_video(made.measure_dir, recording)
    with pytest.raises(InputError, match="decoded"):
        write_sheet(made.measure_dir, recording)
    assert {p.suffix for p in made.measure_dir.iterdir()} == {".parquet", ".csv", ".json"}


def test_sheet_holds_every_tile_apart() -> None:
    tiles = [np.full((40, 100, 3), 10 * (i + 1), np.uint8) for i in range(7)]
    sheet = lay_out(tiles, [FrameRow(i, "x.png") for i in range(7)], 500)
    assert sheet.shape[1] == 500
    for i in range(7):
        assert (sheet == 10 * (i + 1)).all(axis=2).sum() >= 40 * 90


def test_sheet_is_written(tmp_path: Path) -> None:
    made = write_fake(tmp_path, turns=np.linspace(0, 60, 9))
    path = write_sheet(made.measure_dir, open_recording(made.recording_dir), width_px=1600)
    picture = cv2.imread(str(path))
    assert picture.shape[1] == 1600
