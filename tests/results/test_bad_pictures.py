"""The real measuring on pictures without a bundle: every row stays, with its flag."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from cli.main import run
from tsvision.results import read_measurement
from tsvision.run import measure_to_folder

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("default")]


def write_png(path: Path, pixels: np.ndarray) -> None:
    assert cv2.imwrite(str(path), pixels)


def test_nothing_to_see_anywhere(tmp_path: Path) -> None:
    random = np.random.default_rng(0)
    film = tmp_path / "film"
    film.mkdir()
    noise = random.integers(0, 255, (200, 300)).astype(np.uint8)
    gradient = np.tile(np.linspace(0, 255, 300).astype(np.uint8), (200, 1))
    write_png(film / "f0.png", noise)
    write_png(film / "f1.png", np.full((200, 300), 128, np.uint8))
    write_png(film / "f2.png", np.full((200, 300, 3), 255, np.uint8))
    write_png(film / "f3.png", gradient)
    (film / "f4.png").write_bytes(b"")
    write_png(film / "f5.png", noise[:150])
    (film / "turns.csv").write_text("frame,turns\n0,0\n1,1\n2,2\n3,3\n4,4\n")
    out = measure_to_folder(film, tmp_path / "out")
    found = read_measurement(out)
    assert found.frames["frame"].tolist() == list(range(6))
    assert found.frames["turns"].isna().tolist() == [False] * 5 + [True]
    flags = [set(text.split("|")) for text in found.frames["flags"]]
    assert "BLANK" in flags[1] and "BLANK" in flags[2]
    assert "UNREADABLE" in flags[4]
    assert "WRONG_SIZE" in flags[5] and "NO_TURNS" in flags[5]
    assert all(flags)
    assert found.frames["diameter_px"].isna().all()
    assert found.summary["frames_measured"] == 0
    assert found.summary["knot_onset"]["status"] == "undetermined"
    assert found.summary["knot_onset"]["turns"] is None


def test_one_picture_of_noise(tmp_path: Path, capsys) -> None:
    noise = np.random.default_rng(1).integers(0, 255, (120, 160)).astype(np.uint8)
    write_png(tmp_path / "f.png", noise)
    out = tmp_path / "out"
    assert run(["measure", str(tmp_path / "f.png"), "--out", str(out), "-q"]) == 0
    assert "1 frames, 0 measured, 1 flagged" in capsys.readouterr().out
