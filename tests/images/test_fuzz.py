"""Readers under damage: whatever the bytes, an answer or one clear line, never anything else."""

from __future__ import annotations

import base64
import struct
from pathlib import Path

import cv2
import numpy as np
import pytest
import tifffile
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from tsvision.batch.plan import plan, safe_name
from tsvision.errors import InputError
from tsvision.images.frames import iter_frames, open_recording
from tsvision.images.frames_find import natural_key
from tsvision.images.frames_picture import MAX_PIXELS, Unreadable, decode, read_picture
from tsvision.images.turns import read_turns
from tsvision.jsonable import to_json
from tsvision.results.read import read_summary
from tsvision.rig import KEYS, load_rig
from tsvision.run import Request

QUICK = settings(
    max_examples=70,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


def encoded(suffix: str) -> bytes:
    pixels = np.random.default_rng(0).integers(0, 255, (24, 32, 3)).astype(np.uint8)
    good, data = cv2.imencode(suffix, cv2.GaussianBlur(pixels, (5, 5), 1))
    assert good
    return data.tobytes()


WHOLE = {suffix: encoded(suffix) for suffix in (".png", ".jpg", ".bmp", ".tif")}
# found by libFuzzer: a chunk longer than the file, on which OpenCV's own reader never returns
HANGS_OPENCV_5 = (
    "iVBORw0KGgoAAAANSUhEUgAAABAAAAAPaUjpAAAAAEldqQAANElEQVQIHV3BQQEAEBAN6chAJrKQRDZykMvvAXknBOEPa"
    "UjpAAAAAElFTkSuQmCC"
)
damage = st.lists(st.tuples(st.integers(0, 10**6), st.integers(0, 255)), max_size=8)


def damaged(data: bytes, changes: list[tuple[int, int]], cut: float) -> bytes:
    changed = bytearray(data)
    for place, value in changes:
        changed[place % len(changed)] = value
    return bytes(changed[: int(len(changed) * cut)])


def is_picture(pixels: np.ndarray) -> bool:
    usable = pixels.dtype in (np.uint8, np.uint16) and pixels.size <= 3 * MAX_PIXELS
    return usable and (pixels.ndim == 2 or (pixels.ndim == 3 and pixels.shape[2] == 3))


@QUICK
@given(st.sampled_from(sorted(WHOLE)), damage, st.floats(0, 1))
def test_damaged_pictures(tmp_path: Path, suffix: str, changes, cut: float) -> None:
    path = tmp_path / f"f{suffix}"
    path.write_bytes(damaged(WHOLE[suffix], changes, cut))
    try:
        assert is_picture(read_picture(path))
    except Unreadable as problem:
        assert str(problem) and "\n" not in str(problem)


@QUICK
@given(st.binary(max_size=200))
@example(b"BM" + bytes(30))
@example(b"\xff\xd8\xff\xe0\x00\x00\xff\xc0")
@example(b"\xff\xd8" + b"\xff" * 40)
@example(b"\x89PNG\r\n\x1a\n" + bytes(4) + b"IHDR" + struct.pack(">II", 2**31, 2**31))
@example(base64.b64decode(HANGS_OPENCV_5))
def test_any_bytes_as_a_picture(data: bytes) -> None:
    try:
        assert is_picture(decode(data))
    except Unreadable as problem:
        assert "\n" not in str(problem)


@QUICK
@given(damage, st.floats(0.3, 1))
def test_damaged_stacks(tmp_path: Path, changes, cut: float) -> None:
    path = tmp_path / "stack.tif"
    tifffile.imwrite(path, np.zeros((4, 9, 11), np.uint8), photometric="minisblack")
    path.write_bytes(damaged(path.read_bytes(), changes, cut))
    frames = list(iter_frames(open_recording(path), ahead=0))
    assert frames
    assert all(f.pixels is not None or f.problem for f in frames)


@pytest.fixture(scope="module")
def video() -> bytes:
    import io

    import av

    held = io.BytesIO()
    with av.open(held, "w", format="matroska") as container:
        stream = container.add_stream("mpeg4", rate=25)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"  # type: ignore[union-attr]
        for i in range(12):
            grey = np.full((48, 64), 20 * i, np.uint8)
            frame = av.VideoFrame.from_ndarray(grey, format="gray").reformat(format="yuv420p")
            container.mux(stream.encode(frame))  # type: ignore[union-attr, arg-type]
        container.mux(stream.encode())  # type: ignore[union-attr]
    return held.getvalue()


@settings(QUICK, max_examples=30)
@given(changes=damage, cut=st.floats(0, 1))
def test_damaged_videos(tmp_path: Path, video: bytes, changes, cut: float) -> None:
    path = tmp_path / "f.mkv"
    path.write_bytes(damaged(video, changes, cut))
    try:
        recording = open_recording(path)
    except InputError as problem:
        assert "f.mkv" in str(problem) and "\n" not in str(problem)
        return
    frames = list(iter_frames(recording, ahead=0))
    assert len(frames) == len(recording.files)
    assert [f.index for f in frames] == list(range(len(frames)))


cells = st.one_of(
    st.sampled_from(["frame", "file", "turns", "0", "1", "f0.png", "nan", "-3", "1e9", '"', "inf"]),
    st.text(max_size=6),
)
tables = st.lists(st.lists(cells, max_size=4), max_size=6).map(
    lambda rows: "\n".join(",".join(row) for row in rows)
)


@QUICK
@given(st.one_of(st.binary(max_size=120), tables.map(lambda t: t.encode("utf-8", "replace"))))
@example(b"frame,turns\n1e400,1\n")
@example(b"frame,turns\n0,1e400\n")
@example(b"frame,turns\n" + b"9" * 400 + b",1\n")
@example(b"turns\n\x0b1\n2\n")
def test_any_bytes_as_turns(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "turns.csv"
    path.write_bytes(data)
    try:
        found = read_turns(path, ("f0.png", "f1.png"))
    except InputError as problem:
        assert "turns.csv" in str(problem) and "\n" not in str(problem)
    else:
        assert len(found.turns) == 2 and not np.isinf(found.turns).any()


@QUICK
@given(st.one_of(st.binary(max_size=120), st.text(max_size=120).map(str.encode)))
def test_any_bytes_as_a_rig(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "rig.toml"
    path.write_bytes(data)
    try:
        load_rig(path)
    except InputError as problem:
        assert "rig.toml" in str(problem) and "\n" not in str(problem)


values = st.one_of(
    st.text(max_size=10),
    st.integers(),
    st.floats(),
    st.booleans(),
    st.lists(st.floats(), max_size=5),
)


@QUICK
@given(st.dictionaries(st.sampled_from(KEYS), values, max_size=4))
def test_any_values_of_the_rig(overrides: dict) -> None:
    try:
        rig = load_rig(None, overrides)
    except InputError as problem:
        assert "\n" not in str(problem)
    else:
        assert rig.strings.count is None or rig.strings.count >= 1
        assert not rig.camera.mm_per_px <= 0


@QUICK
@given(st.one_of(st.binary(max_size=150), tables.map(lambda t: ("recording," + t).encode())))
def test_any_bytes_as_a_manifest(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "m.csv"
    path.write_bytes(data)
    try:
        items = plan(str(path), Request(""))
    except InputError as problem:
        assert "\n" not in str(problem)
    else:
        assert all(safe_name(item.name) == item.name for item in items)


@QUICK
@given(st.one_of(st.binary(max_size=80), st.text(max_size=80).map(str.encode)))
@example(b'{"frames_total": 1, "format": "x"}')
@example(b"[" * 3000)
def test_any_bytes_as_a_summary(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "summary.json").write_bytes(data)
    with pytest.raises(InputError) as caught:
        read_summary(tmp_path)
    assert "\n" not in str(caught.value)


trees = st.recursive(
    st.one_of(st.none(), st.booleans(), st.floats(), st.integers(), st.text()),
    lambda inner: st.one_of(st.lists(inner), st.dictionaries(st.text(), inner)),
    max_leaves=8,
)


@QUICK
@given(trees)
def test_json_is_always_strict(tree) -> None:
    import json

    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    json.loads(to_json(tree), parse_constant=refuse)


@QUICK
@given(st.lists(st.text(max_size=12), max_size=8))
def test_natural_order_is_an_order(names: list[str]) -> None:
    ordered = sorted(names, key=natural_key)
    backwards = ordered[::-1]
    assert sorted(backwards, key=natural_key) == ordered
