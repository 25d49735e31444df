"""Edges of colours, told by them or by their luma, as real JPEG files give them back."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from tests.measures.tube import offsets_for
from tests.srgb import encode
from tsvision.images.linear import decoded
from tsvision.measures.edges.shading import (
    LAMPS_RAD,
    TEMPLATE_GRID_PX,
    EdgeProfile,
    Shading,
)
from tsvision.measures.light.beside import Beside
from tsvision.measures.light.shading_fit import fit_shading
from tsvision.measures.light.stored import (
    Stored,
    StoredLuma,
    coded,
    luma_added,
    luma_in,
    surface_light,
    without,
)

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
RED, WHITE = np.array([0.05, 0.05, 0.5]), np.full(3, 0.7)
YELLOW, BLUE = np.array([0.05, 0.5, 0.6]), np.array([0.3, 0.1, 0.06])


def edge_picture(
    strand: np.ndarray = GREEN, ground: np.ndarray = DIM_GREY
) -> tuple[np.ndarray, np.ndarray]:
    """Linear light (H, W, 3) of a lit tube's edge before its ground, blurred, and the edge's row
    (W,) in every column: two px of slope show all places that an edge may have."""
    height, width = 48, 512
    edge = 20.0 + 2.0 * np.arange(width) / width
    inside = (np.arange(height * FINE) + 0.5)[:, None] / FINE - 0.5 - edge
    x = np.clip(1.0 - inside / RHO_PX, -1.0, 1.0)
    light = AMBIENT + FRONT * np.sqrt(1.0 - x * x)
    sharp = np.where((inside > 0.0)[..., None], light[..., None] * strand, ground)
    coarse = sharp.reshape(height, FINE, width, 3).mean(axis=1)
    return cv2.GaussianBlur(coarse, (0, 0), BLUR_PX), edge


def through_a_file(linear: np.ndarray, read: int = cv2.IMREAD_COLOR) -> np.ndarray:
    """The same light as a JPEG gives it back: in colour, or its luma decoded as if it were grey."""
    ok, file = cv2.imencode(".jpg", encode(linear), [cv2.IMWRITE_JPEG_QUALITY, 95])
    assert ok
    return decoded(cv2.imdecode(file, read) / 255.0, float("nan"))


def mean_edge(linear: np.ndarray, edge: np.ndarray, t_px: np.ndarray) -> np.ndarray:
    """Contrast by WEIGHTS of green before grey at t_px inside the edge, each value over one px,
    core 1."""
    return over_px((linear - DIM_GREY) @ WEIGHTS / STORED.contrast, edge, t_px)


def over_px(signal: np.ndarray, edge: np.ndarray, t_px: np.ndarray) -> np.ndarray:
    """Mean of a signal (H, W) at t_px inside the edge, each value over one px."""
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


@pytest.mark.parametrize(
    ("strand", "ground", "off_px"),
    [(RED, DIM_GREY, -1.0), (YELLOW, BLUE, -0.4), (RED, WHITE, 0.07)],
)
def test_an_edge_told_by_the_luma_of_colours_lies_elsewhere_until_that_is_undone(
    strand: np.ndarray, ground: np.ndarray, off_px: float
) -> None:
    """Red before dim grey: 1.19 px too thick as read, and 0.01 px too thin once light has been
    fitted thrice; yellow before blue 0.46 px too thick; red before white 0.09 px too thin."""
    stored = StoredLuma(strand, ground, float("nan"))
    level, beside = stored.levels
    linear, edge = edge_picture(strand, ground)
    t_px = offsets_for(RHO_PX)
    luma = through_a_file(linear, cv2.IMREAD_GRAYSCALE)
    value = over_px((luma - beside) / (level - beside), edge, t_px)
    seen = EdgeProfile(t_px, value, np.full(t_px.size, 0.002))
    black = -beside / (level - beside)
    *light, as_read = fit_shading((seen, seen), RHO_PX, black)
    for _ in range(3):
        pair = [without(seen, coded(stored, side)) for side in light]
        *light, undone = fit_shading((pair[0], pair[1]), RHO_PX, black, SEEN_PX)
    assert np.sign(off_px) * float(as_read.sum()) >= abs(off_px)
    assert abs(float(undone.sum())) < 0.06


def test_luma_beside_a_hue_is_read_as_of_colours() -> None:
    """Red before dim grey, whose hue is spread by 1.5 px: 1.01 px too thick with luma as of greys
    beside it, and 0.37 px once that is undone."""
    stored = StoredLuma(RED, DIM_GREY, float("nan"))
    _, ground = stored.levels
    linear, edge = edge_picture(RED, DIM_GREY)
    t_px = offsets_for(RHO_PX)
    weights = np.array([-0.5, -0.5, 1.0])
    hue = cv2.GaussianBlur(linear, (0, 0), 1.5) @ weights / float(weights @ RED)
    colour = EdgeProfile(t_px, over_px(hue, edge, t_px), np.full(t_px.size, 0.002))
    luma = through_a_file(linear, cv2.IMREAD_GRAYSCALE)
    value = over_px((luma - ground) / ground, edge, t_px)
    seen = EdgeProfile(t_px, value, np.full(t_px.size, 0.002))
    soft_px = float(np.hypot(SEEN_PX, 1.5))
    bright, wider_px = seen, []
    for _ in range(4):
        beside = Beside((bright, bright), SEEN_PX)
        upper, _, places = fit_shading(
            (colour, colour), RHO_PX, 0.0, soft_px, beside=beside, by_hue=True
        )
        wider_px.append(-float(places.sum()))
        added = luma_added(stored, surface_light(upper, 0.0), SEEN_PX)
        bright = without(seen, added / ground)
    assert wider_px[0] > 0.8
    assert abs(wider_px[-1]) < 0.5


def test_taking_off_leaves_a_sunk_edge_sunk() -> None:
    t_px = offsets_for(RHO_PX)
    sunk = EdgeProfile(t_px, np.ones(t_px.size), np.ones(t_px.size), sunk=True)
    assert without(sunk, np.zeros(TEMPLATE_GRID_PX.size)).sunk


def cut_of(
    colours: tuple[np.ndarray, np.ndarray] | None, in_colour: bool = False
) -> SimpleNamespace:
    """All that is asked of a cut and its sight: a core 0.1 brighter than its ground."""
    signal = SimpleNamespace(in_colour=in_colour)
    sight = SimpleNamespace(signal=signal, colours=colours, sense=1, gamma=float("nan"))
    return SimpleNamespace(sight=sight, core_level=0.1)


def test_luma_is_undone_of_colours_alone() -> None:
    """Not of greys, nor where a hue tells strings or no colours are known; and of strands as bright
    as their cores are."""
    stored = luma_in([cut_of((RED, DIM_GREY))])  # type: ignore[list-item]
    assert stored is not None
    assert stored.levels[0] - stored.levels[1] == pytest.approx(0.1, abs=0.01)
    assert luma_in([cut_of((WHITE, DIM_GREY))]) is None  # type: ignore[list-item]
    assert luma_in([cut_of((RED, DIM_GREY), in_colour=True)]) is None  # type: ignore[list-item]
    assert luma_in([cut_of(None)]) is None  # type: ignore[list-item]


def test_what_storing_adds_goes_with_the_step() -> None:
    """Lamps' ramps each have a depth of their own in every column: with them it would be anything,
    and edges lay 0.1 px from where the mean edge had them, round after round."""
    added = np.exp(-0.5 * TEMPLATE_GRID_PX**2)
    plain, stored = SHADING, replace(SHADING, added=added)
    assert np.allclose(stored.step - plain.step, added)
    assert np.allclose(stored.template - stored.step, plain.template - plain.step)
