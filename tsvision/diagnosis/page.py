"""A verdict as one page: words, residuals before and after by turns, load and branch, the causes'
signatures, evidence, gain and the next reading. Plain HTML with drawings inside, no scripts."""

from __future__ import annotations

import html
import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from tsvision.diagnosis.drawing import Panel, bars, panel
from tsvision.mechanisms import MECHANISMS

# From low to high load: distinct for colour-blind readers and in print.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
SHOWN_EVIDENCE = 8
HELD_OUT = (
    ("base", "held_out_rmse_base"),
    ("its inputs refitted", "held_out_rmse_base_refitted"),
    ("extended", "held_out_rmse_extended"),
)
CSS = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 1100px; margin: 2em auto; padding: 0 1em;
  color: #1c1c1c; background: #fff; }
h1 { font-size: 1.5em; } h2 { font-size: 1.15em; margin-top: 1.8em; }
table { border-collapse: collapse; } td, th { padding: .2em .7em; text-align: left;
  border-bottom: 1px solid #ddd; } td.n { text-align: right; font-variant-numeric: tabular-nums; }
.row { display: flex; flex-wrap: wrap; gap: 12px; } svg { max-width: 100%; height: auto; }
.key span { margin-right: 1.2em; } .dot { display: inline-block; width: .7em; height: .7em;
  border-radius: 50%; margin-right: .35em; }
"""


def page(answer: dict[str, Any]) -> str:
    """HTML of a verdict's JSON (`Verdict.to_json`)."""
    rows = answer.get("rows") or []
    status = str(answer["status"]).replace("_", " ")
    parts = [
        f"<h1>What the model gets wrong: {html.escape(status)}</h1>",
        f"<p>{html.escape(answer['paragraph'])}</p>",
        *_causes(answer),
        *_drawings(rows),
        *_by_load_and_branch(rows),
        *_evidence(answer),
        *_notes(answer),
    ]
    body = "\n".join(parts)
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>Diagnosis: {html.escape(status)}</title><style>{CSS}</style></head>\n"
        f"<body>\n{body}\n</body></html>\n"
    )


def _causes(answer: dict[str, Any]) -> list[str]:
    if not answer["causes"]:
        return []
    lines = ["<h2>Causes</h2><table><tr><th>cause</th><th>form</th><th>parameters</th></tr>"]
    for cause in answer["causes"]:
        numbers = "; ".join(
            f"{name.replace('_', ' ')} {_span(p)}" for name, p in cause["parameters"].items()
        )
        cells = (cause["title"], cause["equation"], numbers)
        lines.append("<tr>" + "".join(f"<td>{html.escape(c)}</td>" for c in cells) + "</tr>")
    lines.append("</table>")
    if len(answer["equivalent"]) > 1:
        sets = "; ".join(_set_title(names) for names in answer["equivalent"])
        lines.append(f"<p>The data cannot tell these apart: {html.escape(sets)}.</p>")
    return lines


def _span(p: dict[str, Any]) -> str:
    unit = "" if p["unit"] == "1" else f" {p['unit']}"
    return f"{p['value']:.3g}{unit} [{p['low']:.3g}, {p['high']:.3g}]"


def _set_title(names: Iterable[str]) -> str:
    return " with ".join(map(_title, names)) or "the base"


def _title(name: str) -> str:
    known = MECHANISMS.get(name)
    return known.title.lower() if known else name.replace("_", " ")


def _drawings(rows: Sequence[dict[str, Any]]) -> list[str]:
    """For each observable: residuals of both models, and what each cause does to it."""
    if not rows:
        return []
    colour = _load_colours(rows)
    lines = ["<h2>Residuals and signatures</h2>", _key(colour)]
    for name in dict.fromkeys(row["observable"] for row in rows):
        own = [row for row in rows if row["observable"] == name]
        unit = name.rsplit("_", 1)[1]
        what = name.rsplit("_", 1)[0].replace("_", " ")
        before = _panel(own, lambda r: r["value"] - r["base"], f"{what}: measured − base ({unit})")
        after = _panel(
            own, lambda r: r["value"] - r["extended"], f"{what}: measured − extended ({unit})"
        )
        drawn = [before, after]
        for cause in own[0].get("effects") or {}:
            title = f"{what}: {_title(cause)} ({unit})"
            drawn.append(_panel(own, lambda r, c=cause: r["effects"][c], title, joined=True))
        pictures = "".join(panel(p, colour) for p in drawn)
        lines.append(f'<div class="row">{pictures}</div>')
    return lines


