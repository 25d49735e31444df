"""Simulated measurements of a recording, with truth: what a measuring core would hand over.

Written for the tests of the timeline and of watching; it shares no code with either. A bundle of
diameter D is wound from 0 turns; coiling sets in at one turn count, unevenness at another, knots
nucleate, grow and drift. The measured series carry noise that grows with coiling, knots that hide
from the view, false sightings, jitter, unmeasured frames and gaps. Unwinding lags: what the turns
of winding show is still there `lag_turns` lower.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pandas as pd

KNOT_COLUMNS = [
    "frame",
    "turns",
    "centre_mm",
    "length_mm",
    "max_diameter_mm",
    "centre_x_px",
    "centre_y_px",
    "confidence",
    "coils",
]

NOT_SEEN = ("displacement_mm",)  # lengths that no picture tells


@dataclass(frozen=True)
class Plan:
    """What happens, and how well it is seen. Turn counts of nucleation in `knot_turns`."""

    step_turns: float = 1.0
    last_turns: float = 70.0
    diameter_mm: float = 0.48
    overtwist_turns: float = 20.0
    local_turns: float = 40.0
    knot_turns: tuple[float, ...] = (47.5, 55.0)
    vanish_turns: dict[int, float] = field(default_factory=dict)
    noise: float = 0.04
    hide: float = 0.04
    false: float = 0.01
    nan: float = 0.02
    mm_per_px: float = 0.0228
    drift_mm_per_turn: float = 0.03
    lag_turns: float = 0.0
    seed: int = 0


@dataclass(frozen=True)
class Series:
    """`frames`, `knots` as measured; truth: exact largest E / D and knot centres per frame."""

    frames: pd.DataFrame
    knots: pd.DataFrame
    overtwist_turns: float
    local_turns: float
    knot_turns: float
    true_count: np.ndarray


def knot_ratio(plan: Plan, turns: np.ndarray, number: int, base: np.ndarray) -> np.ndarray:
    """Exact E / D of one knot: 1.35 at nucleation, towards 2.6 with a few turns' growth."""
    age = turns - plan.knot_turns[number]
    alive = (age >= 0) & (turns < plan.vanish_turns.get(number, np.inf))
    grown = 1.30 + 1.3 * (1 - np.exp(-np.maximum(age, 0) / 6.0))
    return np.where(alive, np.maximum(grown, base), base)


def simulate(plan: Plan, turns: np.ndarray | None = None) -> Series:
    """Measured series for given turns (n,), by default one winding from 0 to the last."""
    random = np.random.default_rng(plan.seed)
    if turns is None:
        turns = np.arange(0.0, plan.last_turns + 1e-9, plan.step_turns)
    laid = lagging(turns, plan.lag_turns)
    beyond = np.maximum(laid - plan.overtwist_turns, 0)
    coil = np.where(laid >= plan.overtwist_turns, 0.05 + 0.06 * np.sqrt(beyond / 5.0), 0.0)
    uneven = np.where(laid >= plan.local_turns, 0.08 + 0.01 * (laid - plan.local_turns), 0.02)
    base = 1.0 + 2 * np.sqrt(2) * coil * 0.5
    ratios = np.array(
        [knot_ratio(plan, laid, k, base) for k in range(len(plan.knot_turns))]
    ).reshape(len(plan.knot_turns), len(turns))
    truly = ratios >= 1.40
    frames = _frames(plan, random, turns, coil, uneven, base, ratios)
    knots = _sightings(plan, random, turns, ratios, base)
    counts = knots.groupby("frame").size().reindex(range(len(turns)), fill_value=0)
    frames["knot_count"] = counts.to_numpy(dtype=float)
    lost = random.random(len(turns)) < plan.nan
    frames, knots = unmeasure(frames, knots, lost)
    first = np.flatnonzero(truly.any(axis=0))
    return Series(
        frames,
        knots,
        plan.overtwist_turns,
        plan.local_turns,
        float(turns[first[0]]) if len(first) else np.nan,
        truly.sum(axis=0),
    )


def lagging(turns: np.ndarray, lag: float) -> np.ndarray:
    """(n,) the winding turn count that shows the same as each frame."""
    falling = np.diff(turns, prepend=turns[:1]) < 0
    peaks = np.array([turns[: i + 1][-400:].max() for i in range(len(turns))])
    return np.where(falling, np.minimum(turns + lag, peaks), turns)


