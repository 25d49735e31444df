"""Films in which the bundle comes into view late.

A view of little more than the separator shows two legs, for as long as they meet beyond it. What
most frames show is then a leg, or nothing between two; the frames of the most turns show a bundle.
"""

from __future__ import annotations

import numpy as np

from tsvision.flags import Flag
from tsvision.measures.alone import is_described
from tsvision.measures.looks import Looks, learn_looks
from tsvision.records import Rig, Scale

FEWEST = 4  # pictures, of which half teach as well
TOLD = 2  # pictures in which a bundle has to be described: one may show it by chance
UNTOLD = Flag.ENVELOPE_ONLY | Flag.NO_PITCH


def by_twist(pictures: list[np.ndarray], turns: list[float]) -> list[np.ndarray]:
    """The pictures from least to most turns; as they come where some of these are not known."""
    away = np.abs(turns)
    if not np.isfinite(away).all():
        return pictures
    return [pictures[i] for i in np.argsort(away, kind="stable")]


def shown_late(
    pictures: list[np.ndarray], rig: Rig, scale: Scale, looks: Looks | None
) -> Looks | None:
    """The looks of some pictures, in order of twist; those that the more twisted half teaches alone
    where all together describe hardly any of that half, and these most."""
    late = pictures[len(pictures) // 2 :]
    enough = max(0.5 * len(late), TOLD)
    if len(pictures) < FEWEST or _described(looks, late) >= enough:
        return looks
    own = learn_looks(late, rig, scale)
    return own if _described(own, late) >= enough else looks


def _described(looks: Looks | None, pictures: list[np.ndarray]) -> int:
    """In how many of them a helix describes the bundle."""
    return 0 if looks is None else sum(is_described(looks, p, UNTOLD) for p in pictures)
