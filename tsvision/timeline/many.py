"""Onsets of many recordings: one row each, and survival with the censored ones in.

A recording that ended before its onset says "not up to here": leaving it out would make onsets
look earlier than they are, taking its end as the onset would too. Kaplan–Meier keeps what each
recording does say. Recordings that are undetermined say nothing and are only counted.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from tsvision.errors import InputError

COLUMNS = [
    "recording",
    "strings",
    "string_diameter_mm",
    "diameter_mm",
    "load_N",
    "status",
    "turns",
    "low",
    "high",
    "last_turns",
]
LEAST_EVENTS = 8  # fewer onsets do not carry a regression


def onset_table(folders: Iterable[Path], phase: str) -> pd.DataFrame:
    """One row per measured folder, COLUMNS; turns without their sense, NaN where unknown."""
    rows = [_row(folder, f"{phase}_onset") for folder in folders]
    return pd.DataFrame(rows, columns=COLUMNS)


def measured_folders(paths: Iterable[Path]) -> list[Path]:
    """Folders with a summary.json: those given, and those found below them, each once."""
    found: dict[Path, None] = {}
    for path in paths:
        if not path.is_dir():
            raise InputError(f"{path} is no folder; give folders that `tsvision measure` wrote")
        below = sorted(p.parent for p in path.rglob("summary.json"))
        if not below:
            raise InputError(f"{path} holds no summary.json; run `tsvision measure` first")
        found.update(dict.fromkeys(below))
    return list(found)


def _row(folder: Path, name: str) -> dict[str, Any]:
    told = read_summary(folder)
    onset, rig = told[name], told.get("rig", {})
    bounds = [abs(v) for v in (onset["low"], onset["high"]) if v is not None]
    return {
        "recording": folder.name,
        "strings": _number(rig.get("strings.count")),
        "string_diameter_mm": _number(rig.get("strings.diameter_mm")),
        "diameter_mm": _number((told.get("diameter_mm") or {}).get("value")),
        "load_N": _number(rig.get("actuator.load_N")),
        "status": onset["status"],
        "turns": abs(_number(onset["turns"])),
        "low": min(bounds) if bounds else math.nan,
        "high": max(bounds) if bounds else math.nan,
        "last_turns": abs(_number(onset["last_turns"])),
    }


def read_summary(folder: Path) -> dict[str, Any]:
    """summary.json of a measured folder; InputError where it is not one."""
    path = folder / "summary.json"
    try:
        told: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as problem:
        raise InputError(
            f"{path} cannot be read ({problem}); measure that recording anew"
        ) from None
    if not isinstance(told, dict) or "knot_onset" not in told:
        raise InputError(f"{path} holds no onsets; measure that recording anew")
    return told


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else math.nan


def survival(table: pd.DataFrame, by: str | None = "strings", level: float = 0.95) -> pd.DataFrame:
    """Kaplan–Meier survival of "not begun yet" over turns, one curve per value of `by`.

    Columns: `by`'s name, turns, without (share that has not begun), low, high.
    """
    from lifelines import KaplanMeierFitter

    told = usable(table)
    curves = []
    for value, group in _groups(told, by):
        fit = KaplanMeierFitter(alpha=1 - level)
        fit.fit(group["at_turns"], event_observed=group["observed"])
        bounds = fit.confidence_interval_survival_function_
        curves.append(
            pd.DataFrame(
                {
                    by or "all": value,
                    "turns": fit.survival_function_.index.to_numpy(dtype=float),
                    "without": fit.survival_function_.iloc[:, 0].to_numpy(dtype=float),
                    "low": bounds.iloc[:, 0].to_numpy(dtype=float),
                    "high": bounds.iloc[:, 1].to_numpy(dtype=float),
                }
            )
        )
    names = [by or "all", "turns", "without", "low", "high"]
    return pd.concat(curves, ignore_index=True) if curves else pd.DataFrame(columns=names)


def medians(table: pd.DataFrame, by: str | None = "strings", level: float = 0.95) -> pd.DataFrame:
    """Median onset per group with its interval; NaN where half of them never began."""
    from lifelines import KaplanMeierFitter
    from lifelines.utils import median_survival_times

    rows = []
    for value, group in _groups(usable(table), by):
        fit = KaplanMeierFitter(alpha=1 - level)
        fit.fit(group["at_turns"], event_observed=group["observed"])
        bounds = median_survival_times(fit.confidence_interval_).to_numpy(dtype=float).ravel()
        rows.append(
            {
                by or "all": value,
                "recordings": len(group),
                "observed": int(group["observed"].sum()),
                "censored": int((~group["observed"]).sum()),
                "median_turns": _finite(fit.median_survival_time_),
                "low": _finite(bounds.min()),
                "high": _finite(bounds.max()),
            }
        )
    names = [by or "all", "recordings", "observed", "censored", "median_turns", "low", "high"]
    return pd.DataFrame(rows, columns=names)


def _finite(value: float) -> float:
    return float(value) if np.isfinite(value) else math.nan


def usable(table: pd.DataFrame) -> pd.DataFrame:
    """Rows that say something, with `observed` and `at_turns` (onset, or end of the recording)."""
    told = table[table["status"].isin(["observed", "not_observed"])]
    observed = (told["status"] == "observed").to_numpy(dtype=bool)
    at = np.where(observed, told["turns"], told["last_turns"]).astype(float)
    told = told.assign(observed=observed, at_turns=at)
    return told[np.isfinite(told["at_turns"].to_numpy(dtype=float))]


def _groups(told: pd.DataFrame, by: str | None) -> list[tuple[object, pd.DataFrame]]:
    if by is None:
        return [("all", told)] if len(told) else []
    known = told[np.isfinite(told[by].to_numpy(dtype=float))]
    return [(value, group) for value, group in known.groupby(by, sort=True)]


def group_difference(table: pd.DataFrame, by: str = "strings") -> dict[str, float] | None:
    """Log-rank test that all groups begin alike; None with fewer than two groups."""
    from lifelines.statistics import multivariate_logrank_test

    told = usable(table)
    told = told[np.isfinite(told[by].to_numpy(dtype=float))]
    if told[by].nunique() < 2 or not told["observed"].any():
        return None
    test = multivariate_logrank_test(told["at_turns"], told[by], told["observed"])
    return {"chi_square": float(test.test_statistic), "p": float(test.p_value)}


def dependence(
    table: pd.DataFrame, on: Iterable[str] = ("strings", "diameter_mm", "load_N")
) -> pd.DataFrame:
    """Exponents in onset ∝ Π x^b (Weibull accelerated failure time, censoring in), one x at a
    time, so that inputs that vary together (N and D) do not share one effect between them.

    Columns: x, exponent, low, high, p. Empty with fewer than LEAST_EVENTS onsets.
    """
    told = usable(table)
    rows = []
    for name in on:
        row = _exponent(told, name)
        if row is not None:
            rows.append(row)
    return pd.DataFrame(rows, columns=["x", "exponent", "low", "high", "p"])


def _exponent(told: pd.DataFrame, name: str) -> dict[str, object] | None:
    from lifelines import WeibullAFTFitter

    x = told[name].to_numpy(dtype=float)
    data = told.loc[np.isfinite(x) & (x > 0), [name, "at_turns", "observed"]]
    data = data[data["at_turns"] > 0]
    if data["observed"].sum() < LEAST_EVENTS or data[name].nunique() < 2:
        return None
    data = data.assign(log_x=np.log(data[name].astype(float))).drop(columns=name)
    found = WeibullAFTFitter().fit(data, "at_turns", "observed").summary.loc[("lambda_", "log_x")]
    return {
        "x": name,
        "exponent": float(found["coef"]),
        "low": float(found["coef lower 95%"]),
        "high": float(found["coef upper 95%"]),
        "p": float(found["p"]),
    }


def against_paper(overtwist: pd.DataFrame) -> pd.DataFrame:
    """Measured overtwist onsets per N beside the paper's table (seen by eye, no interval).

    `overtwist`: `onset_table(…, "overtwist")`. Columns: strings, paper_turns, recordings,
    median_turns, low, high, difference, agrees (the paper's number lies within the interval of
    the median, or of the onset where there is one recording).
    """
    from tsvision.data import table as paper_table

    measured = medians(overtwist, "strings").set_index("strings")
    rows = []
    for strings, turns in paper_table("overtwist")[["strings", "onset_turns"]].to_numpy():
        row: dict[str, object] = {"strings": int(strings), "paper_turns": float(turns)}
        if strings in measured.index:
            found = measured.loc[strings]
            low, high = _spread(overtwist, strings, found)
            row |= {
                "recordings": int(found["recordings"]),
                "median_turns": float(found["median_turns"]),
                "low": low,
                "high": high,
                "difference": float(found["median_turns"]) - float(turns),
                "agrees": bool(low <= turns <= high),
            }
        rows.append(row)
    names = ["strings", "paper_turns", "recordings", "median_turns", "low", "high"]
    return pd.DataFrame(rows, columns=[*names, "difference", "agrees"])


def _spread(table: pd.DataFrame, strings: float, found: pd.Series) -> tuple[float, float]:
    """The interval of the median, never narrower than the recordings' own intervals allow."""
    rows = table[(table["strings"] == strings) & (table["status"] == "observed")]
    own = (rows["low"].median(), rows["high"].median()) if len(rows) else (math.nan, math.nan)
    return float(np.fmin(found["low"], own[0])), float(np.fmax(found["high"], own[1]))
