"""A measurement is on disk whole, or not at all, and says what it is."""

from __future__ import annotations

import errno
import hashlib
import json
import os
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
import tifffile

from tsvision.errors import InputError
from tsvision.records import FrameResult, Recording
from tsvision.results import read_measurement, summary
from tsvision.run import measure_to_folder

INTERFACE_FRAMES = (
    "frame file turns time_s diameter_mm diameter_mm_sd diameter_px diameter_px_sd "
    "pitch_mm pitch_mm_sd pitch_px strand_repeat_px helix_angle_rad helix_angle_rad_sd "
    "lay_angle_rad handedness midspan_diameter_mm coil_amplitude_mm unevenness knot_count "
    "phase turns_seen turn_budget_error string_length_mm mm_per_px axis_x0_px axis_y0_px "
    "axis_x1_px axis_y1_px separator_x_px separator_y_px flags "
)
FILES = {
    "frames.parquet",
    "frames.csv",
    "profiles.parquet",
    "knots.parquet",
    "knots.csv",
    "summary.json",
}


def everything_in(folder: Path) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in folder.iterdir()}


def test_writes_the_files_and_columns_of_the_interface(film: Path, tmp_path: Path, measure) -> None:
    out = measure_to_folder(film, tmp_path / "out", measure=measure)
    assert {p.name for p in out.iterdir()} == FILES
    found = read_measurement(out)
    assert set(INTERFACE_FRAMES.split()) <= set(found.frames.columns)
    assert found.frames["frame"].tolist() == list(range(12))
    assert found.frames["diameter_px"].tolist() == list(range(12))  # the bar's column
    assert found.frames["turns"].tolist() == [i / 2 for i in range(12)]
    profile_columns = {"frame", "s_mm", "upper_px", "lower_px", "width_mm", "envelope_mm"}
    assert profile_columns <= set(found.profiles.columns)
    assert len(found.profiles) == 12 * 64
    knot_columns = "frame turns track centre_mm length_mm max_diameter_mm centre_x_px centre_y_px"
    assert set(knot_columns.split()) <= set(found.knots.columns)
    csv = pd.read_csv(out / "frames.csv")
    assert csv["diameter_mm"].tolist() == found.frames["diameter_mm"].tolist()


def test_summary_is_strict_json_with_input_versions_rig(
    film: Path, tmp_path: Path, measure
) -> None:
    out = measure_to_folder(film, tmp_path / "out", measure=measure)

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is not JSON")

    summary = json.loads((out / "summary.json").read_text(), parse_constant=refuse)
    assert summary["frames_total"] == summary["frames_measured"] == 12
    assert summary["diameter_mm"]["value"] == pytest.approx(5.5 * 0.02)  # median of 0 to 11 px
    assert summary["helix_angle_deg"]["value"] is None
    for name in ("knot_onset", "overtwist_onset", "local_overtwist_onset", "irreversible_onset"):
        keys = {"status", "turns", "low", "high", "last_turns", "level"}
        assert keys <= set(summary[name])
        assert summary[name]["status"] in ("observed", "not_observed", "undetermined")
    sums = {f["name"]: f["sha256"] for f in summary["input"]["files"]}
    assert sums["f3.png"] == hashlib.sha256((film / "f3.png").read_bytes()).hexdigest()
    assert summary["rig"]["strings.count"] == 2
    assert {"tsvision", "numpy", "opencv-python-headless"} <= set(summary["versions"])
    assert str(tmp_path) not in (out / "summary.json").read_text()


def test_units_stand_in_the_column_metadata(film: Path, tmp_path: Path, measure) -> None:
    out = measure_to_folder(film, tmp_path / "out", measure=measure)
    schema = pq.read_schema(out / "frames.parquet")
    units = {f.name: f.metadata[b"unit"].decode() for f in schema}
    assert units["diameter_mm_sd"] == "mm"
    assert units["mm_per_px"] == "mm/px"
    assert units["helix_angle_rad"] == "rad"
    assert units["turns"] == "turn"
    assert units["time_s"] == "s"
    assert units["flags"] == ""


def test_same_input_gives_the_same_bytes(film: Path, tmp_path: Path, measure) -> None:
    one = measure_to_folder(film, tmp_path / "one", measure=measure)
    two = measure_to_folder(film, tmp_path / "two", measure=measure)
    assert everything_in(one) == everything_in(two)


def test_a_bad_picture_keeps_its_row(film: Path, tmp_path: Path, measure) -> None:
    (film / "f4.png").write_bytes(b"")
    (film / "f7.png").write_bytes((film / "f7.png").read_bytes()[:60])
    found = read_measurement(measure_to_folder(film, tmp_path / "out", measure=measure))
    assert len(found.frames) == 12
    bad = found.frames.loc[[4, 7]]
    assert bad["flags"].tolist() == ["UNREADABLE", "UNREADABLE"]
    assert bad["diameter_px"].isna().all()
    assert found.frames["diameter_px"].drop([4, 7]).notna().all()
    assert found.summary["frames_measured"] == 10
    assert found.summary["flags"] == {"UNREADABLE": 2}


