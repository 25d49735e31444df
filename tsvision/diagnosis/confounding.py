"""Which sets of causes cannot be told apart by the data: by evidence, and by construction."""

from __future__ import annotations

import itertools

from tsvision.diagnosis.candidates import Candidate, Selection, sorted_names
from tsvision.diagnosis.select import CLASS_WIDTH

TEMPER = 0.03  # share of the gain by which the class widens when even the best does not fit well
MOST_TEMPER = 5.0
# How near a set without the last cause may come, to be a rival, or as a share of the gain: a single
# cause in a form that is not on the shelf leaves a second so much as often as two causes do.
SMALLER_WIDTH = 6.0
SMALLER_SHARE = 0.02
ONE_RADIUS = ("radius_bias", "angle_scale", "camera_scale")  # α r, and the D that was stated for it
TELL_RADIUS = {  # what depends on r, α or the camera otherwise than through α r
    "diameter_mm",
    "hole_distance_mm",
    "twist_turns",
    "pitch_mm",
    "turns_seen",
    "torque_Nmm",
}


def equivalent_sets(
    selection: Selection, observables: tuple[str, ...], fits_well: bool
) -> tuple[list[tuple[str, ...]], list[Candidate]]:
    """Sets of causes within reach of the chosen one (itself first), and those that were fitted.

    A set larger than the chosen one is no rival: its further cause has not earned its place. One
    that is smaller is a rival where the chosen one's further cause has but just earned its own.
    """
    chosen = selection.chosen
    if chosen is None:
        return [], []
    width = CLASS_WIDTH
    if not fits_well:
        width += min(TEMPER * selection.gain(chosen), MOST_TEMPER)
    smaller_width = max(SMALLER_WIDTH, SMALLER_SHARE * selection.gain(chosen))
    widths = {len(chosen.names): width, len(chosen.names) - 1: smaller_width}
    rivals = [
        c
        for c in selection.candidates
        if c.names != chosen.names
        and len(c.names) in widths
        and chosen.log_evidence - c.log_evidence < widths[len(c.names)]
    ]
    sets = [chosen.names, *(c.names for c in rivals)]
    for twin in exact_twins(sets, observables):
        if twin not in sets:
            sets.append(twin)
    return sets, [chosen, *rivals]


def exact_twins(sets: list[tuple[str, ...]], observables: tuple[str, ...]) -> list[tuple[str, ...]]:
    """Sets that no reading of these observables can tell from those given.

    Displacement and helix angle depend on α r only, and the stated D may have been read from a
    picture: radius, gear and camera scale are one. Where D is read too, any two of the three make
    up for each other.
    """
    telling = TELL_RADIUS & set(observables)
    twins: list[tuple[str, ...]] = []
    for names in sets:
        ones = [name for name in names if name in ONE_RADIUS]
        if not telling and ones == ["radius_bias"]:
            others: list[tuple[str, ...]] = [(other,) for other in ONE_RADIUS[1:]]
        elif telling == {"diameter_mm"} and len(ones) == 2:
            others = list(itertools.combinations(ONE_RADIUS, 2))
        else:
            continue
        rest = [name for name in names if name not in ones]
        twins += [sorted_names([*other, *rest]) for other in others]
    return twins
