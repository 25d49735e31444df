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
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from tests.hidden import planted

PEERS = os.environ.get("HIDDEN_PEERS", "1") == "1"
ONLY_X = ("displacement_mm",)
ALL = ("displacement_mm", *planted.NOISE)
NULLS = {"clean": 16, "hard": 16, "clean x": 16, "hard x": 16, "hard all": 8}  # kind: how many
ONE_RADIUS = {"radius_bias", "angle_scale", "camera_scale"}  # of which D, x and β tell but two
Results = list[dict[str, Any]]


def cases(scale: int, first: int) -> list[tuple[str, Any]]:
    """(group, function that makes the case) in a fixed order; `first` shifts all seeds."""
    seeds = itertools.count(first)
    jobs: list[tuple[str, tuple]] = []

    def add(group: str, what: str, name: str = "", which: int = 0) -> None:
        jobs.append((group, (what, name, which, next(seeds))))

    pairs = list(itertools.combinations(planted.PLAIN, 2))
    for _ in range(scale):
        for name in planted.PLAIN:
            add("plain", "plain", name)
            if name != "camera_scale":
                add("only x", "onlyx", name)
        for name, forms in planted.FOREIGN.items():
            for which in range(len(forms)):
                add("foreign", "foreign", name, which)
        for name in planted.LATER:
            add("later", "later", name)
        for which in [*range(len(planted.UNLIKE))] * 4:
            add("unlike", "unlike", which=which)
        g = np.random.default_rng(next(seeds))
        for i in g.choice(len(pairs), 16, replace=False):
            add("pair", "pair", "+".join(pairs[i]))
        for kind, many in NULLS.items():
            for _ in range(many):
                add(f"{kind.split()[0]} null{kind[len(kind.split()[0]) :]}", "null", kind)
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


def aims(results: Results) -> str:
    """The aims, row by row, with the figure reached and the number of cases."""
    rows = [
        ("form in the library: named", ">= 98 %", _share(results, ["plain"], _named)),
        ("pairs exactly", ">= 90 %", _share(results, ["pair"], _named)),
        (
            "  of those that x, D and angle can tell",
            "",
            _share(_tellable(results), ["pair"], _named),
        ),
        ("form not in the library: named", ">= 90 %", _share(results, FOREIGN, _named)),
        ("  truth in class", ">= 97 %", _share(results, FOREIGN, _inside)),
        ("  wrong names", "<= 5 %", _share(results, FOREIGN, _wrong)),
        ("false alarms, clean", "<= 1 %", _share(results, ["clean null", "clean null x"], _alarm)),
        ("false alarms, hard", "<= 5 %", _share(results, HARD, _alarm)),
        ("held-out RMSE below the base, median", ">= 10 x", _median_gain(results)),
        ("  worse than the base", "<= 2 %", _share(results, EFFECTS, lambda r: r["ratio"] < 1.0)),
        ("displacement only: truth in class", ">= 97 %", _share(results, ["only x"], _inside)),
        ("  the proposed observable resolves", ">= 95 %", _resolved(results)),
        ("an effect like no cause: flagged", ">= 90 %", _share(results, ["unlike"], _flagged)),
    ]
    return "\n".join(f"{what:<42} aim {aim:<8} {figure}".rstrip() for what, aim, figure in rows)


EFFECTS = ["plain", "foreign", "later", "pair", "only x"]
FOREIGN = ["foreign", "later"]
HARD = ["hard null", "hard null x", "hard null all"]


def _share(results: Results, groups: list[str], right: Callable[[dict[str, Any]], bool]) -> str:
    found = [right(r) for r in results if r["group"] in groups]
    return f"{np.mean(found):.3f} ({sum(found)} of {len(found)})" if found else "-"


def _tellable(results: Results) -> Results:
    return [r for r in results if len(ONE_RADIUS & set(r["truth"])) < 2]


def _median_gain(results: Results) -> str:
    found = [r["ratio"] for r in results if r["group"] in EFFECTS]
    return f"{np.nanmedian(found):.1f} x ({len(found)})" if found else "-"


def _resolved(results: Results) -> str:
    tried = [r for r in results if r["after"] is not None]
    return _share(tried, ["only x"], lambda r: r["after"] == [r["truth"]])


def _named(r: dict[str, Any]) -> bool:
    return bool(r["truth"]) and r["named"] == r["truth"]


def _inside(r: dict[str, Any]) -> bool:
    return r["truth"] in r["class"]


def _wrong(r: dict[str, Any]) -> bool:
    return bool(r["named"]) and not _inside(r)


def _alarm(r: dict[str, Any]) -> bool:
    return r["status"] != "no_discrepancy"


def _flagged(r: dict[str, Any]) -> bool:
    return r["status"] == "unexplained"


def summary(results: Results) -> str:
    lines = ["group         cases  named  class  unexplained  none  wrong  seconds  gain ratio"]
    by = collections.defaultdict(list)
    for r in results:
        by[r["group"]].append(r)
    for group, found in by.items():
        n = len(found)
        named, inside, wrong = (sum(map(is_so, found)) for is_so in (_named, _inside, _wrong))
        unknown, none = sum(map(_flagged, found)), n - sum(map(_alarm, found))
        seconds = np.median([r["seconds"] for r in found])
        ratio = np.nanmedian([r["ratio"] for r in found])
        lines.append(
            f"{group:<13} {n:>5}  {named / n:5.3f}  {inside / n:5.3f}  {unknown / n:11.3f}  "
            f"{none / n:4.2f}  {wrong / n:5.3f}  {seconds:7.2f}  {ratio:6.1f}"
        )
    return "\n".join(lines)


def peers(results: Results) -> str:
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
            if "null" in group:  # what the project calls unexplained is an alarm too
                alarms = [_alarm(r) for r in found] if who == "project" else map(bool, answers)
                shares.append(np.mean([*alarms]))
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
            expected = _flagged if r["group"] == "unlike" else _named if r["truth"] else None
            if not (expected(r) if expected else not _alarm(r)):
                print(r, file=sys.stderr)
    print(summary(results))
    print()
    print(aims(results))
    print()
    if PEERS:
        print(peers(results))
        print()
    print(confusion(results, ("plain", "foreign", "pair")))


if __name__ == "__main__":
    main()
