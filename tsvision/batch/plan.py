"""Which recordings a batch holds: from a manifest, a folder of recordings, or a glob."""

from __future__ import annotations

import csv
import difflib
import glob
import hashlib
import os
import re
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

from tsvision.errors import InputError
from tsvision.images.frames_find import PICTURE_SUFFIXES, VIDEO_SUFFIXES, natural_key
from tsvision.jsonable import printable
from tsvision.rig import KEYS
from tsvision.run import Request
from tsvision.separators import separator_of

COLUMNS = (
    "recording",
    "name",
    "rig",
    "turns_file",
    "turns_per_frame",
    "turns_from_name",
    "frames",
)
MAX_NAME = 100


@dataclass(frozen=True)
class Item:
    """One recording of a batch under the name of its folder in the results."""

    name: str
    request: Request


def plan(source: str, base: Request) -> list[Item]:
    """The recordings that `source` means, in order; `base` holds what is common to all.

    A `.csv` is a manifest, one recording a row; a folder holds recordings (folders of frames and
    videos); anything else is a glob of them, or of pictures, each then a recording of its own.
    Raises InputError.
    """
    path = Path(source)
    if path.is_file() and path.suffix.lower() == ".csv":
        items = _from_manifest(path, base)
    elif path.is_dir():
        items = [_item(p, base) for p in _recordings_in(path)]
        if not items:
            raise InputError(
                f"{path}: holds no recordings (folders of frames, videos); name the folder above "
                "them, a manifest.csv, or a glob"
            )
    elif glob.has_magic(source):
        hits = sorted((Path(p) for p in glob.glob(source)), key=lambda p: natural_key(str(p)))
        items = [_item(p, base) for p in hits if _is_recording(p) or _is_picture(p)]
        if not items:
            raise InputError(f"{source}: matches no folder of frames, no video and no picture")
    else:
        raise InputError(f"{source}: no such manifest (.csv) or folder; check the path")
    return _with_own_names(items)


def _item(path: Path, base: Request, name: str = "") -> Item:
    shown = name or (path.resolve().name if path.is_dir() else path.stem)
    return Item(shown, replace(base, source=path))


def _recordings_in(folder: Path) -> list[Path]:
    try:
        inside = sorted(folder.iterdir(), key=lambda p: natural_key(p.name))
    except OSError as error:
        raise InputError(f"{folder}: cannot be listed ({error.strerror}); mend it") from None
    return [p for p in inside if not p.name.startswith(".") and _is_recording(p)]


def _is_picture(path: Path) -> bool:
    return path.is_file() and path.suffix.lower() in PICTURE_SUFFIXES


def _is_recording(path: Path) -> bool:
    """A video, a TIFF, or a folder with pictures or a video in it (or in its `frames`)."""
    if path.is_file():
        return path.suffix.lower() in (*VIDEO_SUFFIXES, ".tif", ".tiff")
    if not path.is_dir():
        return False
    for place in (path, path / "frames"):
        if place.is_dir() and any(
            p.suffix.lower() in PICTURE_SUFFIXES + VIDEO_SUFFIXES and not p.name.startswith(".")
            for p in place.iterdir()
        ):
            return True
    return False


# ------------------------------------------------------------------ manifest


def _from_manifest(path: Path, base: Request) -> list[Item]:
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            separator = separator_of(file.readline())
            file.seek(0)
            reader = csv.DictReader(file, skipinitialspace=True, delimiter=separator)
            header = [name.strip() for name in reader.fieldnames or ()]
            _check_header(path, header)
            reader.fieldnames = header
            items = [_from_row(path, reader.line_num, row, base) for row in reader]
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: no readable CSV in UTF-8 ({error})") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); mend the path") from None
    if not items:
        raise InputError(f"{path}: has no rows; write one a recording")
    return items


def _check_header(path: Path, header: list[str]) -> None:
    known = [*COLUMNS, *KEYS]
    for name in header:
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1, cutoff=0.3) or ["recording"]
            raise InputError(f"{path}: unknown column {name!r}; did you mean '{near[0]}'?")
    if "recording" not in header:
        raise InputError(f"{path}: no column 'recording'; write the path of each recording there")
    if len(set(header)) < len(header):
        raise InputError(f"{path}: a column is there twice; keep one")


def _from_row(path: Path, line: int, row: dict[str, str], base: Request) -> Item:
    where = f"{path}, line {line}"
    if None in row:
        raise InputError(f"{where}: more values than columns; mend the line")
    given = {key: (value or "").strip() for key, value in row.items()}
    if not given["recording"]:
        raise InputError(f"{where}: 'recording' is empty; name one or take the line out")
    overrides = dict(base.overrides or {})
    overrides.update({key: given[key] for key in KEYS if given.get(key)})
    rig, turns = given.get("rig"), given.get("turns_file")
    request = Request(
        _beside(path, given["recording"]),
        Path(_beside(path, rig)) if rig else base.rig_path,
        overrides,
        Path(_beside(path, turns)) if turns else base.turns_file,
        _float(where, given.get("turns_per_frame", "")) or base.turns_per_frame,
        given.get("turns_from_name") or base.turns_from_name,
        _range(where, given.get("frames", "")) or base.frames,
    )
    name = given.get("name") or Path(given["recording"]).stem or Path(given["recording"]).name
    return Item(name, request)


def _beside(manifest: Path, text: str) -> str:
    """A path in a manifest counts from the manifest's folder."""
    return os.path.join(manifest.parent, text)


def _float(where: str, text: str) -> float | None:
    if not text:
        return None
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{where}: turns_per_frame {text!r} is no number") from None


def _range(where: str, text: str) -> tuple[int, int | None] | None:
    if not text:
        return None
    match = re.fullmatch(r"(\d*):(\d*)", text)
    if not match:
        raise InputError(f"{where}: frames {text!r}: write A:B, such as 0:100")
    return int(match[1] or 0), int(match[2]) if match[2] else None


# ------------------------------------------------------------------ names


def _with_own_names(items: list[Item]) -> list[Item]:
    """Names safe as folders and told apart; equal ones get a piece of their request's hash."""
    safe = [safe_name(item.name) for item in items]
    uses = Counter(name.casefold() for name in safe)
    named = []
    for name, item in zip(safe, items, strict=True):
        if uses[name.casefold()] > 1:
            identity = repr(item.request).encode("utf-8", "backslashreplace")
            name = f"{name}-{hashlib.sha256(identity).hexdigest()[:8]}"
        named.append(Item(name, item.request))
    if len({item.name for item in named}) < len(named):
        raise InputError("the same recording is there twice with the same settings; keep one")
    return named


def safe_name(text: str) -> str:
    """A folder name: letters, digits, and ` ._-+` stay, the rest becomes `_`; never `.` or `..`."""
    kept = re.sub(r"[^\w .+-]", "_", printable(text)).strip(" .")
    return kept[:MAX_NAME] or "recording"
