"""Frames of one recording that are not equally sharp."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from tests.measures.pictures import picture
from tests.measures.tube import offsets_for, seen, tube
from tests.srgb import encode
from tsvision.images.linear import to_linear
from tsvision.measures.light.blur import agree_better, alike, blur_of, undecided
from tsvision.measures.light.shading_fit import fit_shading
from tsvision.measures.recording import Measurer
from tsvision.records import Frame, Rig, Strings, View

DIAMETER_PX = 24.0


def smeared_across(picture: np.ndarray, length_px: int) -> np.ndarray:
    """A shake along the columns, in linear light."""
    light = cv2.blur(to_linear(picture, float("nan")), (1, length_px))
    return encode(light)


@pytest.mark.parametrize("blur_px", [0.6, 1.4, 2.2, 3.0])
def test_blur_is_read_under_known_light(blur_px: float) -> None:
    """Light learnt at a blur of 0.9 px, an edge that the silhouette misplaces by 0.3 px."""
    rho = 6.0
    offsets = offsets_for(rho)
    learnt = seen(rho, tube(offsets, rho, 0.9, 0.4, 0.5, 0.2), offsets)
    upper, lower, _ = fit_shading((learnt, learnt), rho)
    blurred = seen(rho, tube(offsets + 0.3, rho, blur_px, 0.4, 0.5, 0.2), offsets)
    assert blur_of((blurred, blurred), (upper, lower)) == pytest.approx(blur_px, rel=0.1)


def test_frames_count_as_alike_within_what_a_blur_is_read_to() -> None:
    assert alike(np.array([0.85, 0.95, np.nan, 1.0]))
    assert alike(np.array([1.4]))
    assert not alike(np.array([0.9, 0.95, 1.6]))


def test_blurs_are_the_frames_where_diameters_agree_better_under_them() -> None:
    """Readings of two path-traced films: one shaken by 2 to 8 px, one held still whose first frame,
    with few turns, is lit otherwise."""
    shaken = np.array([0.69, 0.98, 1.21, 1.01])
    held = np.array([1.03, 0.85, 0.85, 0.74, 0.83])
    assert undecided(shaken) and undecided(held)
    assert agree_better(
        np.array([20.86, 21.46, 22.04, 21.45]), np.array([21.82, 21.87, 21.79, 21.81])
    )
    assert not agree_better(
        np.array([79.79, 79.79, 79.77, 79.78, 79.77]), np.array([79.44, 79.81, 79.79, 80.02, 79.82])
    )
    # Frames may agree by chance: they have to agree much better.
    chance = np.array([30.8, 31.0, 31.2, 31.5]), np.array([30.95, 31.1, 31.25, 31.4])
    assert not agree_better(*chance)
    assert not agree_better(np.array([27.2, np.nan]), np.array([np.nan, 27.2]))  # of no frame both
    assert agree_better(np.array([27.2, 28.0, 28.2]), np.array([27.2, 27.5, 27.5]))
    assert not agree_better(np.array([27.2, 28.0, 28.2]), np.array([27.2, 27.9, 27.8]))
    assert not undecided(np.array([0.85, 0.9, np.nan, 0.87, 0.88]))  # equally sharp in any case
    assert not undecided(np.array([0.85, 1.3, np.nan]))  # too few to tell


@pytest.mark.slow
def test_a_smeared_frame_is_as_thick_as_the_sharp_ones() -> None:
    """Every second picture smeared over 6 px across the axis: read as sharp as the others, those
    came out 2.2 px thick. Now 0.4 px thin, for a smear is no Gaussian, and their uncertainty says
    so."""
    film = [
        picture(
            diameter_px=DIAMETER_PX, dark_on_bright=False, light_deg=50.0, tilt_deg=1.0,
            phase_rad=0.9 * k, seed=k,
        )
        for k in range(4)
    ]  # fmt: skip
    for k in (1, 3):
        film[k] = smeared_across(film[k], 6)
    measurer = Measurer(Rig(strings=Strings(count=2), view=View(separator_side="none")))
    measurer.prime(film)
    rows = [measurer.measure(Frame(k, f"{k}.png", p)).row for k, p in enumerate(film)]
    assert measurer.looks is not None and not measurer.looks.steady
    sharp, smeared = (np.array([r.diameter_px for r in rows[k::2]]) for k in (0, 1))
    assert rows[1].blur_px > 1.3 * rows[0].blur_px
    assert smeared == pytest.approx(sharp.mean(), abs=0.45)
    assert abs(smeared - sharp.mean()).max() < 1.96 * min(r.diameter_px_sd for r in rows[1::2])

    measurer.looks = replace(measurer.looks, steady=True)
    taken_for_sharp = measurer.measure(Frame(1, "1.png", film[1])).row.diameter_px
    assert abs(taken_for_sharp - sharp.mean()) > 4.0 * abs(smeared - sharp.mean()).max()
