"""What the diagnosis promises beside the battery: `python -m tests.bench.hidden_aims`.

A line for each promise, its aim beside the figure reached: the paper's two tables, the rod
simulation, how often intervals hold the truth, what bad data is answered with, and the seconds that
a table takes. `--only NAME` for one of: life_cycle, diameters, rods, intervals, bad_data, seconds.
"""

from __future__ import annotations

import argparse
import csv
import os
import statistics
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from tsvision.data import table as paper_table

from tests.hidden import planted
from tsvision.diagnosis.bundle_table import read_diameters
from tsvision.diagnosis.bundles import diagnose_bundles
from tsvision.diagnosis.diagnose import diagnose, with_noise_prior
from tsvision.diagnosis.fit import fit, posterior
from tsvision.diagnosis.lack_of_fit import lack_of_fit
from tsvision.diagnosis.problem import prepare
from tsvision.diagnosis.table import table_from_rows
from tsvision.diagnosis.verdict import Verdict
from tsvision.errors import InputError
from tsvision.mechanisms import MECHANISMS, Simulation
from tsvision.records import Rig
from tsvision.units import kgf_to_newton

RODS = Path(__file__).resolve().parents[2].parent / "shared" / "rods"
LOAD_EFFECTS = {"radial_compression", "axial_stretch", "creep"}
Line = tuple[str, str, str]  # what, the aim, the figure


def verdict(rows: list[dict]) -> Verdict:
    return diagnose(table_from_rows(list(rows[0]), rows, Rig()))


def said(answer: Verdict) -> str:
    """The verdict in a few words."""
    names = "+".join(cause.name for cause in answer.causes)
    if answer.status == "ambiguous":
        return f"a class of {len(answer.equivalent)}, first {names}"
    return names or answer.status.replace("_", " ")


def left_out(answer: Verdict) -> str:
    gain = answer.gain or {}
    return f"{gain['held_out_rmse_extended_mm']:.3f} mm ({gain['scheme']})"


# ------------------------------------------------------------------------------ the paper's tables

LIFE_CYCLE = {
    "strings": 2,
    "twisting_zone_mm": 23.20,
    "hole_distance_nominal_mm": 5.0,
    "bundle_diameter_mm": 0.47,
}


def life_cycle() -> Iterator[Line]:
    rows = []
    for row in paper_table("life_cycle").to_dict("records"):
        seen = {"observable": "displacement_mm", "value": row["contraction_mm"]}
        load = {"run": f"{row['load_kgf']} kgf", "load_N": float(kgf_to_newton(row["load_kgf"]))}
        rows.append({"turns": row["turns"], **seen, **load, **LIFE_CYCLE})
    answer = verdict(rows)
    yield "life cycle, a load left out", "<= 0.6 mm", left_out(answer)
    yield "  base", "4.5 mm", f"{answer.base['rmse_mm']:.2f} mm"
    yield "  says", "rivals and the deciding reading named", answer.paragraph
    hidden = verdict([{k: v for k, v in r.items() if k not in ("run", "load_N")} for r in rows])
    claimed = LOAD_EFFECTS & {name for names in hidden.equivalent for name in names}
    yield "  load column hidden", "no load effect", f"{said(hidden)}; load effects: {len(claimed)}"


def diameters() -> Iterator[Line]:
    rows = [
        {"strings": r["strings"], "value": r["diameter_mm"], "value_sd": r["diameter_sd_mm"]}
        for r in paper_table("diameter").to_dict("records")
    ]
    data = read_diameters(list(rows[0]), rows, 0.24, float("nan"), "the diameter table")
    for section, aim in (("pair_core", "0.077"), ("ring", "0.127")):
        answer = diagnose_bundles(data, section)
        yield f"diameters, an N left out ({section})", "<= 0.03 mm", left_out(answer)
        yield "  base", f"{aim} mm", f"{answer.base['rmse_mm']:.3f} mm"
        yield "  says", "rivals named", answer.paragraph


# ----------------------------------------------------------------------------------- other physics


def rods() -> Iterator[Line]:
    if not RODS.is_dir():
        yield "rods", "", "the rod simulation's files are not here"
        return
    loads = ("two_kgf", "three_kgf", "five_kgf")
    yield from _rods("rods, a load left out", loads, 0.38)
    yield from _rods("flexible string, turns left out", ("flexible_d35",), 0.35)


