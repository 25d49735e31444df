"""One picture alone: the line along which it shows a bundle that the model explains.

A film tells by what moves where its bundle lies. One picture has rods, cables and shadows as long
and even as a bundle, and legs that outshine it; but only along a bundle do the edges follow twisted
strands. The likeliest lines are therefore measured one after the other.
"""

from __future__ import annotations

from itertools import islice

import numpy as np

from tsvision.flags import Flag, flags_from_text
from tsvision.measures.frame import Warm, measure_frame
from tsvision.measures.looks import UNLEARNABLE, Looks, learn_looks, sights_of
from tsvision.records import Frame, Rig, Scale

TRIED = 4  # lines
DOUBTFUL = Flag.ENVELOPE_ONLY | Flag.NO_PITCH | Flag.COIL_UNSURE
# What is less likely to begin with has to show more: any wave of noise is some helix.
NO_BETTER = DOUBTFUL | Flag.FEW_LOBES


def explained(picture: np.ndarray, rig: Rig, scale: Scale, likeliest: Looks | None) -> Looks | None:
    """The looks learnt along the likeliest line whose bundle a helix describes, and those of the
    likeliest line of all (as given) where none is."""
    if likeliest is not None and is_described(likeliest, picture):
        return likeliest
    for sight in islice(sights_of([picture], rig, scale), 1, TRIED):
        looks = learn_looks([picture], rig, scale, sight)
        if looks is not None and is_described(looks, picture, NO_BETTER):
            return looks
    return likeliest


def is_described(looks: Looks, picture: np.ndarray, doubtful: Flag = DOUBTFUL) -> bool:
    """Whether a helix describes the bundle that a picture shows; no where it cannot be measured."""
    try:
        row = measure_frame(Frame(0, "", picture), looks, float("nan"), Warm())[0].row
    except UNLEARNABLE:
        return False
    return not flags_from_text(row.flags) & doubtful and bool(np.isfinite(row.pitch_px))
