"""Diameter, angle and sense of twist on pictures with known truth, beside what a user would pick.

Run `python -m tests.bench.pictures48 [--strings 2 4 6 8] [--mesh] [--each] [--no-peers]
[--untold]`. Every
picture is measured cold, as a recording of one frame, knowing the number of strings and nothing
else: no scale, no turns, no neighbours. `--mesh` draws with pyvista instead (needs OpenGL).
Seconds are CPU seconds of one thread.
"""

# ruff: noqa: E402 - the thread counts must be set before numpy and numba are imported
from __future__ import annotations

import os

for _name in ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import argparse
import sys
import time
from dataclasses import dataclass

import cv2
import numpy as np

from tests.bench.pictures48_draw import Case, cases, draw, draw_mesh, mesh_plotter
from tests.bench.pictures48_peers import PEERS
from tsvision.measures.recording import Measurer
from tsvision.records import Frame, Rig, Strings, View

NAN = float("nan")


@dataclass(frozen=True)
class Score:
    """One picture by one method: errors in px and degrees, whether the 95 % intervals hold the
    truth (NaN: none given), sense right, CPU ms to learn the looks and to measure."""

    diameter: float = NAN
    beta: float = NAN
    diameter_held: float = NAN
    beta_held: float = NAN
    sense_right: float = NAN
    learn_ms: float = NAN
    ms: float = NAN
    flags: str = ""


def measure(case: Case, picture: np.ndarray) -> Score:
    """This project on one picture, cold."""
    rig = Rig(strings=Strings(count=case.strings), view=View(separator_side="none"))
    measurer = Measurer(rig)
    frame = Frame(0, "picture.png", picture)
    began = time.process_time()
    measurer.prime([picture])
    learnt = time.process_time()
    row = measurer.measure(frame).row
    done = time.process_time()
    diameter = row.diameter_px - case.diameter_px
    beta = float(np.rad2deg(row.helix_angle_rad)) - case.beta_deg
    return Score(
        diameter=diameter,
        beta=beta,
        diameter_held=float(abs(diameter) <= 1.96 * row.diameter_px_sd),
        beta_held=float(abs(np.deg2rad(beta)) <= 1.96 * row.helix_angle_rad_sd),
        sense_right=float(row.handedness == case.handedness),
        learn_ms=1e3 * (learnt - began),
        ms=1e3 * (done - learnt),
        flags=row.flags,
    )


def peer(name: str, case: Case, picture: np.ndarray) -> Score:
    """One other method; what it cannot do stays NaN."""
    began = time.process_time()
    try:
        reading = PEERS[name](picture, case.strings)
    except (ValueError, IndexError, cv2.error):
        return Score()
    return Score(
        diameter=reading.diameter_px - case.diameter_px,
        beta=reading.beta_deg - case.beta_deg,
        ms=1e3 * (time.process_time() - began),
    )


def _rms(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt((known**2).mean())) if known.size else NAN