def _rods(what: str, names: tuple[str, ...], string_mm: float) -> Iterator[Line]:
    """The onset is set against where the simulation's torque, under the lowest load, is largest."""
    rows = []
    onset, most = 0.0, 0.0
    for name in names:
        with open(RODS / f"{name}.csv", newline="", encoding="utf-8") as file:
            for record in csv.DictReader(file):
                row: dict[str, Any] = {
                    "run": name,
                    "turns": record["turns"],
                    "load_N": record["load_N"],
                    "displacement_mm": record["displacement_mm"],
                    "strings": 2,
                    "string_diameter_mm": string_mm,
                    "twisting_zone_mm": 23.2,
                    "hole_distance_nominal_mm": 5.0,
                    "bundle_diameter_mm": 2 * string_mm,
                }
                rows.append(row)
                torque = float(record["torque_Nmm"])
                if name == names[0] and torque > most:
                    onset, most = float(record["turns"]), torque
    answer = verdict(rows)
    yield what, "<= 0.6 mm", left_out(answer)
    yield "  named", "radius_bias+coiling", said(answer)
    found = {k: e for c in answer.causes for k, e in c.parameters.items()}
    if "onset_turns" in found:
        yield "  onset", f"{onset:g} +- 2 turns", f"{found['onset_turns'].value:.1f} turns"
    if "radius_change_mm" in found:
        radius = string_mm + found["radius_change_mm"].value
        yield "  radius", f"{string_mm / 2:.3f} mm", f"{radius:.3f} mm"


# --------------------------------------------------------------------------------------- intervals


class Overheard:
    """A random generator that keeps what it drew: the truth of a planted effect."""

    def __init__(self, g: np.random.Generator) -> None:
        self.g = g
        self.drawn: list[float] = []

    def uniform(self, low: float, high: float) -> float:
        self.drawn.append(float(self.g.uniform(low, high)))
        return self.drawn[-1]

    def choice(self, options: list[float]) -> float:
        self.drawn.append(float(self.g.choice(options)))
        return self.drawn[-1]


# mechanism: its shape of the planted form, and the truth {parameter: value} from what was drawn,
# the bundle's radius and its largest turns
Truth = Callable[[list[float], float, float], dict[str, float]]
KNOWN: dict[str, tuple[str, Truth]] = {
    "radius_bias": ("absolute", lambda d, r, n: {"radius_change_mm": d[0] * d[1] * r}),
    "angle_scale": ("proportional", lambda d, r, n: {"slip": d[0]}),
    "hole_distance": ("shift", lambda d, r, n: {"hole_distance_change_mm": d[0] * d[1]}),
    "zone_length": ("shift", lambda d, r, n: {"zone_length_change_mm": d[0] * d[1]}),
    "lost_turns": ("sharp", lambda d, r, n: {"lost_turns": d[0]}),
    "axial_stretch": ("hooke", lambda d, r, n: {"compliance_1_N": d[0]}),
    "radial_compression": ("power", lambda d, r, n: {"exponent": d[0]}),
    "backlash": ("kept", lambda d, r, n: {"backlash_turns": d[0]}),
    "creep": ("decades", lambda d, r, n: {"creep_mm_per_decade": d[0]}),
    "knot_absorption": ("kink", lambda d, r, n: {"onset_turns": d[0] * n, "share": d[1]}),
    "camera_scale": ("factor", lambda d, r, n: {"scale_error": d[0] * d[1]}),
    "coiling": ("common_onset", lambda d, r, n: {"onset_turns": d[0] * n}),
}


def intervals(cases: int = 20, first_seed: int = 8_100_000) -> Iterator[Line]:
    """How often the 95 % intervals hold the truth where the form is right."""
    held: list[bool] = []
    for i, (name, (shape, truth_of)) in enumerate(KNOWN.items()):
        own: list[bool] = []
        for seed in range(first_seed + 1000 * i, first_seed + 1000 * i + cases):
            own += _held(name, shape, truth_of, seed)
        held += own
        yield f"  {name}", "", f"{sum(own)} of {len(own)}"
    share = f"{np.mean(held):.3f} ({sum(held)} of {len(held)})"
    yield "95 % intervals hold the truth", "0.92 to 0.98", share


