"""Pages that are made from the code at build time, so that they cannot fall behind it."""

from __future__ import annotations

import functools
import importlib
import importlib.util
import inspect
import pkgutil
from dataclasses import fields
from pathlib import Path
from typing import Any

import click

COLUMNS: dict[str, str] = {
    "frame": "number of the frame, from 0",
    "file": "name of its file, `name#i` for page or frame i of a TIFF or video",
    "turns": "motor turns, signed; they may fall again when unwinding",
    "time_s": "time since the recording began",
    "diameter_mm": "D: smallest cylinder about the bundle's own centre line that holds all strands "
    "near the separator; what a caliper reads on the straight bundle",
    "diameter_px": "the same in pixels",
    "pitch_mm": "p: length along the bundle's centre line of one revolution of the strands",
    "pitch_px": "the same in pixels",
    "strand_repeat_px": "distance along the axis between neighbouring strands (p by the number of "
    "outer strands); any rope shows it",
    "helix_angle_rad": "β, tan β = π D / p, at the outer radius",
    "lay_angle_rad": "angle of the strands' ridges, tan = 2π a / p at the strand-centre radius a",
    "handedness": "`Z` (right-handed) or `S` (left-handed), read with the axis vertical; of a frame "
    "whose bundle is not in view, that of the frames wound the same way",
    "handedness_confidence": "0 to 1",
    "strand_count": "N, as given or estimated",
    "strand_count_confidence": "0 to 1",
    "midspan_diameter_mm": "D in the middle of the bundle",
    "midspan_helix_angle_rad": "β in the middle of the bundle",
    "coil_amplitude_mm": "A: rms lateral swing of the bundle's centre line",
    "coil_amplitude_px": "the same in pixels",
    "coil_pitch_mm": "length of one coil",
    "unevenness": "coefficient of variation of the envelope E(s)",
    "baseline_envelope_mm": "E₀: 25th percentile of E(s) over the twisted part",
    "baseline_envelope_px": "the same in pixels",
    "max_envelope_mm": "largest E(s)",
    "max_envelope_px": "the same in pixels",
    "knot_count": "knots in view",
    "phase": "twist, overtwist, local overtwist, knotted or irreversible",
    "turns_seen": "turns counted in the picture",
    "turn_budget_error": "turns seen minus motor turns",
    "string_length_mm": "length of string inside the twisting zone",
    "displacement_mm": "measured displacement, from turns.csv",
    "load_N": "load, from turns.csv or the rig",
    "cycle": "cycle, from turns.csv",
    "mm_per_px": "scale on the axis",
    "axis_x0_px": "axis: where it begins, on the separator's side",
    "axis_y0_px": "axis: where it begins",
    "axis_x1_px": "axis: where it ends, on the motor's side",
    "axis_y1_px": "axis: where it ends",
    "apex_mm": "s of the point where the legs meet",
    "apex_x_px": "that point in the picture",
    "apex_y_px": "that point in the picture",
    "separator_x_px": "s = 0: the separator's exit face on the axis",
    "separator_y_px": "s = 0",
    "hole_distance_mm": "S between the strings at the separator, from the legs of the recording",
    "gamma": "exponent that encodes the picture, given or told by its noise; empty: sRGB",
    "blur_px": "width of the edges' blur (standard deviation)",
    "fit_rms_px": "what the helix fit leaves",
    "diameter_px_sd_noise": "of diameter_px_sd, by the noise of the edges",
    "diameter_px_sd_light": "of it, by where the limbs' light ends",
    "diameter_px_sd_blur": "of it, by what blur hides of the limbs",
    "diameter_px_sd_section": "of it, by how the strands lie: what coils give way, what is not seen",
    "flags": "why a number may be bad: names joined by `|`",
    # knots
    "track": "number of the knot over all frames",
    "centre_mm": "s of its middle",
    "length_mm": "its length along the axis",
    "max_diameter_mm": "largest E(s) in it",
    "centre_x_px": "its middle in the picture",
    "centre_y_px": "its middle in the picture",
    "confidence": "0 to 1",
    "coils": "coils counted in it",
    "centre_px": "the middle's s in pixels",
    "length_px": "its length in pixels",
    "max_diameter_px": "largest E(s) in it, in pixels",
    # profiles
    "s_mm": "position along the axis from the separator",
    "s_px": "the same in pixels",
    "upper_px": "the edge that lies farther along n = (−u_y, u_x): distance from the axis, signed",
    "lower_px": "the other edge",
    "width_mm": "width of the silhouette",
    "envelope_mm": "E(s): outer diameter about the zone's straight axis",
    "axis_x_px": "where the axis bows: its point in the picture; empty where it is straight",
    "axis_y_px": "the same",
}

