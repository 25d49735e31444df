"""From pixels to a verdict: `python -m tests.bench.hidden_pixels --cases 60 --out DIR`.

Each case is one pair of strings filmed under three loads, wound and unwound, 13 frames a load, with
one hidden effect or none in the renderer. `tsvision measure` reads the frames, `tsvision diagnose`
the three folders; what is named is set against what was planted. Resumable: a case that stands in
DIR/results.jsonl is not done again. The frames are deleted once they are measured (--keep keeps
them). The table of all finished cases is printed at the end.
"""

from __future__ import annotations

import argparse
import collections
import json
import os
import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("NUMBA_NUM_THREADS", "1")

import numpy as np

LOADS_N = (9.81, 29.42, 49.03)
ONSET_TURNS = 20.0  # of overtwist, the renderer's (the paper's) for two strings
LEVELS = 7
Draw = np.random.Generator
Changes = dict[str, object]


def _sign(g: Draw) -> float:
    return float(g.choice([-1.0, 1.0]))


# What is planted, in the renderer's own words; sizes as in the battery of tables.
EFFECTS: dict[str, Callable[[Draw], Changes]] = {
    "angle_scale": lambda g: {"hidden.slip": g.uniform(0.05, 0.15)},
    "lost_turns": lambda g: {"hidden.lost_turns": g.uniform(0.8, 3.0)},
    "backlash": lambda g: {"hidden.backlash_turns": g.uniform(0.5, 2.0)},
    "axial_stretch": lambda g: {"hidden.stretch_per_N": g.uniform(6e-4, 2e-3)},
    "radial_compression": lambda g: {"hidden.compression_exponent": g.uniform(0.04, 0.12)},
    "creep": lambda g: {"hidden.creep_mm_per_decade": g.uniform(0.4, 1.2)},
    "radius_step": lambda g: {
        "hidden.radius_step": _sign(g) * g.uniform(0.08, 0.18),
        "hidden.radius_step_turns": g.uniform(0.3, 0.75) * ONSET_TURNS,
    },
    "knot_absorption": lambda g: {"hidden.knot_absorption": g.uniform(0.3, 0.9)},
    "hole_distance": lambda g: {"hidden.hole_distance_error_mm": _sign(g) * g.uniform(0.8, 2.0)},
    "zone_length": lambda g: {"hidden.zone_length_error_mm": _sign(g) * g.uniform(1.5, 4.0)},
    "radius_bias": lambda g: {"hidden.diameter_error_mm": _sign(g) * g.uniform(0.025, 0.05)},
    "camera_scale": lambda g: {"hidden.camera_scale_error": _sign(g) * g.uniform(0.06, 0.14)},
    "coiling": lambda g: {
        "law.displacement": "linear",
        "law.overtwist_turns": g.uniform(14.0, 18.0),
    },
}
ORDER = (*EFFECTS, *["none"] * 5)


@dataclass(frozen=True)
class Film:
    """One case: what is planted in three recordings, and how each is rendered."""

    number: int
    truth: str
    seed: int
    turns: tuple[float, ...]
    changes: Changes
    size: tuple[int, int]

    def recording(self, load_N: float) -> Any:
        """The renderer's settings under one load: the camera stands still, all noise is new."""
        from synth.build import make_settings
        from synth.settings import Actuator, Strings

        settings = make_settings(
            self.turns,
            "bench",
            self.seed,
            strings=Strings(count=2),
            actuator=Actuator(load_N=load_N),
            changes=dict(self.changes),
        )
        return replace(settings, seed=1000 * self.seed + round(load_N))


def film(number: int, first_seed: int, size: tuple[int, int]) -> Film:
    """Case `number`: effects take turns, everything else is drawn from its seed."""
    truth = ORDER[number % len(ORDER)]
    seed = first_seed + number
    g = np.random.default_rng([seed, 29])
    knots = truth == "knot_absorption" or g.random() < 0.25
    # Recordings of coiling and of knots go on past the overtwist onset, some of the others too.
    far = knots or truth == "coiling" or g.random() < 0.3
    most = ONSET_TURNS * (1.6 if far else g.uniform(0.85, 1.0))
    levels = np.linspace(0.0, most, LEVELS).round(3)
    changes: Changes = {
        "law.displacement": "constant_radius",
        "law.knots": knots,
        "law.local_turns": 1.05 * ONSET_TURNS,
        "law.knot_turns": 1.1 * ONSET_TURNS,
        "displacement_noise_mm": g.uniform(0.1, 0.3),
        "seconds_per_turn": g.uniform(1.0, 4.0),
        "camera.width_px": size[0],
        "camera.height_px": size[1],
        "sensor.format": "png",
    }
    if truth != "none":
        changes.update(EFFECTS[truth](g))
    turns = (*map(float, levels), *map(float, levels[-2::-1]))
    return Film(number, truth, seed, turns, changes, size)


