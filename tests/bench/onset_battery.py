"""`python -m tests.bench.onset_battery`: onsets, intervals and false alarms, ruptures beside it.

By default on simulated measurements of the renderer's exact geometry (≥ 200 recordings); with
`--rendered DIR` on pictures, rendered and measured by the whole chain. DIR keeps pictures and rows:
a run that was broken off goes on, and `--again` measures anew what older code measured.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from synth.strands import hole_diameter_mm
from tests.bench.onset_cases import Case, exact, name_of, onset_truth, plan, simulated
from tests.bench.onset_peers import detectors, onset_by
from tsvision.measures.zone.knots import LOBE
from tsvision.records import Actuator, Rig
from tsvision.timeline.account import Account, account
from tsvision.timeline.evidence import ratio_of

PHASES = {
    "knot_onset": 3,
    "irreversible_onset": 4,
    "local_overtwist_onset": 2,
    "overtwist_onset": 1,
}


@dataclass(frozen=True)
class Measured:
    """A case with what was measured and told of it."""

    case: Case
    frames: pd.DataFrame
    knots: pd.DataFrame
    told: Account


def measure_simulated(case: Case) -> Measured:
    frames, knots = simulated(case)
    hole = hole_diameter_mm(case.settings)
    rig = Rig(actuator=Actuator(twisting_zone_mm=23.2, hole_diameter_mm=hole))
    return Measured(case, frames, knots, account(frames, knots, rig))


def measure_rendered(case: Case, folder: Path, again: bool) -> Measured:
    """Render (once; kept in `folder`), measure (once, or `again` with changed code), account."""
    from tests.bench.onset_rendered import as_rendered, measured, pictures

    source = pictures(case, folder)
    frames, knots, rig = measured(source, again)
    case = as_rendered(case, source)  # pictures kept from before have the truth they came with
    return Measured(case, frames, knots, account(frames, knots, rig))


def tolerance_turns(case: Case) -> float:
    """Two frames or one turn, whichever is larger."""
    return max(2.0 * case.step_turns, 1.0) + 1e-6


def onset_rows(all_measured: Iterable[Measured]) -> pd.DataFrame:
    """One row per recording and phase."""
    rows = []
    for one in all_measured:
        for name, level in PHASES.items():
            truth, before = onset_truth(one.case, level)
            onset = one.told.onsets[name]
            error = np.nan if onset.turns is None else onset.turns - truth
            low, high = onset.low, onset.high
            held = low is not None and high is not None and low - 1e-6 <= truth <= high + 1e-6
            rows.append(
                {
                    "recording": one.case.name,
                    "preset": one.case.settings.preset,
                    "phase": name.removesuffix("_onset"),
                    "step": one.case.step_turns,
                    "truth": truth,
                    "before": before,
                    "last": float(one.case.truth["turns"].iloc[-1]),
                    "status": onset.status,
                    "turns": onset.turns,
                    "low": onset.low,
                    "high": onset.high,
                    "error": error,
                    "within": abs(error) <= tolerance_turns(one.case),
                    "held": held,
                    "reason": one.told.reasons[name],
                }
            )
    return pd.DataFrame(rows)


def onset_summary(rows: pd.DataFrame) -> pd.DataFrame:
    """Per phase and preset (and over all): the numbers that the aims are stated in."""
    parts = [("all", rows), *rows.groupby("preset")]
    table = []
    for preset, part in parts:
        for phase, some in part.groupby("phase", sort=False):
            there = some[np.isfinite(some["truth"])]
            none = some[~np.isfinite(some["truth"])]
            seen = there[there["status"] == "observed"]
            table.append(
                {
                    "preset": preset,
                    "phase": phase,
                    "with": len(there),
                    "within": there["within"].mean(),
                    "interval holds": seen["held"].mean(),
                    "median error": seen["error"].median(),
                    "undetermined": (some["status"] == "undetermined").mean(),
                    "missed": (there["status"] == "not_observed").mean(),
                    "without": len(none),
                    "false alarms": (none["status"] == "observed").mean(),
                }
            )
    return pd.DataFrame(table)


def knot_scores(all_measured: Iterable[Measured]) -> pd.DataFrame:
    """Knots per frame against truth: precision, recall, centre error in D, raw and as told."""
    rows = []
    for one in all_measured:
        seen = one.knots[one.knots["confidence"] > LOBE]
        for kind, knots in (("as seen", seen), ("as told", one.told.knots)):
            rows.append({"preset": one.case.settings.preset, "kind": kind, **_hits(one, knots)})
    table = pd.DataFrame(rows)
    parts = [("all", table), *table.groupby("preset")]
    result = []
    for preset, part in parts:
        for kind, some in part.groupby("kind", sort=False):
            hit, said, true = (some[k].sum() for k in ("hit", "said", "true"))
            errors = np.concatenate(some["errors"].to_list()) if len(some) else np.zeros(0)
            result.append(
                {
                    "preset": preset,
                    "knots": kind,
                    "precision": hit / said if said else np.nan,
                    "recall": hit / true if true else np.nan,
                    "centre within 0.5 D": np.mean(errors <= 0.5) if len(errors) else np.nan,
                    "true": int(true),
                }
            )
    return pd.DataFrame(result)


def knots_by_recording(all_measured: Iterable[Measured]) -> pd.DataFrame:
    """Recordings in which knots are told wrongly: hits, misses, false ones, and hits off by more
    than 0.5 D."""
    rows = []
    for one in all_measured:
        score = _hits(one, one.told.knots)
        hit, errors = score["hit"], score["errors"]
        rows.append(
            {
                "recording": one.case.name,
                "hits": hit,
                "missed": score["true"] - hit,  # type: ignore[operator]
                "false": score["said"] - hit,  # type: ignore[operator]
                "off by 0.5 D": int((errors > 0.5).sum()),  # type: ignore[operator,attr-defined]
            }
        )
    table = pd.DataFrame(rows)
    return table[table[["missed", "false", "off by 0.5 D"]].sum(axis=1) > 0]


def _hits(one: Measured, knots: pd.DataFrame) -> dict[str, object]:
    """Matches within 1.5 D of a true knot, each used once, the nearest first."""
    said = {f: g["centre_mm"].to_numpy(float) for f, g in knots.groupby("frame")}
    unmeasured = set(one.frames.loc[~np.isfinite(one.frames["knot_count"]), "frame"])
    hit = count = true = 0
    errors: list[float] = []
    for frame, diameter, knots_true in zip(
        one.case.truth["frame"], one.case.truth["diameter_mm"], one.case.knots, strict=True
    ):
        if frame in unmeasured:
            continue
        left = list(said.get(frame, []))
        count, true = count + len(left), true + len(knots_true)
        for centre, length, _ in knots_true:
            near = min(left, key=lambda c: abs(c - centre), default=None)
            if near is not None and abs(near - centre) <= max(1.5 * diameter, 0.5 * length):
                left.remove(near)
                hit += 1
                errors.append(abs(near - centre) / diameter)
    return {"hit": hit, "said": count, "true": true, "errors": np.array(errors)}


def peer_table(all_measured: list[Measured]) -> pd.DataFrame:
    """ruptures on the same series: A / D for overtwist, largest E over baseline for knots."""
    named = detectors()
    series = {
        "overtwist_onset": (lambda f: ratio_of(f, "coil_amplitude"), 0.05),
        "knot_onset": (
            lambda f: (f["max_envelope_mm"] / f["baseline_envelope_mm"]).to_numpy(float),
            1.15,
        ),
    }
    rows = []
    for phase, (make, threshold) in series.items():
        scores = []
        for name, detector in named.items():
            within, false = [], []
            for one in all_measured:
                truth, _ = onset_truth(one.case, PHASES[phase])
                turns = one.frames["turns"].to_numpy(float)
                answer = onset_by(detector, make(one.frames), turns, threshold)
                if np.isfinite(truth):
                    within.append(abs(answer - truth) <= tolerance_turns(one.case))
                else:
                    false.append(np.isfinite(answer))
            share = (np.mean(within) if within else np.nan, np.mean(false) if false else np.nan)
            scores.append((name, *share))
        manual = scores[0]
        best = max(scores, key=lambda s: s[1] - (0 if np.isnan(s[2]) else s[2]))
        for label, (name, within_share, false_share) in (("manual", manual), ("best", best)):
            rows.append(
                {
                    "phase": phase.removesuffix("_onset"),
                    "ruptures": f"{label}: {name}",
                    "within": within_share,
                    "false alarms": false_share,
                }
            )
    return pd.DataFrame(rows)


def show(table: pd.DataFrame) -> str:
    return table.to_string(index=False, float_format=lambda v: f"{v:.3f}", na_rep="–")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.bench.onset_battery")
    parser.add_argument("--recordings", type=int, default=216)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--rendered", type=Path, help="folder for pictures; slow")
    parser.add_argument("--width", type=int, default=960, help="of rendered pictures, px")
    parser.add_argument("--again", action="store_true", help="measure anew what older code did")
    parser.add_argument("--there", action="store_true", help="only what was rendered already")
    parser.add_argument("--fresh", action="store_true", help="only rows by the code as it is")
    parser.add_argument("--no-peers", action="store_true")
    parser.add_argument("--wrong", action="store_true", help="list what went wrong")
    options = parser.parse_args()
    from tests.bench.onset_rendered import is_measured

    began = time.time()
    measured = []
    for seed in range(options.first, options.first + options.recordings):
        settings = plan(seed, options.width)
        if options.there and not (options.rendered / name_of(settings)).exists():
            continue
        if options.fresh and not is_measured(options.rendered / name_of(settings), again=True):
            continue
        case = exact(settings)
        print(f"{case.name} {time.time() - began:.0f} s", file=sys.stderr)
        measured.append(
            measure_simulated(case)
            if options.rendered is None
            else measure_rendered(case, options.rendered, options.again)
        )
    if not measured:
        parser.error(f"nothing to tell of in {options.rendered}")
    rows = onset_rows(measured)
    print(f"{len(measured)} recordings, {sum(len(m.frames) for m in measured)} frames")
    print(show(onset_summary(rows)))
    print(show(knot_scores(measured)))
    if options.wrong:
        there = np.isfinite(rows["truth"])
        bad = rows[(there & ~rows["within"]) | (~there & (rows["status"] == "observed"))]
        print(bad.drop(columns=["within"]).to_string(index=False))
        print(show(knots_by_recording(measured)))
    if not options.no_peers:
        print(show(peer_table(measured)))
    print(f"{time.time() - began:.0f} s")


if __name__ == "__main__":
    main()
