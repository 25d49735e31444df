"""Measures recordings that have exact truth and prints how far off each number is.

`python -m tests.bench.pathtraced.score DIR … [--only NAME …] [--out DIR] [--frames] [--csv FILE]`

DIR is a recording (it holds truth.json) or a folder of recordings. With `--no-measure` earlier
measurements in `--out` are scored as they stand. Columns, errors as measured minus true:

D_px / D_coil   rms of diameter_px over straight / coiled frames, against D at the local scale
bias_px         its mean;  D_%: rms of diameter_mm
p_px_% / p_mm_% median and rms of pitch_px at the local scale along the axis; of pitch_mm
beta_deg        rms of β;  hand: frames right of those with a twist
knots           hits-misses-false over frames;  onset: measured [low, high] against the truth
turns           turns seen in the picture minus the motor's: rms in turns where there are no
                knots, in per cent where there are
cover           share of frames whose 95 % interval holds D (px), pitch (mm), β, turns
edge_px         median, and 90th percentile of the size, of half the silhouette's width error
ms              median time a frame

The last line: rms and median over the recordings of D_px and of D_coil.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from tests.bench.scoring import held, rms

MOST_PX = 2.0  # of a recording's D, in a mean over recordings
SIDES = {"right": "Z", "left": "S", "none": ""}


@dataclass(frozen=True)
class Scored:
    """One row a frame, and what concerns the whole recording."""

    name: str
    frames: pd.DataFrame
    knots: tuple[int, int, int]
    onset: dict[str, Any]
    true_onset: float | None
    last_turns: float
    ms: float


def measured(folder: Path, out: Path) -> list[float]:
    """Run the measurement; seconds at which each frame was done."""
    from tsvision.run import measure_to_folder

    times = [time.perf_counter()]
    measure_to_folder(
        folder, out, overwrite=True, progress=lambda done, of: times.append(time.perf_counter())
    )
    return times


def score(folder: Path, out: Path, measure: bool = True) -> Scored:
    """Measure `folder` into `out` and compare with its truth."""
    from tsvision.results.read import read_measurement

    truth = json.loads((folder / "truth.json").read_text())
    times = measured(folder, out) if measure else []
    result = read_measurement(out)
    table = result.frames.set_index("frame")
    true = [f for f in truth["frames"] if f["frame"] in table.index]
    edges = edge_errors(folder, true, table, result.profiles)
    rows = [compare(f, table.loc[f["frame"]]) | edges.get(f["frame"], {}) for f in true]
    return Scored(
        truth["sequence"],
        pd.DataFrame(rows),
        count_knots(true, result.knots),
        result.summary["knot_onset"],
        truth["first_frame_turn_with_visible_knot"],
        truth["frames"][-1]["turns"],
        1000 * float(np.median(np.diff(times))) if len(times) > 1 else np.nan,
    )


def local_scale(true: dict[str, Any]) -> float:
    """px per mm across the view, 1.5 mm past the apex (depth is linear along the axis)."""
    share = min(1.0, (true["merge_apex_mm"] + 1.5) / 23.2)
    ends = true["px_per_mm_separator"], true["px_per_mm_connector"]
    return 1 / ((1 - share) / ends[0] + share / ends[1])


def compare(true: dict[str, Any], row: pd.Series) -> dict[str, Any]:
    """Errors of one frame; NaN where there is nothing true to measure, or nothing measured."""
    scale = local_scale(true)
    along = scale * true["px_per_mm_along_axis"] / true["px_per_mm"]
    d = true["bundle_d_mm"] or np.nan
    pitch = true["pitch_along_bundle_mm"] or np.nan
    beta = np.deg2rad(true["helix_angle_outer_deg"] or np.nan)
    coiled = true["overtwist_coil_radius_mm"] > 0 or bool(true["knots"])
    return {
        "turns": true["turns"],
        "true": np.isfinite(d),
        "coiled": coiled,
        "D_true_px": d * scale,
        "D_px": row["diameter_px"] - d * scale,
        "D_share": row["diameter_mm"] / d - 1,
        "D_sigmas": (row["diameter_px"] - d * scale) / row["diameter_px_sd"],
        "p_px_share": row["pitch_px"] / (pitch * along) - 1,
        "p_mm_share": row["pitch_mm"] / pitch - 1,
        "p_sigmas": (row["pitch_mm"] - pitch) / row["pitch_mm_sd"],
        "beta_deg": np.degrees(row["helix_angle_rad"] - beta),
        "beta_sigmas": (row["helix_angle_rad"] - beta) / row["helix_angle_rad_sd"],
        "hand": row["handedness"] == SIDES[true["handedness"]],
        "turns_off": row["turns_seen"] - true["turns"],
        "turns_share": row["turns_seen"] / true["turns"] - 1 if true["turns"] else np.nan,
        "turns_sigmas": (row["turns_seen"] - true["turns"]) / row["turns_seen_sd"],
        "knots_true": true["n_knots_visible"],
        "knots": row["knot_count"],
        "phase": row["phase"],
        "flags": row["flags"],
    }


def edge_errors(
    folder: Path, true: list[dict[str, Any]], table: pd.DataFrame, profiles: pd.DataFrame
) -> dict[int, dict[str, float]]:
    """Half the error of the silhouette's width (px) by frame, at the same places of the picture."""
    exact = np.load(folder / "profiles.npz")
    found: dict[int, dict[str, float]] = {}
    if "s_px" not in profiles:
        return found
    for number, part in profiles.groupby("frame"):
        at = next((f for f in true if f["frame"] == number), None)
        key = "" if at is None else f"f{at['frame']:03d}"
        if at is None or key not in exact:
            continue
        row = table.loc[number]
        start = np.array([row["axis_x0_px"], row["axis_y0_px"]]) + 0.5
        u = np.array([row["axis_x1_px"], row["axis_y1_px"]]) + 0.5 - start
        zero = np.array([at["axis_x0_px"], at["axis_y0_px"]])
        v = np.array([at["axis_x1_px"], at["axis_y1_px"]]) - zero
        u, v = u / np.linalg.norm(u), v / np.linalg.norm(v)
        place = (start + part["s_px"].to_numpy()[:, None] * u - zero) @ v
        width = np.ptp(exact[key], axis=1)
        ok = np.isfinite(width)
        expected = np.interp(place, np.flatnonzero(ok) + 0.5, width[ok], left=np.nan, right=np.nan)
        got = np.abs(part["lower_px"].to_numpy() - part["upper_px"].to_numpy())
        error = (got - expected) / 2
        error = error[np.isfinite(error)]
        if len(error):
            found[at["frame"]] = {
                "edge_median_px": float(np.median(error)),
                "edge_p90_px": float(np.percentile(np.abs(error), 90)),
            }
    return found


