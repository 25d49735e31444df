"""One self-contained HTML page of a measured recording: no network, opens from file://."""

from __future__ import annotations

import functools
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from jinja2 import Environment, FileSystemLoader, UndefinedError
from markupsafe import Markup

from tsvision.atomic import write_text
from tsvision.errors import InputError
from tsvision.flags import doubtful
from tsvision.jsonable import jsonable
from tsvision.records import Frame, Recording
from tsvision.report import digest, palette, shown
from tsvision.report.confronted import confronted
from tsvision.report.kymograph import colour_bar, kymograph
from tsvision.report.measured import Measured, read_measured, rig_of
from tsvision.report.pictures import data_uri
from tsvision.report.series import abscissa, first_winding_bands, predictions, series
from tsvision.report.wording import ONSET_NAMES, UNKNOWN, plain, with_sd
from tsvision.timeline.constancy import constancy_in_words

PAGE_NAME = "report.html"
ZONE = "actuator.twisting_zone_mm"
MOST_PICTURES = 48
PAGE_DIGITS = 6  # more than a plot shows
MOST_ROWS = 3000  # in the plots; a longer recording is thinned evenly
PICTURE_BYTES = 1_350_000  # of JPEG in all; base64 makes a third more of it
BUDGETS = (
    (
        "turn_budget",
        "Turn budget",
        "Turns counted in the picture minus motor turns; zero closes. Turns inside knots hide "
        "from one view.",
    ),
    (
        "string_budget",
        "String budget",
        "String seen in the zone minus L and the measured displacement; zero closes.",
    ),
)
HEADLINE = (
    ("outer diameter D", "diameter_mm", "mm"),
    ("outer diameter D", "diameter_px", "px"),
    ("helix angle β", "helix_angle_deg", "°"),
)
_HERE = Path(__file__).parent


def write_report(
    measure_dir: Path,
    recording: Recording | None = None,
    verdict: dict[str, Any] | None = None,
) -> Path:
    """Write `report.html` into a folder that `tsvision measure` wrote; returns its path.

    `recording` gives the pictures (without it the lines stand on an empty ground); `verdict` is
    the answer of `tsvision diagnose` for this recording. All text is escaped, so a file name
    that looks like HTML stays text. InputError when the folder is no measure output.
    """
    measured = read_measured(Path(measure_dir))
    chosen = _chosen(measured)
    pictures = shown.frames_at(recording, measured.frames, chosen) if recording else {}
    data = page_data(measured, chosen, pictures) | {"confronted": confronted(verdict)}
    in_px = data["unit"] == "px"
    text = render(
        "page.html",
        title=title_of(measured),
        data=data,
        summary=measured.summary,
        headline=_headline(measured),
        safe=digest.safe_sentence(measured.summary),
        onsets=digest.onset_lines(measured.summary),
        constancy=constancy_in_words(measured.summary.get("near_separator") or {}),
        uncertainties=digest.uncertainty_lines(measured.frames),
        flags=digest.flag_lines(measured.frames),
        table=digest.frame_lines(measured.frames, in_px),
        unit=data["unit"],
        rig=digest.rig_lines(rig_of(measured.summary)),
        verdict=_verdict_part(verdict),
        phases=palette.PHASES,
        unwinds=bool(data["unwinding"].any()),
        thinned=len(data["x"]) < len(measured.frames),
        data_rows=len(data["x"]),
        has_kymograph=data["kymograph"] is not None,
        budgets=[b for b in BUDGETS if np.isfinite(data["series"][b[0]]).any()],
        has_displacement=bool(np.isfinite(data["series"]["displacement"]).any()),
    )
    path = measured.folder / PAGE_NAME
    write_text(path, text)
    return path


def render(template: str, data: dict[str, Any], **values: Any) -> str:
    """Fill a template of this folder; escapes everything but our own script, style and data."""
    return _environment().get_template(template).render(data=Markup(as_script_json(data)), **values)


@functools.cache
def _environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(_HERE), autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    environment.globals["include_raw"] = lambda name: Markup((_HERE / name).read_text("utf-8"))
    environment.filters["number"] = lambda v: plain(v) if isinstance(v, int | float) else UNKNOWN
    return environment


