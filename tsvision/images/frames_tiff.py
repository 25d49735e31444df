"""Pages of a TIFF: count them and read one, colour in OpenCV's order."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
import tifffile

MAX_PAGES = 10_000_000
# EXIF orientation 2..8 as OpenCV operations on the stored picture
_ORIENT: dict[int, tuple[int | None, int | None]] = {  # (rotate code, flip code after it)
    2: (None, 1),
    3: (cv2.ROTATE_180, None),
    4: (None, 0),
    5: (cv2.ROTATE_90_CLOCKWISE, 1),
    6: (cv2.ROTATE_90_CLOCKWISE, None),
    7: (cv2.ROTATE_90_CLOCKWISE, 0),
    8: (cv2.ROTATE_90_COUNTERCLOCKWISE, None),
}


def count_pages(path: Path) -> int:
    """Full-size pages of a TIFF; 1 for a file that cannot be read (it keeps its one frame)."""
    try:
        return max(1, len(_open_stack(*_identity(path))))
    except Exception:  # tifffile raises many kinds on damaged files; the frame reports it later
        return 1


def read_page(path: Path, page: int, check_size: Callable[[int, int], None]) -> np.ndarray:
    """One page as (H, W) or BGR (H, W, 3), turned upright; the size is checked before decoding.

    Raises whatever tifffile raises on damaged files; IndexError when there is no such page.
    """
    entry = _open_stack(*_identity(path))[page]
    with tifffile.TiffFile(path) as tiff:
        if entry.plane is not None:
            return _read_plane(tiff, entry.plane, check_size)
        leaf = tiff.pages[entry.directory]
        assert isinstance(leaf, tifffile.TiffPage)
        check_size(leaf.imagewidth, leaf.imagelength)
        try:
            pixels = _page_pixels(leaf)
        except (ValueError, ImportError):  # a codec or a layout that only OpenCV knows
            pixels = _read_with_opencv(path, entry.directory)
        orientation = leaf.tags.valueof("Orientation", 1)
    return turn_upright(pixels, int(orientation))


def turn_upright(pixels: np.ndarray, orientation: int) -> np.ndarray:
    """Apply an EXIF/TIFF orientation (1..8; anything else leaves the picture as it is)."""
    rotate, flip = _ORIENT.get(orientation, (None, None))
    if rotate is not None:
        pixels = cv2.rotate(pixels, rotate)
    return pixels if flip is None else cv2.flip(pixels, flip)


class _Entry:
    """Where a page lies: a directory of the file, or a plane of an undivided ImageJ stack."""

    __slots__ = ("directory", "plane")

    def __init__(self, directory: int, plane: int | None = None) -> None:
        self.directory = directory
        self.plane = plane


def _identity(path: Path) -> tuple[Path, int, int]:
    stat = path.stat()
    return path, stat.st_mtime_ns, stat.st_size


@lru_cache(maxsize=8)
def _open_stack(path: Path, _mtime_ns: int, _size_bytes: int) -> tuple[_Entry, ...]:
    """The table of pages; thumbnails (reduced pages) are left out."""
    with tifffile.TiffFile(path) as tiff:
        planes = _imagej_planes(tiff)
        if planes > 1:
            return tuple(_Entry(0, plane) for plane in range(planes))
        if len(tiff.pages) > MAX_PAGES:
            raise ValueError("too many pages")
        kept = [
            i
            for i in range(len(tiff.pages))
            if not int(getattr(tiff.pages[i].aspage(), "subfiletype", 0) or 0) & 1
        ]
    return tuple(_Entry(i) for i in kept)


def _imagej_planes(tiff: tifffile.TiffFile) -> int:
    """Planes of an ImageJ stack that is stored behind a single directory; 0 when it is not one."""
    if not tiff.is_imagej or len(tiff.pages) != 1 or not tiff.series:
        return 0
    series = tiff.series[0]
    if series.dataoffset is None or series.axes[-2:] != "YX":
        return 0
    return int(np.prod(series.shape[:-2], dtype=np.int64))


def _read_plane(
    tiff: tifffile.TiffFile, plane: int, check_size: Callable[[int, int], None]
) -> np.ndarray:
    series = tiff.series[0]
    height_px, width_px = series.shape[-2:]
    check_size(width_px, height_px)
    offset = int(series.dataoffset or 0) + plane * height_px * width_px * series.dtype.itemsize
    tiff.filehandle.seek(offset)
    raw = tiff.filehandle.read(height_px * width_px * series.dtype.itemsize)
    stored = series.dtype.newbyteorder(tiff.byteorder)
    native = np.frombuffer(raw, stored).reshape(height_px, width_px)
    return native.astype(series.dtype.newbyteorder("="))


def _page_pixels(leaf: tifffile.TiffPage) -> np.ndarray:
    photometric = int(leaf.photometric)
    if photometric not in (0, 1, 2) or leaf.dtype not in (np.dtype("u1"), np.dtype("u2")):
        raise ValueError("left to OpenCV")
    pixels = leaf.asarray()
    if leaf.planarconfig == 2 and pixels.ndim == 3:
        pixels = np.moveaxis(pixels, 0, -1)
    pixels = pixels.astype(pixels.dtype.newbyteorder("="), copy=False)
    if photometric == 0:  # white is zero
        return np.iinfo(pixels.dtype).max - pixels
    if pixels.ndim == 3 and pixels.shape[2] >= 3:
        return np.ascontiguousarray(pixels[:, :, 2::-1])
    return pixels[:, :, 0] if pixels.ndim == 3 else pixels


def _read_with_opencv(path: Path, directory: int) -> np.ndarray:
    flags = cv2.IMREAD_ANYCOLOR | cv2.IMREAD_ANYDEPTH | cv2.IMREAD_IGNORE_ORIENTATION
    good, pictures = cv2.imreadmulti(str(path), directory, 1, flags=flags)
    if not good or not pictures:
        raise RuntimeError("neither tifffile nor OpenCV can decode it")
    return pictures[0]
