"""rig.toml: what is known of strings, actuator, camera and view, and where each value came from.

Every key is optional. Precedence: an option on the command line, then the file, then unknown.
"""

from __future__ import annotations

import difflib
import math
import tomllib
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from tsvision.errors import InputError
from tsvision.records import Actuator, Camera, Rig, Strings, View
from tsvision.rig_keys import SECTIONS

_NOUNS: dict[str, type] = {
    "strings": Strings,
    "actuator": Actuator,
    "camera": Camera,
    "view": View,
}
KEYS: tuple[str, ...] = tuple(
    f"{section}.{name}" for section, model in SECTIONS.items() for name in model.model_fields
)
MAX_FILE_BYTES = 1_000_000


def load_rig(path: Path | None, overrides: Mapping[str, object] = {}) -> Rig:
    """Read and check a rig file (None: nothing but the overrides).

    `overrides` maps keys such as "strings.count" to values, text from a command line included;
    None means not given. Raises InputError naming the key, the value and the mend.
    """
    given: dict[str, object] = {}
    source: dict[str, str] = {}
    if path is not None:
        given = _flatten(path, _read(path))
        source = dict.fromkeys(given, str(path))
    options = {key: value for key, value in overrides.items() if value is not None}
    for key in options:
        _must_be_known(key, "options")
    if "camera.mm_per_px" in options and "camera.scale_from" not in options:
        given.pop("camera.scale_from", None)  # a scale given by hand replaces the file's recipe
    if "camera.scale_from" in options and "camera.mm_per_px" not in options:
        given.pop("camera.mm_per_px", None)
        given.pop("camera.mm_per_px_sd", None)
    given.update(options)
    source.update(dict.fromkeys(options, "option"))
    values = _validated(given, source)
    _check_together(values, path)
    return _build(values, {key: source.get(key, "not given") for key in KEYS})


def find_rig(source: str | Path) -> Path | None:
    """The rig file that belongs to a recording: `film.rig.toml`, else `rig.toml` beside it."""
    path = Path(source)
    folder = path if path.is_dir() else path.parent
    named = [] if path.is_dir() else [folder / f"{path.stem}.rig.toml"]
    for candidate in [*named, folder / "rig.toml"]:
        if candidate.is_file():
            return candidate
    return None


def rig_values(rig: Rig) -> dict[str, Any]:
    """All keys with their values; None where unknown (strict JSON holds no NaN)."""
    values: dict[str, Any] = {}
    for section in _NOUNS:
        noun = getattr(rig, section)
        for name in SECTIONS[section].model_fields:
            value = getattr(noun, name)
            unknown = value == () or (isinstance(value, float) and math.isnan(value))
            values[f"{section}.{name}"] = None if unknown else value
    return values


def _read(path: Path) -> dict[str, Any]:
    try:
        if path.stat().st_size > MAX_FILE_BYTES:
            raise InputError(f"{path}: larger than a rig file can be; name the right file")
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        reason = " ".join(str(error).split())
        raise InputError(f"{path}: no valid TOML ({reason}); mend that place") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); mend the path") from None


def _flatten(path: Path, tree: dict[str, Any]) -> dict[str, object]:
    """{"strings": {"count": 2}} to {"strings.count": 2}; unknown keys raise."""
    flat: dict[str, object] = {}
    for section, content in tree.items():
        if not isinstance(content, dict):
            if section not in SECTIONS:
                _must_be_known(section, str(path))
            raise InputError(f"{path}: [{section}] must be a table of keys")
        if not content and section not in SECTIONS:
            _must_be_known(section, str(path))
        for name, value in content.items():
            _must_be_known(f"{section}.{name}", str(path))
            flat[f"{section}.{name}"] = value
    return flat


def _must_be_known(key: str, where: str) -> None:
    if key in KEYS:
        return
    bare = {known.split(".")[1]: known for known in KEYS}
    near = (
        difflib.get_close_matches(key, KEYS, n=1, cutoff=0.75)
        or difflib.get_close_matches(key.split(".")[-1], bare, n=1, cutoff=0.5)
        or difflib.get_close_matches(key, [*SECTIONS, *KEYS], n=1, cutoff=0.3)
    )
    nearest = bare.get(near[0], near[0]) if near else KEYS[0]
    raise InputError(
        f"{where}: unknown key '{key}'; did you mean '{nearest}'? (`tsvision rig init` lists all)"
    )


def _validated(given: dict[str, object], source: dict[str, str]) -> dict[str, BaseModel]:
    models: dict[str, BaseModel] = {}
    for section, model in SECTIONS.items():
        own = {
            key.split(".")[1]: value
            for key, value in given.items()
            if key.startswith(section + ".")
        }
        try:
            models[section] = model.model_validate(own)
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            name = str(first["loc"][0])
            key = f"{section}.{name}"
            example = (model.model_fields[name].examples or [""])[0]
            raise InputError(
                f"{_shown_source(source[key])}: {key} = {given[key]!r}: {_plain_reason(first)}; "
                f"such as {name} = {example}"
            ) from None
    return models


def _shown_source(source: str) -> str:
    return "command line" if source == "option" else source


def _plain_reason(problem: Any) -> str:
    reason = str(problem["msg"]).removeprefix("Value error, ").removeprefix("Input ")
    return reason[0].lower() + reason[1:]


def _check_together(values: dict[str, BaseModel], path: Path | None) -> None:
    """What two keys say of each other."""
    where = str(path) if path is not None else "command line"
    camera: Any = values["camera"]
    actuator: Any = values["actuator"]
    if camera.mm_per_px is not None and camera.scale_from is not None:
        raise InputError(
            f"{where}: camera.mm_per_px and camera.scale_from are both given; keep one of them"
        )
    if camera.mm_per_px_sd is not None and camera.mm_per_px is None:
        raise InputError(f"{where}: camera.mm_per_px_sd needs camera.mm_per_px; add it")
    needed = {
        "hole_distance": ("actuator.hole_distance_mm", actuator.hole_distance_mm),
        "length": ("camera.length_mm", camera.length_mm),
        "charuco": ("camera.board", camera.board),
        "ruler": ("camera.length_mm (one division)", camera.length_mm),
    }
    if camera.scale_from == "ruler" and camera.points_px is None:
        raise InputError(
            f'{where}: camera.scale_from = "ruler" needs camera.points_px, a line across its ticks'
        )
    key, value = needed.get(camera.scale_from or "", ("", True))
    if value is None:
        raise InputError(f'{where}: camera.scale_from = "{camera.scale_from}" needs {key}; add it')
    if camera.points_px is not None and len(camera.points_px) != 2:
        raise InputError(f"{where}: camera.points_px must hold two points, [[x, y], [x, y]]")
    if camera.points_px is not None and camera.points_px[0] == camera.points_px[1]:
        raise InputError(f"{where}: camera.points_px must be two different points")


def _build(values: dict[str, BaseModel], source: dict[str, str]) -> Rig:
    nouns = {}
    for section, noun in _NOUNS.items():
        known = {f.name for f in fields(noun)}
        given = values[section].model_dump(exclude_none=True)
        nouns[section] = noun(**{name: v for name, v in given.items() if name in known})
    return Rig(**nouns, source=source)
