"""All that a log tells, in one record."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from tsvision.riglog.cycles import Cycles, Levels, find_cycles, levels
from tsvision.riglog.events import (
    End,
    Stretch,
    event_findings,
    find_end,
    stalls,
    supply_losses,
)
from tsvision.riglog.read import Finding, RigLog, read_log
from tsvision.riglog.wear import Trend, cycle_table, trends


@dataclass(frozen=True)
class LogReport:
    """A log with its cycles, events, trends, and everything that is wrong in it."""

    log: RigLog
    levels: Levels
    cycles: Cycles
    table: pd.DataFrame
    stalls: tuple[Stretch, ...]
    supply_losses: tuple[Stretch, ...]
    trends: tuple[Trend, ...]
    end: End
    findings: tuple[Finding, ...]

    @property
    def counted(self) -> float:
        """Last value of the log's own counter, NaN where it has none."""
        known = self.log.cycle[np.isfinite(self.log.cycle)]
        return float(known[-1]) if known.size else float("nan")


def report(path: Path) -> LogReport:
    """Read a log and work out cycles, dirt, wear and the end."""
    log = read_log(path)
    known, cycles = levels(log), find_cycles(log)
    stalled, lost = stalls(log, cycles, known), supply_losses(log, cycles)
    table = cycle_table(log, cycles, known)
    return LogReport(
        log=log,
        levels=known,
        cycles=cycles,
        table=table,
        stalls=tuple(stalled),
        supply_losses=tuple(lost),
        trends=tuple(trends(table)),
        end=find_end(log, cycles, known, stalled),
        findings=(*log.findings, *cycles.findings, *event_findings(log, stalled, lost)),
    )