_PACKAGES = (
    "tsvision.images",
    "tsvision.measures",
    "tsvision.timeline",
    "tsvision.live",
    "tsvision.models",
    "tsvision.mechanisms",
    "tsvision.diagnosis",
    "tsvision.results",
    "tsvision.report",
    "synth",
)
_TOP = ("tsvision.run", "tsvision.batch", "tsvision.rig", "tsvision.records", "tsvision.units")


def meaning_of(column: str) -> str:
    """Words for a column; a `_sd` column is the standard uncertainty of its neighbour."""
    if column in COLUMNS:
        return COLUMNS[column]
    if column.endswith("_sd") and column.removesuffix("_sd") in COLUMNS:
        return "its standard uncertainty"
    raise KeyError(f"column '{column}' has no meaning in docs/reference_hook.py; add a line")


def _table(head: tuple[str, ...], lines: list[tuple[Any, ...]]) -> str:
    def row(cells: tuple[Any, ...]) -> str:
        return (
            "| " + " | ".join(str(c).replace("|", "\\|").replace("\n", " ") for c in cells) + " |"
        )

    return "\n".join([row(head), row(tuple("---" for _ in head)), *(row(line) for line in lines)])


def columns_page() -> str:
    from tsvision.results.schema import FRAMES, KNOTS, PROFILES

    parts = ["# Columns", "Every table that `tsvision measure` writes. Unknown numbers are empty."]
    for name, schema in (("frames", FRAMES), ("profiles", PROFILES), ("knots", KNOTS)):
        lines = [
            (f"`{f.name}`", (f.metadata or {}).get(b"unit", b"").decode(), meaning_of(f.name))
            for f in schema
        ]
        parts += [f"## {name}", _table(("column", "unit", "meaning"), lines)]
    return "\n\n".join(parts)


def flags_page() -> str:
    from tsvision.flags import MEANING

    lines = [(f"`{name}`", why) for name, why in MEANING.items()]
    return "# Flags\n\nA frame never loses its row; its flags say why a number may be bad.\n\n" + (
        _table(("flag", "meaning"), lines)
    )


def rig_page() -> str:
    from tsvision.rig_keys import SECTIONS

    parts = [
        "# rig.toml",
        "Every key is optional; each can be overridden by an option of the same name. "
        "`tsvision rig init` writes this file with all keys as comments.",
    ]
    for section, model in SECTIONS.items():
        lines = [
            (f"`{name}`", info.description or "", f"`{(info.examples or [''])[0]}`")
            for name, info in model.model_fields.items()
        ]
        parts += [f"## [{section}]", _table(("key", "meaning", "example"), lines)]
    return "\n\n".join(parts)


def models_page() -> str:
    from tsvision.models import GEOMETRY, MODELS, SECTIONS

    parts = ["# The shelf of models"]
    geometry = [(f"`{k}`", unit, words) for k, (unit, words) in GEOMETRY.items()]
    parts += ["## What they take", _table(("keyword", "unit", "meaning"), geometry)]
    for model in (*MODELS.values(), *SECTIONS.values()):
        parts += [
            f"## {model.title}",
            f"`{model.name}`: {model.equation}",
            "Assumes:\n\n" + "\n".join(f"- {a}" for a in model.assumptions),
            f"Fails: {model.fails}",
            f"Source: {model.source}",
        ]
    return "\n\n".join(parts)


def mechanisms_page() -> str:
    from tsvision.mechanisms import MECHANISMS

    parts = ["# The shelf of causes"]
    for mechanism in MECHANISMS.values():
        parts.append(f"## {mechanism.name}")
        for f in fields(mechanism):
            value = getattr(mechanism, f.name)
            if isinstance(value, str) and f.name != "name":
                parts.append(f"**{f.name.replace('_', ' ')}**: {value}")
        for shape in getattr(mechanism, "shapes", ()):
            lines = [
                (p.name, getattr(p, "unit", ""), getattr(p, "low", ""), getattr(p, "high", ""))
                for p in getattr(shape, "parameters", ())
            ]
            if lines:
                words = getattr(shape, "claim", "") or getattr(shape, "name", "")
                parts += [f"Shape: {words}", _table(("parameter", "unit", "from", "to"), lines)]
    return "\n\n".join(parts)


