"""What the runs of strings in a mask's columns say: axis, width, legs, extent."""

from __future__ import annotations

import warnings

import numba
import numpy as np

from tsvision.images.strip import Axis, straight_axis

WIDEST = 2.5  # times a bundle's width, beyond which a run is hardware's: it coils up to 2.2 times


def single_columns(mask: np.ndarray, half: int, width: float) -> np.ndarray:
    """Columns (M,) bool with one run of about the bundle's width on the axis."""
    low, high = _scan(mask, half, 0.25 * width)[:2]
    size, centre = high - low + 1, 0.5 * (low + high)
    with np.errstate(invalid="ignore"):
        return (np.abs(centre) < 0.3 * width) & (size > 0.35 * width) & (size < 1.7 * width)


@numba.njit(cache=True)
def _scan(mask, half, near):  # pragma: no cover - compiled
    """Runs of mask nearest to the axis: out (6, M) = central low, high, then the nearest run
    below (low, high) and above (low, high) where no run comes within `near` of n = 0."""
    rows, columns = mask.shape
    out = np.full((6, columns), np.nan)
    for c in range(columns):
        r = 0
        best = 1e9
        while r < rows:
            if mask[r, c] == 0:
                r += 1
                continue
            first = r
            while r < rows and mask[r, c] > 0:
                r += 1
            low, high = first - half, r - 1 - half
            distance = 0.0 if low <= 0 <= high else float(min(abs(low), abs(high)))
            if distance <= near and distance < best:
                best = distance
                out[0, c], out[1, c] = low, high
            if high < -near:
                out[2, c], out[3, c] = low, high
            elif low > near and np.isnan(out[4, c]):
                out[4, c], out[5, c] = low, high
        if not np.isnan(out[0, c]):
            out[2:, c] = np.nan
    return out


def leg_columns(mask: np.ndarray, half: int, width: float) -> np.ndarray:
    """Columns (M,) bool with a thin run on either side of the axis and a gap between."""
    _, _, below_low, below_high, above_low, above_high = _scan(mask, half, 0.1 * width)
    with np.errstate(invalid="ignore"):
        thin = np.maximum(below_high - below_low, above_high - above_low) < 1.2 * width
        alike = np.abs(below_high + above_low) < 0.35 * (above_low - below_high) + 0.3 * width
    return thin & alike


def leg_spread(masks: list[np.ndarray], half: int, width: float) -> tuple[float, float]:
    """How many leg columns lie before and after the middle of those with one run on the axis, no
    wider than a bundle: behind a plate that stands out as well lie the legs of hardly a turn."""
    inner = np.abs(np.arange(-half, half + 1)) < 0.2 * width
    near = far = 0.0
    for mask in masks:
        legs = leg_columns(mask, half, width)
        low, high = _scan(mask, half, 0.25 * width)[:2]
        with np.errstate(invalid="ignore"):
            single = np.flatnonzero(
                ((mask[inner] > 0).mean(0) > 0.8) & (high - low < WIDEST * width)
            )
        if single.size:
            s = np.arange(mask.shape[1])
            near += float(legs[s < np.median(single)].sum())
            far += float(legs[s > np.median(single)].sum())
    return near, far


def refine(axis: Axis, masks: list[np.ndarray], half: int, width: float) -> tuple[Axis, float]:
    """Robust line through the runs' middles of all frames, and the bundle's typical outer width.

    Where two legs run beside the axis their midpoint counts: it lies on the axis too.
    """
    s_all, c_all, w_all = [], [], []
    for mask in masks:
        low, high, below_low, below_high, above_low, above_high = _scan(mask, half, 0.25 * width)
        size, centre = high - low + 1, 0.5 * (low + high)
        with np.errstate(invalid="ignore"):
            ok = (size > 0.25 * width) & (size < 1.8 * width) & (np.abs(centre) < 0.5 * width)
            thin = np.maximum(below_high - below_low, above_high - above_low) < 1.2 * width
        between = 0.25 * (below_low + below_high + above_low + above_high)
        legs = np.isfinite(between) & thin
        s_all += [np.flatnonzero(ok).astype(float), np.flatnonzero(legs).astype(float)]
        c_all += [centre[ok], between[legs]]
        w_all.append(size[ok])
    s, c, w = (np.concatenate(v) for v in (s_all, c_all, w_all))
    if s.size < 20 or w.size < 5:
        return axis, width
    typical = float(np.percentile(w, 75))
    weight = np.ones_like(s)
    line = np.zeros(2)
    for _ in range(12):
        design = np.stack([s, np.ones_like(s)], 1) * weight[:, None]
        line, *_ = np.linalg.lstsq(design, c * weight, rcond=None)
        r = (c - s * line[0] - line[1]) / (0.3 * typical)
        weight = 1.0 / (1.0 + r * r)
    ends = np.array([0.0, axis.length_px])
    u = axis.tangent(np.array(0.0))
    normal = np.array([-u[1], u[0]])
    points = axis.at(ends) + (ends * line[0] + line[1])[:, None] * normal
    return straight_axis(points[0], points[1]), float(np.clip(typical, 3.0, 1.5 * width))


def extent_of(masks: list[np.ndarray], half: int, width: float) -> tuple[float, float, float]:
    """(start, end, connector) along s: where strings may lie, and the connector's face if seen.

    The connector is wide, and it stands still while the strands' edges swing from frame to frame.
    """
    columns = masks[0].shape[1]
    lows, highs = zip(*(_scan(m, half, 0.25 * width)[:2] for m in masks), strict=True)
    low, high = np.array(lows), np.array(highs)
    size = high - low + 1
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        typical = np.nanmedian(size, axis=0)
        swing = np.nanstd(low, axis=0) + np.nanstd(high, axis=0)
    seen = np.isfinite(size).mean(axis=0) > 0.5
    wide = seen & (typical > 1.6 * width)
    if len(masks) >= 3:
        wide &= swing < 0.12 * width
    connector = float("nan")
    end = float(columns - 1)
    # Walk inwards from the far end: the connector reaches from some column to the picture's edge.
    hold = max(int(0.3 * width), 3)
    s = columns - 1
    while s > 0 and not seen[s]:
        s -= 1
    if s > hold and wide[max(s - 3 * hold, 0) : s + 1].mean() > 0.5:
        face = s
        misses = 0
        while face > 0 and misses <= hold:
            face -= 1
            misses = 0 if wide[face] else misses + 1
        connector = float(face + misses)
        end = connector
    else:
        end = float(s)
    first = int(np.argmax(seen)) if seen.any() else 0
    return float(first), end, connector