def measured(case: Film, out: Path, keep: bool) -> list[Path]:
    """Render and measure one case; the folders that `tsvision measure` wrote, one a load."""
    from synth.recording import write_recording
    from tsvision.run import measure_to_folder

    folders = []
    for load in LOADS_N:
        name = f"case{case.number:03d}_{load:.0f}N"
        target = out / "measured" / name
        folders.append(target)
        if (target / "summary.json").exists():
            continue
        frames = write_recording(out / "frames" / name, case.recording(load), overwrite=True)
        measure_to_folder(frames, target, overwrite=True)
        shutil.copy(frames / "truth.parquet", target / "truth.parquet")
        if not keep:
            shutil.rmtree(frames)
    return folders


def asked(folders: list[Path]) -> dict[str, Any]:
    """What the diagnosis says of the three folders."""
    from tsvision.diagnosis.sources import diagnose_sources
    from tsvision.records import Rig

    verdict = diagnose_sources(folders, Rig())
    return {
        "status": verdict.status,
        "named": sorted(c.name for c in verdict.causes),
        "shapes": [c.shape for c in verdict.causes],
        "class": [sorted(names) for names in verdict.equivalent],
        "evidence": [(e["causes"], float(e["log_evidence_gain"])) for e in verdict.evidence[:8]],
        "p": verdict.residual["lack_of_fit_p"],
        "place": verdict.residual["place"],
        "observable": verdict.residual["observable"],
        "noise": verdict.data["noise"],
    }


def done(path: Path) -> dict[int, dict[str, Any]]:
    if not path.exists():
        return {}
    found = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    return {item["case"]: item for item in found}


def table(results: list[dict[str, Any]]) -> str:
    """A line an effect, then the three figures that are asked for."""
    by: dict[str, list[dict[str, Any]]] = collections.defaultdict(list)
    for r in results:
        by[r["truth"]].append(r)
    lines = ["hidden              cases  named  in class  unexplained  said instead"]
    for truth in (*EFFECTS, "none"):
        if truth not in by:
            continue
        found = by[truth]
        said = collections.Counter(
            "+".join(r["named"]) or r["status"] for r in found if not _right(r)
        )
        named, inside = sum(map(_right, found)), sum(map(_inside, found))
        lost = sum(r["status"] == "unexplained" for r in found)
        instead = ", ".join(f"{name} {n}" for name, n in said.most_common())
        lines.append(
            f"{truth:<18} {len(found):>6} {named:>6} {inside:>9} {lost:>12}  {instead}".rstrip()
        )
    some = [r for r in results if r["truth"] != "none"]
    none = [r for r in results if r["truth"] == "none"]
    if some:
        lines.append(
            f"named {sum(map(_right, some))}/{len(some)} = {np.mean([*map(_right, some)]):.2f}, "
            f"truth in class {np.mean([*map(_inside, some)]):.2f}"
        )
    if none:
        alarms = sum(not _right(r) for r in none)
        lines.append(f"false alarms {alarms}/{len(none)}")
    return "\n".join(lines)


def _right(r: dict[str, Any]) -> bool:
    if r["truth"] == "none":
        return bool(r["status"] == "no_discrepancy")
    return bool(r["named"] == [r["truth"]])


def _inside(r: dict[str, Any]) -> bool:
    return _right(r) or [r["truth"]] in r["class"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=18)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--size", default="960x540")
    parser.add_argument("--only", choices=(*EFFECTS, "none"), help="of the cases, these alone")
    parser.add_argument("--keep", action="store_true", help="keep the rendered frames")
    parser.add_argument("--again", action="store_true", help="diagnose anew what was measured")
    options = parser.parse_args()
    width, height = map(int, options.size.split("x"))
    options.out.mkdir(parents=True, exist_ok=True)
    path = options.out / "results.jsonl"
    if options.again:
        path.unlink(missing_ok=True)
    known = done(path)
    for number in range(options.cases):
        if number in known:
            continue
        case = film(number, options.first_seed, (width, height))
        if options.only not in (None, case.truth):
            continue
        start = time.perf_counter()
        folders = measured(case, options.out, options.keep)
        middle = time.perf_counter()
        planted = {k: v for k, v in case.changes.items() if k.startswith(("hidden", "law.over"))}
        known[number] = {
            "case": number,
            "truth": case.truth,
            "seed": case.seed,
            "planted": planted,
            **asked(folders),
            "seconds": [middle - start, time.perf_counter() - middle],
        }
        with open(path, "a", encoding="utf-8") as file:
            print(json.dumps(known[number]), file=file, flush=True)
    print(table([known[n] for n in sorted(known)]))


if __name__ == "__main__":
    main()
