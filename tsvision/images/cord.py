"""What of a picture is cord, and the way along its middle from end to end.

The cord stands off its ground by colour where it is coloured, else by lightness; in a small
picture its piece on the straight axis is followed along the middle, a geodesic between the two ends
that lie farthest apart.
"""

from __future__ import annotations

import cv2
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from tsvision.images.colour import Ground, colour_contrast
from tsvision.images.ground import above_ground
from tsvision.images.linear import project
from tsvision.images.sight import Sight

LEVEL = 0.35  # share of the core's contrast at which strings begin
FIBRE = 0.35  # of the width: what is thinner is no strand of the core
EDGE = 0.5  # share of the core's contrast at which the cord ends at full size, fuzz left out
WIDE_PX = 31  # discs above are drawn by distances, which cost the same for all
SHORTEST_WIDTHS = 4.0  # of a cord that can be followed


def cord_contrast(
    values: np.ndarray, weights: np.ndarray, ground: Ground | None, width_px: float
) -> np.ndarray:
    """Contrast (R, M) of a strip's linear light (R, M) or (R, M, 3), core about 1."""
    if ground is not None:
        return colour_contrast(values, ground)
    signal = project(values, weights)
    contrast = above_ground(signal, 0.9 * width_px)
    half = values.shape[0] // 2
    core = contrast[np.abs(np.arange(-half, half + 1)) <= max(0.2 * width_px, 1.0)]
    level = float(np.nanmedian(core)) if np.isfinite(core).any() else 1.0
    return contrast / (level if abs(level) > 1e-6 else 1e-6)


def core_mask(contrast: np.ndarray, width_px: float, coloured: bool) -> np.ndarray:
    """Where the cord's core lies in a strip's contrast: uint8 0/1, same shape.

    Fibres thinner than a third of the width, and meshes of them, are opened away before the
    valleys between strands are closed: closing first would fill the meshes. Plies of two colours
    are unlike the ground by unlike amounts, so that colour counts from a lower level on.
    """
    mask = (contrast > (LEVEL if coloured else EDGE)).astype(np.uint8)
    size = max(int(FIBRE * width_px), 1) | 1
    if size > WIDE_PX:
        radius = size // 2
        opened = _grown(_shrunk(mask, radius), radius)
        return _shrunk(_grown(opened, radius), radius)
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    opened = cv2.morphologyEx(mask, cv2.MORPH_OPEN, disc)
    return cv2.morphologyEx(opened, cv2.MORPH_CLOSE, disc)


def _shrunk(mask: np.ndarray, radius: int) -> np.ndarray:
    """What of a mask lies farther than a radius from all that is not it: erosion by a disc, at a
    cost that does not grow with the disc."""
    far = cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_PRECISE) > radius
    return far.astype(np.uint8)


def _grown(mask: np.ndarray, radius: int) -> np.ndarray:
    """Dilation by the same disc."""
    return 1 - _shrunk(1 - mask, radius)


def cord_map(
    linear: np.ndarray, line: np.ndarray, sight: Sight, factor: float, ground: Ground | None
) -> np.ndarray:
    """How much each px of a small picture looks like the cord, core about 1."""
    if ground is not None:
        return colour_contrast(linear, ground).astype(np.float32)
    signal = cv2.GaussianBlur(sight.sense * project(linear, sight.signal.weights), (0, 0), 0.8)
    size = int(2.0 * sight.width_px * factor) | 1
    stands_out = cv2.morphologyEx(signal, cv2.MORPH_TOPHAT, np.ones((size, size), np.uint8))
    h, w = signal.shape
    at = np.round(line).astype(int)
    at = at[(at[:, 0] >= 0) & (at[:, 0] < w) & (at[:, 1] >= 0) & (at[:, 1] < h)]
    # The line may lie on a bowed cord for a fifth of its way only.
    along = np.percentile(stands_out[at[:, 1], at[:, 0]], [80.0, 95.0]) if len(at) else (0.0, 0.0)
    level = float(max(along[0], 0.8 * along[1]))
    return stands_out / max(level, 1e-6)


