"""Young knots: a lobe that reached out of the bundle just before a knot was seen there.

Of a knot that begins one view often shows a single lobe, too short to be told from a chance one.
What follows tells: where a knot shows from one frame on, a lobe at its place in the frame before
was its own, for a chance lobe may lie anywhere along the bundle. The same holds for a knot that is
about to dissolve. It does not hold where the frames lie many turns apart: a young knot is soon an
old one, and what reached out there before was something else.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from tsvision.measures.zone.knots import LOBE
from tsvision.timeline.evidence import measured
from tsvision.timeline.order import Order, numbers
from tsvision.timeline.places import places_in_diameters, rows_of_steps
from tsvision.timeline.tracks import GATE_D, track_knots

YOUNG_TURNS = 2.5  # for no longer is a knot young; nor was this tried on frames farther apart
A_KNOTS = 0.75  # confidence of a lobe that lies where a knot shows


def with_young(
    frames: pd.DataFrame, knots: pd.DataFrame, order: Order, zone_mm: float = float("nan")
) -> pd.DataFrame:
    """`knots` without the lobes but for those at the place of a knot in the frame after or before.

    zone_mm: as for `track_knots`."""
    lone = numbers(knots, "confidence") <= LOBE
    whole = knots[~lone].reset_index(drop=True)
    lobes = knots[lone].reset_index(drop=True)
    if not len(lobes) or not len(whole):
        return whole
    taken = _beside_tracks(frames, whole, lobes, order, zone_mm)
    young = lobes.iloc[sorted(taken)].assign(confidence=A_KNOTS)
    joined = pd.concat([whole, young]) if len(young) else whole
    return joined.sort_values("frame", kind="stable").reset_index(drop=True)


def _beside_tracks(
    frames: pd.DataFrame, whole: pd.DataFrame, lobes: pd.DataFrame, order: Order, zone_mm: float
) -> set[int]:
    """Rows of the lobes that lie where a knot shows next, or showed last, in unbroken sequence."""
    tracking = track_knots(frames, whole, order, zone_mm)
    place, _ = places_in_diameters(frames, whole)
    lobe_place, _ = places_in_diameters(frames, lobes)
    lobe_rows = rows_of_steps(frames, lobes, order)
    good = np.flatnonzero(measured(frames)[order.rows])
    turns = numbers(frames, "turns")[order.rows]
    step_of = {name: i for i, name in enumerate(frames["frame"].to_numpy()[order.rows])}
    step = whole["frame"].map(step_of).to_numpy()
    taken: set[int] = set()
    for number in np.unique(tracking.number[tracking.confirmed & ~tracking.artefact]):
        rows = np.flatnonzero(tracking.number == number)
        for way, row in ((-1, rows[np.argmin(step[rows])]), (1, rows[np.argmax(step[rows])])):
            beyond = good[good < step[row]][::-1] if way < 0 else good[good > step[row]]
            at, last = float(place[row]), int(step[row])
            for there in beyond:
                if abs(turns[there] - turns[last]) > YOUNG_TURNS:
                    break
                free = [int(k) for k in lobe_rows[there] if int(k) not in taken]
                near = min(free, key=lambda k: abs(lobe_place[k] - at), default=None)
                if near is None or abs(lobe_place[near] - at) > GATE_D:
                    break
                taken.add(near)
                at, last = float(lobe_place[near]), int(there)
    return taken