def spoil(film: Path, numbers: range) -> None:
    for i in numbers:
        pixels = np.zeros((48, 64), np.float32)
        tifffile.imwrite(film / f"f{i}.tif", pixels)
        (film / f"f{i}.png").unlink()
    (film / "turns.csv").unlink()


def test_pictures_that_cannot_be_read_are_told_with_the_reason(
    film: Path, tmp_path: Path, measure
) -> None:
    spoil(film, range(3, 6))
    found = read_measurement(measure_to_folder(film, tmp_path / "out", measure=measure))
    assert len(found.frames) == 12
    (note,) = [note for note in found.summary["notes"] if "cannot be read" in note]
    assert note.startswith("3 of 12 pictures cannot be read, e.g. f3.tif: ")
    assert "float32" in note


def test_a_recording_of_which_nothing_can_be_read_is_bad_input(
    film: Path, tmp_path: Path, measure
) -> None:
    spoil(film, range(12))
    with pytest.raises(InputError, match=r"none of its 12 .* read, e\.g\. f0\.tif: .*float32"):
        measure_to_folder(film, tmp_path / "out", measure=measure)
    assert {p.name for p in tmp_path.iterdir()} == {"film"}


def test_frames_keep_their_numbers_in_a_part(film: Path, tmp_path: Path, measure) -> None:
    out = measure_to_folder(film, tmp_path / "out", frames=(9, None), measure=measure)
    found = read_measurement(out)
    assert found.frames["frame"].tolist() == [9, 10, 11]
    assert found.frames["diameter_px"].tolist() == [9, 10, 11]
    assert set(found.profiles["frame"]) == {9, 10, 11}
    with pytest.raises(InputError, match="0:12"):
        measure_to_folder(film, tmp_path / "no", frames=(5, 99), measure=measure)


def test_existing_output_is_refused_then_replaced(film: Path, tmp_path: Path, measure) -> None:
    out = measure_to_folder(film, tmp_path / "out", frames=(0, 3), measure=measure)
    (out / "my notes.txt").write_text("mine")
    before = everything_in(out)
    with pytest.raises(InputError, match="--overwrite"):
        measure_to_folder(film, out, measure=measure)
    assert everything_in(out) == before
    measure_to_folder(film, out, overwrite=True, measure=measure)
    assert len(read_measurement(out).frames) == 12
    assert (out / "my notes.txt").read_text() == "mine"
    assert {p.name for p in tmp_path.iterdir()} == {"film", "out"}


def test_overwrite_never_replaces_a_folder_that_is_no_measurement(
    film: Path, tmp_path: Path, measure
) -> None:
    before = everything_in(film)
    with pytest.raises(InputError, match="no measurement"):
        measure_to_folder(film, film, overwrite=True, measure=measure)
    assert everything_in(film) == before


def test_a_link_is_followed_and_stays_one(film: Path, tmp_path: Path, measure) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to("real")
    for overwrite in (False, True):
        measure_to_folder(film, tmp_path / "link", overwrite=overwrite, measure=measure)
        assert (tmp_path / "link").is_symlink()
        assert len(read_measurement(tmp_path / "real").frames) == 12
    assert {p.name for p in tmp_path.iterdir()} == {"film", "real", "link"}


def test_a_folder_that_cannot_be_moved_is_refused_before_measuring(
    film: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(recording: Recording, start: int, stop: int) -> Iterator[FrameResult]:
        raise AssertionError("measured although the folder cannot be replaced")

    (tmp_path / "here" / "inner").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "here")
    with pytest.raises(InputError, match="current folder"):
        measure_to_folder(film, Path("."), measure=never)
    monkeypatch.chdir("inner")
    with pytest.raises(InputError, match="current folder"):
        measure_to_folder(film, Path(".."), measure=never)
    with pytest.raises(InputError, match="disk is mounted"):
        measure_to_folder(film, Path("/proc"), measure=never)
    assert {p.name for p in tmp_path.iterdir()} == {"film", "here"}


def test_an_old_measurement_that_cannot_step_aside_leaves_nothing_behind(
    film: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, measure
) -> None:
    out = measure_to_folder(film, tmp_path / "out", frames=(0, 3), measure=measure)
    before = everything_in(out)
    rename = os.rename

    def busy(source: Path, target: Path) -> None:
        if Path(source) == out:
            raise OSError(errno.EBUSY, "Device or resource busy")
        rename(source, target)

    monkeypatch.setattr("tsvision.staging.os.rename", busy)
    with pytest.raises(InputError, match="busy"):
        measure_to_folder(film, out, overwrite=True, measure=measure)
    assert everything_in(out) == before
    assert {p.name for p in tmp_path.iterdir()} == {"film", "out"}


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError, MemoryError])
def test_nothing_half_written_is_left(film: Path, tmp_path: Path, measure, error) -> None:
    old = everything_in(measure_to_folder(film, tmp_path / "out", frames=(0, 2), measure=measure))

    def fails_midway(recording: Recording, start: int, stop: int) -> Iterator[FrameResult]:
        for result in measure(recording, start, stop):
            if result.row.frame >= 5:
                raise error("midway")
            yield result

    for name in ("fresh", "out"):
        with pytest.raises(error):
            measure_to_folder(film, tmp_path / name, overwrite=True, measure=fails_midway)
    assert {p.name for p in tmp_path.iterdir()} == {"film", "out"}
    assert everything_in(tmp_path / "out") == old


