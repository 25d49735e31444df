"""The paper's tables; see MANIFEST.toml for sources, units and licence."""

from __future__ import annotations

import copy
import tomllib
from functools import lru_cache
from importlib import resources

import pandas as pd

from tsvision.errors import InputError


def manifest() -> dict[str, dict]:
    """MANIFEST.toml as a dict: `source`, and `tables` by name."""
    return copy.deepcopy(_manifest())


@lru_cache
def _manifest() -> dict[str, dict]:
    text = resources.files(__package__).joinpath("MANIFEST.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def table(name: str) -> pd.DataFrame:
    """One of the paper's tables as published; columns carry their units.

    Raises InputError on an unknown name and lists those that exist.
    """
    known = _manifest()["tables"]
    if name not in known:
        raise InputError(f"no table '{name}' in the reference data; there are: {', '.join(known)}")
    return _read(known[name]["file"]).copy()


@lru_cache
def _read(file_name: str) -> pd.DataFrame:
    with resources.files(__package__).joinpath(file_name).open(encoding="utf-8") as file:
        return pd.read_csv(file)
