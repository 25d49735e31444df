"""Folders and tables that grow are read as finished ones are."""

from __future__ import annotations

import threading
import time
from pathlib import Path

import numpy as np
import pytest

from tests.live.made import write_picture
from tsvision.errors import InputError
from tsvision.images.turns import read_turns
from tsvision.live.sources import growing_folder, turns_from_file, turns_from_name, turns_per_frame


def test_a_growing_folder_yields_in_order_and_waits_for_half_written_pictures(
    tmp_path: Path,
) -> None:
    write_picture(tmp_path / "f2.png")
    whole = (tmp_path / "f2.png").read_bytes()

    def grow() -> None:
        time.sleep(0.1)
        (tmp_path / "f10.png").write_bytes(whole[: len(whole) // 2])
        time.sleep(0.15)
        (tmp_path / "f10.png").write_bytes(whole)

    writer = threading.Thread(target=grow)
    writer.start()
    came = list(growing_folder(tmp_path, turns_per_frame(0.5), idle_s=0.6))
    writer.join()
    assert [a.frame.file for a in came] == ["f2.png", "f10.png"]
    assert [a.turns for a in came] == [0.0, 0.5]
    assert came[1].frame.pixels is not None


def test_turns_come_from_a_growing_table_or_a_lone_number(tmp_path: Path) -> None:
    table = tmp_path / "turns.csv"
    read = turns_from_file(table)
    assert np.isnan(read(0, "f0.png", 0.0))
    table.write_text("file,turns\nf0.png,1.5\n")
    assert read(0, "f0.png", 0.0) == 1.5
    table.write_text("file,turns\nf0.png,1.5\nf1.png,2.5\n")
    assert read(1, "f1.png", 0.0) == 2.5
    number = tmp_path / "now.txt"
    number.write_text("17.25\n")
    assert turns_from_file(number)(9, "x", 0.0) == 17.25


@pytest.mark.parametrize(
    "table",
    [
        "file;turns\na.png;1.5\nb.png;2\n",
        "frame, turns\n0, 1.5\n1, 2\n",
        "file\tturns\nrun 3/a.png\t1.5\nrun 3\\b.png\t2\n",
        "turns,load_N\n1.5,3\n\n2,3\n",
    ],
)
def test_a_growing_table_reads_as_a_finished_one_does(tmp_path: Path, table: str) -> None:
    path = tmp_path / "turns.csv"
    path.write_text(table)
    read = turns_from_file(path)
    files = ("a.png", "b.png")
    growing = [read(i, name, 0.0) for i, name in enumerate(files)]
    assert growing == read_turns(path, files).turns.tolist() == [1.5, 2.0]


def test_what_no_finished_table_may_hold_is_refused_once_its_line_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "turns.csv"
    read = turns_from_file(path)
    for text, wrong in (
        ("file,turn\na.png,1.5", "no column 'turns'; rename 'turn'"),
        ("file,turns\na.png,one", "is no number"),
        ("file,turns\na.png,1,5", "3 values under 2 columns"),
        ("frame,turns\n0.5,1.5", "no whole number"),
    ):
        path.write_text(text)
        assert np.isnan(read(0, "a.png", 0.0))
        path.write_text(text + "\n")
        with pytest.raises(InputError, match=wrong):
            read(0, "a.png", 0.0)


def test_a_half_written_last_line_is_waited_for(tmp_path: Path) -> None:
    path = tmp_path / "turns.csv"
    read = turns_from_file(path)
    whole = "file,turns\na.png,1.5\ngrün.png,12.5\n".encode()
    for end in range(len(whole) + 1):
        path.write_bytes(whole[:end])
        first, second = read(0, "a.png", 0.0), read(1, "grün.png", 0.0)
        assert first in (1.0, 1.5) or (np.isnan(first) and end < whole.index(b"1.5") + 1)
    assert (first, second) == (1.5, 12.5)
    path.write_text("frame,turns\n1,2.5\n1")  # the beginning of frame 10 or more
    assert read(1, "x", 0.0) == 2.5


def test_turns_in_file_names_are_read_by_the_rules_of_a_finished_recording() -> None:
    read = turns_from_name("t([0-9.a-z]+)_")
    assert read(0, "t12.5_x.png", 0.0) == 12.5
    assert np.isnan(read(0, "x.png", 0.0))
    with pytest.raises(InputError, match="is not a number"):
        read(0, "tx_.png", 0.0)
