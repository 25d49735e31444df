"""Edges of a shaded, blurred tube drawn from the formula: where the model must find them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d, uniform_filter1d

from tests.measures.tube import FINE, ROUGH, edge_model_sd_px, offsets_for, px_tube, seen
from tsvision.measures.edges.shading import (
    LAMPS_RAD,
    EdgeProfile,
)
from tsvision.measures.light.shading_fit import fit_shading
from tsvision.measures.light.shading_lamp import fit_lamp


@pytest.mark.parametrize("rho_px", [6.0, 10.0, 15.0])
@pytest.mark.parametrize("sense", [1, -1])
def test_a_plain_step_is_placed_exactly(rho_px: float, sense: int) -> None:
    """Silhouette lighting: 0.4 px off before, under 0.03 px after. Bright strings without any ramp
    are unlikely light, hence 0.15 there."""
    offsets = offsets_for(rho_px)
    loss = 0.0 if sense < 0 else ROUGH
    profile = seen(rho_px, px_tube(offsets + 0.4, rho_px, 1.0, 1.0, 0.0, 0.0, loss), offsets)
    black = 1.03 if sense < 0 else 0.0
    *sides, place = fit_shading((profile, profile), rho_px, black)
    np.testing.assert_allclose(place, -0.4, atol=0.03 if sense < 0 else 0.15)
    assert sides[0].blur_px == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("angle_deg", [0.0, 30.0, 60.0])
@pytest.mark.parametrize("rho_px", [6.0, 10.0, 15.0])
def test_the_edge_of_a_lit_tube_lies_outside_its_half_level(
    rho_px: float, angle_deg: float
) -> None:
    """Ambient 0.3, one lamp: the half level is 0.2 to 1.5 px inside on the mean of both sides; the
    model, to which this light is known, is where the edge is."""
    offsets = offsets_for(rho_px)
    turn = np.deg2rad(angle_deg)
    sides = [
        px_tube(offsets, rho_px, 1.0, 0.3, 0.7 * np.cos(turn), sign * 0.7 * np.sin(turn))
        for sign in (1.0, -1.0)
    ]
    half = [float(np.interp(0.5 * p.max(), p, offsets)) for p in sides]
    upper, lower, place = fit_shading(
        (seen(rho_px, sides[0], offsets), seen(rho_px, sides[1], offsets)), rho_px
    )
    error = abs(float(place.sum()))
    assert sum(half) > 0.4
    assert error < 0.03
    assert error < 3.0 * edge_model_sd_px((upper, lower))


@pytest.mark.parametrize("loss", [0.0, 0.5])
@pytest.mark.parametrize("rho_px", [5.0, 10.0, 15.0])
def test_matt_or_shiny_strings_are_off_by_no_more_than_is_said(rho_px: float, loss: float) -> None:
    """Surfaces that are not the assumed one. Measured: the width 0.07 to 0.13 px off."""
    offsets = offsets_for(rho_px)
    upper, lower = (
        px_tube(offsets, rho_px, 1.0, 0.3, 0.6, sign * 0.35, loss) for sign in (1.0, -1.0)
    )
    *sides, place = fit_shading(
        (seen(rho_px, upper, offsets), seen(rho_px, lower, offsets)), rho_px
    )
    assert abs(float(place.sum())) < min(0.2, 2.0 * edge_model_sd_px((sides[0], sides[1])))


@pytest.mark.parametrize("angle_deg", [0.0, 30.0])
@pytest.mark.parametrize("rho_px", [5.0, 12.0])
def test_what_is_told_by_hue_and_darkness_stands_out_at_a_dark_limb(
    rho_px: float, angle_deg: float
) -> None:
    """Red strings on grey, told by being redder or darker: without light they show 0.65 of the
    core's contrast. The edge (measured: 0.001 px) and what of the contrast is no lamp's (0.04)."""
    offsets, black = offsets_for(rho_px), 0.65
    turn, loss = np.deg2rad(angle_deg), ROUGH * (1.0 - black)
    b, c = 0.8 * np.cos(turn), 0.8 * np.sin(turn)
    upper, lower = (
        seen(
            rho_px,
            black * px_tube(offsets, rho_px, 1.0, 1.0, 0.0, 0.0, loss)
            + (1.0 - black) * px_tube(offsets, rho_px, 1.0, 0.2, b, sign * c, loss),
            offsets,
        )
        for sign in (1.0, -1.0)
    )
    *sides, place = fit_shading((upper, lower), rho_px, black)
    assert abs(float(place.sum())) < 0.05
    assert sides[0].ambient == pytest.approx(black + 0.35 * 0.2, abs=0.05)


def fresnel(facing: np.ndarray) -> np.ndarray:
    """What a smooth dielectric of index 1.5 mirrors of unpolarised light, beyond what it does at
    right angles."""
    index = 1.5
    inside = np.sqrt(1.0 - (1.0 - facing**2) / index**2)
    across = ((facing - index * inside) / (facing + index * inside)) ** 2
    along = ((inside - index * facing) / (inside + index * facing)) ** 2
    return 0.5 * (across + along) - 0.04


@pytest.mark.parametrize(("rho_px", "blur_px"), [(8.0, 0.6), (8.0, 1.0), (14.0, 1.5)])
@pytest.mark.parametrize("share", [0.0, 0.9])
def test_an_outline_may_mirror_the_screen_behind_it(
    rho_px: float, blur_px: float, share: float
) -> None:
    """Dark strands before a lit screen, whose limbs mirror a share of what a smooth dielectric
    does. Taken for plain outlines they are 0.3 to 0.5 px thin where that is nine tenths; measured:
    0.06 px at most."""
    offsets, black = offsets_for(rho_px), 1.04
    t = np.arange(-14.0, 30.0, FINE)
    facing = np.sqrt(1.0 - np.clip(1.0 - t / rho_px, -1.0, 1.0) ** 2)
    inside = np.where(np.abs(t) < 0.5 * FINE, 0.5, t > 0.0)
    sharp = black * inside * (1.0 - share * fresnel(facing))
    soft = gaussian_filter1d(uniform_filter1d(sharp, round(1.0 / FINE)), blur_px / FINE)
    profile = seen(rho_px, np.interp(offsets, t, soft), offsets)
    *sides, place = fit_shading((profile, profile), rho_px, black, blur_px)
    assert abs(float(place.sum())) < min(0.1, 2.0 * edge_model_sd_px((sides[0], sides[1])))


@pytest.mark.parametrize("ground", [0.15, 0.35])
@pytest.mark.parametrize(("rho_px", "blur_px"), [(6.0, 0.8), (6.0, 1.5), (10.0, 1.5)])
def test_a_limb_may_be_darker_than_its_ground(rho_px: float, blur_px: float, ground: float) -> None:
    """A lamp 40 degrees aside that leaves one limb black before a lit ground. Taken to end where it
    falls to the ground's light, the strand is 1.3 to 2.5 px thin; now up to 0.05 px off."""
    offsets, turn = offsets_for(rho_px), np.deg2rad(40.0)
    body = px_tube(offsets, rho_px, blur_px, 1.0, 0.0, 0.0, 0.0)
    b, c = 0.95 * np.cos(turn), 0.95 * np.sin(turn)
    upper, lower = (
        seen(
            rho_px,
            (1.0 + ground) * px_tube(offsets, rho_px, blur_px, 0.05, b, sign * c) - ground * body,
            offsets,
        )
        for sign in (1.0, -1.0)
    )
    _, _, as_black = fit_shading((upper, lower), rho_px, 0.0, blur_px)
    *sides, places = fit_shading((upper, lower), rho_px, -ground, blur_px)
    assert abs(float(as_black.sum())) > 1.0
    assert abs(float(places.sum())) < min(0.1, edge_model_sd_px((sides[0], sides[1])))


