"""The same account while it happens: one frame in, what is believed of it out.

The hidden chain of `timeline.chain` runs forward only. Once a phase is there with the certainty
asked for, the account of all frames so far is drawn up, exactly as for a finished recording, and
its onset is the decision: live and afterwards, one piece of code tells the turn count.
"""

from __future__ import annotations

from collections import deque
from dataclasses import asdict, dataclass

import numpy as np
import pandas as pd

from tsvision.records import FrameResult, FrameRow, KnotSighting, Onset, Rig
from tsvision.timeline import evidence as speak
from tsvision.timeline.account import Account, account
from tsvision.timeline.background import Background, sets_top
from tsvision.timeline.chain import emissions, independence, start, transition
from tsvision.timeline.criteria import LEVEL_OF_ONSET, PHASES, RATES, Criteria
from tsvision.timeline.lengths import either
from tsvision.timeline.repeats import USUAL_EXTENT_D, repeat_odds
from tsvision.timeline.tables import tables
from tsvision.timeline.tracks import (
    ARTEFACT_GROWTH,
    ARTEFACT_REACH_D,
    ARTEFACT_SHARE,
    ARTEFACT_TURNS,
    BEYOND_D,
    GATE_D,
    GATE_LENGTH,
)

TAIL = 15  # frames over which noise and D are taken; a longer memory costs time and brings little
SWING_TURNS = 1.5  # turning back by more than this means unwinding


@dataclass(frozen=True)
class LiveState:
    """What is believed after a frame: `there` chance of each phase by level, `phase` the highest
    likely one, `onset` the decision, once it is made."""

    there: dict[int, float]
    phase: str
    onset: Onset | None