def test_a_picture_on_which_the_program_fails_costs_only_its_row(
    film: Path, tmp_path: Path, measure, caplog: pytest.LogCaptureFixture
) -> None:
    def fails_on_some(recording: Recording, start: int, stop: int) -> Iterator[FrameResult]:
        for result in measure(recording, start, stop):
            if result.row.frame in (0, 5, 6, 11):
                raise ZeroDivisionError("a bug\nin two lines")
            yield result

    found = read_measurement(measure_to_folder(film, tmp_path / "out", measure=fails_on_some))
    assert found.frames["frame"].tolist() == list(range(12))
    failed = found.frames["flags"] == "FAILED"
    assert found.frames["frame"][failed].tolist() == [0, 5, 6, 11]
    assert found.frames["turns"].tolist() == [i / 2 for i in range(12)]
    assert found.frames["diameter_px"][~failed].notna().all()
    assert "frame 5: ZeroDivisionError: a bug in two lines" in caplog.text


def test_output_place_is_checked_before_measuring(film: Path, tmp_path: Path) -> None:
    def never(recording: Recording, start: int, stop: int) -> Iterator[FrameResult]:
        raise AssertionError("measured although nothing could be written")

    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="no folder"):
        measure_to_folder(film, tmp_path / "file", measure=never)
    with pytest.raises(InputError, match="cannot be written"):
        measure_to_folder(film, tmp_path / "file" / "out", measure=never)
    with pytest.raises(InputError, match="cannot be written"):
        measure_to_folder(film, Path("/proc/nowhere/out"), measure=never)


def test_no_room_is_said_before_measuring(film: Path, tmp_path: Path, monkeypatch, measure) -> None:
    nearly_full = SimpleNamespace(free=1000)
    monkeypatch.setattr("tsvision.staging.shutil.disk_usage", lambda place: nearly_full)
    with pytest.raises(InputError, match="make room"):
        measure_to_folder(film, tmp_path / "out", measure=measure)


def test_names_with_spaces_newlines_and_odd_bytes(film: Path, tmp_path: Path, measure) -> None:
    strange = ["a b 1.png", "zeile\n2.png", "ünï 3.png", '"4",x.png', "<script>5.png"]
    for old, new in zip(sorted(film.glob("f?.png")), strange, strict=False):
        old.rename(film / new)
    raw = os.fsencode(film) + b"/bad\xff6.png"
    os.rename(film / "f6.png", raw)
    (film / "turns.csv").unlink()
    out = measure_to_folder(film, tmp_path / "o ut\n", turns_per_frame=1.0, measure=measure)
    found = read_measurement(out)
    names = set(found.frames["file"])
    assert set(strange) <= names
    assert "bad\\xff6.png" in names
    assert set(pd.read_csv(out / "frames.csv")["file"]) == names
    assert found.frames["diameter_px"].notna().all()


def test_measurement_that_is_not_whole_is_refused(film: Path, tmp_path: Path, measure) -> None:
    out = measure_to_folder(film, tmp_path / "out", measure=measure)
    (out / "frames.parquet").write_bytes(b"PAR1")
    with pytest.raises(InputError, match=r"Parquet"):
        read_measurement(out)
    (out / "summary.json").write_text("{")
    with pytest.raises(InputError, match="cannot be read"):
        read_measurement(out)
    with pytest.raises(InputError, match="holds no"):
        read_measurement(tmp_path)


def test_recording_without_scale_keeps_px_and_empties_mm(
    film: Path, tmp_path: Path, measure
) -> None:
    (film / "rig.toml").unlink()
    found = read_measurement(measure_to_folder(film, tmp_path / "out", measure=measure))
    assert found.frames["diameter_mm"].isna().all()
    assert found.frames["diameter_px"].notna().all()
    assert found.summary["diameter_mm"]["value"] is None
    assert np.isclose(found.summary["diameter_px"]["value"], 5.5)


def test_every_source_that_measures_moves_the_programs_digest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = Path(summary.__file__).parents[1]
    top = sorted(package.glob("*.py"))
    parts = ("images", "measures", "timeline", "results")
    deciding = [*top, *(p for part in parts for p in sorted((package / part).rglob("*.py")))]
    copies = [tmp_path / path.relative_to(package) for path in deciding]
    for copy in copies:
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_text("")
    monkeypatch.setattr(summary, "__file__", str(tmp_path / "results" / "summary.py"))
    digest = summary.code_digest.__wrapped__
    seen = {digest()}
    for copy in copies:
        copy.write_text("changed")
        seen.add(digest())
    assert len(seen) == 1 + len(copies)
