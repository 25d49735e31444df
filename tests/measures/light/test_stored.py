"""Edges told by their colour, as real JPEG files give them back."""

from __future__ import annotations

import cv2
import numpy as np

from tests.measures.tube import offsets_for
from tests.srgb import encode
from tsvision.images.linear import decoded
from tsvision.measures.edges.shading import (
    LAMPS_RAD,
    TEMPLATE_GRID_PX,
    EdgeProfile,
    Shading,
)
from tsvision.measures.light.shading_fit import fit_shading
from tsvision.measures.light.stored import Stored, coded, without

RHO_PX, BLUR_PX, FINE = 9.0, 0.7, 16
SEEN_PX = float(np.hypot(BLUR_PX, 12.0**-0.5))  # with what a pixel averages over
GREEN, DIM_GREY = np.array([0.05, 0.30, 0.08]), np.full(3, 0.05)  # linear, blue, green, red
AMBIENT, FRONT = 0.5, 0.5  # of the light on the core
WEIGHTS = np.array([-0.4, 0.3, -0.3])
STORED = Stored(GREEN, DIM_GREY, WEIGHTS, float("nan"), SEEN_PX)
SHADING = Shading(
    RHO_PX,
    SEEN_PX,
    STORED.black + (1.0 - STORED.black) * AMBIENT,
    (1.0 - STORED.black) * FRONT * np.isclose(LAMPS_RAD, 0.0),
)


def edge_picture() -> tuple[np.ndarray, np.ndarray]:
    """Linear light (H, W, 3) of a lit green tube's edge before dim grey, blurred, and the edge's
    row (W,) in every column: two px of slope show all places that an edge may have."""
    height, width = 48, 512
    edge = 20.0 + 2.0 * np.arange(width) / width
    inside = (np.arange(height * FINE) + 0.5)[:, None] / FINE - 0.5 - edge
    x = np.clip(1.0 - inside / RHO_PX, -1.0, 1.0)
    light = AMBIENT + FRONT * np.sqrt(1.0 - x * x)
    sharp = np.where((inside > 0.0)[..., None], light[..., None] * GREEN, DIM_GREY)
    coarse = sharp.reshape(height, FINE, width, 3).mean(axis=1)
    return cv2.GaussianBlur(coarse, (0, 0), BLUR_PX), edge


def through_a_file(linear: np.ndarray) -> np.ndarray:
    """The same light as a JPEG gives it back."""
    ok, file = cv2.imencode(".jpg", encode(linear), [cv2.IMWRITE_JPEG_QUALITY, 95])
    assert ok
    return decoded(cv2.imdecode(file, cv2.IMREAD_COLOR) / 255.0, float("nan"))


def mean_edge(linear: np.ndarray, edge: np.ndarray, t_px: np.ndarray) -> np.ndarray:
    """Contrast by WEIGHTS at t_px inside the edge, each value over one px, core 1."""
    signal = (linear - DIM_GREY) @ WEIGHTS / STORED.contrast
    rows = np.arange(signal.shape[0])
    over = np.linspace(-0.5, 0.5, 21)[:-1] + 0.025
    columns = range(16, signal.shape[1] - 16)
    each = [np.interp(edge[c] + t_px[:, None] + over, rows, signal[:, c]) for c in columns]
    return np.asarray(np.mean(each, axis=(0, 2)))


def test_what_a_file_adds_to_an_edge_is_known() -> None:
    """The difference that a JPEG makes. Measured: to a quarter of it, rms; the rest is what the
    file's quality adds, and pixels, which are no Gaussian."""
    linear, edge = edge_picture()
    t_px = offsets_for(RHO_PX)
    added = mean_edge(through_a_file(linear), edge, t_px) - mean_edge(linear, edge, t_px)
    known = np.interp(t_px, TEMPLATE_GRID_PX, coded(STORED, SHADING))
    assert np.abs(added).max() > 0.05
    assert np.sqrt(np.mean((known - added) ** 2)) < 0.3 * np.sqrt(np.mean(added**2))


def test_an_edge_told_by_its_colour_lies_further_in_until_that_is_undone() -> None:
    """A width 0.61 px too small as read, and 0.02 px once light has been fitted thrice."""
    linear, edge = edge_picture()
    t_px = offsets_for(RHO_PX)
    value = mean_edge(through_a_file(linear), edge, t_px)
    seen = EdgeProfile(t_px, value, np.full(t_px.size, 0.002))
    *light, as_read = fit_shading((seen, seen), RHO_PX, STORED.black)
    for _ in range(3):
        pair = [without(seen, coded(STORED, side)) for side in light]
        *light, undone = fit_shading((pair[0], pair[1]), RHO_PX, STORED.black, SEEN_PX)
    assert float(as_read.sum()) > 0.4
    assert abs(float(undone.sum())) < 0.1
