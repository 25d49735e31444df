"""The loop of `tsvision watch`: arrivals in, one plain row a frame out, until told to stop."""

from __future__ import annotations

import math
import time
from collections.abc import Generator, Iterable
from typing import Any, Protocol, runtime_checkable

from tsvision.live.believing import Live, LiveState
from tsvision.live.sources import Arrival
from tsvision.records import Frame, FrameResult
from tsvision.timeline.lengths import UNITS
from tsvision.timeline.told import onset_values

SHOWN = (
    "frame",
    "file",
    "turns",
    "diameter_mm",
    "diameter_px",
    "pitch_mm",
    "helix_angle_rad",
    "handedness",
    "coil_amplitude_mm",
    "unevenness",
    "flags",
)


class Measures(Protocol):
    """Measures one frame at a time, remembering what the frames before showed."""

    def measure(self, frame: Frame, turns: float) -> FrameResult: ...


@runtime_checkable
class Learns(Protocol):
    """A measurer that gets to know the view as it goes on (see `learning.Learner`)."""

    settled: bool

    def review(self) -> list[FrameResult]: ...


def watch(
    arrivals: Iterable[Arrival], measurer: Measures, live: Live
) -> Generator[dict[str, Any], None, None]:
    """One row a frame: what was measured, what is believed, how long it took.

    `decided` is True on the frame at which the onset watched for became certain enough.
    """
    before = None
    learner = measurer if isinstance(measurer, Learns) else None
    for arrival in arrivals:
        began = time.perf_counter()
        result = measurer.measure(arrival.frame, arrival.turns)
        revised = learner.review() if learner else []
        known = learner is None or (learner.settled and not revised)
        state = live.push(result, may_decide=known)
        if revised:
            live.restart(revised)
        took_ms = 1e3 * (time.perf_counter() - began)
        yield _row(result, state, decided=before is None and state.onset is not None) | {
            "latency_ms": round(took_ms, 2)
        }
        before = state.onset


def _row(result: FrameResult, state: LiveState, decided: bool) -> dict[str, Any]:
    row: dict[str, Any] = {name: _plain(getattr(result.row, name)) for name in SHOWN}
    sizes = {unit: [getattr(k, f"max_diameter_{unit}") for k in result.knots] for unit in UNITS}
    return row | {
        "knot_count": _plain(result.row.knot_count),
        **{f"largest_knot_{unit}": _plain(max(some, default=None)) for unit, some in sizes.items()},
        "phase": state.phase,
        "knot_probability": round(state.there[3], 4),
        "decided": decided,
        "onset": onset_values(state.onset) if state.onset is not None else None,
    }


def _plain(value: object) -> object:
    return None if isinstance(value, float) and not math.isfinite(value) else value