@pytest.mark.parametrize("rho_px", [8.0, 13.0])
def test_a_dark_limb_far_outside_is_sought_where_strands_are_thick_too(rho_px: float) -> None:
    """A lamp 50 degrees wide, 40 aside, before a lit ground: the dark limb is a thirtieth darker
    than that, 1.5 px outside the edge assumed, and what is lit ends 0.2 radii further in. Both may
    be the edge. Where strands were thick no start lay as far out: 1.7 and 2.2 px thin, said to be
    sure to 0.4."""
    offsets, ground, out_px = offsets_for(rho_px), 0.15, 1.5
    sides = []
    for sign in (1.0, -1.0):
        at_px = offsets + (out_px if sign < 0.0 else 0.0)
        lit = np.mean(
            [
                px_tube(at_px, rho_px, 0.8, 0.0, 0.95 * np.cos(turn), sign * 0.95 * np.sin(turn))
                for turn in np.deg2rad(40.0 + np.linspace(-25.0, 25.0, 11))
            ],
            axis=0,
        )
        around = px_tube(at_px, rho_px, 0.8, 0.1, 0.0, 0.0)
        body = px_tube(at_px, rho_px, 0.8, 1.0, 0.0, 0.0, 0.0)
        sides.append(seen(rho_px, (1.0 + ground) * (lit + around) - ground * body, offsets))
    *found, places = fit_shading((sides[0], sides[1]), rho_px, -ground, 0.8)
    error = abs(float(places.sum()) + out_px)
    assert error < 2.0 * edge_model_sd_px((found[0], found[1]))


