"""Pictures measured one by one, each as if it were all there is, against their truth.

`python -m tests.bench.alone DIR … [--every 1] [--only NAME …] [--jobs 2] [--no-turns] [--csv FILE]`

DIR is a recording or a folder of them: path-traced (truth.json, see `tests.bench.pathtraced`) or
rendered (truth.parquet, see `tests.bench.onset_battery --rendered`). A film tells by what moves
where its bundle lies; here nothing does. Printed by kind of picture: pictures whose truth is known,
how many were measured, how many of these grossly wrong (D off by more than a tenth and outside its
95 % interval), D rms and median of the rest in px, share of intervals that hold the truth, and of
pictures whose sense is right. Then every picture that is grossly wrong.
"""

from __future__ import annotations

import argparse
import json
import os
import warnings
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from tests.bench.pathtraced import score
from tests.bench.scoring import HELD, held, rms
from tsvision.images.frames import iter_frames
from tsvision.measures.recording import Measurer
from tsvision.run import Request, open_request

GROSS = 0.1  # of D
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
SHOWN = ["recording", "frame", "turns", "D_true_px", "D_px", "D_sd_px", "flags"]


def truth(folder: Path) -> pd.DataFrame:
    """By frame: D_true_px (NaN where there is no bundle or it cannot be compared), handedness."""
    if (folder / "truth.parquet").is_file():
        table = pd.read_parquet(folder / "truth.parquet").set_index("frame")
        whole = table["has_bundle"] & table["mask_diameter"]
        return pd.DataFrame(
            {
                "D_true_px": table["diameter_px"].where(whole),
                "hand_true": table["handedness"],
                "kind": folder.name.split("_")[-1],
            }
        )
    rows = json.loads((folder / "truth.json").read_text())["frames"]
    return pd.DataFrame(
        {
            "D_true_px": [(f["bundle_d_mm"] or np.nan) * score.local_scale(f) for f in rows],
            "hand_true": [score.SIDES[f["handedness"]] for f in rows],
            "kind": "path-traced",
        },
        index=[f["frame"] for f in rows],
    )


def pictures(folder: Path, every: int, with_turns: bool) -> pd.DataFrame:
    """One row a picture of the recording, each measured by a measurer that has seen no other."""
    warnings.simplefilter("ignore")
    recording, _ = open_request(Request(folder))
    true = truth(folder)
    found: list[dict[str, Any]] = []
    for frame in iter_frames(recording, threads=1):
        if frame.index % every or frame.index not in true.index:
            continue
        turns = float(recording.turns[frame.index]) if with_turns else np.nan
        row = Measurer(recording.rig).measure(replace(frame, index=0), turns).row
        found.append(
            {
                "recording": folder.name,
                "frame": frame.index,
                "turns": float(recording.turns[frame.index]),
                "D_measured_px": row.diameter_px,
                "D_sd_px": row.diameter_px_sd,
                "hand": row.handedness,
                "flags": row.flags,
                **true.loc[frame.index],
            }
        )
    table = pd.DataFrame(found)
    table["D_px"] = table["D_measured_px"] - table["D_true_px"]
    table["D_sigmas"] = table["D_px"] / table["D_sd_px"]
    wrong = table["D_px"].abs() > GROSS * table["D_true_px"]
    table["gross"] = wrong & (table["D_sigmas"].abs() > HELD)
    return table


def summary(rows: pd.DataFrame) -> pd.Series:
    """One printed line."""
    rows = rows[rows["D_true_px"].notna()]
    seen = rows[rows["D_px"].notna()]
    fine = seen[~seen["gross"]]
    return pd.Series(
        {
            "pictures": len(rows),
            "measured": len(seen),
            "gross": int(seen["gross"].sum()),
            "D px rms": rms(fine["D_px"]),
            "median": fine["D_px"].abs().median(),
            "held D": held(seen["D_sigmas"]),
            "sense": (seen["hand"] == seen["hand_true"]).mean(),
        }
    )


def main() -> None:
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    words.add_argument("folders", nargs="+", type=Path)
    words.add_argument("--every", type=int, default=1, help="frames apart")
    words.add_argument("--only", nargs="+", default=[], help="recordings whose name holds this")
    words.add_argument("--jobs", type=int, default=2)
    words.add_argument("--no-turns", action="store_true", help="the motor's turns are not told")
    words.add_argument("--csv", type=Path, help="write every picture")
    given = words.parse_args()
    folders = [
        path
        for folder in given.folders
        for path in ([folder] if is_recording(folder) else sorted(folder.iterdir()))
        if is_recording(path) and (not given.only or any(o in path.name for o in given.only))
    ]
    if not folders:
        words.error("no recording with a truth there")
    count = len(folders)
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))  # read by the jobs as they start
    with ProcessPoolExecutor(given.jobs, get_context("spawn")) as pool:
        tables = pool.map(pictures, folders, [given.every] * count, [not given.no_turns] * count)
        rows = pd.concat(list(tables), ignore_index=True)
    lines = pd.DataFrame({str(kind): summary(part) for kind, part in rows.groupby("kind")}).T
    counts = ["pictures", "measured", "gross"]
    print(lines.astype(dict.fromkeys(counts, int)).round(3).to_string())
    if rows["gross"].any():
        print(rows.loc[rows["gross"], SHOWN].round(2).to_string(index=False))
    if given.csv:
        rows.to_csv(given.csv, index=False)


def is_recording(folder: Path) -> bool:
    return (folder / "truth.json").is_file()


if __name__ == "__main__":
    main()
