"""One picture file to pixels, never trusting it: size first, decoding after.

The header is read before anything is decoded, so that a small file cannot claim a room-filling
picture (decompression bomb), and the end of the file is checked, so that a half-copied picture is
called unreadable and not measured as a picture with a grey lower half.
"""

from __future__ import annotations

import re
import struct
from pathlib import Path

import cv2
import numpy as np

from tsvision.images.frames_tiff import read_page

MAX_PIXELS = 150_000_000  # a 150-megapixel back; colour in 16 bit is 0.9 GB
MAX_SIDE_PX = 60_000
MIN_SIDE_PX = 8  # a bundle of 3 px, with ground on both sides of it
MAX_FILE_BYTES = 2_000_000_000
_PAGE = re.compile(r"(.+\.tiff?)#(\d+)", re.IGNORECASE | re.DOTALL)
_AS_STORED = cv2.IMREAD_ANYCOLOR | cv2.IMREAD_ANYDEPTH  # grey stays grey, 16 bit stays; EXIF turns
_JPEG_SIZE_MARKERS = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}


class Unreadable(Exception):
    """Why one picture cannot be used, in words; the frame keeps its row."""


def split_page(name: str) -> tuple[str, int | None]:
    """`stack.tif#3` to (`stack.tif`, 3); any other name to (name, None)."""
    match = _PAGE.fullmatch(name)
    return (match[1], int(match[2])) if match else (name, None)


def read_picture(path: Path, page: int | None = None, color: bool = True) -> np.ndarray:
    """Pixels of one picture, (H, W) grey or (H, W, 3) BGR, uint8 or uint16, upright by EXIF.

    `color=False` gives (H, W) luma whatever the file holds. Raises Unreadable with the reason.
    """
    try:
        if not path.is_file():
            raise Unreadable("the file is missing or no ordinary file")
        size_bytes = path.stat().st_size
        if size_bytes == 0:
            raise Unreadable("the file is empty")
        if size_bytes > MAX_FILE_BYTES and page is None:
            raise Unreadable(f"the file is larger than {MAX_FILE_BYTES:.0e} bytes")
        with path.open("rb") as file:
            is_tiff = file.read(4) in (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
        if is_tiff:
            pixels = _read_tiff(path, page or 0)
        else:
            pixels = decode(path.read_bytes())
    except OSError as error:
        raise Unreadable(f"the file cannot be read ({error.strerror or error})") from None
    return pixels if color else to_luma(pixels)


def decode(data: bytes) -> np.ndarray:
    """Pixels of an encoded PNG, JPEG or BMP; raises Unreadable."""
    width_px, height_px = _stated_size(data)
    check_size(width_px, height_px)
    if not _is_whole(data):
        raise Unreadable("the file is cut off: its end is missing")
    try:
        pixels = cv2.imdecode(np.frombuffer(data, np.uint8), _AS_STORED)
    except (cv2.error, MemoryError):
        pixels = None
    if pixels is None:
        raise Unreadable("the picture is damaged and cannot be decoded")
    return _usable(pixels)


def check_size(width_px: int, height_px: int) -> None:
    """Refuse absurd dimensions before decoding."""
    if width_px < 1 or height_px < 1:
        raise Unreadable(f"the header states a size of {width_px} x {height_px} px")
    if min(width_px, height_px) < MIN_SIDE_PX:
        raise Unreadable(
            f"the header states {width_px} x {height_px} px, too small to show a bundle"
        )
    if width_px * height_px > MAX_PIXELS or max(width_px, height_px) > MAX_SIDE_PX:
        raise Unreadable(
            f"the header states {width_px} x {height_px} px, more than {MAX_PIXELS // 10**6} "
            "megapixels; refused before decoding"
        )


def to_luma(pixels: np.ndarray) -> np.ndarray:
    """BGR to (H, W) luma; grey passes through."""
    return pixels if pixels.ndim == 2 else cv2.cvtColor(pixels, cv2.COLOR_BGR2GRAY)


def _read_tiff(path: Path, page: int) -> np.ndarray:
    try:
        return _usable(read_page(path, page, check_size))
    except (Unreadable, OSError):
        raise
    except Exception as error:  # tifffile raises many kinds on damaged files
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise Unreadable(f"the TIFF page cannot be decoded ({reason})") from None


def _usable(pixels: np.ndarray) -> np.ndarray:
    if pixels.dtype not in (np.uint8, np.uint16):
        raise Unreadable(f"pixels of type {pixels.dtype} are not supported, only 8 and 16 bit")
    if pixels.ndim == 3 and pixels.shape[2] == 4:
        pixels = pixels[:, :, :3]
    if pixels.ndim == 3 and pixels.shape[2] == 1:
        pixels = pixels[:, :, 0]
    if pixels.ndim not in (2, 3) or (pixels.ndim == 3 and pixels.shape[2] != 3):
        raise Unreadable(f"a picture of shape {pixels.shape} is neither grey nor colour")
    return np.ascontiguousarray(pixels)


def _stated_size(data: bytes) -> tuple[int, int]:
    """(width, height) from the header of PNG, JPEG or BMP; raises Unreadable."""
    if data[:8] == b"\x89PNG\r\n\x1a\n" and data[12:16] == b"IHDR" and len(data) >= 24:
        width_px, height_px = struct.unpack(">II", data[16:24])
        return width_px, height_px
    if data[:2] == b"BM" and len(data) >= 26:
        if struct.unpack("<I", data[14:18])[0] == 12:
            return struct.unpack("<HH", data[18:22])
        width_px, height_px = struct.unpack("<ii", data[18:26])
        return abs(width_px), abs(height_px)  # a negative height only means top-down
    if data[:2] == b"\xff\xd8":
        return _jpeg_size(data)
    raise Unreadable("the content is no PNG, JPEG, BMP or TIFF picture")


def _jpeg_size(data: bytes) -> tuple[int, int]:
    at = 2
    while at + 9 <= len(data):
        if data[at] != 0xFF:
            break
        marker = data[at + 1]
        if marker == 0xFF or marker == 0x01 or 0xD0 <= marker <= 0xD8:
            at += 1 if marker == 0xFF else 2  # fill byte, or a marker without a length
        elif marker in _JPEG_SIZE_MARKERS:
            height_px, width_px = struct.unpack(">HH", data[at + 5 : at + 9])
            return width_px, height_px
        else:
            at += 2 + struct.unpack(">H", data[at + 2 : at + 4])[0]
    raise Unreadable("the JPEG header is cut off or damaged")


def _is_whole(data: bytes) -> bool:
    """Whether the end of the picture is there (decoders differ in what they let pass)."""
    if data[:2] == b"\xff\xd8":
        # an EXIF thumbnail has an end marker of its own, before the scan starts
        return data.rfind(b"\xff\xd9") > data.rfind(b"\xff\xda") > 0
    if data[:4] == b"\x89PNG":
        return _chunks_reach_the_end(data)
    return True


def _chunks_reach_the_end(data: bytes) -> bool:
    """Whether a PNG's chunks lead, length by length, to its last one: OpenCV 5 loops for ever on a
    chunk that claims to be longer than the file."""
    at = 8
    while at + 12 <= len(data):
        length = struct.unpack(">I", data[at : at + 4])[0]
        if data[at + 4 : at + 8] == b"IEND":
            return True
        at += 12 + length
    return False
