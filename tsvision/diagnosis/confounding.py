"""Which sets of causes cannot be told apart by the data: by evidence, and by construction."""

from __future__ import annotations

from tsvision.diagnosis.candidates import Candidate, Selection
from tsvision.diagnosis.select import CLASS_WIDTH
from tsvision.mechanisms import MECHANISMS

TEMPER = 0.03  # share of the gain by which the class widens when even the best does not fit well
MOST_TEMPER = 5.0


def equivalent_sets(
    selection: Selection, observables: tuple[str, ...], fits_well: bool
) -> tuple[list[tuple[str, ...]], list[Candidate]]:
    """Sets of causes within reach of the chosen one (itself first), and those that were fitted.

    A set larger than the chosen one is no rival: its further cause has not earned its place.
    """
    chosen = selection.chosen
    if chosen is None:
        return [], []
    width = CLASS_WIDTH
    if not fits_well:
        width += min(TEMPER * selection.gain(chosen), MOST_TEMPER)
    rivals = [
        c
        for c in selection.candidates
        if len(c.names) == len(chosen.names)
        and c.names != chosen.names
        and chosen.log_evidence - c.log_evidence < width
    ]
    sets = [chosen.names, *(c.names for c in rivals)]
    for twin in exact_twins(sets, observables):
        if twin not in sets:
            sets.append(twin)
    return sets, [chosen, *rivals]


def exact_twins(sets: list[tuple[str, ...]], observables: tuple[str, ...]) -> list[tuple[str, ...]]:
    """From displacement alone radius, gear and camera scale (through the stated D) are one:
    x depends on α r only, and D may have been read from a picture."""
    if observables != ("displacement_mm",):
        return []
    order = list(MECHANISMS)
    twins = []
    for names in sets:
        for name in names:
            if name == "radius_bias":
                for other in MECHANISMS[name].like_exactly:
                    if other not in names:
                        swapped = [other if n == name else n for n in names]
                        twins.append(tuple(sorted(swapped, key=order.index)))
    return twins
