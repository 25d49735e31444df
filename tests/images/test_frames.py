"""Recordings from every kind of source, whole or damaged: each frame keeps its place."""

from __future__ import annotations

import os
import struct
import time
import zlib
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
import pytest
import tifffile

from tsvision.errors import InputError
from tsvision.images.frames import input_files, iter_frames, open_recording, part_of
from tsvision.images.frames_find import natural_key
from tsvision.images.frames_picture import Unreadable, decode

CORNERS = np.array([[10, 60], [120, 200]], np.uint8)  # told apart in all eight orientations


def numbered(number: int, shape: tuple[int, int] = (48, 160)) -> np.ndarray:
    """A bright bar whose column tells the frame's number."""
    pixels = np.full(shape, 50, np.uint8)
    pixels[:, 4 * number : 4 * number + 4] = 200
    return pixels


def number_of(pixels: np.ndarray) -> int:
    row = pixels[5] if pixels.ndim == 2 else pixels[5, :, 1]
    return int(np.argmax(row > row.max() / 2 + row.min() / 2)) // 4


def write_video(path: Path, count: int, codec: str = "libx264", **options: str) -> None:
    with av.open(str(path), "w") as container:
        stream: Any = container.add_stream(codec, rate=25, options=options)
        stream.width, stream.height = 160, 48
        stream.pix_fmt = "yuvj420p" if codec == "mjpeg" else "yuv420p"
        stream.time_base = Fraction(1, 25)
        for i in range(count):
            frame = av.VideoFrame.from_ndarray(numbered(i), format="gray")
            frame.pts = i
            container.mux(stream.encode(frame.reformat(format=stream.pix_fmt)))
        container.mux(stream.encode())


def write_frames(folder: Path, names: list[str]) -> None:
    folder.mkdir(exist_ok=True)
    for i, name in enumerate(names):
        assert cv2.imwrite(str(folder / name), numbered(i))


# ------------------------------------------------------------------ finding


def test_natural_order() -> None:
    names = ["f10.png", "f2.png", "F1.png", "f02b.png", "f-3.png", "g.png"]
    expected = ["F1.png", "f2.png", "f02b.png", "f10.png", "f-3.png", "g.png"]
    assert sorted(names, key=natural_key) == expected


@pytest.mark.parametrize("suffix", ["png", "jpg", "bmp", "tif", "PNG", "jpeg", "tiff"])
def test_folder_of_any_format(tmp_path: Path, suffix: str) -> None:
    write_frames(tmp_path / "r", [f"f{i}.{suffix}" for i in range(12)])
    for junk in (
        "truth.json",
        "notes.txt",
        "Thumbs.db",
        "._f1.png",
        ".hidden.png",
        "truth.parquet",
    ):
        (tmp_path / "r" / junk).write_text("no picture")
    (tmp_path / "r" / "folder.png").mkdir()
    recording = open_recording(tmp_path / "r")
    assert recording.files == tuple(f"f{i}.{suffix}" for i in range(12))
    frames = list(iter_frames(recording))
    assert [number_of(f.pixels) for f in frames if f.pixels is not None] == list(range(12))
    assert [f.index for f in frames] == list(range(12))


def test_glob_list_and_single_picture(tmp_path: Path) -> None:
    write_frames(tmp_path / "a", [f"f{i}.png" for i in range(3)])
    write_frames(tmp_path / "b", [f"f{i}.png" for i in range(3)])
    (tmp_path / "a" / "turns.csv").write_text("file,turns\nf0.png,7\nf1.png,8\nf2.png,9\n")
    assert open_recording(str(tmp_path / "a" / "*.png")).turns.tolist() == [7, 8, 9]
    both = open_recording(str(tmp_path / "*" / "f*.png"))
    assert both.files == tuple(f"{d}/f{i}.png" for d in "ab" for i in range(3))
    assert all(f.pixels is not None for f in iter_frames(both))
    single = open_recording(tmp_path / "a" / "f1.png")
    assert single.files == ("f1.png",)
    assert single.turns.tolist() == [8]
    listed = open_recording([tmp_path / "a" / "f2.png", tmp_path / "a" / "f0.png"])
    assert listed.turns.tolist() == [7, 9]


