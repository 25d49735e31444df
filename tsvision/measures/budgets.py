"""Turns and string length that one frame shows: what slips or stretches is missing from them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tsvision.measures.bundle import BundleFit
from tsvision.measures.helix import KC, Edges, K
from tsvision.measures.looks import Looks
from tsvision.records import FrameRow

NAN = float("nan")


def add_budgets(
    row: FrameRow,
    looks: Looks,
    near: BundleFit | None,
    mid: BundleFit | None,
    apex_px: float,
    edges: Edges,
) -> FrameRow:
    """Turns and string length seen, from the rates beside the separator and in mid-span."""
    known = np.flatnonzero((edges.upper_weight > 0) & (edges.lower_weight > 0))
    end = looks.ends.connector_px
    if known.size < 10 or not np.isfinite(apex_px) or not np.isfinite(end):
        return row
    fits = [f.fit for f in (near, mid) if f is not None]
    if not fits:
        return row
    length = end - apex_px
    rates = [(f.p[K] + (f.p[KC] if f.coiled else 0.0)) / (2 * np.pi) for f in fits]
    turns_seen = 0.25 + float(np.mean(rates)) * length
    sd = 0.01 * turns_seen + float(np.ptp(rates)) * length / 2
    scale = looks.scale.mm_per_px
    a = [np.sqrt(np.mean((2 * f.p[0] * f.section.radius_d) ** 2)) for f in fits]
    stretch = [
        f.stretch * np.sqrt(1.0 + (2 * np.pi * ai / f.pitch_px) ** 2)
        for f, ai in zip(fits, a, strict=True)
    ]
    leg = NAN
    row = replace(
        row,
        turns_seen=turns_seen,
        turns_seen_sd=sd,
        turn_budget_error=(turns_seen - abs(row.turns)) if np.isfinite(row.turns) else NAN,
        apex_mm=(apex_px - looks.zero_px) * scale,
        apex_x_px=float(looks.sight.axis.at(np.array(apex_px))[0]),
        apex_y_px=float(looks.sight.axis.at(np.array(apex_px))[1]),
    )
    apex_mm = row.apex_mm
    if np.isfinite(apex_mm) and looks.zero_known:
        leg = float(np.hypot(apex_mm, 0.5 * looks.hole_distance_mm))
        bundle = float(np.mean(stretch)) * length * scale
        row = replace(
            row,
            string_length_mm=leg + bundle,
            string_length_mm_sd=0.01 * bundle + float(np.ptp(stretch)) * length * scale / 2,
        )
    return row