def commands_page() -> str:
    from cli.main import VERBS, load_command

    parts = [
        "# Commands",
        _table(("command", "does"), [(f"`tsvision {v}`", t) for v, (_, t) in VERBS.items()]),
    ]
    for verb, (module, text) in VERBS.items():
        if importlib.util.find_spec(module) is None:
            continue
        command: Any = load_command(verb)
        parts += [f"## tsvision {verb}", *_command_parts(command, text)]
    return "\n\n".join(parts)


def _command_parts(command: click.Command, text: str) -> list[str]:
    parts = [inspect.cleandoc(command.help or text)]
    parts.append(_parameters(command))
    for name, inner in getattr(command, "commands", {}).items():
        parts += [f"### {command.name or ''} {name}".replace("  ", " "), *_command_parts(inner, "")]
    return [p for p in parts if p]


def _parameters(command: click.Command) -> str:
    lines = []
    for p in command.params:
        option = [f"`{o}`" for o in p.opts[:1] + [o for o in p.opts[1:] if len(o) == 2]]
        name = (
            " ".join(option)
            if isinstance(p, click.Option) or p.param_type_name == "option"
            else f"`{(p.name or '').upper()}`"
        )
        default = p.default if not callable(p.default) else None
        shown = "" if default in (None, False, (), []) else f"`{default}`"
        lines.append((name, getattr(p, "help", "") or "", shown))
    return _table(("option", "meaning", "default"), lines) if lines else ""


def python_page(package: str) -> str:
    found = importlib.import_module(package)
    parts = [f"# {package}", inspect.getdoc(found) or ""]
    names = [package]
    if hasattr(found, "__path__"):
        names = [m.name for m in pkgutil.walk_packages(found.__path__, f"{package}.")]
    for name in names:
        module = importlib.import_module(name)
        members = [
            (n, v)
            for n, v in vars(module).items()
            if not n.startswith("_")
            and (inspect.isfunction(v) or inspect.isclass(v))
            and v.__module__ == name
        ]
        if not members:
            continue
        if name != package:
            parts += [f"## {name}", inspect.getdoc(module) or ""]
        for n, v in members:
            parts += [
                f"### `{n}`",
                f"```text\n{n}{_signature(v)}\n```",
                _as_text(inspect.getdoc(v)),
            ]
    return "\n\n".join(p for p in parts if p)


def _signature(thing: Any) -> str:
    try:
        return str(inspect.signature(thing)).replace("'", "")
    except (TypeError, ValueError):
        return ""


def _as_text(doc: str | None) -> str:
    """A docstring as Markdown: angle brackets and pipes are its own, not markup."""
    return (doc or "").replace("<", "&lt;").replace("_", "\\_").replace("*", "\\*")


@functools.cache
def pages() -> dict[str, str]:
    """Address -> Markdown of every generated page."""
    made = {
        "reference/commands.md": commands_page(),
        "reference/rig.md": rig_page(),
        "reference/columns.md": columns_page(),
        "reference/flags.md": flags_page(),
        "reference/models.md": models_page(),
        "reference/mechanisms.md": mechanisms_page(),
    }
    for package in (*_TOP, *_PACKAGES):
        if importlib.util.find_spec(package) is not None:
            made[f"reference/python/{package}.md"] = python_page(package)
    return made


_ORDER = ("index.md", "tutorial.md")
_MEASURING = "measuring.md"
_EXPLANATION = ("models.md", "diagnosis.md", "onset.md", "synth.md", "real.md")


def on_config(config: Any) -> Any:
    """Navigation from what there is: start, how-to, explanation, reference."""
    root = Path(config["docs_dir"])

    def under(folder: str) -> list[str]:
        return sorted(p.relative_to(root).as_posix() for p in (root / folder).glob("*.md"))

    placed = (*_ORDER, *_EXPLANATION, _MEASURING)
    others = sorted(p.name for p in root.glob("*.md") if p.name not in placed)
    explained = [n for n in (*_EXPLANATION, *others) if (root / n).is_file()]
    made = list(pages())
    config["nav"] = [
        *(n for n in _ORDER if (root / n).is_file()),
        {"How to": under("howto")},
        {"Explanation": [*under("explanation"), *explained]},
        {"How well it measures": [{"In short": _MEASURING}, *under("measuring")]},
        {"Reference": [n for n in made if "/python/" not in n]},
        {"Python": [{n.rsplit("/", 1)[1][:-3]: n} for n in made if "/python/" in n]},
    ]
    return config


def on_files(files: Any, config: Any) -> Any:
    from mkdocs.structure.files import File

    for address, text in pages().items():
        files.append(File.generated(config, address, content=text))
    return files
