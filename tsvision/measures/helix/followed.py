"""A coiled fit followed along the bundle, part of a coil at a time, to both its ends.

A fit knows the stretch that it was made of; a bundle that overtwists coils wider here and narrower
there. The stretch beside it is fitted from what it was found to be, and so on (`carried`). What is
read there is the angle that strands and coil together have in the picture: whatever the coil's
radius, and however its torsion turns the strands, that angle counts the turns. (A bundle whose
middle line does not cross itself in the picture has no more to its linking number than its strands'
turning in the picture's own frame.) It is known but for the part of a turn after which the section
looks the same, and a place that was read wrongly is found out by it: from one place to the next the
angle goes on as fast as either says. What agrees best with itself is kept.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numba
import numpy as np

from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.bundle import FLANK, SCALE_PX, BundleFit
from tsvision.measures.helix.carried import STEPS, Limits, Seen, Sites, at_the_end, carried
from tsvision.measures.helix.coil_radius import coil_px
from tsvision.measures.helix.expected import Expected, turns_before
from tsvision.measures.helix.fit import HelixFit
from tsvision.measures.helix.reduced import reduced
from tsvision.measures.helix.silhouette import KC, PHI, PHIC, RC, K, rescaled
from tsvision.measures.helix.weigh import POOR, noise_cost

FOLLOWED_DIAMETER_PX = 12.0  # wider bundles are followed at reduced size
STEP, WINDOW = 0.25, 1.5  # of a coil: from place to place, and what is fitted about each
SHORTEST = 2.5  # D, of what is fitted
BEGUN_STEPS = 12  # of the first descent, ...
WHATEVER = Limits(np.inf, np.inf)  # ... which is heard in any case
# What a place may cost above the edges' noise: twice what the fit's own does, within these; if no
# more than so much of that, nothing else is tried.
LIKE, LEAST_COST, MOST_COST = 2.0, 0.06, 0.12
WELL, LEAST_WELL, MOST_WELL = 1.0, 0.02, 0.06
# Of turns, and of those between two places, by which their angle may differ from what they expect.
MISS, MISS_SHARE = 0.03, 0.1
WORTH = 2.0  # of a place that costs nothing; one at the limit has 1, as much as a miss by one sd
UNLIKE = 0.25  # log of the times that a rate is another than expected, which double what it costs
AGAINST = 1e3  # the same of one that turns against what is expected
LEAST_TOLD = 0.15  # of the places: fewer agree by chance
REACH = 1.2  # steps about a place: so far it tells all, and fades to nothing at twice that


@dataclass(frozen=True)
class Followed:
    """Places s_px (K,), in order, that were read; there strands and coils turn at rate (K,) rad per
    px of axis, and stretch (K,) px of bundle lie on one; angle_rad (K,) of both together, after a
    `fold`th turn the same; reach_px: see REACH."""

    s_px: np.ndarray
    rate: np.ndarray
    stretch: np.ndarray
    angle_rad: np.ndarray
    fold: int
    reach_px: float

    def counted(self, laid: np.ndarray) -> np.ndarray:
        """Turns (K - 1,) from place to place: of all that lead from angle to angle, those nearest
        to what is laid (K - 1,)."""
        part = np.diff(self.angle_rad) / (2.0 * np.pi)
        return np.asarray(part + np.round((laid - part) * self.fold) / self.fold)

    def told(self, s_px: np.ndarray) -> np.ndarray:
        """How much is told of each s (M,), 0..1."""
        after = np.searchsorted(self.s_px, s_px)
        beside = self.s_px[np.clip([after - 1, after], 0, self.s_px.size - 1)]
        away = np.abs(beside - s_px).min(axis=0)
        return np.asarray(np.clip(2.0 - away / self.reach_px, 0.0, 1.0))

    def unbroken(self, start_px: float, end_px: float, ends_px: float) -> bool:
        """Whether all between two s is told, but for so much at either end."""
        near = self.s_px[0] <= start_px + ends_px and self.s_px[-1] >= end_px - ends_px
        return bool(near and np.diff(self.s_px).max(initial=0.0) <= 3.0 * self.reach_px)


def follow(
    found: BundleFit, edges: Edges, expected: Expected, start_px: float, end_px: float
) -> Followed | None:
    """A coiled fit followed between two s, what is expected to lie there being known; None where
    the stretch is short or nothing is told."""
    fit = found.fit
    coil = coil_px(float(fit.p[KC]), fit.diameter_px)
    half = 0.5 * max(WINDOW * coil, SHORTEST * fit.diameter_px)
    part = replace(edges.window(start_px, end_px), half_slope=FLANK, light=None)
    if part.s_px.size < 2.0 * half:
        return None
    own = float(np.clip(0.5 * (fit.z_px[0] + fit.z_px[1]), start_px + half, end_px - half))
    step = STEP * coil
    up = np.append(np.arange(own, end_px - half, step), end_px - half)
    down = np.append(np.arange(own - step, start_px + half, -step), start_px + half)
    noise = noise_cost(edges.window(*fit.z_px), 2.0 * SCALE_PX)
    s_px, cost, rate, stretch, angle = _places(fit, part, half, up, down, noise)
    turns = 2.0 * np.pi
    before = turns_before(expected.s_px, expected.turning, s_px)
    laid = np.interp(s_px, expected.s_px, expected.turning)
    kept = _agreeing(s_px, rate / turns, angle / turns, cost, before, laid, fit.section.fold)
    if kept.sum() < LEAST_TOLD * (up.size + down.size):
        return None
    s_px, rate, stretch, angle = (x[kept] for x in (s_px, rate, stretch, angle))
    return Followed(s_px, rate, stretch, angle, fit.section.fold, REACH * step)


def _places(
    fit: HelixFit, part: Edges, half_px: float, up: np.ndarray, down: np.ndarray, noise: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """What is read at places up (K,) and down (L,) from the fit's own, the first of `up`, in order
    and some twice: s (M,), its cost, as a share of the most that a helix may cost, and rate,
    stretch and angle as in `Followed`."""
    small = reduced(part, fit.diameter_px / FOLLOWED_DIAMETER_PX)
    edges, factor = small.edges, small.factor
    middle = 0.5 * float(part.s_px[0] + part.s_px[-1])
    seen = Seen(edges.observed, edges.trusted, edges.worth, 2.0 * SCALE_PX / factor)
    sites = Sites(*fit.section.outer, 2.0 * np.pi / fit.section.fold)
    half = half_px / factor

    def at(s_px: np.ndarray) -> np.ndarray:
        return (s_px - middle - small.shift) / factor

    own = small.down(rescaled(fit.p, 1.0, middle - 0.5 * (fit.z_px[0] + fit.z_px[1])))
    begun, costs, _ = carried(own, at(up[:1]), half, seen, sites, WHATEVER, BEGUN_STEPS)
    above = float(costs[0]) - noise
    most = min(noise + float(np.clip(LIKE * above, LEAST_COST, MOST_COST)), POOR)
    limits = Limits(noise + float(np.clip(WELL * above, LEAST_WELL, MOST_WELL)), most)
    if costs[0] < most:
        own = begun[0]
    there = [carried(own, at(s), half, seen, sites, limits, STEPS) for s in (up, down)]
    s_px = np.concatenate([down[::-1], up])
    p, costs, well = (np.concatenate([y[::-1], x]) for x, y in zip(*there, strict=True))
    all_s, all_p, all_costs = [s_px], [p], [costs]
    for back in _to_come_back(well, down.size):
        again, its, _ = carried(p[back[0]], at(s_px[back[1:]]), half, seen, sites, limits, STEPS)
        all_s.append(s_px[back[1:]])
        all_p.append(again)
        all_costs.append(its)
    s_px, p, costs = np.concatenate(all_s), np.concatenate(all_p), np.concatenate(all_costs)
    told = np.argsort(s_px, kind="stable")
    told = told[costs[told] < most]
    s_px, p, costs = s_px[told], p[told], costs[told]
    z = at(s_px)
    for k, s, to in ((0, down[-1], -half), (-1, up[-1], half)) if told.size else ():
        if s_px[k] != s:
            continue
        end, cost = at_the_end(p[k], float(at(s)), to, seen, sites)
        if cost < most:
            where = 0 if k == 0 else s_px.size
            s_px, costs = (
                np.insert(line, where, value)
                for line, value in ((s_px, s + to * factor), (costs, cost))
            )
            p, z = np.insert(p, where, end, axis=0), np.insert(z, where, 0.0)
    rate, stretch = p[:, K] + p[:, KC], np.hypot(1.0, p[:, RC] * p[:, KC])
    angle = p[:, PHI] + p[:, PHIC] + rate * z
    return s_px, costs / most, rate / factor, stretch, angle


def _to_come_back(well: np.ndarray, own: int) -> list[np.ndarray]:
    """Places, one behind the other, on which to come back from one that a helix describes well (the
    first of each) over others; well (K,): which do, carried from `own` to both ends."""
    runs = np.split(np.arange(well.size), np.flatnonzero(np.diff(well)) + 1)
    back = []
    for run in runs:
        beyond = run[-1] + 1 if run[0] > own else run[0] - 1
        if not well[run[0]] and 0 <= beyond < well.size:
            back.append(np.append(beyond, run[::-1] if run[0] > own else run))
    return back


@numba.njit(cache=True, error_model="numpy")
def _agreeing(s, rate, angle, cost, before, laid, fold):  # pragma: no cover - compiled
    """Which of places s (K,), in order, with rate (turns per px), angle (turns) and cost (K,) lead
    on to each other: those whose worth, less their misses, is greatest. before, laid (K,): turns
    expected up to there, and per px there."""
    best, last = np.empty(s.size), np.full(s.size, -1)
    times = rate / laid
    for j in range(s.size):
        unlike = abs(np.log(times[j])) if times[j] > 0.0 else AGAINST
        worth = WORTH - cost[j] * (1.0 + unlike / UNLIKE)
        best[j] = worth
        for i in range(j):
            if s[j] <= s[i]:
                continue
            turns = 0.5 * (times[i] + times[j]) * (before[j] - before[i])
            miss = turns - (angle[j] - angle[i])
            miss -= np.round(miss * fold) / fold
            so_far = best[i] + worth - (miss / (MISS + MISS_SHARE * turns)) ** 2
            if so_far > best[j]:
                best[j], last[j] = so_far, i
    kept = np.zeros(s.size, np.bool_)
    j = int(np.argmax(best)) if s.size else -1
    while j >= 0:
        kept[j] = True
        j = last[j]
    return kept
