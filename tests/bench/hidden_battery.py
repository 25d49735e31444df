"""The whole battery of hidden effects: `python -m tests.bench.hidden_battery --help`.

Prints efficiency, false alarms and the confusion matrix; runs cases in parallel processes.
"""

from __future__ import annotations

import argparse
import collections
import itertools
import os
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from tests.hidden import planted

PEERS = os.environ.get("HIDDEN_PEERS", "1") == "1"
ONLY_X = ("displacement_mm",)
ALL = ("displacement_mm", *planted.NOISE)


def cases(scale: int, first: int) -> list[tuple[str, Any]]:
    """(group, function that makes the case) in a fixed order; `first` shifts all seeds."""
    seeds = itertools.count(first)
    jobs: list[tuple[str, tuple]] = []
    for _ in range(scale):
        for name in planted.PLAIN:
            jobs.append(("plain", ("plain", name, 0, next(seeds))))
        for name, forms in planted.FOREIGN.items():
            for which in range(len(forms)):
                jobs.append(("foreign", ("foreign", name, which, next(seeds))))
        for which in range(len(planted.UNLIKE)):
            jobs.append(("unlike", ("unlike", "", which, next(seeds))))
        for name in planted.PLAIN:
            if name != "camera_scale":
                jobs.append(("only x", ("onlyx", name, 0, next(seeds))))
        pairs = list(itertools.combinations(planted.PLAIN, 2))
        g = np.random.default_rng(next(seeds))
        for i in g.choice(len(pairs), 12, replace=False):
            jobs.append(("pair", ("pair", "+".join(pairs[i]), 0, next(seeds))))
        for _ in range(12):
            jobs.append(("clean null", ("null", "clean", 0, next(seeds))))
        for _ in range(12):
            jobs.append(("hard null", ("null", "hard", 0, next(seeds))))
    for _ in range(scale):
        for name in planted.LATER:
            jobs.append(("later", ("later", name, 0, next(seeds))))
        for _ in range(12):
            jobs.append(("hard null, all", ("null", "hard all", 0, next(seeds))))
    for _ in range(12 * scale):
        jobs.append(("clean null, x", ("null", "clean x", 0, next(seeds))))
        jobs.append(("hard null, x", ("null", "hard x", 0, next(seeds))))
    return jobs


def build(spec: tuple) -> planted.Case:
    what, name, which, seed = spec
    if what == "plain":
        return planted.plain_case(name, seed)
    if what == "foreign":
        return planted.foreign_case(name, which, seed)
    if what == "later":
        return planted.later_case(name, seed)
    if what == "unlike":
        return planted.unlike_case(which, seed)
    if what == "onlyx":
        return planted.plain_case(name, seed, planted.Setting(observables=ONLY_X))
    if what == "pair":
        one, other = name.split("+")
        return planted.pair_case(one, other, seed)
    hard = planted.Setting(
        correlation=0.6, offsets_mm=0.1, tolerance_times=2.0, tolerance_exact=True
    )
    settings = {
        "clean": planted.Setting(),
        "hard": hard,
        "hard all": replace(hard, observables=ALL),
        "clean x": planted.Setting(observables=ONLY_X),
        "hard x": replace(hard, observables=ONLY_X),
    }
    return planted.plant([], seed, settings[name], "null")


def run(job: tuple[str, tuple]) -> dict[str, Any]:
    from tests.bench.hidden_peers import ask_peers
    from tsvision.diagnosis.diagnose import diagnose
    from tsvision.diagnosis.table import table_from_rows
    from tsvision.records import Rig

    group, spec = job
    case = build(spec)
    start = time.perf_counter()
    table = table_from_rows(list(case.rows[0]), case.rows, Rig())
    verdict = diagnose(table)
    seconds = time.perf_counter() - start
    after = _carried_out(spec, verdict) if group == "only x" else None
    gain = verdict.gain or {}
    noise = np.array([verdict.data["noise"][name] for name in table.observables])
    return {
        "group": group,
        "spec": spec,
        "truth": tuple(sorted(case.truth)),
        "form": case.form,
        "named": tuple(sorted(c.name for c in verdict.causes)),
        "class": [tuple(sorted(names)) for names in verdict.equivalent],
        "status": verdict.status,
        "ratio": gain.get("ratio", float("nan")),
        "gain": verdict.evidence[0]["log_evidence_gain"] if verdict.evidence else 0.0,
        "evidence": [(e["causes"], e["log_evidence_gain"]) for e in verdict.evidence[:12]],
        "p": verdict.residual["lack_of_fit_p"],
        "rho": list(verdict.data["autocorrelation"].values()),
        "partly": verdict.residual.get("partly"),
        "seconds": seconds,
        "peers": ask_peers(table, noise) if PEERS else {},
        "next": verdict.next_experiment,
        "after": after,
    }


