"""Write docs/models.md from the shelves: `python -m tsvision.document docs/models.md`."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from tsvision.actuator.onset import RULES, rule_errors
from tsvision.actuator.reversible import limit_errors
from tsvision.comparison.compare import Result, evaluate
from tsvision.comparison.sample import Sample, paper_sample
from tsvision.life.fit import LifeFit, fit_all
from tsvision.life.shelf import LIFE_MODELS
from tsvision.life.table import paper_tests
from tsvision.models import GEOMETRY, MODELS, SECTIONS, BundleSection, DisplacementModel

HEAD = """# Models

Generated from the shelves by `python -m tsvision.document docs/models.md`; a test keeps it
current. Edit the files under `tsvision/models` and `tsvision/life`, not this page.

All lengths in mm, angles in rad, α the motor's angle, n its turns. `tsvision predict --model NAME`
and `tsvision invert --model NAME` use them; `tsvision compare DATA` runs all of them on a data set.
"""


def page() -> str:
    """The whole page as Markdown text."""
    parts = [HEAD, "## Geometry", "", *_geometry()]
    parts += ["", "## Displacement models", "", *_overview(), ""]
    for model in MODELS.values():
        parts += [*_displacement(model), ""]
    parts += ["## Bundle sections", ""]
    for section in SECTIONS.values():
        parts += [*_section(section), ""]
    parts += ["## Onset of overtwist and the reversible limit, from geometry", "", *_limits(), ""]
    parts += ["## Cycles to failure", "", *_life(), ""]
    return "\n".join(parts).rstrip() + "\n"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    lines = ["| " + " | ".join(head) + " |", "|" + " --- |" * len(head)]
    return lines + ["| " + " | ".join(row) + " |" for row in rows]


def _geometry() -> list[str]:
    return _table(
        ("keyword", "unit", "meaning"),
        [(f"`{name}`", unit, text) for name, (unit, text) in GEOMETRY.items()],
    )


def _overview() -> list[str]:
    sample = paper_sample()
    rows = []
    for model in MODELS.values():
        result = evaluate(model, sample)
        rows.append((f"[`{model.name}`](#{model.name})", f"`{model.equation}`", *_numbers(result)))
    return [
        "RMSE on the paper's life-cycle contractions (12 values, N = 2; 2, 3 and 5 kgf), mm: with",
        "the stated geometry and nothing fitted; with its free geometry refitted to the other two",
        "loads and the third predicted. A dash: no solution there, or an input is not published.",
        "",
        *_table(("model", "equation", "as given", "load left out"), rows),
        "",
        *_winner(sample),
    ]


def _numbers(result: Result) -> tuple[str, str]:
    given, held = result.as_given_mm, result.held_out_mm
    return ("–" if given != given else f"{given:.2f}", "–" if held != held else f"{held:.1f}")


def _winner(sample: Sample) -> list[str]:
    scale = f"{sample.turns.size} values hardly tell the refitted locking models and the"
    return [
        f"{scale} refitted constant radius apart; none of",
        "them knows load, which is what is missing (`tsvision diagnose`).",
    ]


def _displacement(model: DisplacementModel) -> list[str]:
    needs = ", ".join(f"`{name}`" for name in model.parameters)
    free = ", ".join(f"`{name}`" for name in model.free)
    only = "" if model.only_strings is None else f" Holds for N = {model.only_strings} only."
    return [
        f"### {model.name}",
        "",
        f"{model.title}.{only}",
        "",
        f"    {model.equation}",
        "",
        f"- needs: {needs}; a refit changes {free}",
        *[f"- assumes: {text}" for text in model.assumptions],
        f"- source: {model.source}",
        f"- where it fails: {model.fails}",
    ]


def _section(section: BundleSection) -> list[str]:
    widths = section.bundle_diameter_mm(list(range(1, 9)), 1.0)
    numbers = ", ".join(f"{width:.3f}" for width in widths)
    return [
        f"### {section.name}",
        "",
        f"{section.title}.",
        "",
        f"    {section.equation}",
        "",
        f"- D/d for N = 1 … 8: {numbers}",
        *[f"- assumes: {text}" for text in section.assumptions],
        f"- source: {section.source}",
        f"- where it fails: {section.fails}",
    ]


def _limits() -> list[str]:
    counts = sorted(rule_errors("zero_twist_outer"))
    rows = [
        (f"`{name}`", (rule.__doc__ or "").strip(), *_percent(rule_errors(name).values()))
        for name, rule in RULES.items()
    ]
    limits = limit_errors()
    return [
        "Error against the four onsets that the paper saw (20, 11, 10, 8 turns); the first rule is",
        "the one in use. None has a fitted constant.",
        "",
        *_table(("rule", "says", *[f"N = {n}" for n in counts]), rows),
        "",
        "Largest reversible contraction, mm (the zone coiled evenly, two bundles wide) against the",
        "largest that the paper reached; with a known hole the coil that passes it sets the limit.",
        "",
        *_table(
            ("", *[f"N = {n}" for n in limits]),
            [
                ("geometry", *[f"{predicted:.0f}" for predicted, _ in limits.values()]),
                ("paper", *[f"{published:.1f}" for _, published in limits.values()]),
            ],
        ),
    ]


def _percent(values: Iterable[float]) -> list[str]:
    return [f"{100 * value:+.0f} %" for value in values]


def _life() -> list[str]:
    fits = fit_all(paper_tests())
    rows = [_life_row(fit, fits[0].aicc) for fit in fits]
    return [
        "Fitted to the paper's twelve tests, best first; F in N, x in mm. Left out: the rms factor",
        "by which a test is missed by a fit to the other eleven (`tsvision life`).",
        "",
        *_table(("model", "equation", "ΔAICc", "left out", "source"), rows),
    ]


def _life_row(fit: LifeFit, best: float) -> tuple[str, ...]:
    model = LIFE_MODELS[fit.model]
    return (
        f"`{fit.model}`",
        f"`{model.equation}`",
        f"{fit.aicc - best:.1f}",
        f"× {fit.left_out_factor:.2f}",
        model.source,
    )


def main(arguments: Sequence[str]) -> int:
    """Write the page to the file named; without one, to stdout."""
    if arguments:
        Path(arguments[0]).write_text(page(), encoding="utf-8")
    else:
        print(page(), end="")
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
