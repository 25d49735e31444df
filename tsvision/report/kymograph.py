"""Envelope against turns and position: every frame's E(s) side by side, as one small picture."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import cv2
import numpy as np
import pandas as pd

MAX_COLUMNS, BINS = 480, 220


@dataclass(frozen=True)
class Kymograph:
    """`png`: columns run with x from `x_low` to `x_high`, rows with s from `s_high` (top) down.

    `value_low`, `value_high` are the ends of the colour scale, in the unit of the profiles.
    """

    png: bytes
    x_low: float
    x_high: float
    s_low: float
    s_high: float
    value_low: float
    value_high: float


def kymograph(
    x: np.ndarray, frames: np.ndarray, chunks: Callable[[], Iterable[pd.DataFrame]]
) -> Kymograph | None:
    """`x` (K,) rises and tells where each of `frames` (K,) stands; `chunks()` goes through tables
    of frame, s, value, twice. None when there is no profile or only one place along x.

    Each frame fills x from half-way to the frame before it to half-way to the next.
    """
    good = np.isfinite(x)
    x, frames = x[good], frames[good]
    if len(x) < 2 or x[0] == x[-1]:
        return None
    ends = [(c["s"].min(), c["s"].max()) for c in chunks() if c["s"].notna().any()]
    s_low, s_high = (min(e[0] for e in ends), max(e[1] for e in ends)) if ends else (0.0, 0.0)
    if s_low >= s_high:
        return None
    columns = _columns(frames, chunks(), float(s_low), float(s_high))
    if not np.isfinite(columns).any():
        return None
    middles = (x[1:] + x[:-1]) / 2
    places = np.linspace(x[0], x[-1], min(MAX_COLUMNS, max(2, 12 * len(x))))
    values = columns[np.searchsorted(middles, places)].T[::-1]
    low, high = (float(v) for v in np.nanpercentile(columns, (1, 99.8)))
    png = _coloured(values, low, high)
    return Kymograph(png, float(x[0]), float(x[-1]), float(s_low), float(s_high), low, high)


def colour_bar() -> bytes:
    """The colour scale as a PNG of 128 × 1 px, low to high."""
    return _coloured(np.linspace(0.0, 1.0, 128)[None], 0.0, 1.0)


def _columns(
    frames: np.ndarray, chunks: Iterable[pd.DataFrame], s_low: float, s_high: float
) -> np.ndarray:
    """(K, BINS) mean value in each bin of s, NaN where a frame shows nothing."""
    where = {int(frame): i for i, frame in enumerate(frames)}
    size = len(frames) * BINS
    count, total = np.zeros(size), np.zeros(size)
    for chunk in chunks:
        row = chunk["frame"].map(where).to_numpy(float)
        s, value = chunk["s"].to_numpy(float), chunk["value"].to_numpy(float)
        kept = np.isfinite(row) & np.isfinite(s) & np.isfinite(value)
        bins = ((s[kept] - s_low) / (s_high - s_low) * BINS).astype(int).clip(0, BINS - 1)
        flat = row[kept].astype(int) * BINS + bins
        count += np.bincount(flat, minlength=size)
        total += np.bincount(flat, weights=value[kept], minlength=size)
    with np.errstate(invalid="ignore"):
        return (total / count).reshape(len(frames), BINS)


def _coloured(values: np.ndarray, low: float, high: float) -> bytes:
    """Cividis, even for colour-blind eyes; NaN is transparent. PNG bytes."""
    unknown = ~np.isfinite(values)
    span = max(high - low, 1e-12)
    grey = ((np.where(unknown, low, values) - low) / span).clip(0, 1)
    picture = cv2.applyColorMap((grey * 255 + 0.5).astype(np.uint8), cv2.COLORMAP_CIVIDIS)
    picture = np.dstack([picture, np.where(unknown, 0, 255).astype(np.uint8)])
    _, data = cv2.imencode(".png", picture)
    return data.tobytes()
