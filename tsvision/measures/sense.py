"""S or Z of one frame, together with what the other frames of its recording show.

Strands do not change their sense unless the motor turns back past zero: what one frame shows
faintly, or not at all because its bundle is not in view yet, others show plainly.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tsvision.measures.edges.cut import Cut
from tsvision.measures.edges.edges import Edges
from tsvision.measures.handedness import handedness_of, slope_between
from tsvision.measures.looks import Looks

PLAIN_SLOPE = 0.2  # of the ridges: that frame's own sense; strands seldom show less
FAINT_SLOPE = 0.01  # of the ridges: no sense at all
SURE_SUM = 0.05  # of slopes, by which what is left of doubt falls to 1/e
SURE_OF_SENSE = 0.7  # confidence below which none is told
SURE_OF_OTHERS = 0.95  # ... and below which none is told of a frame that shows none itself
TWISTED_TURNS = 1.0  # of the motor, from which on strands that are not in view have a sense


@dataclass(frozen=True)
class Ridges:
    """Sum of the slopes seen in the frames so far, and to which side the motor had turned in these
    (-1 or 1; 0 where that is not known)."""

    slope_sum: float = 0.0
    way: int = 0


NO_RIDGES = Ridges()


class Sense(NamedTuple):
    """handedness: "Z", "S", or "" where it is not told; how sure that is (NaN: not looked for)."""

    handedness: str
    confidence: float


UNKNOWN = Sense("", float("nan"))


def way_of(turns: float) -> int:
    """To which side the motor has turned; 0 where that is not known."""
    return int(np.sign(turns)) if np.isfinite(turns) else 0


def sense_of(
    cut: Cut, edges: Edges, looks: Looks, turns: float, before: Ridges
) -> tuple[Sense, Ridges]:
    """Of a frame by its own ridges, where they tell it plainly, else by all seen so far; and what
    was seen with this frame's."""
    slope = slope_between(cut, edges, looks.diameter_px)
    if not np.isfinite(slope):
        return sense_by_others(looks, turns, before), before
    so_far = Ridges(_same_way(before, turns) + slope, way_of(turns))
    pooled = _same_way(looks, turns) + so_far.slope_sum
    decided = slope if abs(slope) > PLAIN_SLOPE or abs(pooled) < abs(slope) else pooled
    sure = _confidence(pooled)
    told = abs(decided) >= FAINT_SLOPE and sure >= SURE_OF_SENSE
    return Sense(handedness_of(decided) if told else "", sure), so_far


def sense_by_others(looks: Looks, turns: float, before: Ridges) -> Sense:
    """Of a frame that shows no bundle of its own, by the others that are turned the same way."""
    pooled = _same_way(looks, turns) + _same_way(before, turns)
    sure = _confidence(pooled)
    if not abs(turns) >= TWISTED_TURNS or sure < SURE_OF_OTHERS:
        return UNKNOWN
    return Sense(handedness_of(pooled), sure)


def _confidence(slope_sum: float) -> float:
    return float(1.0 - 0.5 * np.exp(-abs(slope_sum) / SURE_SUM))


def _same_way(seen: Looks | Ridges, turns: float) -> float:
    """Sum of the slopes in frames seen, as far as they are of the twist at these turns: 0 where the
    motor had turned to the other side."""
    return seen.slope_sum if seen.way * way_of(turns) >= 0 else 0.0
