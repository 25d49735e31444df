"""Which files are the frames of a recording, in their natural order."""

from __future__ import annotations

import glob
import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from tsvision.errors import InputError
from tsvision.images.frames_tiff import count_pages

PICTURE_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
VIDEO_SUFFIXES = (".mp4", ".avi", ".mkv", ".mov", ".m4v", ".webm")
_TIFF = (".tif", ".tiff")
_SUBFOLDER = "frames"


@dataclass(frozen=True)
class Found:
    """`source` is the folder of the pictures, or the one TIFF or video; `files` name frames
    relative to it (for a video empty: the frames are counted by its own index)."""

    source: Path
    kind: str
    files: tuple[str, ...]
    notes: tuple[str, ...] = ()


def natural_key(name: str) -> list[tuple[int, int, str]]:
    """Sort key with numbers by value: `f2` before `f10`."""
    parts = re.split(r"([0-9]+)", name)
    key = [(1, int(p), "") if i % 2 else (0, 0, p.casefold()) for i, p in enumerate(parts)]
    return [*key, (0, 0, name)]


def find_frames(
    source: str | Path | Sequence[str | Path], listed: Iterable[str] | None = None
) -> Found:
    """Find the frames of a folder, a glob, a list of pictures, one picture, one TIFF, one video.

    `listed` are the names in a turns table: they decide when a folder holds each frame in several
    formats. Raises InputError when there is nothing, or when it is not clear what is meant.
    """
    if not isinstance(source, str | Path):
        return _from_list([Path(p) for p in source], "the list of files")
    path = Path(source)
    if path.is_dir():
        return _from_folder(path, set(listed or ()))
    if os.path.lexists(path):
        return _from_list([path], str(path))
    if glob.has_magic(str(source)):
        hits = [Path(p) for p in glob.glob(str(source), recursive=True)]
        hits = [p for p in hits if _is_media(p)]
        if not hits:
            raise InputError(f"{source}: no picture or video matches; mend the pattern")
        return _from_list(hits, str(source))
    raise InputError(f"{source}: no such file or folder; check the path")


def _is_media(path: Path) -> bool:
    known = path.suffix.lower() in PICTURE_SUFFIXES + VIDEO_SUFFIXES
    return known and not path.name.startswith(".") and path.is_file()


def _entries(folder: Path) -> list[Path]:
    try:
        return [p for p in folder.iterdir() if _is_media(p)]
    except OSError as error:
        raise InputError(
            f"{folder}: cannot be listed ({error.strerror}); mend its permissions"
        ) from None


def _from_folder(folder: Path, listed: set[str]) -> Found:
    media = _entries(folder)
    pictures = [p for p in media if p.suffix.lower() in PICTURE_SUFFIXES]
    if not pictures:
        if len(media) == 1:
            return Found(media[0], "video", ())
        if len(media) > 1:
            raise InputError(f"{folder}: holds {len(media)} videos; name one of them")
        inner = folder / _SUBFOLDER
        if inner.is_dir() and _entries(inner):
            return _from_folder(inner, listed)
        raise InputError(
            f"{folder}: no pictures in it ({', '.join(s[1:] for s in PICTURE_SUFFIXES)}) "
            "and no video; name the folder that holds the frames"
        )
    pictures, notes = _one_format(folder, pictures, listed)
    videos = sum(p.suffix.lower() in VIDEO_SUFFIXES for p in media)
    if videos:
        notes += (f"{videos} video(s) beside the pictures were left out",)
    names = sorted((p.name for p in pictures), key=natural_key)
    return Found(folder, "folder", _with_pages(folder, names), notes)


def _one_format(
    folder: Path, pictures: list[Path], listed: set[str]
) -> tuple[list[Path], tuple[str, ...]]:
    """Settle a folder that holds the same frame in more than one format."""
    stems: dict[str, list[Path]] = {}
    for picture in pictures:
        stems.setdefault(picture.stem.casefold(), []).append(picture)
    if all(len(same) == 1 for same in stems.values()):
        return pictures, ()
    chosen = [p for p in pictures if p.name in listed]
    kinds = {p.suffix.lower() for p in chosen}
    if chosen:
        # frames that the table forgot stay in, as long as they are of the table's format
        kept = [p for p in pictures if p.suffix.lower() in kinds]
        if len({p.stem.casefold() for p in kept}) == len(kept):
            return kept, (f"the turns table names {_plain(kinds)} files; other formats left out",)
    kinds = {p.suffix.lower() for p in pictures}
    example = sorted(kinds)[0]
    raise InputError(
        f"{folder}: holds the same frames in several formats ({_plain(kinds)}); "
        f"name one with a pattern such as '{folder}/*{example}'"
    )


def _plain(kinds: Iterable[str]) -> str:
    return ", ".join(sorted(kinds))


def _from_list(paths: list[Path], shown: str) -> Found:
    if not paths:
        raise InputError("no file was named; name a folder, a glob, a video or pictures")
    for path in paths:
        if path.suffix.lower() not in PICTURE_SUFFIXES + VIDEO_SUFFIXES:
            raise InputError(f"{path}: neither a picture nor a video that is known by its ending")
        if not path.is_file():
            raise InputError(f"{path}: no ordinary file (missing, or a link in a circle)")
    videos = [p for p in paths if p.suffix.lower() in VIDEO_SUFFIXES]
    if videos and len(paths) > 1:
        raise InputError(f"{shown}: matches a video and other files; name one video alone")
    if videos:
        return Found(videos[0], "video", ())
    if len(paths) == 1:
        return _single(paths[0])
    folder = Path(os.path.commonpath([os.path.abspath(p.parent) for p in paths]))
    names = {Path(os.path.abspath(p)).relative_to(folder).as_posix() for p in paths}
    return Found(folder, "folder", _with_pages(folder, sorted(names, key=natural_key)))


def _single(path: Path) -> Found:
    names = _with_pages(path.parent, [path.name])
    if len(names) > 1:
        return Found(path, "tiff", names)
    return Found(path.parent, "folder", names)


def _with_pages(folder: Path, names: list[str]) -> tuple[str, ...]:
    """Names with each page of a multi-page TIFF as a frame of its own, `stack.tif#3`."""
    frames: list[str] = []
    for name in names:
        pages = count_pages(folder / name) if name.lower().endswith(_TIFF) else 1
        frames += [name] if pages == 1 else [f"{name}#{page}" for page in range(pages)]
    return tuple(frames)
