"""What of a pixel's light tells strings from their ground: brightness, a hue, or a distance."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from tsvision.images.linear import LUMA_BGR


class Way(Enum):
    """How strings stand out, the sharpest first: chroma is stored at half the resolution."""

    LUMA = "brighter or darker"
    HUE = "by a weighted sum of channels"
    DISTANCE = "by any difference from the ground's colour"
    ACROSS = "by a difference that light and shadow on the ground do not make"


@dataclass(frozen=True)
class Signal:
    """One number a pixel, of linear light, in which strings stand out from their ground.

    weights (3,), blue, green, red: LUMA and HUE sum the channels by them. A DISTANCE takes them for
    how bright a pixel is; one ACROSS does not count what lies along them, the ground's direction.
    averaged_px: side of the squares over which light is averaged before a distance is taken: noise
    makes that longer, never shorter.
    """

    way: Way
    weights: np.ndarray
    averaged_px: int = 1

    @property
    def in_colour(self) -> bool:
        """Whether it takes more than the luma that files store in full."""
        return self.way is not Way.LUMA

    @property
    def by_distance(self) -> bool:
        """Whether it has no sign: strands both brighter and darker than the ground stand out."""
        return self.way in (Way.DISTANCE, Way.ACROSS)


LUMA = Signal(Way.LUMA, LUMA_BGR)
DISTANCE = Signal(Way.DISTANCE, LUMA_BGR)


def summed(weights: np.ndarray) -> Signal:
    """The signal that sums the channels by `weights` (3,)."""
    if np.array_equal(weights, LUMA_BGR):
        return LUMA
    return Signal(Way.HUE, np.asarray(weights))