def test_name_that_looks_like_a_pattern(tmp_path: Path) -> None:
    write_frames(tmp_path / "run[1]", ["f0.png"])
    assert open_recording(tmp_path / "run[1]").files == ("f0.png",)
    assert open_recording(tmp_path / "run[1]" / "f0.png").files == ("f0.png",)


def test_same_frames_in_several_formats(tmp_path: Path) -> None:
    folder = tmp_path / "r"
    write_frames(folder, ["f0.png", "f1.png"])
    write_frames(folder, ["f0.jpg", "f1.jpg"])
    with pytest.raises(InputError, match=r"several formats \(\.jpg, \.png\)"):
        open_recording(folder)
    (folder / "turns.csv").write_text("file,turns\nf0.jpg,1\nf1.jpg,2\n")
    assert open_recording(folder).files == ("f0.jpg", "f1.jpg")
    assert open_recording(str(folder / "*.png"), turns_per_frame=1).files == ("f0.png", "f1.png")


def test_different_names_in_several_formats_are_one_recording(tmp_path: Path) -> None:
    write_frames(tmp_path / "r", ["f0.png", "f1.jpg", "f2.tif"])
    assert open_recording(tmp_path / "r").files == ("f0.png", "f1.jpg", "f2.tif")


@pytest.mark.parametrize("make", ["empty", "text only", "missing", "two videos", "no match", "pdf"])
def test_nothing_to_measure_is_said(tmp_path: Path, make: str) -> None:
    source: str | Path = tmp_path / "r"
    (tmp_path / "r").mkdir()
    if make == "text only":
        (tmp_path / "r" / "a.txt").write_text("")
    elif make == "missing":
        source = tmp_path / "other"
    elif make == "two videos":
        for name in "ab":
            (tmp_path / "r" / f"{name}.mp4").write_text("")
    elif make == "no match":
        source = str(tmp_path / "r" / "*.png")
    elif make == "pdf":
        source = tmp_path / "r.pdf"
        source.write_text("")
    with pytest.raises(InputError) as caught:
        open_recording(source)
    assert str(source) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_links_in_a_circle_are_no_pictures(tmp_path: Path) -> None:
    write_frames(tmp_path / "r", ["f0.png"])
    os.symlink(tmp_path / "r" / "f1.png", tmp_path / "r" / "f1.png")
    os.symlink(tmp_path / "r", tmp_path / "r" / "frames")
    os.symlink(tmp_path / "nowhere.png", tmp_path / "r" / "f2.png")
    assert open_recording(tmp_path / "r").files == ("f0.png",)
    with pytest.raises(InputError, match="circle"):
        open_recording(tmp_path / "r" / "f1.png")


def test_pipe_with_a_picture_name_does_not_hang(tmp_path: Path) -> None:
    write_frames(tmp_path / "r", ["f0.png"])
    os.mkfifo(tmp_path / "r" / "f1.png")
    assert open_recording(tmp_path / "r").files == ("f0.png",)


# ------------------------------------------------------------------ decoding


def with_exif(jpeg: bytes, orientation: int) -> bytes:
    tiff = b"II*\0" + struct.pack("<IHHHIHHI", 8, 1, 0x112, 3, 1, orientation, 0, 0)
    body = b"Exif\0\0" + tiff
    return jpeg[:2] + b"\xff\xe1" + struct.pack(">H", len(body) + 2) + body + jpeg[2:]


def upright(stored: np.ndarray, orientation: int) -> np.ndarray:
    """EXIF's own words: where row 0 and column 0 of the stored picture are when shown."""
    shown = {
        1: stored,
        2: stored[:, ::-1],
        3: stored[::-1, ::-1],
        4: stored[::-1],
        5: stored.T,
        6: stored.T[:, ::-1],
        7: stored.T[::-1, ::-1],
        8: stored.T[::-1],
    }
    return shown[orientation]


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize("suffix", ["jpg", "tif"])
def test_orientation_is_applied(tmp_path: Path, orientation: int, suffix: str) -> None:
    stored = np.kron(CORNERS, np.ones((16, 32), np.uint8))
    path = tmp_path / f"f.{suffix}"
    if suffix == "jpg":
        good, data = cv2.imencode(".jpg", stored, [cv2.IMWRITE_JPEG_QUALITY, 100])
        assert good
        path.write_bytes(with_exif(data.tobytes(), orientation))
    else:
        tifffile.imwrite(path, stored, extratags=[(274, "H", 1, orientation, True)])
    (frame,) = iter_frames(open_recording(path))
    assert frame.pixels is not None
    expected = upright(stored, orientation)
    assert frame.pixels.shape == expected.shape
    assert np.abs(frame.pixels.astype(int) - expected).max() <= 2


