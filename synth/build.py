"""From short words (a preset, `name=value` pairs, a turns range) to full settings."""

from __future__ import annotations

import ast
import dataclasses
import difflib
from typing import Any

import numpy as np

from synth.presets import preset
from synth.settings import Actuator, Settings, Strings
from synth.validate import check_seed
from tsvision.errors import InputError

_GROUPS = ("strings", "actuator", "law", "hidden", "camera", "look", "sensor")


def parse_turns(text: str) -> tuple[float, ...]:
    """`0:70:2` (70 included), `3.5`, or several parts joined by commas: `0:60:2,58:0:2`.

    A step's sign does not matter. Raises InputError on anything else.
    """
    turns: list[float] = []
    for part in text.split(","):
        turns.extend(_parse_part(part, text))
    return tuple(turns)


def _parse_part(part: str, text: str) -> list[float]:
    try:
        numbers = [float(number) for number in part.split(":")]
    except ValueError:
        numbers = []
    if len(numbers) == 1 and np.isfinite(numbers[0]):
        return numbers
    if len(numbers) not in (2, 3) or not np.isfinite(numbers).all():
        raise InputError(f"--turns '{text}' cannot be read; give START:STOP:STEP such as 0:70:2")
    start, stop = numbers[:2]
    step = abs(numbers[2]) if len(numbers) == 3 else 1.0
    if step == 0.0:
        raise InputError(f"--turns '{text}' has a step of 0; give a step above 0")
    count = int(np.floor(abs(stop - start) / step + 1e-9)) + 1
    if count > 1_000_000:
        raise InputError(f"--turns '{text}' asks for {count} frames; give at most 1000000")
    sign = 1.0 if stop >= start else -1.0
    return [round(start + sign * step * i, 9) for i in range(count)]


def make_settings(
    turns: tuple[float, ...],
    preset_name: str = "clean",
    seed: int = 0,
    look: str | None = None,
    strings: Strings | None = None,
    actuator: Actuator | None = None,
    changes: dict[str, object] | None = None,
) -> Settings:
    """A preset with changes such as {"camera.view": "closeup", "hidden.slip": 0.03}."""
    check_seed(seed)
    camera, chosen, sensor = preset(preset_name, seed, look)
    settings = Settings(
        turns=turns,
        strings=strings or Strings(),
        actuator=actuator or Actuator(),
        camera=camera,
        look=chosen,
        sensor=sensor,
        preset=preset_name,
        seed=seed,
    )
    for key, value in (changes or {}).items():
        settings = with_change(settings, key, value)
    return settings


def with_change(settings: Settings, key: str, value: object) -> Settings:
    """One field replaced; `key` is group.field or a field of Settings itself."""
    group, _, name = key.rpartition(".")
    target: Any = getattr(settings, group) if group in _GROUPS else settings
    names = [field.name for field in dataclasses.fields(target)]
    if (group and group not in _GROUPS) or name not in names or name in _GROUPS:
        raise InputError(f"no setting '{key}'; {_nearest(key)}")
    changed = dataclasses.replace(target, **{name: _fitted(key, getattr(target, name), value)})
    return changed if target is settings else dataclasses.replace(settings, **{group: changed})


def setting_names() -> list[str]:
    """Every key that `with_change` knows."""
    names = []
    for field in dataclasses.fields(Settings):
        if field.name in _GROUPS:
            inner = dataclasses.fields(getattr(Settings(), field.name))
            names += [f"{field.name}.{part.name}" for part in inner]
        else:
            names.append(field.name)
    return names


def _nearest(key: str) -> str:
    near = difflib.get_close_matches(key, setting_names(), n=1, cutoff=0.4)
    return f"did you mean '{near[0]}'?" if near else "`tsvision synth --list` names them all"


def _fitted(key: str, old: object, value: object) -> object:
    """Text from a command line becomes the type that the field has."""
    if isinstance(value, str) and not isinstance(old, str):
        try:
            value = ast.literal_eval(value.capitalize() if value in ("true", "false") else value)
        except (ValueError, SyntaxError) as problem:
            raise InputError(f"{key} = {value} is not a number or a list of numbers") from problem
    if isinstance(old, bool) != isinstance(value, bool) and isinstance(old, bool):
        raise InputError(f"{key} = {value!r} must be true or false")
    if isinstance(old, (int, float)) and not isinstance(value, (int, float)):
        raise InputError(f"{key} = {value!r} must be a number")
    if isinstance(old, int) and not isinstance(old, bool) and value != int(value):  # type: ignore[call-overload]
        raise InputError(f"{key} = {value!r} must be a whole number")
    if isinstance(old, tuple):
        return _tuples(value)
    return value


def _tuples(value: object) -> object:
    return tuple(_tuples(v) for v in value) if isinstance(value, (list, tuple)) else value
