"""A rig's log with a known break, and dirt on request: the truth for the reader."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np


@dataclass(frozen=True)
class Rig:
    """What a made-up rig does. Currents in mA, times in s."""

    cycles: int = 60
    break_cycle: int | None = None  # the string breaks in this cycle (1-based) ...
    break_share: float = 0.6  # ... this far into winding
    cycles_after: int = 4  # the rig goes on unloaded for so many
    step_s: float = 0.05
    wind_s: float = 1.5
    turn_s: float = 0.2
    rest_s: float = 1.0
    logs_rest: bool = False
    idle_mA: float = -3.0
    load_mA: float = 480.0
    free_mA: float = 70.0
    ceiling_mA: float = 3276.0
    wear_share: float = 0.0  # rise of the load current over the log
    noise_mA: float = 15.0
    seed: int = 0


@dataclass(frozen=True)
class Made:
    """Rows (time, counter, current, supply) and the truth: the break's time, cycle starts."""

    rows: np.ndarray
    break_s: float | None
    starts_s: np.ndarray


def make(rig: Rig) -> Made:
    """Wind, short stop, unwind, rest, again; load current rises while winding."""
    rng = np.random.default_rng(rig.seed)
    rows: list[tuple[float, float, float, float]] = []
    starts, time, break_s = [], 0.5, None
    last = rig.cycles if rig.break_cycle is None else rig.break_cycle + rig.cycles_after
    for cycle in range(1, last + 1):
        starts.append(time)
        worn = rig.load_mA * (1 + rig.wear_share * cycle / rig.cycles)
        for phase in ("idle", "wind", "turn", "back"):
            span = {"idle": rig.step_s, "turn": rig.turn_s}.get(phase, rig.wind_s)
            begun = time
            while time - begun < span:
                share = (time - begun) / span
                broken = rig.break_cycle is not None and (
                    cycle > rig.break_cycle
                    or (cycle == rig.break_cycle and phase == "back")
                    or (phase == "wind" and cycle == rig.break_cycle and share > rig.break_share)
                )
                if broken and break_s is None:
                    break_s = time
                current = _current(rig, phase, share, worn, broken, time - begun, rng)
                rows.append((time, cycle, current, 4700 - 0.4 * max(current, 0)))
                time += rig.step_s * float(rng.uniform(0.9, 1.1))
        if rig.logs_rest:
            begun = time
            while time - begun < rig.rest_s:
                rows.append((time, cycle, rig.idle_mA, 4700.0))
                time += rig.step_s * float(rng.uniform(0.9, 1.1))
        else:
            time += rig.rest_s
    return Made(np.array(rows), break_s, np.array(starts))


def _current(
    rig: Rig, phase: str, share: float, worn: float, broken: bool, since_s: float, rng
) -> float:
    if phase in ("idle", "turn"):
        return rig.idle_mA
    if since_s < 1.5 * rig.step_s:
        return rig.ceiling_mA
    shape = 0.7 + 0.6 * share if phase == "wind" else 0.6
    level = rig.free_mA if broken else worn * shape
    return level + float(rng.normal(0, rig.noise_mA))


def write(
    path: Path, rows: np.ndarray, header: str = "Timestamp,CycleCount,Current,Voltage"
) -> Path:
    lines = [f"{t:.4f},{c:.0f},{i:.2f},{v:.2f}" for t, c, i, v in rows]
    path.write_text("\n".join([header, *lines]) + "\n")
    return path
