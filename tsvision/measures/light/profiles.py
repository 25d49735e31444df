"""The mean profiles of both edges over some cuts, and what a first glance makes of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tsvision.measures.edges.cut import Cut
from tsvision.measures.edges.find import FEWEST_COLUMNS, along_axis, rough_edges
from tsvision.measures.edges.mean_edge import edge_samples, mean_profile
from tsvision.measures.edges.shading import EdgeProfile, Shading, inside_px
from tsvision.measures.light.shading_fit import fit_shading


def edge_profiles(
    cuts: list[Cut],
    rho_px: float,
    known: list[tuple[np.ndarray, np.ndarray]] | None = None,
) -> tuple[EdgeProfile, EdgeProfile] | None:
    """Mean edge profile of the upper and lower side over all cuts; None when too little is seen.

    known: rows of the upper and lower edge (M,) for each cut, NaN where unknown; the rough edges
    without it. Only edges that run nearly along the axis count: others are smeared across columns.
    """
    profiles = []
    for side, outward in ((0, 1), (1, -1)):
        samples, some_sunk = [], False
        for i, cut in enumerate(cuts):
            edge = rough_edges(cut)[side] if known is None else known[i][side]
            slope, flat = along_axis(cut, edge)
            dim = np.isfinite(cut.dim[side])
            sunk = cut.sunk == outward
            flat &= dim if sunk else ~dim
            if flat.sum() < FEWEST_COLUMNS:
                continue
            part = cut.contrast[:, flat], edge[flat], slope[flat]
            samples.append(edge_samples(*part, outward, inside_px(rho_px), sunk))
            some_sunk |= sunk
        if not samples:
            return None
        profile = mean_profile(*(np.concatenate(v) for v in zip(*samples, strict=True)))
        if profile is None:
            return None
        profiles.append(replace(profile, sunk=some_sunk))
    return profiles[0], profiles[1]


def learn_shading(cuts: list[Cut], rho_px: float) -> tuple[Shading, Shading] | None:
    """Upper and lower side's shading over some frames; None when too little edge is seen."""
    profiles = edge_profiles(cuts, rho_px)
    if profiles is None:
        return None
    upper, lower, _ = fit_shading(profiles, rho_px, black_of(cuts), by_hue=cuts[0].in_colour)
    return upper, lower


def black_of(cuts: list[Cut]) -> float:
    """The contrast of a strand without light, the typical one of the cuts that show one; 0 where
    none does, as before a black ground."""
    known = [cut.black for cut in cuts if np.isfinite(cut.black)]
    return float(np.median(known)) if known else 0.0
