"""One page over many measured recordings: a table, onsets side by side, D and β against turns."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from tsvision.atomic import write_text
from tsvision.errors import InputError
from tsvision.report import palette
from tsvision.report.measured import Measured, read_measured, rig_of
from tsvision.report.page import PAGE_NAME, render, title_of
from tsvision.report.series import abscissa, series
from tsvision.report.wording import ONSET_NAMES, UNKNOWN, onset_sentence, plain, with_sd

_MOST_POINTS = 300
_STRIP_WIDTH = 220.0
_PHASE_OF_ONSET = {
    "overtwist_onset": "overtwist",
    "local_overtwist_onset": "local_overtwist",
    "knot_onset": "knotted",
    "irreversible_onset": "irreversible",
}


def write_overview(measure_dirs: Sequence[Path], out: Path) -> Path:
    """Write one self-contained page over the recordings measured into these folders.

    Each row links to that folder's own report.html, relative to `out`, where there is one.
    InputError when there is no folder, or one is no measure output.
    """
    if not measure_dirs:
        raise InputError("no measured recording was given; name folders that `measure` wrote")
    measured = [read_measured(Path(folder)) for folder in measure_dirs]
    last = max((_last_turns(m) for m in measured), default=0.0)
    titles = _titles(measured)
    rows = [_row(m, titles[i], Path(out), last, i) for i, m in enumerate(measured)]
    data = {"recordings": [_lines(m, title) for m, title in zip(measured, titles, strict=True)]}
    text = render(
        "many.html", data=data, rows=rows, last=plain(last), phases=palette.PHASES, count=len(rows)
    )
    write_text(Path(out), text)
    return Path(out)


def _titles(measured: Sequence[Measured]) -> list[str]:
    """Each recording's name; those that share one are told apart by their folder."""
    names = [title_of(m) for m in measured]
    return [
        name if names.count(name) == 1 else f"{name} ({m.folder})"
        for name, m in zip(names, measured, strict=True)
    ]


def _row(measured: Measured, title: str, out: Path, last: float, number: int) -> dict[str, Any]:
    summary, rig = measured.summary, rig_of(measured.summary)
    diameter, angle = summary.get("diameter_mm") or {}, summary.get("helix_angle_deg") or {}
    loads = measured.frames["load_N"].dropna()
    load = float(loads.median()) if len(loads) else rig.get("actuator.load_N")
    return {
        "number": number,
        "title": title,
        "link": _link(measured.folder, out),
        "count": plain(rig.get("strings.count")),
        "load": plain(load),
        "diameter": with_sd(diameter.get("value"), diameter.get("sd")),
        "angle": with_sd(angle.get("value"), angle.get("sd")),
        "knots": onset_sentence("knot_onset", summary.get("knot_onset") or {}),
        "marks": [m for n in _PHASE_OF_ONSET if (m := _mark(n, summary.get(n), last))],
        "frames": summary.get("frames_total", len(measured.frames)),
        "flagged": summary.get("frames_flagged", UNKNOWN),
    }


def _mark(name: str, onset: dict[str, Any] | None, last: float) -> dict[str, Any] | None:
    """An onset as places (0 to _STRIP_WIDTH) on the strip of its row."""
    if not isinstance(onset, dict) or not last:
        return None
    place = {
        key: value / last * _STRIP_WIDTH
        for key in ("turns", "low", "high", "last_turns")
        if isinstance(value := onset.get(key), int | float) and math.isfinite(value)
    }
    name_text = f"{ONSET_NAMES[name]}: {onset_sentence(name, onset)}"
    colour = palette.PHASES[_PHASE_OF_ONSET[name]]
    return {"status": onset.get("status"), "text": name_text, "colour": colour, **place}


def _lines(measured: Measured, title: str) -> dict[str, Any]:
    """D and β against turns, thinned evenly; mm where known, else px."""
    in_px = not np.isfinite(measured.frames["diameter_mm"].to_numpy(float)).any()
    axis, columns = abscissa(measured.frames), series(measured.frames, in_px)
    kept = slice(None, None, max(1, math.ceil(len(axis.x) / _MOST_POINTS)))
    return {
        "title": title,
        "x": axis.x[kept] if axis.label != "frame" else [],
        "diameter": [] if in_px else columns["diameter"][kept],
        "angle": columns["angle"][kept],
    }


def _last_turns(measured: Measured) -> float:
    known = [o.get("last_turns") for n in ONSET_NAMES if (o := measured.summary.get(n))]
    return max((float(v) for v in known if v is not None and math.isfinite(v)), default=0.0)


def _link(folder: Path, out: Path) -> str:
    page = folder / PAGE_NAME
    if not page.is_file():
        return ""
    return quote(Path(os.path.relpath(page, out.resolve().parent)).as_posix())
