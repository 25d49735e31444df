"""How often cycles and breaks are read right from random made-up rig logs.

    python tests/bench/riglog_battery.py [NUMBER OF LOGS]

Prints counts: cycles exact, breaks found in the right cycle and within three steps (0.2 s at
least), false breaks in whole logs. About 0.3 s a log.
"""

from __future__ import annotations

import collections
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "riglog"))

from made_log import Rig, make, write

from tsvision.riglog.report import report


def random_rig(rng: np.random.Generator, seed: int) -> Rig:
    """Rigs with loads of 3 to 40 times the unloaded current, sampled at 10 to 100 Hz."""
    cycles = int(rng.integers(15, 80))
    return Rig(
        cycles=cycles,
        break_cycle=int(rng.integers(3, cycles)) if rng.random() < 0.5 else None,
        break_share=float(rng.uniform(0.05, 0.95)),
        cycles_after=int(rng.integers(0, 5)),
        step_s=float(rng.choice([0.01, 0.05, 0.1])),
        wind_s=float(rng.uniform(0.5, 3)),
        turn_s=float(rng.uniform(0.05, 0.4)),
        rest_s=float(rng.uniform(1.5, 4)),
        logs_rest=bool(rng.random() < 0.5),
        load_mA=float(rng.choice([150, 300, 480, 900])),
        free_mA=float(rng.uniform(20, 60)),
        ceiling_mA=float(rng.choice([3276.0, 2000.0])),
        wear_share=float(rng.uniform(-0.3, 0.5)),
        noise_mA=float(rng.uniform(2, 25)),
        seed=seed,
    )


def main(number: int) -> None:
    """Run the battery and print one line for each count."""
    rng, counts = np.random.default_rng(3), collections.Counter[str]()
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(number):
            rig = random_rig(rng, seed)
            truth = make(rig)
            found = report(write(Path(folder) / "log.csv", truth.rows))
            counts["cycles exact"] += len(found.cycles.start) == len(truth.starts_s)
            broke = found.end.kind == "broke"
            if rig.break_cycle is None or truth.break_s is None:
                counts["whole logs"] += 1
                counts["false breaks"] += broke
                continue
            counts["logs with a break"] += 1
            counts["break in the right cycle"] += broke and found.end.cycle == rig.break_cycle
            late = abs(found.end.time_s - truth.break_s)
            counts["break in time"] += broke and late <= max(3 * rig.step_s, 0.2)
    print(f"{'logs':<26}{number:>5}")
    for name, count in counts.items():
        print(f"{name:<26}{count:>5}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 300)