def count_knots(true: list[dict[str, Any]], seen: pd.DataFrame) -> tuple[int, int, int]:
    """Hits, misses, false sightings; one on a knot too small to count is neither."""
    hits = misses = false = 0
    for frame in true:
        here = seen[seen["frame"] == frame["frame"]]
        px = here[["centre_x_px", "centre_y_px"]].to_numpy(float) + 0.5
        taken = np.zeros(len(px), bool)
        for knot in frame["knots"]:
            reach = frame["px_per_mm"] * max(1.0, knot["length_mm"] / 2)
            near = np.hypot(*(px - knot["centre_px"]).T) <= reach if len(px) else taken
            taken |= near
            hits += knot["visible"] and bool(near.any())
            misses += knot["visible"] and not near.any()
        false += int((~taken).sum())
    return hits, misses, false


def median_and_rms(shares: pd.Series) -> str:
    return f"{100 * shares.abs().median():.2f} {100 * rms(shares):.2f}"


def cover(sigmas: pd.Series) -> str:
    return f"{held(sigmas):.2f}" if sigmas.notna().any() else "-"


def summary(scored: Scored) -> dict[str, str]:
    """One printed row."""
    all_rows = scored.frames
    rows = all_rows[all_rows["true"]]
    straight, coiled = rows[~rows["coiled"]], rows[rows["coiled"]]
    plain, knotted = rows[rows["knots_true"] == 0], rows[rows["knots_true"] > 0]
    onset, true = scored.onset, scored.true_onset
    got = onset["status"] if onset["turns"] is None else f"{onset['turns']:.3g}"
    if onset["turns"] is not None and onset["low"] is not None:
        got += f"[{onset['low']:.3g},{onset['high']:.3g}]"
    edges = [rows[c] for c in ("edge_median_px", "edge_p90_px") if c in rows]
    return {
        "recording": scored.name,
        "D": f"{rows['D_true_px'].mean():.0f}",
        "n": f"{rows['D_px'].notna().sum()}/{len(rows)}",
        "D_px": f"{rms(straight['D_px']):.3f}",
        "D_coil": f"{rms(coiled['D_px']):.3f}",
        "bias_px": f"{rows['D_px'].mean():+.3f}",
        "D_%": f"{100 * rms(rows['D_share']):.2f}",
        "p_px_%": median_and_rms(rows["p_px_share"]),
        "p_mm_%": median_and_rms(rows["p_mm_share"]),
        "beta_deg": f"{rms(rows['beta_deg']):.2f}",
        "hand": f"{rows['hand'].sum()}/{len(rows)}",
        "knots": "{}-{}-{}".format(*scored.knots),
        "onset": f"{got} / {'none' if true is None else f'{true:g}'}",
        "turns": f"{rms(plain['turns_off']):.2f} {100 * rms(knotted['turns_share']):.1f}",
        "cover": " ".join(
            cover(rows[c]) for c in ("D_sigmas", "p_sigmas", "beta_sigmas", "turns_sigmas")
        ),
        "edge_px": " ".join(f"{e.mean():+.2f}" for e in edges) or "-",
        "ms": f"{scored.ms:.0f}",
    }