@pytest.mark.parametrize("angle_deg", [-75.0, -45.0, 0.0, 30.0, 60.0, 80.0])
@pytest.mark.parametrize("rho_px", [4.0, 6.0, 15.0])
def test_one_lamp_is_found_for_what_it_is(rho_px: float, angle_deg: float) -> None:
    """What was drawn by one lamp: its direction, and the edges where they are."""
    offsets = offsets_for(rho_px)
    turn = np.deg2rad(angle_deg)
    sides = [
        seen(
            rho_px,
            px_tube(offsets + 0.2, rho_px, 1.0, 0.3, 0.7 * np.cos(turn), sign * 0.7 * np.sin(turn)),
            offsets,
        )
        for sign in (1.0, -1.0)
    ]
    sd = tuple(s.sd for s in sides)
    lamp = fit_lamp((sides[0], sides[1]), sd, rho_px, 1.3)
    np.testing.assert_allclose(lamp.places_px, -0.2, atol=0.05)
    assert np.rad2deg(lamp.theta_rad) == pytest.approx(angle_deg, abs=3.0)
    assert lamp.blur_px == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize("brighter_side", [1.0, -1.0])
@pytest.mark.parametrize("angle_deg", [15.0, 29.0])
@pytest.mark.parametrize("rho_px", [7.0, 11.0])
def test_a_sky_beside_the_lamp_does_not_move_the_edge(
    rho_px: float, angle_deg: float, brighter_side: float
) -> None:
    """Light from all around that comes twice as much from one side, the lamp's or the other. What
    is told of one lamp alone is 0.1 to 0.75 px off in width."""
    offsets, turn = offsets_for(rho_px), np.deg2rad(angle_deg)
    sides = []
    for sign in (1.0, -1.0):
        lit = px_tube(
            offsets, rho_px, 1.0, 0.0, 0.75 * np.cos(turn), sign * 0.75 * np.sin(turn), ROUGH
        )
        around = px_tube(offsets, rho_px, 1.0, 0.18, 0.0, 0.0, ROUGH)
        aside = px_tube(offsets, rho_px, 1.0, 0.0, 0.0, 0.06, ROUGH)
        sides.append(seen(rho_px, lit + around + sign * brighter_side * aside, offsets))
    lamp = fit_lamp((sides[0], sides[1]), tuple(s.sd for s in sides), rho_px, 1.0)
    assert abs(float(lamp.places_px.sum())) < 0.1


@pytest.mark.parametrize(("rho_px", "angle_deg"), [(8.0, 30.0), (15.0, 0.0), (15.0, 30.0)])
def test_neighbours_that_take_light_do_not_move_the_edge(rho_px: float, angle_deg: float) -> None:
    """A strand that loses 30 % of its light towards the groove, along a smoothstep. Measured: 0.02
    to 0.04 px; 0.1 to 0.4 px too far in where no groove is allowed for."""
    offsets = offsets_for(rho_px)
    turn = np.deg2rad(angle_deg)
    x = np.clip((offsets / rho_px - 0.2) / 0.8, 0.0, 1.0)
    left = 1.0 - 0.3 * x * x * (3.0 - 2.0 * x)
    sides = [
        seen(
            rho_px,
            left
            * px_tube(offsets, rho_px, 1.0, 0.3, 0.7 * np.cos(turn), sign * 0.7 * np.sin(turn)),
            offsets,
        )
        for sign in (1.0, -1.0)
    ]
    *_, place = fit_shading((sides[0], sides[1]), rho_px, grooved=True)
    *_, ungrooved = fit_shading((sides[0], sides[1]), rho_px)
    assert abs(float(place.sum())) < 0.08
    assert float(ungrooved.sum()) > float(place.sum()) + 0.08


def gleaming(
    rho_px: float,
    blur_px: float,
    angle_deg: float,
    light: tuple[float, float, float],
    ground: float = 0.0,
) -> tuple[EdgeProfile, EdgeProfile]:
    """Upper and lower limb before a ground so bright, under so much light from all around, of a
    lamp, and of the lamp's mirror image as Phong (1975) draws it."""
    offsets, turn = offsets_for(rho_px), np.deg2rad(angle_deg)
    around, lamp, mirrored = light
    t = np.arange(-14.0, 30.0, FINE)
    inside = np.where(np.abs(t) < 0.5 * FINE, 0.5, t > 0.0)
    phi = np.arcsin(np.clip(1.0 - t / rho_px, -1.0, 1.0))
    sides = []
    for sign in (1.0, -1.0):
        lit = np.maximum(np.cos(phi - sign * turn), 0.0)
        gleam = np.maximum(np.cos(2.0 * phi - sign * turn), 0.0) ** 8
        sent = around + lamp * lit + mirrored * gleam
        sharp = inside * ((1.0 + ground) * sent - ground)
        soft = gaussian_filter1d(uniform_filter1d(sharp, round(1.0 / FINE)), blur_px / FINE)
        sides.append(seen(rho_px, np.interp(offsets, t, soft), offsets))
    return sides[0], sides[1]


