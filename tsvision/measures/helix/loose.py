"""What a straight bundle may be besides seen square from beside and as close as at no twist.

Nobody holds a camera quite square to a bundle, and strands that lie steeply find no room on the
section of straight ones: by how much it opens depends on how far they flatten. Both change the
outline little, but leave so much of it unexplained that a coil would be sought in it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.fit import HelixFit, Hold, fit_helix
from tsvision.measures.helix.section import room_needed
from tsvision.measures.helix.silhouette import FREE_STRAIGHT, OPEN, PARAMETERS, RHO, TILT, K

# Off the picture's middle a bundle looks aslant. Of a helix seen so one edge's crests are stretched
# and the other's squeezed: either on its own would be that of another radius, by 2 % a hundredth of
# the tilt for strands that lie as steep as 54 deg.
TILT_SD = 0.06
# Edges of neighbouring columns are off together: a fit's own sd counts this many times.
WIDENED = 3.0
LEAST_ROOM = 0.01  # of the section, that strands need more for its opening to be asked
OFF_PX = (1e-3, 1e3)  # that edges may lie off a fit: none do by less, and by more all is lost
# What edges are off by is known when the fit is free: then again, but so often at most and not once
# that changes by less.
FITTED, SETTLED = 2, 0.8
LOOSE = (*FREE_STRAIGHT, TILT, OPEN)


def held_about(which: int, value: float, sd: float, rms_px: float) -> Hold:
    """Of one parameter that is known so well beforehand, for edges that lie so far off a fit."""
    toward, px2 = np.zeros(PARAMETERS), np.zeros(PARAMETERS)
    toward[which] = value
    px2[which] = (WIDENED * float(np.clip(rms_px, *OFF_PX)) / sd) ** 2
    return Hold(toward, px2)


def aslant_hold(rms_px: float) -> Hold:
    """Of the tilt, for edges that lie so far off a fit."""
    return held_about(TILT, 0.0, TILT_SD, rms_px)


def loosened(edges: Edges, fit: HelixFit, scale_px: float) -> HelixFit:
    """A straight fit, tilted and opened as far as its edges say; as it is where its strands have
    all the room that they need. Rigid strands open the section by all of that, soft ones by none:
    anything between is as likely (a rectangular distribution)."""
    room = room_needed(fit.section, float(2.0 * fit.p[RHO] * fit.p[K]))
    if room < LEAST_ROOM:
        return fit
    loose = fit
    for _ in range(FITTED):
        rms_px = loose.rms_px
        hold = aslant_hold(rms_px)
        hold.toward[OPEN] = 0.5 * room
        hold.px2[OPEN] = 12.0 * (WIDENED * max(rms_px, 1e-3) / room) ** 2
        loose = fit_helix(edges, fit.section, loose.p, LOOSE, scale_px, near=True, hold=hold)
        if loose.rms_px > SETTLED * rms_px:
            break
    return replace(loose, relief=fit.relief)
