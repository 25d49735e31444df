"""What a batch holds, and that names can do no harm."""

from __future__ import annotations

from pathlib import Path

import pytest

from tsvision.batch.plan import plan, safe_name
from tsvision.errors import InputError
from tsvision.run import Request

BASE = Request("", overrides={"strings.count": "2"}, turns_per_frame=0.5)


def make(folder: Path, *names: str) -> None:
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"x")


def test_folder_of_recordings(tmp_path: Path) -> None:
    make(tmp_path, "run10/f0.png", "run2/f0.jpg", "b.mp4", "notes.txt", ".hidden/f0.png")
    make(tmp_path, "empty/readme.md", "deep/frames/f0.png", "stack.tif")
    assert [i.name for i in plan(str(tmp_path), BASE)] == ["b", "deep", "run2", "run10", "stack"]
    assert plan(str(tmp_path), BASE)[0].request.turns_per_frame == 0.5


def test_glob(tmp_path: Path) -> None:
    make(tmp_path, "a/x.mp4", "b/x.mp4", "c/y.mp4")
    items = plan(str(tmp_path / "*" / "x.mp4"), BASE)
    assert len({i.name for i in items}) == 2
    assert all(i.name.startswith("x-") for i in items)  # told apart by their path
    make(tmp_path, "photos/1.jpg", "photos/2.jpg")  # of different things: each by itself
    assert [i.name for i in plan(str(tmp_path / "photos" / "*.jpg"), BASE)] == ["1", "2"]
    with pytest.raises(InputError, match="matches no"):
        plan(str(tmp_path / "*.avi"), BASE)


def test_manifest(tmp_path: Path) -> None:
    (tmp_path / "m.csv").write_text(
        "recording,name,rig,turns_per_frame,frames,strings.count,camera.mm_per_px\n"
        "films/a,first,r.toml,0.25,5:10,4,\n"
        "films/b.mp4,,,,,,0.02\n"
    )
    first, second = plan(str(tmp_path / "m.csv"), BASE)
    assert (first.name, second.name) == ("first", "b")
    assert first.request.source == str(tmp_path / "films/a")
    assert first.request.rig_path == tmp_path / "r.toml"
    assert first.request.frames == (5, 10)
    assert first.request.overrides == {"strings.count": "4"}
    assert first.request.turns_per_frame == 0.25
    assert second.request.overrides == {"strings.count": "2", "camera.mm_per_px": "0.02"}
    assert second.request.turns_per_frame == 0.5


@pytest.mark.parametrize("separator", [";", "\t"])
def test_a_manifest_of_a_spreadsheet_in_another_language(tmp_path: Path, separator: str) -> None:
    (tmp_path / "m.csv").write_text("recording,name,frames\na,b,5:10\n".replace(",", separator))
    [item] = plan(str(tmp_path / "m.csv"), BASE)
    assert (item.name, item.request.frames) == ("b", (5, 10))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "no column 'recording'"),
        ("recording\n", "no rows"),
        ("path\na\n", "unknown column 'path'"),
        ("recording,strings.cuont\na,2\n", "did you mean 'strings.count'"),
        ("recording\n\n \n", "recording"),
        ("recording,turns_per_frame\na,x\n", "no number"),
        ("recording,frames\na,x\n", "A:B"),
        ("recording,name\na\nb,c,d\n", "more values"),
        ("recording\na\na\n", "twice"),
        ("recording,recording\na,b\n", "twice"),
    ],
)
def test_what_is_wrong_in_a_manifest_is_named(tmp_path: Path, text: str, says: str) -> None:
    (tmp_path / "m.csv").write_text(text)
    with pytest.raises(InputError, match=says) as caught:
        plan(str(tmp_path / "m.csv"), BASE)
    assert "\n" not in str(caught.value)


def test_nothing_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no recordings"):
        plan(str(tmp_path), BASE)
    with pytest.raises(InputError, match="no such"):
        plan(str(tmp_path / "gone"), BASE)


@pytest.mark.parametrize(
    "name",
    ["..", ".", "", "a/b", "../../etc", "a\nb", "a\0b", ".hidden", "x" * 5000, "ünï ö", "\udcff"],
)
def test_names_stay_inside_the_results(tmp_path: Path, name: str) -> None:
    safe = safe_name(name)
    assert (tmp_path / safe).parent == tmp_path
    assert safe not in (".", "..") and not safe.startswith(".")
    assert not set(safe) & set("/\\\0\n")
    (tmp_path / safe).mkdir()
