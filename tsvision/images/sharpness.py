"""How sharp a picture is, by the straight edges of whatever else it shows.

Plates, connectors and holes end in straight edges: steps of brightness under the blur that the
strings are seen by as well, without the light that falls off along a strand's limb and passes for
more of it. Each is fitted as ISO 12233 does its slanted edge: every pixel counts by its distance
from a line, nothing is interpolated. Edges that are rounded, out of focus or drawn out by the
camera's shake are blurred by more, none by less: the sharpest tell.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.optimize import least_squares
from scipy.special import ndtr

from tsvision.images.linear import LUMA_BGR, linear_signal

REACH_PX = 7.0  # to either side of an edge
SHORTEST_PX, MOST_EDGES = 14.0, 120  # of a picture, the longest
END_PX = 2.0  # of either end, that is left out
BLUR_RANGE_PX = (0.3, 4.0)
FULL, MOST_FULL = 0.985, 0.01  # of a code, what the sensor hardly told apart, and of the pixels
# Of the step: what the mean across an edge is off a blurred one, and what light may change beside
# it, a px. Of the picture's light: a step itself. Of its blur: how well that is told.
PLAIN, EVEN, LEAST_STEP, TOLD = 0.02, 0.15, 0.08, 0.06
FEWEST_EDGES = 3
SHARPEST = 0.1  # of all edges' length
BIN_PX = 0.5
DARKEST, BRIGHTEST = 0.5, 99.5  # percentiles of light, between which a picture's lies


@dataclass(frozen=True)
class StepEdge:
    """A straight edge: blur_px and its sd; step: of light, off: of the mean across it (rms), and
    slope: what light changes a px beside it, both in units of the step; length_px."""

    blur_px: float
    blur_sd_px: float
    step: float
    off: float
    slope: float
    length_px: float

    @property
    def is_plain(self) -> bool:
        """Whether it is a step between two even sides, and its blur is told."""
        told = self.blur_sd_px < TOLD * self.blur_px
        return bool(told and self.off < PLAIN and self.slope < EVEN)


def sharpness_px(pictures: list[np.ndarray], gamma: float = float("nan")) -> float:
    """The sd of the blur of some pictures (H, W) or (H, W, 3), 8 or 16 bit, in px, by their
    brightness; NaN where too few straight edges are seen. gamma as `to_linear` takes it."""
    edges = [edge for picture in pictures for edge in step_edges(picture, gamma)]
    if len(edges) < FEWEST_EDGES:
        return float("nan")
    blurs = np.array([edge.blur_px for edge in edges])
    lengths = np.array([edge.length_px for edge in edges])
    return float(np.quantile(blurs, SHARPEST, weights=lengths, method="inverted_cdf"))


def step_edges(picture: np.ndarray, gamma: float = float("nan")) -> list[StepEdge]:
    """The plain steps of brightness along straight lines of a picture."""
    light = linear_signal(picture, LUMA_BGR, gamma)
    darkest, brightest = np.percentile(light, [DARKEST, BRIGHTEST])
    if not brightest > darkest:
        return []
    full = _is_full(picture)
    edges = (_fitted(light, full, line) for line in _lines(light, float(brightest)))
    least = LEAST_STEP * float(brightest - darkest)
    return [edge for edge in edges if edge is not None and edge.is_plain and edge.step > least]


def _is_full(picture: np.ndarray) -> np.ndarray:
    """Where the sensor was full in any channel, or beside (H, W)."""
    most = picture if picture.ndim == 2 else picture.max(axis=2)
    full = (most >= FULL * np.iinfo(picture.dtype).max).astype(np.uint8)
    return np.asarray(cv2.dilate(full, np.ones((5, 5), np.uint8)))


def _lines(light: np.ndarray, brightest: float) -> np.ndarray:
    """Ends (K, 4) of the straight edges, x and y of either, in px; the longest first."""
    grey = np.sqrt(np.clip(light / brightest, 0.0, 1.0))
    smooth = cv2.GaussianBlur((255.0 * grey).astype(np.uint8), (0, 0), 0.8)
    found = cv2.createLineSegmentDetector(cv2.LSD_REFINE_STD, scale=1.0).detect(smooth)[0]
    if found is None:
        return np.empty((0, 4))
    lines = found.reshape(-1, 4).astype(float)
    length = np.hypot(*(lines[:, 2:] - lines[:, :2]).T)
    longest = np.argsort(-length, kind="stable")[:MOST_EDGES]
    return np.asarray(lines[longest][length[longest] > SHORTEST_PX])


def _fitted(light: np.ndarray, full: np.ndarray, line: np.ndarray) -> StepEdge | None:
    """The blurred step along a line; None at the picture's border, or where the sensor is full."""
    start, end = line[:2], line[2:]
    length = float(np.hypot(*(end - start)))
    along = (end - start) / length
    low = np.floor(np.minimum(start, end) - REACH_PX).astype(int)
    high = np.ceil(np.maximum(start, end) + REACH_PX).astype(int) + 1
    if (low < 0).any() or high[0] > light.shape[1] or high[1] > light.shape[0]:
        return None
    box = (slice(low[1], high[1]), slice(low[0], high[0]))
    y, x = np.mgrid[box]
    t = (x - start[0]) * along[0] + (y - start[1]) * along[1] - 0.5 * length
    n = (y - start[1]) * along[0] - (x - start[0]) * along[1]
    near = (np.abs(n) < REACH_PX) & (np.abs(t) < 0.5 * length - END_PX)
    if full[box][near].mean() > MOST_FULL:
        return None
    n, t, seen = n[near], t[near] / length, light[box][near].astype(float)

    def solved(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Level, step, both sides' slopes and what light changes along; and all residuals."""
        inside = n - q[0] - q[1] * length * t
        sides = np.minimum(inside, 0.0), np.maximum(inside, 0.0)
        design = np.stack([np.ones_like(n), ndtr(inside / q[2]), *sides, t], axis=1)
        levels, *_ = np.linalg.lstsq(design, seen, rcond=None)
        return levels, design @ levels - seen

    fit = least_squares(
        lambda q: solved(q)[1],
        [0.0, 0.0, 1.0],
        bounds=([-3.0, -0.2, BLUR_RANGE_PX[0]], [3.0, 0.2, BLUR_RANGE_PX[1]]),
        x_scale=[0.3, 0.02, 0.3],
        diff_step=1e-3,
        max_nfev=30,
    )
    levels, off = solved(fit.x)
    step = abs(float(levels[1]))
    if step == 0.0:
        return None
    covariance = np.linalg.pinv(fit.jac.T @ fit.jac) * off.var()
    bins = np.floor((n - fit.x[0] - fit.x[1] * length * t) / BIN_PX).astype(int)
    bins -= bins.min()
    each = np.bincount(bins)
    mean = np.bincount(bins, off) / np.maximum(each, 1)
    return StepEdge(
        float(fit.x[2]),
        float(np.sqrt(max(covariance[2, 2], 0.0))),
        step,
        float(np.sqrt(np.sum(each * mean**2) / each.sum())) / step,
        float(np.abs(levels[2:4]).sum()) / step,
        length,
    )