@pytest.mark.parametrize("suffix", ["png", "tif"])
def test_sixteen_bit_and_colour_are_kept(tmp_path: Path, suffix: str) -> None:
    deep = (np.arange(48 * 160, dtype=np.uint16) * 8).reshape(48, 160)
    colour = np.dstack([deep, deep // 2, deep // 3])
    assert cv2.imwrite(str(tmp_path / f"a.{suffix}"), deep)
    assert cv2.imwrite(str(tmp_path / f"b.{suffix}"), colour)
    first, second = iter_frames(open_recording(tmp_path))
    assert first.pixels is not None and second.pixels is not None
    assert first.pixels.dtype == second.pixels.dtype == np.uint16
    assert np.array_equal(first.pixels, deep)
    assert np.array_equal(second.pixels, colour)  # BGR, as OpenCV wrote it
    grey = next(iter_frames(open_recording(tmp_path), start=1, color=False)).pixels
    assert grey is not None and grey.ndim == 2 and grey.dtype == np.uint16


def test_transparency_is_dropped(tmp_path: Path) -> None:
    assert cv2.imwrite(str(tmp_path / "f.png"), np.full((8, 9, 4), 77, np.uint8))
    (frame,) = iter_frames(open_recording(tmp_path))
    assert frame.pixels is not None and frame.pixels.shape == (8, 9, 3)


@pytest.mark.parametrize("suffix", ["png", "jpg", "bmp", "tif"])
@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.97])
def test_cut_off_picture_keeps_its_place(tmp_path: Path, suffix: str, share: float) -> None:
    write_frames(tmp_path / "r", [f"f{i}.{suffix}" for i in range(3)])
    path = tmp_path / "r" / f"f1.{suffix}"
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * share)])
    first, bad, last = iter_frames(open_recording(tmp_path / "r"))
    assert first.pixels is not None and last.pixels is not None
    assert bad.pixels is None
    assert bad.problem and "\n" not in bad.problem
    assert number_of(last.pixels) == 2


def test_phone_thumbnail_does_not_hide_a_cut(tmp_path: Path) -> None:
    good, thumb = cv2.imencode(".jpg", numbered(0, (16, 16)))
    good2, whole = cv2.imencode(".jpg", numbered(1))
    assert good and good2
    body = b"Exif\0\0" + thumb.tobytes()
    whole_b = whole.tobytes()
    data = whole_b[:2] + b"\xff\xe1" + struct.pack(">H", len(body) + 2) + body + whole_b[2:]
    assert decode(data).shape == (48, 160)
    with pytest.raises(Unreadable, match="cut off"):
        decode(data[:-40])


def png_of(width_px: int, height_px: int) -> bytes:
    def chunk(kind: bytes, body: bytes) -> bytes:
        return (
            struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
        )

    head = struct.pack(">IIBBBBB", width_px, height_px, 8, 2, 0, 0, 0)
    body = zlib.compress(bytes(2000))
    start = b"\x89PNG\r\n\x1a\n"
    return start + chunk(b"IHDR", head) + chunk(b"IDAT", body) + chunk(b"IEND", b"")


@pytest.mark.parametrize("size", [(60_000, 60_000), (200_000, 2), (0, 5), (2**31 - 1, 2**31 - 1)])
def test_bomb_is_refused_before_decoding(tmp_path: Path, size: tuple[int, int]) -> None:
    (tmp_path / "f.png").write_bytes(png_of(*size))
    start_s = time.monotonic()
    (frame,) = iter_frames(open_recording(tmp_path))
    assert frame.pixels is None
    assert "header states" in frame.problem
    assert time.monotonic() - start_s < 2


