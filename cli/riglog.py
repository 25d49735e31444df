"""`tsvision riglog`: read life-cycle rigs' logs: cycles, dirt, wear, how they end."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cli import actuator_options as options

if TYPE_CHECKING:
    from tsvision.riglog.report import LogReport


def command(
    logs: Annotated[list[Path], typer.Argument(help="CSV logs: time, cycle, current, supply.")],
    cycles: Annotated[
        Path | None, typer.Option("--cycles", help="Write one row a cycle to this CSV (one log).")
    ] = None,
    as_json: options.JsonOption = False,
) -> None:
    """Count the cycles, list what is wrong, find wear trends and the break from the current."""
    from tsvision.errors import InputError
    from tsvision.jsonable import to_json
    from tsvision.riglog.report import report

    if cycles is not None and len(logs) > 1:
        raise InputError("--cycles writes the table of one log; give one log at a time")
    reports = [report(path) for path in logs]
    if cycles is not None:
        try:
            reports[0].table.to_csv(cycles, index=False)
        except OSError as problem:
            raise InputError(f"cannot write '{cycles}' ({problem}); choose another place") from None
    if as_json:
        print(to_json([_as_data(found) for found in reports]), end="")
    else:
        print("\n\n".join("\n".join(_as_text(found)) for found in reports))


def _as_data(found: LogReport) -> dict[str, object]:
    ceiling = found.levels.saturated_mA
    return {
        "log": found.log.source,
        "rows": found.log.time_s.size,
        "cycles": len(found.cycles.start),
        "counter_last": found.counted,
        "counter_sound": found.cycles.sound,
        "cycles_by": found.cycles.by,
        "levels": {**asdict(found.levels), "saturated_mA": ceiling if ceiling < 1e9 else None},
        "end": found.end,
        "stalls": found.stalls,
        "supply_losses": found.supply_losses,
        "trends": found.trends,
        "findings": found.findings,
    }


def _as_text(found: LogReport) -> list[str]:
    log, known = found.log, found.levels
    counter = "the log has no counter"
    if not math.isnan(found.counted):
        says = "agrees" if found.cycles.sound else "is not sound, see below"
        counter = f"the log's own counter ends at {found.counted:.0f} and {says}"
    lines = [
        f"{log.source}: {log.time_s.size} rows, {len(found.cycles.start)} cycles "
        f"(cut by {found.cycles.by}); {counter}",
        f"  load {known.load_mA:.0f} mA, idle {known.idle_mA:.1f} mA",
        f"  end: {found.end.kind} in cycle {found.end.cycle} at {found.end.time_s:.1f} s, "
        f"line {found.end.line}: {found.end.text}",
    ]
    if found.findings:
        lines.append("  wrong or odd in it:")
        lines += [
            f"    {f.kind:<24}{f.count:>6} ×, first in line {f.line}: {f.text}"
            for f in found.findings
        ]
    lines.append("  trends over the cycles, per 100 cycles [95 %]:" if found.trends else "")
    lines += [
        f"    {t.measure:<16}{t.slope:+9.4g} [{t.low:+.3g}, {t.high:+.3g}], p = {t.p_value:.2g}, "
        f"{100 * t.share:+.1f} % over the log"
        for t in found.trends
    ]
    return [line for line in lines if line]