def as_script_json(data: Any) -> str:
    """JSON that may stand in a script element: no `<`, no NaN (null instead)."""
    plain = jsonable(data, PAGE_DIGITS)
    text = json.dumps(plain, allow_nan=False, ensure_ascii=True, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def title_of(measured: Measured) -> str:
    """The recording's name: of its source where the summary tells, else of the folder."""
    name = (measured.summary.get("input") or {}).get("name")
    return str(name) if name else measured.folder.resolve().name


def page_data(measured: Measured, chosen: list[int], pictures: dict[int, Frame]) -> dict[str, Any]:
    """All that the page's script draws, as plain values; `chosen` are positions in the table."""
    frames = measured.frames
    in_px = not np.isfinite(frames["diameter_mm"].to_numpy(float)).any()
    kept = shown.choose(len(frames), MOST_ROWS, chosen)
    frames = frames.iloc[kept]
    axis = abscissa(frames)
    columns = series(frames, in_px, float(rig_of(measured.summary).get(ZONE, "nan")))
    phases = [p if isinstance(p, str) else "" for p in frames["phase"]]
    summary = measured.summary
    diameter = float((summary.get("diameter_mm") or {}).get("value") or "nan")
    known = np.isfinite(columns["displacement"]).any() and axis.label != "frame"
    rig = rig_of(summary)
    return {
        "unit": "px" if in_px else "mm",
        "x": axis.x,
        "x_label": axis.label,
        "frames": frames["frame"].to_numpy(int),
        "series": columns,
        "flagged": [doubtful(flags) for flags in frames["flags"]],
        "phases": phases,
        "bands": first_winding_bands(axis, phases),
        "unwinding": axis.falling(),
        "phase_colours": palette.PHASES,
        "onsets": {ONSET_NAMES[n]: summary[n] for n in ONSET_NAMES if n in summary},
        "predicted": predictions(axis.x, diameter, rig) if known else {},
        "kymograph": _kymograph(measured, in_px),
        "shown": _shown(measured, chosen, pictures, in_px, {p: i for i, p in enumerate(kept)}),
        "start": _start(chosen, measured.frames["knot_count"].to_numpy(float)),
    }


def _verdict_part(verdict: dict[str, Any] | None) -> Markup:
    """The verdict's section; InputError when it is not of the form that `diagnose` writes."""
    if verdict is None:
        return Markup()
    try:
        return Markup(render("verdict.html", data={}, verdict=verdict))
    except (TypeError, ValueError, AttributeError, UndefinedError) as problem:
        raise InputError(
            f"the verdict is not of the form that `tsvision diagnose --json` prints ({problem})"
        ) from None


def _headline(measured: Measured) -> list[tuple[str, str]]:
    summary, frames = measured.summary, measured.frames
    lines = [
        ("knots begin", text) for name, text, _ in digest.onset_lines(summary) if name == "knots"
    ]
    in_mm = (summary.get("diameter_mm") or {}).get("value") is not None
    for label, key, unit in HEADLINE:
        if in_mm and key.endswith("_px"):
            continue
        value = summary.get(key) or {}
        if value.get("value") is not None:
            lines.append((label, with_sd(value["value"], value.get("sd"), unit)))
    hands = [h for h in frames["handedness"] if h in ("S", "Z")]
    if hands:
        lines.append(("handedness", max(sorted(set(hands)), key=hands.count)))
    total = summary.get("frames_total", len(frames))
    if "frames_measured" in summary:
        lines.append(("frames measured", f"{summary['frames_measured']} of {total}"))
    return lines


def _chosen(measured: Measured) -> list[int]:
    knots = measured.frames["knot_count"].to_numpy(float)
    first = np.flatnonzero(knots > 0)[:1]
    return shown.choose(len(measured.frames), MOST_PICTURES, [int(i) for i in first])


def _start(chosen: list[int], knots: np.ndarray) -> int:
    """The page opens at the last frame with a knot, else in the middle."""
    with_knots = [i for i, at in enumerate(chosen) if knots[at] > 0]
    return with_knots[-1] if with_knots else len(chosen) // 2


def _shown(
    measured: Measured,
    chosen: list[int],
    pictures: dict[int, Frame],
    in_px: bool,
    place: dict[int, int],
) -> list[dict[str, Any]]:
    """What the page shows of each chosen frame; `at` is its place among the rows plotted."""
    rows = [measured.row(i) for i in chosen]
    profiles = [measured.profile(r) for r in rows]
    knots = [measured.sightings(r.frame) for r in rows]
    traces = shown.trace_all(rows, profiles, knots)
    sizes = [f.pixels.shape[:2] for f in pictures.values() if f.pixels is not None]
    height, width = sizes[0] if sizes else (10**6, 10**6)
    window = shown.window_px(traces, width, height)
    if not sizes and window[3] == 10**6:
        window = (0, 0, 640, 360)
    budget = PICTURE_BYTES // max(len(chosen), 1)
    step = max(1.0, (window[2] - window[0]) / 1280)
    return [
        {
            "at": place[at],
            "frame": row.frame,
            "picture": shown.picture_of(pictures[at], window, budget) if at in pictures else None,
            "problem": pictures[at].problem if at in pictures else "no picture was given",
            "view": [
                window[0] - 0.5,
                window[1] - 0.5,
                window[2] - window[0],
                window[3] - window[1],
            ],
            "paths": shown.paths_of(trace, step),
            "profile": shown.profile_of(row, profile, seen, in_px),
            "card": digest.frame_card(row),
            "flags": [f for f in row.flags.split("|") if f],
        }
        for at, row, profile, seen, trace in zip(chosen, rows, profiles, knots, traces, strict=True)
    ]


def _kymograph(measured: Measured, in_px: bool) -> dict[str, Any] | None:
    frames = measured.frames
    axis = abscissa(frames)
    x = axis.x if axis.rises else frames["frame"].to_numpy(float)
    made = kymograph(x, frames["frame"].to_numpy(int), lambda: _envelopes(measured, in_px))
    if made is None:
        return None
    place = dict(zip(frames["frame"].astype(int), x, strict=True))
    columns_of = measured.knots[["frame", "centre_mm", "length_mm", "max_diameter_mm"]]
    marks = [
        [place.get(int(frame)), *numbers] for frame, *numbers in columns_of.to_numpy(float).tolist()
    ]
    return {
        "href": data_uri(made.png, "png"),
        "bar": data_uri(colour_bar(), "png"),
        "x": [made.x_low, made.x_high],
        "s": [made.s_low, made.s_high],
        "value": [made.value_low, made.value_high],
        "x_label": axis.label if axis.rises else "frame",
        "by_frame": not axis.rises,
        "knots": [] if in_px else marks,
    }


def _envelopes(measured: Measured, in_px: bool) -> Iterator[pd.DataFrame]:
    """Tables of frame, s, value: the envelope in mm, or without a scale the width in px."""
    for table in measured.profiles.chunks():
        s, value = (
            (table["s_px"], (table["upper_px"] - table["lower_px"]).abs())
            if in_px
            else (table["s_mm"], table["envelope_mm"])
        )
        yield pd.DataFrame({"frame": table["frame"], "s": s, "value": value})