def cycles(last_turns: float, step_turns: float, count: int) -> np.ndarray:
    """Turns of `count` times winding up and back to 0."""
    up = np.arange(0.0, last_turns + 1e-9, step_turns)
    one = np.concatenate([up, up[-2:0:-1]])
    return np.concatenate([*[one] * count, [0.0]])


def _frames(plan, random, turns, coil, uneven, base, ratios):  # type: ignore[no-untyped-def]
    count = len(turns)
    diameter = plan.diameter_mm * (1 + 0.004 * random.standard_normal(count))
    noisy_coil = np.hypot(coil, 0.012) + 0.15 * plan.noise * random.standard_normal(count)
    noisy_uneven = uneven * (1 + plan.noise * random.standard_normal(count))
    noisy_uneven += 0.1 * plan.noise * random.standard_normal(count)
    top = np.vstack([base[None, :], ratios]).max(axis=0)
    top = top * (1 + plan.noise * random.standard_normal(count))
    return pd.DataFrame(
        {
            "frame": np.arange(count),
            "file": [f"f{i:04d}.png" for i in range(count)],
            "turns": turns,
            "time_s": np.nan,
            "diameter_mm": diameter,
            "diameter_px": diameter / plan.mm_per_px,
            "coil_amplitude_mm": np.abs(noisy_coil) * plan.diameter_mm,
            "unevenness": np.abs(noisy_uneven),
            "baseline_envelope_mm": base * plan.diameter_mm,
            "max_envelope_mm": top * plan.diameter_mm,
            "turns_seen": turns * (1 + 0.005 * random.standard_normal(count)),
            "displacement_mm": 1.2 * turns,
            "flags": "",
        }
    )


def _sightings(plan, random, turns, ratios, base):  # type: ignore[no-untyped-def]
    rows = []
    for i, turn in enumerate(turns):
        for k in range(len(plan.knot_turns)):
            ratio = ratios[k, i] * (1 + plan.noise * random.standard_normal())
            if ratios[k, i] <= base[i] or ratio < 1.40 or random.random() < plan.hide:
                continue
            place = 6.0 + 5.0 * k + plan.drift_mm_per_turn * (turn - plan.knot_turns[k])
            chance = np.clip(0.5 + 0.5 * (ratio - 1.40) / (3 * plan.noise + 1e-9), 0.5, 0.98)
            rows.append(_row(plan, random, i, turn, place, ratio, chance))
        if random.random() < plan.false:
            place, ratio = random.uniform(3, 20), random.uniform(1.41, 1.6)
            rows.append(_row(plan, random, i, turn, place, ratio, random.uniform(0.5, 0.8)))
    return pd.DataFrame(rows, columns=KNOT_COLUMNS)


def _row(plan, random, frame, turn, place, ratio, chance):  # type: ignore[no-untyped-def]
    place = place + 0.1 * random.standard_normal()
    x = 100 + place / plan.mm_per_px
    return (
        frame,
        turn,
        place,
        1.5 * plan.diameter_mm * ratio,
        ratio * plan.diameter_mm,
        x,
        270.0,
        chance,
        2.0,
    )


def with_px(table: pd.DataFrame, mm_per_px: float) -> pd.DataFrame:
    """A table of frames or knots with its lengths in px beside those in mm."""
    names = [c.removesuffix("_mm") for c in table if c.endswith("_mm") and c not in NOT_SEEN]
    return table.assign(**{f"{name}_px": table[f"{name}_mm"] / mm_per_px for name in names})


def without_scale(table: pd.DataFrame, mm_per_px: float) -> pd.DataFrame:
    """The same table as it would be told without a scale: lengths in px alone."""
    lost = [c for c in table if c.endswith("_mm") and c not in NOT_SEEN]
    table = with_px(table, mm_per_px).assign(**dict.fromkeys(lost, np.nan))
    return table.assign(mm_per_px=np.nan) if "flags" in table else table


def unmeasure(
    frames: pd.DataFrame, knots: pd.DataFrame, lost: np.ndarray, flag: str = "UNREADABLE"
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Blank out the measured columns of the frames where `lost` (n,) is True."""
    frames = frames.copy()
    columns = frames.columns.difference(["frame", "file", "turns", "time_s", "flags"])
    frames.loc[lost, columns] = np.nan
    frames.loc[lost, "flags"] = flag
    gone = frames.loc[lost, "frame"]
    return frames, knots[~knots["frame"].isin(gone)].reset_index(drop=True)
