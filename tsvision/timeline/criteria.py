"""What counts as which phase, and how long it must last."""

from __future__ import annotations

from dataclasses import dataclass

from tsvision.measures.zone.definitions import COIL_RATIO, KNOT_RATIO, KNOT_RISE, UNEVENNESS

PHASES = ("twist", "overtwist", "local overtwist", "knotted", "irreversible")
"""Phases in rising order; each holds what the ones before it hold, but more."""

LEVEL_OF_ONSET = {
    "overtwist_onset": 1,
    "local_overtwist_onset": 2,
    "knot_onset": 3,
    "irreversible_onset": 4,
}
"""Which phase, as an index into PHASES, an onset is the beginning of."""


@dataclass(frozen=True)
class Criteria:
    """The definitions of the phases and of persistence.

    `coil_ratio`: A / D from which the bundle counts as coiled. `unevenness`: coefficient of
    variation of E(s) from which coiling counts as local. A knot rises to `knot_rise` of the
    baseline E₀ and to `knot_ratio` of D.
    A phase that appears persists when it holds for `persist_frames` frames and `persist_turns`
    turns (or to the end) and for `persist_share` of all turns wound from there on: what shows and
    goes again while the winding goes on was a beat of coils or a slip, no beginning.
    `level`: probability mass of every interval.

    Pictures are read by the definitions themselves: set otherwise here, these numbers change what
    is told of what was seen, not what is seen.
    """

    coil_ratio: float = COIL_RATIO
    unevenness: float = UNEVENNESS
    knot_rise: float = KNOT_RISE
    knot_ratio: float = KNOT_RATIO
    persist_frames: int = 3
    persist_turns: float = 2.0
    persist_share: float = 0.75
    level: float = 0.95


@dataclass(frozen=True)
class Rates:
    """How readily the hidden state changes, per turn; the answer hardly depends on them.

    A phase begins about once in a winding and seldom ends before the unwinding, where it is the
    other way round. Knots grow out of a bundle that coils widely: there they begin `ready_times` as
    readily. A knot can hide behind the bundle in one view: such a spell lasts a fraction
    of a turn, or a frame or two where frames are turns apart.
    """

    rise_per_turn: float = 0.02
    ready_times: float = 3.0
    ready_coil_ratio: float = 0.3
    fall_per_turn: float = 0.002
    unwind_rise_per_turn: float = 0.001
    unwind_fall_per_turn: float = 0.03
    hide: float = 0.03
    hidden_at_start: float = 0.06
    hidden_turns: float = 0.7
    reveal_most: float = 0.7
    step_floor_turns: float = 0.02
    independent_turns: float = 0.2


RATES = Rates()