def _held(name: str, shape: str, truth_of: Truth, seed: int) -> list[bool]:
    heard: list[Overheard] = []
    plan: Callable[..., Any] = planted.PLAIN[name]

    def overheard(*args: Any) -> Any:
        heard.append(Overheard(args[-1]))
        return plan(*args[:-1], heard[-1])

    case = planted.plant([(name, overheard)], seed)
    radius, most = next(
        (d / 2, n) for c, (d, n) in planted.BUNDLES.items() if c == case.rows[0]["strings"]
    )
    problem = prepare(table_from_rows(list(case.rows[0]), case.rows, Rig()))
    problem = with_noise_prior(problem, lack_of_fit(problem, fit(problem, Simulation())))
    found = posterior(problem, fit(problem, MECHANISMS[name].extend(Simulation(), shape)))
    truth = truth_of(heard[0].drawn, radius, most)
    return [
        bool(found[f"{name}.{key}"][1] <= value <= found[f"{name}.{key}"][2])
        for key, value in truth.items()
    ]


# ---------------------------------------------------------------------------------------- bad data


def bad_data() -> Iterator[Line]:
    """A bundle 5 to 20 % off in radius, spoiled in each of the ways that tables are."""
    rows = planted.plain_case("radius_bias", 8_200_001, planted.Setting(levels=9, count=4)).rows
    x = [r for r in rows if r["observable"] == "displacement_mm"]
    g = np.random.default_rng(3)
    wild = [
        {**r, "value": r["value"] * (g.uniform(0.5, 1.6) if g.random() < 0.3 else 1.0)}
        for r in rows
    ]
    metres = [{**r, "value": r["value"] / 1000} if i % 2 else r for i, r in enumerate(x)]
    nan = [{**r, "value": float("nan")} if i % 7 == 0 else r for i, r in enumerate(rows)]
    spoiled: dict[str, tuple[str, list[dict]]] = {
        "as it is": ("radius_bias", rows),
        "three rows": ("refused", rows[:3]),
        "five rows": ("no single cause", x[3:8]),
        "one load only": ("radius_bias in class", [r for r in rows if r["run"] == "run0"]),
        "constant turns": ("no single cause", [{**r, "turns": 20.0} for r in x if r["turns"] > 10]),
        "a negative load": ("refused", [*rows[:5], {**rows[5], "load_N": -3}, *rows[6:]]),
        "duplicate rows": ("radius_bias, noted", rows + rows[3:40]),
        "m among mm": ("asked about", metres),
        "NaN": ("radius_bias, noted", nan),
        "30 % outliers": ("radius_bias in class", wild),
    }
    for what, (aim, table) in spoiled.items():
        yield f"bad data: {what}", aim, _answer(table)


def _answer(rows: list[dict]) -> str:
    try:
        answer = verdict(rows)
    except InputError as refusal:
        return f"refused: {refusal}"
    notes = f"; noted: {answer.notes[0]}" if answer.notes else ""
    return said(answer) + notes


# ----------------------------------------------------------------------------------------- seconds


def seconds() -> Iterator[Line]:
    """Processor time, on one core, of tables of 486 rows."""
    long = planted.Setting(levels=27)
    cases = [
        planted.plant([], 8_300_001, long, "null"),
        *(planted.plain_case(n, 8_300_011, long) for n in ("radius_bias", "coiling", "creep")),
        *(planted.foreign_case(n, 0, 8_300_021, long) for n in ("coiling", "angle_scale")),
        planted.pair_case("lost_turns", "axial_stretch", 8_300_031, long),
        planted.pair_case("radius_step", "backlash", 8_300_032, long),
        planted.unlike_case(1, 8_300_041, long),
    ]
    took = []
    for case in cases:
        table = table_from_rows(list(case.rows[0]), case.rows, Rig())
        start = time.process_time()
        diagnose(table)
        took.append(time.process_time() - start)
    spread = f"{statistics.median(took):.2f} s, at most {max(took):.2f} s ({len(took)} tables)"
    yield f"a table of {table.rows} rows", "<= 2 s", spread


PROMISES: dict[str, Callable[[], Iterator[Line]]] = {
    "life_cycle": life_cycle,
    "diameters": diameters,
    "rods": rods,
    "bad_data": bad_data,
    "seconds": seconds,
    "intervals": intervals,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=tuple(PROMISES))
    options = parser.parse_args()
    for name, lines in PROMISES.items():
        if options.only in (None, name):
            for what, aim, figure in lines():
                print(f"{what:<40} aim {aim:<28} {figure}", flush=True)


if __name__ == "__main__":
    main()
