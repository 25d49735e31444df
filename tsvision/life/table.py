"""Life tests as arrays: load, turns, contraction, cycles, and whether the string broke."""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from tsvision.data import table
from tsvision.errors import InputError
from tsvision.separators import has_decimal_comma, read_frame
from tsvision.units import kgf_to_newton

COLUMNS = ("load_N", "load_kgf", "turns", "cycles", "contraction_mm", "broke")
FALSE_WORDS = {"0", "0.0", "false", "no", "stopped", "censored"}
TRUE_WORDS = {"1", "1.0", "true", "yes", "broke", "failed"}


@dataclass(frozen=True)
class LifeTests:
    """One test an entry, arrays of shape (n,). `broke` is False where a test was stopped with
    the string whole: its life is at least `cycles` (right-censored)."""

    name: str
    load_N: np.ndarray
    turns: np.ndarray
    contraction_mm: np.ndarray
    cycles: np.ndarray
    broke: np.ndarray

    def select(self, keep: np.ndarray) -> LifeTests:
        """The tests where `keep` (n,) is true."""
        return LifeTests(
            self.name,
            self.load_N[keep],
            self.turns[keep],
            self.contraction_mm[keep],
            self.cycles[keep],
            self.broke[keep],
        )


def paper_tests() -> LifeTests:
    """The paper's twelve tests, all run until the string broke."""
    return tests_from_frame(table("life_cycle"), "the paper's life-cycle table")


def read_tests(path: Path) -> LifeTests:
    """A CSV with load_N or load_kgf, turns, cycles, contraction_mm and optionally `broke`."""
    return tests_from_frame(read_frame(path), path.name)


def tests_from_frame(data: pd.DataFrame, name: str) -> LifeTests:
    """Checked arrays of a table; raises InputError with column and row where something is off."""
    for need in ("turns", "cycles", "contraction_mm"):
        if need not in data:
            near = difflib.get_close_matches(need, list(data.columns), n=1)
            hint = f"did you mean '{near[0]}'? " if near else ""
            raise InputError(f"{name} has no column '{need}'; {hint}add it")
    if "load_N" not in data and "load_kgf" not in data:
        raise InputError(f"{name} has neither 'load_N' nor 'load_kgf'; add one")
    in_newton = "load_N" in data
    load = _positive(data, "load_N" if in_newton else "load_kgf", name)
    return LifeTests(
        name,
        load if in_newton else kgf_to_newton(load),
        _positive(data, "turns", name),
        _positive(data, "contraction_mm", name),
        _positive(data, "cycles", name),
        _broke(data, name),
    )


def _positive(data: pd.DataFrame, column: str, name: str) -> np.ndarray:
    values = pd.to_numeric(data[column], errors="coerce").to_numpy(dtype=float)
    wrong = np.flatnonzero(~(np.isfinite(values) & (values > 0)))
    if wrong.size:
        text = data[column].iloc[wrong[0]]
        mend = "write a decimal point" if has_decimal_comma(text) else "give a number above 0"
        raise InputError(f"{name}, row {wrong[0] + 1}: {column} is '{text}'; {mend}")
    return values


def _broke(data: pd.DataFrame, name: str) -> np.ndarray:
    if "broke" not in data:
        return np.ones(len(data), dtype=bool)
    words = [str(word).strip().lower() for word in data["broke"]]
    for row, word in enumerate(words, start=1):
        if word not in FALSE_WORDS | TRUE_WORDS:
            raise InputError(
                f"{name}, row {row}: broke is '{word}'; write 1 (broke) or 0 (stopped)"
            )
    return np.array([word in TRUE_WORDS for word in words])