class Live:
    """Holds the frames so far; `push` takes the next one. Memory: one row a frame."""

    def __init__(
        self,
        rig: Rig,
        watch_for: str = "knot_onset",
        certainty: float = 0.95,
        criteria: Criteria = Criteria(),
    ) -> None:
        self.rig, self.criteria = rig, criteria
        self.watch_for, self.certainty = watch_for, certainty
        self.results: list[FrameResult] = []
        self.onset: Onset | None = None
        self._forget()

    def _forget(self) -> None:
        self._tail: deque[dict[str, object]] = deque(maxlen=TAIL)
        self._belief: dict[int, np.ndarray] = {}
        self._wind = float("nan")
        self._extreme = 0.0
        self._winding = True
        self._background = Background()
        self._early: list[list[tuple[float, float]]] = []
        self._before: tuple[KnotSighting, ...] = ()

    def restart(self, revised: list[FrameResult]) -> None:
        """Take back what was believed since the first of the revised frames and believe them
        instead. The other frames since then keep their rows, but count as not measured."""
        by_frame = {one.row.frame: one for one in revised}
        first = min(by_frame)
        earlier, self.results = self.results, []
        self._forget()
        for old in earlier:
            one = old if old.row.frame < first else by_frame.get(old.row.frame)
            if one is not None:
                self.push(one, may_decide=False)
            else:
                row = FrameRow(old.row.frame, old.row.file, turns=old.row.turns)
                self.results.append(FrameResult(row))

    def push(self, result: FrameResult, may_decide: bool = True) -> LiveState:
        """Take one measured frame, in the order taken."""
        self.results.append(FrameResult(result.row, None, result.knots, result.lobes))
        self._tail.append(asdict(result.row))
        tail = pd.DataFrame(list(self._tail))
        spoken = self._evidence(result, tail)
        ready = bool(speak.ready_to_knot(tail)[-1])
        self._advance(spoken, abs(result.row.turns), ready)
        there = self._nested()
        level = max((k for k, p in there.items() if p > 0.5), default=0)
        level_watched = LEVEL_OF_ONSET[self.watch_for]
        sure = there[level_watched] >= self.certainty
        # what stands out this early is mostly hardware, which a few more frames will tell
        sure &= level_watched < 3 or abs(result.row.turns) >= ARTEFACT_TURNS
        if may_decide and self.onset is None and sure:
            self.onset = self._decide()
        return LiveState(there, PHASES[level], self.onset)

    def account(self) -> Account:
        """The account of all frames so far."""
        return account(*tables(self.results), self.rig, self.criteria)

    def _decide(self) -> Onset | None:
        onset = self.account().onsets[self.watch_for]
        return onset if onset.status == "observed" else None

    def _evidence(self, result: FrameResult, tail: pd.DataFrame) -> dict[int, float]:
        """What this frame says of each phase; tail: the last frames, it the last of them."""
        now = tail.iloc[-1:]
        certainty, largest = self._sightings(result)
        hole = self.rig.actuator.hole_diameter_mm
        return {
            1: float(speak.coil_evidence(tail, self.criteria)[-1]),
            2: float(speak.uneven_evidence(tail, self.criteria)[-1]),
            3: float(speak.knot_evidence(now, certainty, self.criteria)[0]),
            4: float(speak.larger_evidence(now, certainty, largest, hole)[0]),
        }

    def _sightings(self, result: FrameResult) -> tuple[np.ndarray, np.ndarray]:
        """Certainty and largest diameter (1,) of this frame's knots, without what was there from
        the start of a recording that began untwisted."""
        if self._winding and abs(result.row.turns) < ARTEFACT_TURNS:
            early = [(k.centre_x_px, either(k, "max_diameter")) for k in result.knots]
            self._early.append(early)
        against, largest = float("nan"), float("nan")
        row = result.row
        zone = self.rig.actuator.twisting_zone_mm + BEYOND_D * row.diameter_mm
        base = self._background.steady(either(row, "baseline_envelope"))
        for knot in result.knots:
            size = either(knot, "max_diameter")
            if self._is_dirt(knot.centre_x_px, size, row.diameter_px):
                continue
            if knot.centre_mm > zone:
                continue
            chance = self._background.chance(size / base, knot.confidence)
            chance = self._repeated(chance, knot, row)
            against = (1.0 if np.isnan(against) else against) * (1 - chance)
            largest = float(np.fmax(largest, knot.max_diameter_mm))
        coil = either(row, "coil_amplitude") / either(row, "diameter")
        lobe = max((either(one, "max_diameter") for one in result.lobes), default=0.0)
        top = either(row, "max_envelope")
        if not sets_top(lobe, top):
            self._background.push(top / base, coil, sighted=bool(result.knots))
        self._before = result.knots
        return np.array([1 - against]), np.array([largest])

    def _repeated(self, chance: float, knot: KnotSighting, row: FrameRow) -> float:
        """The chance of a sighting that shows where one showed in the frame before."""
        if not self._before:
            return chance
        unit = row.diameter_px if np.isfinite(row.diameter_px) else 20.0
        away = [
            np.hypot(knot.centre_x_px - one.centre_x_px, knot.centre_y_px - one.centre_y_px) / unit
            for one in self._before
        ]
        length = either(knot, "length") / either(row, "diameter")
        gate = GATE_D + GATE_LENGTH * (length if np.isfinite(length) else 1.5)
        if min(away) > gate:
            return chance
        axis = np.hypot(row.axis_x1_px - row.axis_x0_px, row.axis_y1_px - row.axis_y0_px) / unit
        extent = float(axis) if np.isfinite(axis) else USUAL_EXTENT_D
        odds = np.log(chance / (1.0 - chance)) + repeat_odds(len(self._before), gate, extent)
        return float(1.0 / (1.0 + np.exp(-odds)))

    def _is_dirt(self, x_px: float, size: float, diameter_px: float) -> bool:
        reach = ARTEFACT_REACH_D * (diameter_px if np.isfinite(diameter_px) else 20.0)
        alike = [
            any(abs(x_px - x) < reach and not size > ARTEFACT_GROWTH * first for x, first in some)
            for some in self._early
        ]
        return sum(alike) >= 2 and sum(alike) >= ARTEFACT_SHARE * len(alike)

    def _advance(self, spoken: dict[int, float], wind: float, ready: bool) -> None:
        """One step of the forward filter for each level; `ready`: knots begin the more readily."""
        step = abs(wind - self._wind)
        self._turn_back(wind)
        first = not self._belief
        weight = float(independence(np.array([1.0 if first else step]))[0])
        for level, value in spoken.items():
            hides = level >= 3
            if first:
                prior = start(wind)
            else:
                readily = RATES.ready_times if ready and level == 3 else 1.0
                steps = transition(step, self._winding, hides, readily)
                prior = self._belief[level] @ steps
            belief = prior * emissions(np.array([value * weight]), hides)[0]
            self._belief[level] = belief / belief.sum()
        if np.isfinite(wind):
            self._wind = wind

    def _turn_back(self, wind: float) -> None:
        if not np.isfinite(wind):
            return
        ahead = wind - self._extreme if self._winding else self._extreme - wind
        if ahead >= 0:
            self._extreme = wind
        elif -ahead > SWING_TURNS:
            self._winding, self._extreme = not self._winding, wind

    def _nested(self) -> dict[int, float]:
        alone = {level: float(1 - b[0]) for level, b in self._belief.items()}
        coiled, knot = max(alone[1], alone[3]), alone[3]
        uneven = max(min(alone[2], coiled), knot)
        return {1: coiled, 2: uneven, 3: knot, 4: min(alone[4], knot)}
