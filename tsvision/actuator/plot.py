"""The picture of a design search: turns and life against the length of the zone."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tsvision.actuator.design import Candidate, Wanted
from tsvision.errors import InputError

COLOURS = ("#1b6ca8", "#d1603d", "#2d936c", "#7a4fa3", "#b8860b", "#555555")  # by N
MARKERS = "os^Dv"  # by d


def design_plot(found: list[Candidate], wanted: Wanted, path: Path) -> None:
    """Write a PNG or SVG: three panels over the zone's length, one line per N and d.

    Filled marks break no limit; hollow ones do. Raises InputError when it cannot be written.
    """
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, panels = plt.subplots(1, 3, figsize=(13, 4.8), constrained_layout=True)
    counts = sorted({c.strings for c in found})
    diameters = sorted({c.string_diameter_mm for c in found})
    for count in counts:
        for diameter in diameters:
            group = sorted(
                (c for c in found if (c.strings, c.string_diameter_mm) == (count, diameter)),
                key=lambda c: c.twisting_zone_mm,
            )
            colour = COLOURS[counts.index(count) % len(COLOURS)]
            marker = MARKERS[diameters.index(diameter) % len(MARKERS)]
            _lines(panels, group, colour, marker)
    _dress(panels, wanted)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=6, fontsize=8, frameon=False)
    figure.suptitle(
        f"{wanted.stroke_mm:g} mm stroke under {wanted.load_N:g} N: filled marks break no limit",
        fontsize=11,
    )
    try:
        figure.savefig(path, dpi=130)
    except (OSError, ValueError) as problem:
        raise InputError(f"cannot write the plot '{path}' ({problem}); use .png or .svg") from None
    finally:
        plt.close(figure)


def _lines(panels: np.ndarray, group: list[Candidate], colour: str, marker: str) -> None:
    """One N and d in all panels, with its label for the legend."""
    if not group:
        return
    zone = np.array([c.twisting_zone_mm for c in group])
    good = np.array([not c.against for c in group])
    label = f"N = {group[0].strings}, d = {group[0].string_diameter_mm:g} mm"
    for panel, name in zip(panels, ("turns", "torque_Nm", "life_cycles"), strict=True):
        values = np.array([getattr(c, name) for c in group])
        values = values * (1000 if name == "torque_Nm" else 1)
        hollow = {"mfc": "white", "color": colour, "ms": 4.5}
        text = label if name == "turns" else None
        panel.plot(zone, values, "-" + marker, lw=1, label=text, **hollow)
        panel.plot(zone[good], values[good], marker, color=colour, ms=5)
    panels[0].plot(zone, [c.onset_turns for c in group], ":", color=colour, lw=1)


def _dress(panels: np.ndarray, wanted: Wanted) -> None:
    titles = (
        "turns for the stroke (dotted: onset of overtwist)",
        "largest torque, N mm",
        "life, cycles (median)",
    )
    for panel, title in zip(panels, titles, strict=True):
        panel.set_title(title, fontsize=10)
        panel.set_xlabel("twisting zone L, mm")
        panel.grid(True, color="#dddddd", lw=0.5)
        panel.spines[["top", "right"]].set_visible(False)
    panels[0].set_ylim(bottom=0)
    panels[2].set_yscale("log")
    if wanted.life_cycles > 0:
        panels[2].axhline(wanted.life_cycles, color="black", lw=1, ls="--")