@pytest.mark.parametrize("shape", [(1, 640), (640, 1), (7, 7)])
@pytest.mark.parametrize("suffix", ["png", "jpg", "tif"])
def test_a_picture_too_small_for_a_bundle_is_said_to_be(
    tmp_path: Path, shape: tuple[int, int], suffix: str
) -> None:
    assert cv2.imwrite(str(tmp_path / f"f.{suffix}"), np.zeros(shape, np.uint8))
    (frame,) = iter_frames(open_recording(tmp_path))
    assert frame.pixels is None and "too small" in frame.problem


def test_jpeg_bmp_and_tiff_bombs(tmp_path: Path) -> None:
    good, jpeg = cv2.imencode(".jpg", numbered(0))
    assert good
    data = bytearray(jpeg.tobytes())
    at = data.index(b"\xff\xc0") + 5
    data[at : at + 4] = struct.pack(">HH", 65000, 65000)
    (tmp_path / "a.jpg").write_bytes(bytes(data))
    head = struct.pack("<IiiHH", 40, 50_000, -50_000, 1, 24)
    (tmp_path / "b.bmp").write_bytes(b"BM" + struct.pack("<IHHI", 100, 0, 0, 54) + head + bytes(50))
    tifffile.imwrite(tmp_path / "c.tif", np.zeros((20000, 20000), np.uint8), compression="zlib")
    for frame in iter_frames(open_recording(tmp_path)):
        assert frame.pixels is None, frame.file
        assert "refused before decoding" in frame.problem


def test_wrong_ending_is_read_by_content_and_text_is_not(tmp_path: Path) -> None:
    good, png = cv2.imencode(".png", numbered(2))
    assert good
    (tmp_path / "a.jpg").write_bytes(png.tobytes())
    (tmp_path / "b.png").write_text("hello")
    tifffile.imwrite(tmp_path / "c.tif", np.zeros((15, 15), np.float32))
    first, second, third = iter_frames(open_recording(tmp_path))
    assert first.pixels is not None and number_of(first.pixels) == 2
    assert second.pixels is None and "no PNG" in second.problem
    assert third.pixels is None and "float32" in third.problem


# ------------------------------------------------------------------ TIFF stacks and videos


@pytest.mark.parametrize("kind", ["pages", "imagej", "folder"])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_tiff_stack(tmp_path: Path, kind: str, dtype: type) -> None:
    stack: np.ndarray = np.stack([numbered(i).astype(dtype) for i in range(11)])
    path = tmp_path / "stack.tif"
    if kind == "imagej":
        tifffile.imwrite(path, stack, imagej=True)
    else:
        with tifffile.TiffWriter(path) as writer:
            for page in stack:
                writer.write(page, contiguous=False, compression="zlib")
    recording = open_recording(tmp_path if kind == "folder" else path, turns_per_frame=0.5)
    assert recording.files == tuple(f"stack.tif#{i}" for i in range(11))
    frames = list(iter_frames(recording))
    assert [number_of(f.pixels) for f in frames if f.pixels is not None] == list(range(11))
    assert frames[0].pixels is not None and frames[0].pixels.dtype == dtype
    assert [number_of(f.pixels) for f in iter_frames(recording, 7, 9) if f.pixels is not None] == [
        7,
        8,
    ]
    assert input_files(recording) == (path,)


def test_colour_tiff_page_comes_as_bgr(tmp_path: Path) -> None:
    rgb = np.zeros((12, 14, 3), np.uint8)
    rgb[:, :, 0] = 200
    tifffile.imwrite(tmp_path / "f.tif", rgb, photometric="rgb")
    (frame,) = iter_frames(open_recording(tmp_path))
    assert frame.pixels is not None
    assert frame.pixels[0, 0].tolist() == [0, 0, 200]


