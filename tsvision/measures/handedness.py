"""S or Z, from the slope of the strands' ridges. The silhouette alone cannot tell."""

from __future__ import annotations

import cv2
import numpy as np

from tsvision.images.percentiles import median, row_medians
from tsvision.measures.edges.cut import Cut
from tsvision.measures.edges.edges import Edges

SOME = 3  # columns apart that tell typical light and shading
# Smoothed so far along ridges and across them, of the half width, and by so much at least.
ALONG, ACROSS, LEAST_SMOOTH_PX = 0.6, 0.15, 0.8
PAIRED_FROM_PX = 4.0  # of smoothing along: pairs of columns tell as much as each
# Stretches as long as the rows used are high, and times its standard error that their mean slope
# is: neighbours are not independent. Bare silhouettes show up to 4, strands in light 6 to 90.
FEWEST_STRETCHES = 4
UNLIKE, ALIKE = 4.0, 7.0


def ridge_slope(light: np.ndarray, centre_row: np.ndarray, half_width_px: float) -> float:
    """Sign-bearing slope of the ridges in a strip, in -1..1: sum(gx gy) over sum of both squares.

    light (R, M) linear light, or (R, M, 3), of whose channels each shows the borders between other
    colours and counts by how much of them it shows; centre_row (M,) the bundle's middle, along
    which the strip is straightened so that coiling does not count; half_width_px: rows used on
    either side (keep inside the edges, whose own slope alternates). Its logarithm is taken, so that
    lit and shadow side weigh alike and backlit strands, dark all over, still show their ridges.
    Ridges run along the bundle more than across: noise is smoothed away along it. What stretches of
    the bundle do not show alike counts as less, down to 0: an outline's notches, noise.
    Positive: ridges run from lower to higher n with growing s.
    """
    product, total = _products(light, centre_row, half_width_px)
    whole = float(total.sum())
    if not whole > 0:
        return 0.0
    size = max(round(2.0 * half_width_px * total.size / light.shape[1]), 1)
    # A ridge along n = m s has gx = -m gy: the product's sign is opposite to the slope's.
    return -2.0 * float(product.sum()) / whole * _alike(product, total, size)


def _products(
    light: np.ndarray, centre_row: np.ndarray, half_width_px: float
) -> tuple[np.ndarray, np.ndarray]:
    """gx gy and the sum of both squares, each summed across the strip, along it (K,); of all
    channels."""
    channels = [light] if light.ndim == 2 else [light[..., c] for c in range(light.shape[2])]
    each = [_of_channel(np.asarray(one), centre_row, half_width_px) for one in channels]
    product, total = (np.sum(part, axis=0) for part in zip(*each, strict=True))
    return product, total


def _of_channel(
    light: np.ndarray, centre_row: np.ndarray, half_width_px: float
) -> tuple[np.ndarray, np.ndarray]:
    """The same of one channel (R, M)."""
    reach = max(int(half_width_px), 2)
    along_px, across_px = (max(share * half_width_px, LEAST_SMOOTH_PX) for share in (ALONG, ACROSS))
    step = 2 if along_px > PAIRED_FROM_PX and light.shape[1] > 2 else 1
    count = light.shape[1] // step
    middle = centre_row[: count * step].reshape(count, step).mean(axis=1)
    rows = (middle + np.arange(-reach, reach + 1)[:, None]).astype(np.float32)
    columns = np.empty_like(rows)
    columns[:] = np.arange(count)
    first = min(max(int(rows.min()) - 1, 0), light.shape[0] - 1)
    last = max(int(rows.max()) + 3, first + 1)
    filled = light[first:last, : count * step].astype(np.float32)
    cv2.patchNaNs(filled, 0.0)
    if step > 1:
        halved = (count, filled.shape[0])
        filled = cv2.resize(filled, halved, interpolation=cv2.INTER_AREA).astype(np.float32)
    straight = cv2.remap(
        filled,
        columns,
        rows - np.float32(first),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )
    floor = max(0.02 * median(np.abs(straight[:, ::SOME])), 1e-4)
    log = np.log(np.maximum(straight, floor))
    log = cv2.GaussianBlur(log, (0, 0), sigmaX=along_px / step, sigmaY=across_px)
    gx = (0.5 / step) * (log[1:-1, 2:] - log[1:-1, :-2])
    gy = 0.5 * (log[2:, 1:-1] - log[:-2, 1:-1])
    # The mean shading across carries no slope.
    gy = gy - row_medians(gy[:, ::SOME])[:, None].astype(np.float32)
    return (gx * gy).sum(axis=0), (gx * gx + gy * gy).sum(axis=0)


def slope_between(cut: Cut, edges: Edges, diameter_px: float) -> float:
    """`ridge_slope` along the middle between a bundle's edges; NaN where less than D of them is
    known."""
    known = (edges.upper_weight > 0) & (edges.lower_weight > 0)
    if known.sum() < diameter_px:
        return float("nan")
    s = np.arange(known.size)
    index = np.flatnonzero(known)
    first, last = index[0], index[-1] + 1
    centre = np.interp(s, index, 0.5 * (edges.upper_px + edges.lower_px)[index])[first:last]
    light = cut.light if cut.colours is None else cut.colours
    return ridge_slope(light[:, first:last], centre + cut.half_px, 0.25 * diameter_px)


def _alike(product: np.ndarray, total: np.ndarray, size: int) -> float:
    """0 to 1: whether ridges slope alike in stretches of so many columns. An outline's do not,
    where blur draws it in: it falls and rises; nor does noise. Of few stretches nothing can be
    said."""
    count = total.size // size
    if count < FEWEST_STRETCHES:
        return 1.0
    part = slice(0, count * size)
    of_each = total[part].reshape(count, size).sum(axis=1)
    slopes = product[part].reshape(count, size).sum(axis=1) / np.maximum(of_each, 1e-12)
    error = float(slopes.std(ddof=1)) / np.sqrt(count)
    times = abs(float(slopes.mean())) / max(error, 1e-12)
    return float(np.clip((times - UNLIKE) / (ALIKE - UNLIKE), 0.0, 1.0))


def handedness_of(slope: float) -> str:
    """Z for a right-handed helix, S for a left-handed one.

    The strip shows s to the right and n downwards, like the picture. Held upright, the visible
    front of a right-handed helix rises to the right like the middle stroke of a Z; laid over to the
    right it falls to the right, so that n grows with s: a positive slope.
    """
    return "Z" if slope > 0 else "S"
