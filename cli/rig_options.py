"""Every key of rig.toml as an option of the same name, for any verb that reads a rig.

`camera.mm_per_px` is `--mm-per-px`, `--mm_per_px` or `--camera.mm_per_px`.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

import typer

from tsvision.rig import KEYS
from tsvision.rig_keys import SECTIONS

_PANEL = "Rig: each wins over rig.toml"


def spellings(key: str) -> list[str]:
    """The option names of a key, the usual one first."""
    name = key.split(".")[1]
    usual = "--" + name.replace("_", "-")
    more = [usual, usual.lower(), f"--{name}", f"--{key}"]
    return list(dict.fromkeys(more))


def with_rig_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add `--rig` and one option a key to a typer command.

    The function gets `rig_path: Path | None` and `overrides: dict[str, str]` (only what was given).
    """
    own = inspect.signature(function)
    added = {_parameter_name(key): key for key in KEYS}

    @functools.wraps(function)
    def command(*args: Any, **values: Any) -> Any:
        overrides = {added[name]: values.pop(name) for name in added}
        overrides = {key: value for key, value in overrides.items() if value is not None}
        return function(*args, overrides=overrides, **values)

    rig_path = typer.Option(None, "--rig", help="rig.toml; without it the one beside RECORDING.")
    parameters = [p for n, p in own.parameters.items() if n not in ("rig_path", "overrides")]
    keyword = inspect.Parameter.KEYWORD_ONLY
    parameters = [p.replace(kind=keyword) for p in parameters]
    parameters.append(
        inspect.Parameter("rig_path", keyword, default=rig_path, annotation=Path | None)
    )
    for name, key in added.items():
        section, bare = key.split(".")
        info = SECTIONS[section].model_fields[bare]
        option = typer.Option(
            None, *spellings(key), help=info.description, rich_help_panel=_PANEL, metavar="VALUE"
        )
        parameters.append(inspect.Parameter(name, keyword, default=option, annotation=str | None))
    command.__signature__ = own.replace(parameters=parameters)  # type: ignore[attr-defined]
    hints = inspect.get_annotations(function, eval_str=True)
    command.__annotations__ = {
        **{p.name: hints.get(p.name, p.annotation) for p in parameters},
        "return": hints.get("return"),
    }
    return command


def _parameter_name(key: str) -> str:
    return "rig_" + key.replace(".", "_").lower()