def over_all(scores: list[Scored]) -> str:
    """What all recordings come to: rms errors of D by recording, each recording's counting once;
    intervals, sense and knots by frame."""
    rows = pd.concat([s.frames[s.frames["true"]] for s in scores])
    lines = [f"over {len(scores)} recordings, {len(rows)} frames"]
    for name, coiled in (("D_px", False), ("D_coil", True)):
        kind = [s.frames[s.frames["true"] & (s.frames["coiled"] == coiled)] for s in scores]
        each = pd.Series([rms(part["D_px"]) for part in kind]).dropna()
        mean = each.clip(upper=MOST_PX).mean()
        lines.append(
            f"{name} of {len(each)}: median {each.median():.2f}, rms {rms(each):.2f}, "
            f"mean {mean:.2f} where none counts for more than {MOST_PX:g}"
        )
    intervals = {"D": "D_sigmas", "pitch": "p_sigmas", "beta": "beta_sigmas"}
    lines.append("held: " + ", ".join(f"{n} {cover(rows[c])}" for n, c in intervals.items()))
    hits, misses, false = (sum(s.knots[i] for s in scores) for i in range(3))
    sense = f"sense right in {int(rows['hand'].sum())} of {len(rows)}"
    lines.append(f"{sense}; knots told {hits} of {hits + misses}, {false} false")
    return "\n".join(lines)


def recordings(folders: list[Path], only: list[str]) -> list[Path]:
    """Folders that hold a truth.json (a recording still being rendered has none yet)."""
    found = []
    for folder in folders:
        inside = [folder] if (folder / "truth.json").is_file() else sorted(folder.iterdir())
        found += [f for f in inside if (f / "truth.json").is_file()]
    return [f for f in found if not only or f.name in only]


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.bench.pathtraced.score")
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME")
    parser.add_argument("--out", type=Path, help="keep the measurements here")
    parser.add_argument("--no-measure", action="store_true", help="score what --out holds")
    parser.add_argument("--frames", action="store_true", help="print every frame too")
    parser.add_argument("--csv", type=Path, help="write every frame of every recording")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        out = args.out or Path(scratch)
        out.mkdir(parents=True, exist_ok=True)
        scores = []
        for folder in recordings(args.folders, args.only):
            scores.append(score(folder, out / folder.name, not args.no_measure))
            if args.frames:
                print(scores[-1].frames.round(4).to_string(), "\n")
    if not scores:
        parser.error("no recording with a truth.json there")
    print(pd.DataFrame([summary(s) for s in scores]).to_string(index=False))
    print(over_all(scores))
    if args.csv:
        named = [s.frames.assign(recording=s.name) for s in scores]
        pd.concat(named).to_csv(args.csv, index=False)


if __name__ == "__main__":
    main()
