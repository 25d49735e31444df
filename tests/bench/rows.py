"""D, pitch and angle of rendered recordings against their truth, and whether intervals hold.

`python -m tests.bench.rows DIR … [--first SEED] [--recordings N] [--strands]`

Each DIR holds recordings that `tests.bench.onset_battery --rendered DIR` has rendered and
measured: 960 x 540, the whole zone in view, bundles 15 to 40 px wide. Rows are widened by their
scatter as those of a measurement are. Only frames whose comparison is fair (the truth's masks). By
preset, straight and coiled; rms and median of the errors' sizes, and the share of 95 % intervals
that hold the truth. Beside D, which is told near the separator, that in mid-span: the truth's is
the widest of one pitch, and the first pitch of a coil, where legs come in, is up to 5 % wider than
those that are fitted. Then, by preset and phase, turns seen in the picture less those of the motor
that reached the strings: the share within 2 % or 0.3 turns, median, 95th percentile of the size.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd

from tests.bench.scoring import held, rms
from tsvision.timeline.scatter import with_scatter

VALUES = {"diameter_px": "mask_diameter", "pitch_mm": "mask_pitch", "helix_angle_rad": "mask_pitch"}
PHASES = ("twist", "overtwist", "local overtwist", "knotted", "irreversible")
CLOSED, CLOSED_TURNS = 0.02, 0.3  # a turn budget is, within either


def compared(folder: Path) -> pd.DataFrame:
    """One row a frame: errors and errors over their sd, NaN where not measured or not fair."""
    truth = pd.read_parquet(folder / "truth.parquet")
    rows = pd.read_parquet(folder / "measured_frames.parquet")
    both = truth.merge(with_scatter(rows), on="frame", suffixes=("_true", ""))
    found = pd.DataFrame(
        {
            "preset": folder.name.split("_")[-1],
            "strands": both["strand_count_true"],
            "phase": pd.Categorical(both["phase_true"], PHASES, ordered=True),
            "turns": both["turns_true"].abs(),
            "bundle": np.where(both["coil_amplitude_mm_true"] > 0, "coiled", "straight"),
        }
    )
    whole = both["mask_full_zone"] & both["has_bundle"]
    reached = both["turns_true"].abs() - both["turns_lost"]
    found["turns_off"] = (both["turns_seen"] - reached).where(whole)
    found["turns_sigmas"] = found["turns_off"] / both["turns_seen_sd"]
    for name, mask in VALUES.items():
        off = (both[name] - both[f"{name}_true"]).where(both[mask] & both["mask_diameter"])
        found[name] = off
        found[f"{name}_share"] = off / both[f"{name}_true"]
        found[f"{name}_sigmas"] = off / both[f"{name}_sd"]
    midspan = both["midspan_diameter_mm"] / both["midspan_diameter_mm_true"] - 1.0
    found["midspan_share"] = midspan.where(both["mask_diameter"])
    return found


def summary(rows: pd.DataFrame) -> pd.Series:
    """One printed line."""
    return pd.Series(
        {
            "frames": rows["diameter_px"].notna().sum(),
            "D px rms": rms(rows["diameter_px"]),
            "median": rows["diameter_px"].abs().median(),
            "mean": rows["diameter_px"].mean(),
            "D % median": 100 * rows["diameter_px_share"].abs().median(),
            "midspan": 100 * rows["midspan_share"].abs().median(),
            "p % median": 100 * rows["pitch_mm_share"].abs().median(),
            "beta deg median": np.degrees(rows["helix_angle_rad"].abs().median()),
            "held D": held(rows["diameter_px_sigmas"]),
            "p": held(rows["pitch_mm_sigmas"]),
            "beta": held(rows["helix_angle_rad_sigmas"]),
        }
    )


def budget(rows: pd.DataFrame) -> pd.Series:
    """One printed line on turns."""
    off = rows["turns_off"].dropna()
    closed = off.abs() <= np.maximum(CLOSED_TURNS, CLOSED * rows["turns"][off.index])
    return pd.Series(
        {
            "frames": len(off),
            "turns closed": closed.mean(),
            "median": off.median(),
            "95 % below": off.abs().quantile(0.95),
            "held": held(rows["turns_sigmas"]),
        }
    )


def table(
    rows: pd.DataFrame, by: list[str], told: Callable[[pd.DataFrame], pd.Series] = summary
) -> str:
    grouped = rows.groupby(by, observed=True)
    lines = pd.DataFrame({name: told(part) for name, part in grouped}).T
    lines["frames"] = lines["frames"].astype(int)
    return lines.round(3).to_string()


def main() -> None:
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    words.add_argument("folders", nargs="+", type=Path)
    words.add_argument("--first", type=int, default=0, help="least seed")
    words.add_argument("--recordings", type=int, default=10**9, help="seeds from there on")
    words.add_argument("--strands", action="store_true", help="by N, too")
    given = words.parse_args()
    folders = [
        path
        for folder in given.folders
        for path in sorted(folder.iterdir())
        if (path / "measured_frames.parquet").is_file()
        and given.first <= int(path.name.split("_")[0]) < given.first + given.recordings
    ]
    if not folders:
        raise SystemExit("no measured recordings there; run tests.bench.onset_battery --rendered")
    rows = pd.concat([compared(folder) for folder in folders], ignore_index=True)
    print(f"{len(folders)} recordings")
    print(table(rows, ["preset", "bundle"]))
    print(table(rows, ["preset", "phase"], budget))
    if given.strands:
        print(table(rows, ["preset", "bundle", "strands"]))


if __name__ == "__main__":
    main()
