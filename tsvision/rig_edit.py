"""Change single keys of a rig.toml and leave the rest, comments included, as it stands."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from tsvision.atomic import write_text
from tsvision.errors import InputError
from tsvision.rig import load_rig
from tsvision.rig_keys import SECTIONS


def set_keys(path: Path, values: Mapping[str, float | tuple[float, ...] | None]) -> None:
    """Set keys such as "camera.mm_per_px" in a rig file (made if missing); None takes a key out.

    The changed text is read back and checked before it replaces the file. Raises InputError.
    """
    text = ""
    if path.exists():
        load_rig(path)  # a broken file is reported, not overwritten
        text = path.read_text(encoding="utf-8-sig")
    for key, value in values.items():
        section, name = key.split(".")
        text = _without(text, section, name)
        if value is not None:
            text = _with(text, section, f"{name} = {_toml(value)}")
    check = path.with_name(f".{path.name}.check")
    write_text(check, text)
    try:
        load_rig(check)
    except InputError as error:
        raise InputError(f"{path}: left as it was ({error})") from None
    finally:
        check.unlink()
    write_text(path, text)


def _toml(value: float | tuple[float, ...]) -> str:
    if isinstance(value, tuple):
        return "[" + ", ".join(f"{v:.8g}" for v in value) + "]"
    return f"{value:.8g}"


def _without(text: str, section: str, name: str) -> str:
    """Take the key's line out of its section."""
    kept, here = [], ""
    for line in text.splitlines():
        header = re.match(r"\s*\[([^\]]+)\]", line)
        here = header[1].strip() if header else here
        if not (here == section and re.match(rf"\s*{re.escape(name)}\s*=", line)):
            kept.append(line)
    return "\n".join(kept) + "\n" if kept else ""


def _with(text: str, section: str, line: str) -> str:
    """Put the line right under its section's header, which is made if missing."""
    assert section in SECTIONS
    pattern = re.compile(rf"^[ \t]*\[{section}\][^\n]*\n", re.MULTILINE)
    match = pattern.search(text)
    if match:
        return text[: match.end()] + line + "\n" + text[match.end() :]
    gap = "\n" if text and not text.endswith("\n\n") else ""
    return f"{text}{gap}[{section}]\n{line}\n"