@pytest.mark.parametrize(
    ("suffix", "codec"),
    [
        ("mp4", "libx264"),
        ("mkv", "libx264"),
        ("mov", "libx264"),
        ("avi", "mjpeg"),
        ("avi", "mpeg4"),
    ],
)
def test_video_is_exact_to_the_frame(tmp_path: Path, suffix: str, codec: str) -> None:
    path = tmp_path / f"film.{suffix}"
    write_video(path, 30, codec)
    recording = open_recording(path, turns_per_frame=1.0)
    assert len(recording.files) == 30
    assert recording.time_s == pytest.approx(np.arange(30) / 25, abs=1e-3)
    seen = [number_of(f.pixels) for f in iter_frames(recording) if f.pixels is not None]
    assert seen == list(range(30))
    for start in (1, 13, 29):
        frame = next(iter_frames(recording, start, ahead=0))
        assert frame.pixels is not None and frame.index == start
        assert number_of(frame.pixels) == start
    (frame,) = iter_frames(part_of(part_of(recording, 5, 20), 4, 5))
    assert frame.pixels is not None and number_of(frame.pixels) == 9 and frame.index == 0


def test_luma_of_a_video_is_its_y_plane_at_full_range(tmp_path: Path) -> None:
    write_video(tmp_path / "f.mp4", 3, crf="1")
    recording = open_recording(tmp_path / "f.mp4")
    for grey, colour in zip(
        iter_frames(recording, color=False), iter_frames(recording), strict=True
    ):
        assert grey.pixels is not None and colour.pixels is not None
        assert grey.pixels.shape == (48, 160)
        expected = cv2.cvtColor(colour.pixels, cv2.COLOR_BGR2GRAY)
        assert np.abs(grey.pixels.astype(int) - expected).max() <= 2
        assert grey.pixels.max() == pytest.approx(200, abs=3)
        assert grey.pixels.min() == pytest.approx(50, abs=3)


def test_hole_in_a_video_shifts_nothing(tmp_path: Path) -> None:
    path = tmp_path / "f.mp4"
    write_video(path, 40, g="5", bf="0")
    data = bytearray(path.read_bytes())
    middle = data.index(b"mdat") + (len(data) - data.index(b"mdat")) // 3
    data[middle : middle + 120] = bytes(120)
    path.write_bytes(bytes(data))
    frames = list(iter_frames(open_recording(path)))
    assert [f.index for f in frames] == list(range(40))
    lost = [f.index for f in frames if f.pixels is None]
    assert 0 < len(lost) < 15
    assert all("video" in f.problem for f in frames if f.pixels is None)
    late = [f for f in frames if f.index > max(lost) + 5 and f.pixels is not None]
    assert [number_of(f.pixels) for f in late if f.pixels is not None] == [f.index for f in late]


@pytest.mark.parametrize("content", [b"", b"no video", b"\0" * 5000])
def test_unreadable_video_is_said(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "f.mp4").write_bytes(content)
    with pytest.raises(InputError, match=r"f\.mp4"):
        open_recording(tmp_path / "f.mp4")


def test_video_beside_its_turns(tmp_path: Path) -> None:
    write_video(tmp_path / "f.mp4", 4)
    (tmp_path / "f.turns.csv").write_text("frame,turns,time_s\n0,0,10\n1,3,11\n3,9,13\n")
    (tmp_path / "turns.csv").write_text("frame,turns\n0,99\n")
    recording = open_recording(tmp_path / "f.mp4")
    assert np.array_equal(recording.turns, [0, 3, np.nan, 9], equal_nan=True)
    assert recording.time_s[0] == 10  # the table's times, where it has them
    assert open_recording(tmp_path).files == recording.files  # a folder with one video in it


def test_stopping_early_ends_the_decoding_thread(tmp_path: Path) -> None:
    import threading

    write_frames(tmp_path / "r", [f"f{i}.png" for i in range(20)])
    frames = iter_frames(open_recording(tmp_path / "r"))
    next(frames)
    frames.close()  # type: ignore[attr-defined]
    assert not [t for t in threading.enumerate() if t.name == "decode-ahead"]


def test_error_in_the_decoding_thread_comes_out(tmp_path: Path, monkeypatch) -> None:
    write_frames(tmp_path / "r", ["f0.png", "f1.png"])

    def broken(*args: object) -> None:
        raise RuntimeError("a bug")

    monkeypatch.setattr("tsvision.images.frames.read_picture", broken)
    with pytest.raises(RuntimeError, match="a bug"):
        list(iter_frames(open_recording(tmp_path / "r")))
