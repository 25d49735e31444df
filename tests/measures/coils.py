"""Coils in space, as the renderer's contact leaves them: outlines without light or camera noise."""

from __future__ import annotations

import numpy as np

from synth.actuator import state_at
from synth.render import make_scene
from synth.settings import PAPER_ONSET_TURNS, Law, Settings, Strings
from synth.truth import frame_truth
from tsvision.measures.edges.edges import Edges


def touching_coil(strings: int, past_onset: float = 1.4) -> tuple[Edges, float, float]:
    """The exact outline of a coil whose strands touch, at so many times the turns of its onset, its
    D and pitch in px."""
    turns = past_onset * PAPER_ONSET_TURNS[strings]
    law = Law(overtwist_turns=PAPER_ONSET_TURNS[strings], knots=False)
    settings = Settings(turns=(0.0, turns), strings=Strings(count=strings), law=law)
    view = make_scene(settings).view
    truth = frame_truth(settings, view, state_at(settings, 1), 1)
    seen = np.isfinite(truth.upper_px)
    sure = seen.astype(float)
    upper, lower = (np.where(seen, edge, 0.0) for edge in (truth.upper_px, truth.lower_px))
    return (
        Edges(truth.s_px, upper, lower, sure, sure),
        truth.row["midspan_diameter_mm"] / truth.row["diameter_mm"] * truth.row["diameter_px"],
        truth.row["pitch_px"],
    )


def behind_the_apex(edges: Edges, diameter_px: float) -> tuple[float, float]:
    """A stretch of it, from where the coil has its full radius on."""
    first = float(edges.s_px[edges.both_seen][0]) + 2.4 * diameter_px
    return first, first + 8.0 * diameter_px
