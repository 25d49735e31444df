"""What neighbouring frames differ by enters their uncertainty.

A frame's own uncertainty knows the noise of its edges, its light and its scale. It cannot know that
its fit fell into another hollow than its neighbours' did: of a coil seen dimly or blurred many
pitches explain the outline about equally well. D, the strands' rate 2 pi / p, the turns and the
string seen change steadily with the motor's turns, so that how far a frame lies from the line
through its neighbours shows what its own account left out. Squares add up, as always (GUM 5.1.2, a
component of type A).
"""

from __future__ import annotations

import numpy as np
import pandas as pd
from scipy import stats

from tsvision.timeline.order import Order, numbers, order_frames

BESIDE = 4  # frames before, and as many after, through which the line is laid
FEWEST = 4  # of them; where there are fewer nothing is said
AROUND = 6  # frames to either side whose distances from their lines tell the scatter
OWN = 0.5  # of a frame's own distance: the scatter is at least that
OF_NORMAL = 1.4826  # sd of a normal distribution in its median absolute deviations


def with_scatter(frames: pd.DataFrame) -> pd.DataFrame:
    """`frames` (FrameRow's columns) with the `_sd` of diameters, pitch, angles, turns and string
    seen widened by their scatter about their neighbours, coils and straight bundles apart. Frames
    without a value, and recordings of few frames, stay as they are."""
    order = order_frames(frames)
    coiled = np.isfinite(numbers(frames, "coil_pitch_mm"))
    d, p = numbers(frames, "diameter_px"), numbers(frames, "pitch_px")
    fitted = np.isfinite(p) & np.isfinite(d)
    d_share = _share(d, fitted, coiled, order)
    p_share = _share(1.0 / p, fitted, coiled, order)
    tan_share = np.hypot(d_share, p_share)  # of both angles: tan beta = pi D / p
    shares = {
        "diameter_px": d_share,
        "diameter_mm": d_share,
        "midspan_diameter_mm": d_share,
        "pitch_px": p_share,
        "pitch_mm": p_share,
        "helix_angle_rad": _angle_share(numbers(frames, "helix_angle_rad"), tan_share),
        "lay_angle_rad": _angle_share(numbers(frames, "lay_angle_rad"), tan_share),
    }
    for name in ("turns_seen", "string_length_mm"):
        value = numbers(frames, name)
        shares[name] = _share(value, np.isfinite(value), coiled, order)
    wider = {
        f"{name}_sd": np.hypot(numbers(frames, f"{name}_sd"), numbers(frames, name) * share)
        for name, share in shares.items()
        if name in frames and f"{name}_sd" in frames
    }
    return frames.assign(**wider)


def _angle_share(angle: np.ndarray, tan_share: np.ndarray) -> np.ndarray:
    """(n,) share of angles by the share of their tangents: a steep angle moves less with its
    tangent than a flat one, so that beta and the lay angle each have their own."""
    return np.asarray(np.abs(np.cos(angle) * np.sinc(angle / np.pi)) * tan_share)


def _share(value: np.ndarray, known: np.ndarray, coiled: np.ndarray, order: Order) -> np.ndarray:
    """(n,) of every value, by how much it and its neighbours scatter; 0 where it is not known."""
    share = np.zeros(value.size)
    known = known & (value != 0.0)
    for kind in (known & coiled, known & ~coiled):
        rows = order.rows[kind[order.rows]]
        share[rows] = scatter(value[rows], _abscissa(order, kind)) / np.abs(value[rows])
    return share


def scatter(value: np.ndarray, at: np.ndarray) -> np.ndarray:
    """(n,) by how much values (n,) in the order taken scatter about their neighbours' line over
    `at` (n,): sd around each, 0 where that cannot be told. Assumes that they change steadily."""
    off = np.abs(_off_line(value, at))
    spread = np.zeros(value.size)
    for i in range(value.size):
        around = off[max(0, i - AROUND) : i + AROUND + 1]
        around = around[np.isfinite(around)]
        if around.size >= FEWEST:
            spread[i] = OF_NORMAL * float(np.median(around))
    return np.fmax(spread, OWN * off)


def _off_line(value: np.ndarray, at: np.ndarray) -> np.ndarray:
    """(n,) distance from the line through the neighbours (Theil-Sen: one neighbour far off does not
    turn it); NaN where there are too few."""
    off = np.full(value.size, np.nan)
    for i in range(value.size):
        beside = np.r_[max(0, i - BESIDE) : i, i + 1 : min(value.size, i + BESIDE + 1)]
        if beside.size < FEWEST:
            continue
        x, y = at[beside] - at[i], value[beside]
        steady = np.ptp(x) == 0.0  # turns that stand still have no slope
        there = np.median(y) if steady else stats.theilslopes(y, x, method="joint").intercept
        off[i] = value[i] - there
    return off


def _abscissa(order: Order, chosen: np.ndarray) -> np.ndarray:
    """Turns of the chosen rows in the order taken; the order itself where turns are not known."""
    kept = chosen[order.rows]
    return order.wind[kept] if order.known.all() else np.flatnonzero(kept).astype(float)