@pytest.mark.parametrize("angle_deg", [10.0, 20.0])
@pytest.mark.parametrize("rho_px", [8.0, 14.0])
def test_limbs_darker_than_a_ground_nearly_as_bright_are_told_surely(
    rho_px: float, angle_deg: float
) -> None:
    """Limbs of 0.3 of the strands' light before a ground of 0.45. Measured: 0.13 px off at most, at
    an sd of 0.3 to 0.7; 0.1 to 0.4 px thin at one of 1 to 1.3 when limbs darker than the ground and
    such as are not counted by no more than the ratio of their misfits."""
    upper, lower = gleaming(rho_px, 1.0, angle_deg, (0.3, 0.7, 0.4), ground=0.8)
    *shades, places = fit_shading((upper, lower), rho_px, -0.8, 1.0)
    assert abs(float(places.sum())) < 0.2
    assert edge_model_sd_px((shades[0], shades[1])) < 0.8


@pytest.mark.parametrize("angle_deg", [0.0, 30.0, 40.0])
@pytest.mark.parametrize(("rho_px", "blur_px"), [(5.0, 1.3), (8.0, 1.3)])
def test_strands_that_gleam_are_as_thick_as_matt_ones(
    rho_px: float, blur_px: float, angle_deg: float
) -> None:
    """A lamp mirrored as Phong (1975) draws it, whose lobe is not the model's. Measured: the width
    0.26 px off at most; taken for matt, up to 0.8 either way."""
    upper, lower = gleaming(rho_px, blur_px, angle_deg, (0.35, 0.6, 0.6))
    *shades, places = fit_shading((upper, lower), rho_px, blur_start_px=blur_px)
    off_px = abs(float(places.sum()))
    assert off_px < min(0.3, 2.0 * edge_model_sd_px((shades[0], shades[1])))


def test_the_light_found_is_the_light_that_shone() -> None:
    """A lamp 45 degrees to one side shines on the upper limb and leaves the lower in the dark."""
    offsets = offsets_for(12.0)
    turn = np.deg2rad(45.0)
    sides = [
        px_tube(offsets, 12.0, 1.0, 0.2, 0.8 * np.cos(turn), sign * 0.8 * np.sin(turn))
        for sign in (1.0, -1.0)
    ]
    upper, lower, _ = fit_shading(
        (seen(12.0, sides[0], offsets), seen(12.0, sides[1], offsets)), 12.0
    )
    brightest = [float(np.rad2deg(LAMPS_RAD[np.argmax(shade.lamps)])) for shade in (upper, lower)]
    np.testing.assert_allclose(brightest, [45.0, -45.0], atol=25.0)
    assert (upper.lamps >= 0.0).all() and (lower.lamps >= 0.0).all()


@pytest.mark.parametrize("slope", [-0.004, 0.004])
def test_ground_that_slopes_beside_a_dark_limb_is_not_taken_for_the_limb(slope: float) -> None:
    """A strand lit from 60 degrees aside, whose far limb sends a twentieth of the core's light. The
    slope, a shadow's border, may move the width by less than its sd, and by 0.2 px."""
    rho_px, turn = 6.0, np.deg2rad(60.0)
    offsets = offsets_for(rho_px)
    lit, dark = (
        px_tube(offsets, rho_px, 1.0, 0.05, 0.9 * np.cos(turn), sign * 0.9 * np.sin(turn))
        for sign in (1.0, -1.0)
    )
    widths = []
    for ground in (0.0, slope):
        beside = dark + ground * np.minimum(offsets, 0.0)
        upper, lower, places = fit_shading(
            (seen(rho_px, lit, offsets), seen(rho_px, beside, offsets)), rho_px
        )
        widths.append(float(places.sum()))
    moved = abs(widths[1] - widths[0])
    assert moved < min(0.2, edge_model_sd_px((upper, lower)))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_lamp_far_aside_is_found_with_its_dark_limb_far_out(sign: float) -> None:
    """The outline taken for the lit part's: the dark limb lies 2.4 px beyond it. From edges where
    they were found alone every start ended at four times the misfit, 0.7 px further in."""
    rho_px, turn = 5.0, sign * np.deg2rad(-64.0)
    offsets, out = offsets_for(rho_px), (2.4, 0.0) if sign > 0 else (0.0, 2.4)
    sides = [
        seen(
            rho_px,
            px_tube(
                offsets + away, rho_px, 0.8, 0.02, 0.95 * np.cos(turn), way * 0.95 * np.sin(turn)
            ),
            offsets,
        )
        for away, way in zip(out, (1.0, -1.0), strict=True)
    ]
    lamp = fit_lamp((sides[0], sides[1]), tuple(s.sd for s in sides), rho_px, 1.0)
    np.testing.assert_allclose(lamp.places_px, -np.array(out), atol=0.4)
