"""Mean brightness along edges that were found by another signal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tsvision.measures.edges.cut import Cut
from tsvision.measures.edges.find import FEWEST_COLUMNS, along_axis
from tsvision.measures.edges.mean_edge import edge_samples, mean_profile
from tsvision.measures.edges.shading import EdgeProfile, Shading, inside_px
from tsvision.measures.light.beside import NONE, Beside
from tsvision.measures.light.profiles import black_of
from tsvision.measures.light.stored import StoredLuma, luma_added, surface_light, without


@dataclass(frozen=True)
class BrightCuts:
    """What shows the same frames by brightness: the cuts by the id of those by colour, alike in
    rows and columns; blur_px: theirs; sought: whether that is a guess; halved: whether files keep
    the colour at half the resolution; stored: how they keep brightness, where that is to be undone.
    """

    cuts: dict[int, Cut]
    blur_px: float
    sought: bool
    halved: bool
    stored: StoredLuma | None = None

    def beside(
        self,
        cuts: list[Cut],
        rho_px: float,
        known: list[tuple[np.ndarray, np.ndarray]],
        shading: tuple[Shading, Shading],
    ) -> Beside:
        """The mean brightness along known rows of the edges in some cuts by colour, which look like
        `shading` as far as it is known; NONE where too little is seen."""
        upper = self._profile(0, cuts, rho_px, known)
        lower = self._profile(1, cuts, rho_px, known)
        if upper is None or lower is None:
            return NONE
        if self.stored is not None and self.stored.levels[1] > 0.0:  # in units of the ground
            stored, black = self.stored, black_of(cuts)
            light = [surface_light(side, black) for side in shading]
            added = [luma_added(stored, own, self.blur_px) / stored.levels[1] for own in light]
            upper, lower = without(upper, added[0]), without(lower, added[1])
        return Beside((upper, lower), self.blur_px, self.sought, self.halved)

    def _profile(
        self,
        side: int,
        cuts: list[Cut],
        rho_px: float,
        known: list[tuple[np.ndarray, np.ndarray]],
    ) -> EdgeProfile | None:
        """Of the upper (0) or the lower side (1)."""
        outward = 1 if side == 0 else -1
        samples = []
        for cut, rows in zip(cuts, known, strict=True):
            other, edge = self.cuts.get(id(cut)), rows[side]
            if other is None:
                continue
            slope, flat = along_axis(cut, edge)
            if flat.sum() < FEWEST_COLUMNS:
                continue
            by_ground = other.contrast[:, flat] * other.core_share
            part = by_ground, edge[flat], slope[flat]
            samples.append(edge_samples(*part, outward, inside_px(rho_px), unscaled=True))
        if not samples:
            return None
        return mean_profile(*(np.concatenate(v) for v in zip(*samples, strict=True)))