def follow(cord: np.ndarray, line: np.ndarray, anywhere: bool) -> tuple[np.ndarray, float] | None:
    """Points (K, 2) along the middle of the map's best piece from end to end, and its width.

    anywhere: the piece need not lie on the line (coloured strings, whose shadow may have been
    taken for them)."""
    over = (cord > LEVEL).astype(np.uint8)
    mask: np.ndarray = cv2.morphologyEx(over, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    piece = _piece(mask, line, anywhere)
    if piece is None:
        return None
    depth = _depth(piece)
    width = 2.0 * float(np.percentile(depth[piece > 0], 90.0))
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (max(int(0.45 * width), 1) | 1,) * 2)
    piece = _piece(
        cv2.morphologyEx(_bordered(piece), cv2.MORPH_OPEN, kernel)[8:-8, 8:-8], line, anywhere
    )
    if piece is None:
        return None
    depth = _depth(piece)
    ys, xs = np.nonzero(piece)
    path = _longest_path(xs, ys, depth[ys, xs], piece.shape)
    width = 2.0 * float(np.median(depth[ys[path], xs[path]]))
    if len(path) < SHORTEST_WIDTHS * width:
        return None
    return np.stack([xs[path], ys[path]], axis=1).astype(float), width


def _bordered(piece: np.ndarray) -> np.ndarray:
    """The piece carried on beyond the picture's border, where it is cut and does not end."""
    return cv2.copyMakeBorder(piece, 8, 8, 8, 8, cv2.BORDER_REPLICATE)


def _depth(piece: np.ndarray) -> np.ndarray:
    """Distance of every px to the piece's edge; the picture's border is no edge."""
    return cv2.distanceTransform(_bordered(piece), cv2.DIST_L2, 5)[8:-8, 8:-8]


def _piece(mask: np.ndarray, line: np.ndarray, anywhere: bool) -> np.ndarray | None:
    """The connected piece, holes filled, that lies most along the line; None without any."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    if count < 2:
        return None
    near = np.zeros(mask.shape, np.uint8)
    cv2.polylines(near, [np.round(line).astype(np.int32)], False, 1, 3)
    on_line = np.bincount(labels[near > 0], minlength=count).astype(float)
    long = np.hypot(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT])
    score = on_line + 0.5 * long * ((on_line > 0) | anywhere)
    score[0] = 0.0
    best = int(np.argmax(score))
    if score[best] <= 0:
        return None
    piece = (labels == best).astype(np.uint8)
    outlines = cv2.findContours(piece, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
    return cv2.drawContours(np.zeros_like(piece), outlines, -1, 1, cv2.FILLED)


def _longest_path(
    xs: np.ndarray, ys: np.ndarray, depth: np.ndarray, shape: tuple[int, ...]
) -> np.ndarray:
    """Indices of the px along the cheapest way between the two ends farthest apart, where px near
    the edge cost more (a geodesic along the middle)."""
    number = np.full(shape, -1)
    number[ys, xs] = np.arange(xs.size)
    middle = float(np.percentile(depth, 90.0))
    cost = (middle / np.maximum(depth, 0.5)) ** 2
    rows, columns, costs = [], [], []
    for dx, dy in ((1, 0), (0, 1), (1, 1), (1, -1)):
        x, y = xs + dx, ys + dy
        inside = (x < shape[1]) & (y >= 0) & (y < shape[0])
        a = np.flatnonzero(inside)
        b = number[y[a], x[a]]
        a, b = a[b >= 0], b[b >= 0]
        rows.append(a)
        columns.append(b)
        costs.append(np.hypot(dx, dy) * 0.5 * (cost[a] + cost[b]))
    a, b, c = (np.concatenate(v) for v in (rows, columns, costs))
    graph = coo_matrix((c, (a, b)), shape=(xs.size, xs.size)).tocsr()
    far = dijkstra(graph, directed=False, indices=int(np.argmax(depth)))
    one = int(np.argmax(np.where(np.isfinite(far), far, -1.0)))
    far, before = dijkstra(graph, directed=False, indices=one, return_predecessors=True)
    at = int(np.argmax(np.where(np.isfinite(far), far, -1.0)))
    path = []
    while at >= 0:
        path.append(at)
        at = int(before[at])
    return np.array(path)
