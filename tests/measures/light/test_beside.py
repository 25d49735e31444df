"""Edges told by a hue, found with what brightness shows of them."""

from __future__ import annotations

import numpy as np
import pytest

from tests.measures.tube import edge_model_sd_px, offsets_for, px_tube, seen
from tsvision.measures.edges.shading import TEMPLATE_GRID_PX, averaged_blur_px, mirror_shape
from tsvision.measures.light.beside import Beside
from tsvision.measures.light.shading_fit import fit_shading

RHO_PX, SHARP_PX, SOFT_PX = 8.0, 0.7, 1.9
OUT_PX = 0.6  # how far outside the edges assumed the true ones lie
SPREAD_PX = 0.35  # farther out that a file spreads the colour
# Ambient light, a lamp's on the core, and how much of that falls on the upper limb
LIGHTS = [(0.5, 0.45, 0.1), (0.25, 0.6, 0.5)]
AT_PX = offsets_for(RHO_PX)


def both_sides(light: tuple[float, float, float], blur_px: float, out_px: float) -> np.ndarray:
    """Light (2, K) of the upper and the lower side, so blurred, whose edges are so far outside."""
    ambient, front, aside = light
    sides = (px_tube(AT_PX + out_px, RHO_PX, blur_px, ambient, front, w * aside) for w in (1, -1))
    return np.stack(list(sides))


def brightness(light: tuple[float, float, float], lit: float, mirrored: float) -> np.ndarray:
    """Less the ground's and in units of it (2, K), of strands so much as bright whose limbs mirror
    a share of the ground."""
    hidden = px_tube(AT_PX + OUT_PX, RHO_PX, SHARP_PX, 1.0, 0.0, 0.0, 0.0)
    rim = mirror_shape(RHO_PX, averaged_blur_px(SHARP_PX))
    rim = np.interp(AT_PX + OUT_PX, TEMPLATE_GRID_PX, rim)
    return lit * both_sides(light, SHARP_PX, OUT_PX) - hidden + mirrored * rim


@pytest.mark.parametrize("mirrored", [0.0, 0.4])
@pytest.mark.parametrize("lit", [0.5, 1.0, 1.6])
@pytest.mark.parametrize("light", LIGHTS)
def test_brightness_tells_where_a_spread_hue_ends(
    light: tuple[float, float, float], lit: float, mirrored: float
) -> None:
    """Strands of half, as much and more of the ground's brightness: the colour alone makes them
    0.7 px too thick, with brightness they are off by 0.22 at most, whichever limbs it shows."""
    colour = both_sides(light, SOFT_PX, OUT_PX + SPREAD_PX)
    upper, lower = (seen(RHO_PX, side, AT_PX) for side in colour)
    bright = [seen(RHO_PX, side, AT_PX) for side in brightness(light, lit, mirrored)]
    *_, alone = fit_shading((upper, lower), RHO_PX, blur_start_px=SOFT_PX)
    beside = Beside((bright[0], bright[1]), SHARP_PX)
    *sides, places = fit_shading((upper, lower), RHO_PX, blur_start_px=SOFT_PX, beside=beside)
    wide_px = -float(alone.sum()) - 2.0 * OUT_PX
    left_px = abs(-float(places.sum()) - 2.0 * OUT_PX)
    assert wide_px > 0.6
    assert left_px < 0.25
    assert left_px < 2.0 * edge_model_sd_px((sides[0], sides[1]))


@pytest.mark.parametrize("light", LIGHTS)
def test_brightness_tells_how_sharp_the_picture_is(light: tuple[float, float, float]) -> None:
    """Where that is not known: strands half as bright as the ground. A tenth of a px less of blur
    makes them 0.4 px thicker."""
    colour = both_sides(light, SOFT_PX, OUT_PX + SPREAD_PX)
    upper, lower = (seen(RHO_PX, side, AT_PX) for side in colour)
    bright = [seen(RHO_PX, side, AT_PX) for side in brightness(light, 0.5, 0.0)]
    unknown = Beside((bright[0], bright[1]), sought=True)
    *_, places = fit_shading((upper, lower), RHO_PX, blur_start_px=SOFT_PX, beside=unknown)
    assert -float(places.sum()) == pytest.approx(2.0 * OUT_PX, abs=0.25)


@pytest.mark.parametrize("turn_deg", [20.0, 45.0, 70.0])
def test_a_gleam_without_colour_is_not_taken_for_light(turn_deg: float) -> None:
    """Strands that mirror a lamp in white, as bright again as their own light. Measured: 0.16 px
    off at most, at an sd of 0.4 to 0.6; 0.8 to 2.0 px thin where that passed for their own."""
    turn = np.deg2rad(turn_deg)
    light = (0.3, 0.7 * float(np.cos(turn)), 0.7 * float(np.sin(turn)))
    upper, lower = (seen(RHO_PX, side, AT_PX) for side in both_sides(light, SOFT_PX, OUT_PX))
    phi = np.arcsin(np.clip(1.0 - (AT_PX + OUT_PX) / RHO_PX, -1.0, 1.0))
    bright = []
    for matt, sign in zip(brightness(light, 2.0, 0.0), (1.0, -1.0), strict=True):
        gleam = np.maximum(np.cos(phi - 0.5 * sign * turn), 0.0) ** 32
        bright.append(seen(RHO_PX, matt + 2.0 * gleam * (AT_PX > -OUT_PX), AT_PX))
    beside = Beside((bright[0], bright[1]), SHARP_PX)
    *sides, places = fit_shading((upper, lower), RHO_PX, 0.0, SOFT_PX, beside=beside, by_hue=True)
    off_px = abs(-float(places.sum()) - 2.0 * OUT_PX)
    assert off_px < min(0.4, edge_model_sd_px((sides[0], sides[1])))
