"""What another witness of the width makes of edges that light and shape told."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tsvision.measures.edges.shading import Shading
from tsvision.measures.helix.uncertainty import light_sd_px, place_sd_px


@dataclass(frozen=True)
class Witness:
    """By how much edges make a width too large, px, and its standard uncertainty."""

    wide_px: float
    sd_px: float


def heard(
    shading: tuple[Shading, Shading], witness: Witness, apart_px: float = 0.0
) -> tuple[tuple[Shading, Shading], float]:
    """The shading with both edges moved by what a witness says, as far as light and shape are less
    sure of the width than it; and by how much, px, that makes a bundle wider. apart_px: by how much
    the two of them differ, where that is to count as not known."""
    light = light_sd_px(shading)
    share = float(light**2 / (light**2 + witness.sd_px**2))
    wider = -share * witness.wide_px
    between = np.sqrt(share * (1.0 - share)) * apart_px
    sd_px = float(np.hypot(np.sqrt(share) * witness.sd_px, between))
    place_sd = place_sd_px(sd_px)
    upper, lower = (
        replace(s, beyond_px=s.beyond_px + 0.5 * wider, place_sd_px=place_sd) for s in shading
    )
    return (upper, lower), wider