def _mean(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else NAN


def line(name: str, scores: list[Score]) -> str:
    """A row of the Markdown table."""
    names = ("diameter", "beta", "diameter_held", "beta_held", "sense_right", "ms")
    column = {name: np.array([getattr(score, name) for score in scores]) for name in names}
    worst = np.abs(column["diameter"])
    cells = [
        f"{_mean(column['diameter']):+.2f}",
        f"{_rms(column['diameter']):.2f}",
        f"{np.nanmax(worst):.2f}" if np.isfinite(worst).any() else "nan",
        f"{_rms(column['beta']):.2f}",
        f"{int(np.nansum(column['sense_right'] == 0))}",
        f"{100 * _mean(column['diameter_held']):.0f}",
        f"{100 * _mean(column['beta_held']):.0f}",
        f"{(np.isnan(column['diameter']) & np.isnan(column['beta'])).sum()}",
        f"{np.nanmedian(column['ms']):.1f}",
    ]
    if not np.isfinite(column["sense_right"]).any():
        cells[4] = ""
    cells = ["" if cell in ("nan", "+nan") else cell for cell in cells]
    return f"| {name} | " + " | ".join(cells) + " |"


OURS = "tsvision"
HEAD = (
    "| N = {n} | D bias px | D RMSE px | D worst px | β RMSE ° | sense wrong "
    "| D in 95 % | β in 95 % | missing | ms |\n"
    "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
)


def run(strings: int, mesh: bool, each: bool, peers: bool, plotter: object = None) -> None:
    """Draw, measure and print one set of 48."""
    found: dict[str, list[Score]] = {OURS: []}
    drawn = cases(strings)
    for index, case in enumerate(drawn):
        picture = draw_mesh(case, plotter) if mesh else draw(case)
        score = measure(case, picture)
        found[OURS].append(score)
        if each:
            print(
                f"{index:3d} D {case.diameter_px:5.1f} beta {case.beta_deg:4.0f} "
                f"tilt {case.tilt_deg:+5.1f} {'dark' if case.dark_on_bright else 'lit '} "
                f"noise {case.noise:.2f} light {case.light_deg:+4.0f}: D {score.diameter:+7.3f} "
                f"beta {score.beta:+7.3f} held {score.diameter_held:.0f} {score.beta_held:.0f} "
                f"sense {score.sense_right:.0f} {score.learn_ms:6.0f} {score.ms:6.1f} ms "
                f"{score.flags}",
                file=sys.stderr,
            )
        for name in PEERS if peers else ():
            found.setdefault(name, []).append(peer(name, case, picture))
    print(HEAD.format(n=strings))
    for name, scores in found.items():
        print(line(name, scores))
        if name == OURS:
            for ground, dark in (("bright on dark", False), ("dark on bright", True)):
                part = [s for s, c in zip(scores, drawn, strict=True) if c.dark_on_bright == dark]
                print(line(f"{name}, {ground}", part))
    learn = np.median([s.learn_ms for s in found[OURS]])
    print(f"\nLearning a recording's looks: {learn:.0f} ms, once.\n", flush=True)


def count(strings: int, mesh: bool, plotter: object = None) -> None:
    """Measure one set without telling N, and print how often it is found."""
    rows = []
    for case in cases(strings):
        measurer = Measurer(Rig(view=View(separator_side="none")))
        picture = draw_mesh(case, plotter) if mesh else draw(case)
        rows.append(measurer.measure(Frame(0, "picture.png", picture)).row)
    right = [row.strand_count == strings for row in rows]
    sure = [row.strand_count_confidence for row, good in zip(rows, right, strict=True) if good]
    others = sorted(
        f"{row.strand_count:.0f}" for row, good in zip(rows, right, strict=True) if not good
    )
    print(
        f"| {strings} | {sum(right)} of {len(right)} | {', '.join(others)} "
        f"| {np.median(sure) if sure else NAN:.2f} |",
        flush=True,
    )


def main() -> None:
    """Print a table for every number of strings asked for."""
    cv2.setNumThreads(1)
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--strings", type=int, nargs="+", default=[2, 4, 6, 8])
    parser.add_argument("--mesh", action="store_true", help="draw with pyvista")
    parser.add_argument("--each", action="store_true", help="every picture, on stderr")
    parser.add_argument("--no-peers", action="store_true")
    parser.add_argument(
        "--untold", action="store_true", help="do not tell N; count how often it is found"
    )
    given = parser.parse_args()
    plotter = mesh_plotter() if given.mesh else None
    if given.untold:
        print("| N | found | else taken for | median confidence |\n| --- | --- | --- | --- |")
        for strings in given.strings:
            count(strings, given.mesh, plotter)
        return
    warm = cases(2)[0]
    measure(warm, draw(warm))  # compiled before the clock runs
    for strings in given.strings:
        run(strings, given.mesh, given.each, not given.no_peers, plotter)


if __name__ == "__main__":
    main()