def _panel(rows: Sequence[dict[str, Any]], what: Any, title: str, joined: bool = False) -> Panel:
    along = "turns" if "turns" in rows[0] else "strings"
    return Panel(
        title=title,
        along=along,
        x=np.array([row[along] for row in rows], dtype=float),
        y=np.array([what(row) for row in rows], dtype=float),
        group=tuple(_load_of(row) for row in rows),
        open=np.array([row.get("branch") == "unwind" for row in rows]),
        run=tuple(f"{row.get('run')} {row.get('branch')}" for row in rows),
        joined=joined,
    )


def _load_of(row: dict[str, Any]) -> str:
    load = row.get("load_N")
    return "load unknown" if load is None or math.isnan(load) else f"{load:.3g} N"


def _load_colours(rows: Sequence[dict[str, Any]]) -> dict[str, str]:
    loads = sorted({(row.get("load_N") or 0.0, _load_of(row)) for row in rows})
    return {name: COLOURS[i % len(COLOURS)] for i, (_, name) in enumerate(loads)}


def _key(colour: dict[str, str]) -> str:
    dots = "".join(
        f'<span><i class="dot" style="background:{c}"></i>{html.escape(name)}</span>'
        for name, c in colour.items()
    )
    return f'<p class="key">{dots}<span>filled: winding, open: unwinding</span></p>'


def _by_load_and_branch(rows: Sequence[dict[str, Any]]) -> list[str]:
    """rms of both residuals by observable, load and branch, outliers left out."""
    groups: dict[tuple[str, str, str], list[dict[str, Any]]] = {}
    for row in rows:
        if row.get("weight", 0.0) > 0.2:
            key = (row["observable"], _load_of(row), row["branch"])
            groups.setdefault(key, []).append(row)
    if not groups:
        return []
    lines = [
        "<h2>By load and branch</h2><table><tr><th>observable</th><th>load</th><th>branch</th>"
        "<th>readings</th><th>base, rms</th><th>extended, rms</th></tr>"
    ]
    for (name, load, branch), own in groups.items():
        off = [
            math.sqrt(sum((r["value"] - r[model]) ** 2 for r in own) / len(own))
            for model in ("base", "extended")
        ]
        unit = name.rsplit("_", 1)[1]
        numbers = "".join(f'<td class="n">{o:.3g} {unit}</td>' for o in off)
        what = name.rsplit("_", 1)[0].replace("_", " ")
        lines.append(
            f"<tr><td>{what}</td><td>{load}</td><td>{branch}</td>"
            f'<td class="n">{len(own)}</td>{numbers}</tr>'
        )
    return [*lines, "</table>"]


def _evidence(answer: dict[str, Any]) -> list[str]:
    found = answer["evidence"][:SHOWN_EVIDENCE]
    if not found:
        return []
    named = [(_set_title(e["causes"]), float(e["log_evidence_gain"])) for e in found]
    lines = ["<h2>Evidence</h2><p>Gain in log evidence over the base model.</p>", bars(named)]
    gain = answer.get("gain")
    if gain:
        said = [
            f"{words} {gain[key + suffix]:.3g}"
            for words, key in HELD_OUT
            for suffix in ("_mm", "")
            if key + suffix in gain
        ]
        times = f"{gain['ratio']:.3g} times better"
        if gain.get("low") is not None:
            times += f" [{gain['low']:.3g}, {gain['high']:.3g}]"
        lines.append(f"<p>On what was left out ({gain['scheme']}): {', '.join(said)}; {times}.</p>")
    return lines


def _notes(answer: dict[str, Any]) -> list[str]:
    data = answer["data"]
    lines = [f"<h2>The data</h2><p>{data['rows']} readings.</p>"]
    if "noise" in data:
        noise = ", ".join(f"{k.replace('_', ' ')} {v:.2g}" for k, v in data["noise"].items())
        lines.append(f"<p>Noise found: {html.escape(noise)}; {data['outliers']} outliers.</p>")
    lines += [f"<p>{html.escape(note)}</p>" for note in answer["notes"]]
    return lines