def _carried_out(spec: tuple, verdict: Any) -> list[tuple[str, ...]] | None:
    """The class after the proposed observable was measured too, over the same runs."""
    from tsvision.diagnosis.diagnose import diagnose
    from tsvision.diagnosis.table import table_from_rows
    from tsvision.records import Rig

    if verdict.status != "ambiguous" or verdict.next_experiment is None:
        return None
    both = ("displacement_mm", verdict.next_experiment["observable"])
    case = planted.plain_case(spec[1], spec[3], planted.Setting(observables=both))
    answer = diagnose(table_from_rows(list(case.rows[0]), case.rows, Rig()))
    return [tuple(sorted(names)) for names in answer.equivalent]


def proposals(results: list[dict[str, Any]]) -> str:
    """Of the ambiguous cases: how often the proposed observable left the truth alone."""
    tried = [r for r in results if r["after"] is not None]
    if not tried:
        return "proposed observable: no ambiguous case"
    done = sum(r["after"] == [r["truth"]] for r in tried)
    return f"proposed observable resolves {done} of {len(tried)} ambiguous cases"


def summary(results: list[dict[str, Any]]) -> str:
    lines = ["group         cases  named  class  unexplained  none  wrong  seconds  gain ratio"]
    by = collections.defaultdict(list)
    for r in results:
        by[r["group"]].append(r)
    for group, found in by.items():
        n = len(found)
        named = sum(r["named"] == r["truth"] and bool(r["truth"]) for r in found)
        inside = sum(r["truth"] in r["class"] for r in found)
        unknown = sum(r["status"] == "unexplained" for r in found)
        none = sum(r["status"] == "no_discrepancy" for r in found)
        wrong = sum(bool(r["named"]) and r["truth"] not in r["class"] for r in found)
        seconds = np.median([r["seconds"] for r in found])
        ratio = np.nanmedian([r["ratio"] for r in found])
        lines.append(
            f"{group:<13} {n:>5}  {named / n:5.3f}  {inside / n:5.3f}  {unknown / n:11.3f}  "
            f"{none / n:4.2f}  {wrong / n:5.3f}  {seconds:7.2f}  {ratio:6.1f}"
        )
    return "\n".join(lines)


def peers(results: list[dict[str, Any]]) -> str:
    """Named exactly by the project and the peers; for nulls, the share of false alarms."""
    by = collections.defaultdict(list)
    for r in results:
        by[r["group"]].append(r)
    lines = ["group         project  matched filter  STLSQ   (nulls: false alarms)"]
    for group, found in by.items():
        if group == "unlike":
            continue
        shares = []
        for who in ("project", "matched filter", "STLSQ"):
            answers = [r["named"] if who == "project" else r["peers"].get(who, ()) for r in found]
            if "null" in group:
                shares.append(np.mean([bool(a) for a in answers]))
            else:
                pairs = zip(answers, found, strict=True)
                shares.append(np.mean([tuple(a) == r["truth"] for a, r in pairs]))
        lines.append(f"{group:<13} {shares[0]:7.3f}  {shares[1]:14.3f}  {shares[2]:5.3f}")
    return "\n".join(lines)


def confusion(results: list[dict[str, Any]], groups: tuple[str, ...]) -> str:
    """Rows: what was hidden; columns: what was named."""
    counts: collections.Counter = collections.Counter()
    for r in results:
        if r["group"] in groups:
            answer = "+".join(r["named"]) or r["status"]
            counts["+".join(r["truth"]) or "?", answer] += 1
    rows = sorted({a for a, _ in counts})
    return "\n".join(
        f"{row:<20} " + ", ".join(f"{b} {n}" for (a, b), n in counts.most_common() if a == row)
        for row in rows
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scale", type=int, default=1, help="repetitions of every case")
    parser.add_argument("--first-seed", type=int, default=100_000)
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--group", default="", help="only this group")
    parser.add_argument("--verbose", action="store_true", help="list what went wrong")
    parser.add_argument("--log", default="", help="append every case's result here as it comes")
    options = parser.parse_args()
    jobs = [j for j in cases(options.scale, options.first_seed) if options.group in ("", j[0])]
    results = []
    with ProcessPoolExecutor(options.workers) as pool:
        for result in pool.map(run, jobs):
            results.append(result)
            if options.log:
                with open(options.log, "a", encoding="utf-8") as file:
                    print(repr(result), file=file)
    if options.verbose:
        for r in results:
            right = (
                r["named"] == r["truth"]
                and (r["group"] != "unlike" or r["status"] == "unexplained")
                and ("null" not in r["group"] or r["status"] == "no_discrepancy")
            )
            if not right:
                print(r, file=sys.stderr)
    print(summary(results))
    print(proposals(results))
    print()
    if PEERS:
        print(peers(results))
        print()
    print(confusion(results, ("plain", "foreign", "pair")))


if __name__ == "__main__":
    main()
