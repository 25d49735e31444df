"""Turns are never shifted against frames in silence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tsvision.errors import InputError
from tsvision.images.turns import read_turns

FILES = tuple(f"f{i}.png" for i in range(4))
NAN = float("nan")


def turns_of(tmp_path: Path, text: str, **options) -> np.ndarray:
    table = tmp_path / "turns.csv"
    table.write_text(text)
    return read_turns(table, FILES, **options).turns


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("frame,turns\n0,0\n1,5\n2,10\n3,-15\n", [0, 5, 10, -15]),
        ("frame,turns\n3,15\n0,0\n2,10\n1,5\n", [0, 5, 10, 15]),
        ("file,turns\nf3.png,3\nf0.png,0\n", [0, NAN, NAN, 3]),
        ("file,turns\nruns\\a\\f3.png,3\n", [NAN, NAN, NAN, 3]),
        ("turns\n1\n2\n3\n4\n", [1, 2, 3, 4]),
        ("\ufeffframe;turns\r\n0;1.5\r\n1;2.5\r\n", [1.5, 2.5, NAN, NAN]),
        ("frame\tturns\n0\t1\n", [1, NAN, NAN, NAN]),
        ("frame,turns\n0,\n1,nan\n2,NA\n3,7\n", [NAN, NAN, NAN, 7]),
        ("frame,turns\n0,1\n0,1\n", [1, NAN, NAN, NAN]),
        ("frame,file,turns\n9,f1.png,5\n", [NAN, 5, NAN, NAN]),  # the file name wins
        ("file,turns\nf1.png,5\ngone.png,6\n", [NAN, 5, NAN, NAN]),
        (" frame , turns \n 0 , 2 \n\n", [2, NAN, NAN, NAN]),
        ("frame,file,turns\n0,a.tif,5\n1,b.tif,6\n", [5, 6, NAN, NAN]),  # names of another format
    ],
)
def test_what_is_clear_is_taken(tmp_path: Path, text: str, expected: list[float]) -> None:
    assert np.array_equal(turns_of(tmp_path, text), expected, equal_nan=True)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "no rows"),
        ("frame,turns\n", "no rows"),
        ("frame,turn\n0,1\n", "rename 'turn'"),
        ("a,b\n0,1\n", "it has a, b"),
        ("frame,turns\n0,abc\n", "line 2: turns 'abc' is no number"),
        ("frame,turns\n0,1\n1,inf\n", "line 3"),
        ("frame;turns\n0;1,5\n", "decimal point"),
        ("frame,turns\n4,1\n", r"4 but the recording has 4 frames \(0 to 3\)"),
        ("frame,turns\n-1,1\n", "whole number"),
        ("frame,turns\n0.5,1\n", "whole number"),
        ("frame,turns\nnan,1\n", "whole number"),
        ("frame,turns\n,1\n", "whole number"),
        ("frame,turns\n0,1\n1,2\n0,3\n", "lines 2 and 4 give frame 0 different"),
        ("turns\n1\n2\n", "2 rows for 4 frames"),
        ("turns\n1\n2\n3\n4\n5\n", "5 rows for 4 frames"),
        ("file,turns\nx.png,1\n", "none of its files"),
        ("file,turns\n,1\n", "'file' is empty"),
        ("frame,turns\n0,1,2\n", "3 values under 2 columns"),
        ("turns,turns\n0,1\n", "twice"),
        ("frame,turns\n0,\x00\n", "turns"),
    ],
)
def test_what_is_not_clear_is_refused(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(InputError, match=says) as caught:
        turns_of(tmp_path, text)
    assert "\n" not in str(caught.value)
    assert "turns.csv" in str(caught.value)


def test_bytes_that_are_no_text(tmp_path: Path) -> None:
    (tmp_path / "turns.csv").write_bytes(b"\xff\xfe\x00frame")
    with pytest.raises(InputError, match="UTF-8"):
        read_turns(tmp_path / "turns.csv", FILES)
    with pytest.raises(InputError, match="cannot be read"):
        read_turns(tmp_path / "gone.csv", FILES)


def test_missing_turns_are_counted_in_a_note(tmp_path: Path) -> None:
    (tmp_path / "turns.csv").write_text("frame,turns\n0,1\n")
    notes = read_turns(tmp_path / "turns.csv", FILES).notes
    assert notes == ("3 of 4 frames lack motor turns; such rows are flagged NO_TURNS",)


def test_further_columns(tmp_path: Path) -> None:
    (tmp_path / "turns.csv").write_text(
        "frame,turns,time_s,displacement_mm,load_N,cycle,comment\n2,1,0.5,1.25,19.6,3,hello\n"
    )
    found = read_turns(tmp_path / "turns.csv", FILES)
    got = [found.time_s[2], found.displacement_mm[2], found.load_N[2], found.cycle[2]]
    assert got == [0.5, 1.25, 19.6, 3]


def test_options_win_over_the_table(tmp_path: Path) -> None:
    text = "frame,turns\n0,7\n"
    assert turns_of(tmp_path, text, turns_per_frame=-0.5).tolist() == [0, -0.5, -1, -1.5]
    assert turns_of(tmp_path, text, turns_from_name=r"f(\d)").tolist() == [0, 1, 2, 3]


@pytest.mark.parametrize(
    "options",
    [
        {"turns_per_frame": 0.0},
        {"turns_per_frame": NAN},
        {"turns_per_frame": 1.0, "turns_from_name": "(x)"},
        {"turns_from_name": "f"},
        {"turns_from_name": "(f)(0)"},
        {"turns_from_name": "(("},
        {"turns_from_name": "(f)"},
        {"turns_from_name": "q([0-9])"},
    ],
)
def test_options_that_say_nothing_are_refused(options: dict) -> None:
    with pytest.raises(InputError, match="--turns-"):
        read_turns(None, FILES, **options)


def test_turns_from_names_with_gaps_and_decimals() -> None:
    files = ("t-2.5_a.png", "t3,5_b.png", "setup.png")
    found = read_turns(None, files, turns_from_name=r"t([-0-9.,]+)_")
    assert np.array_equal(found.turns, [-2.5, 3.5, NAN], equal_nan=True)
