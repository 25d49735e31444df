"""The bundle among what is not one: its own shadow, a cable, strands of two colours.

Drawn films of eight frames, small enough to check by eye: two strands that wind about a known
line, more turns in every frame, 16 px wide at their widest.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from tsvision.images.axis import Ridge, find_channels, find_ridges, off_surroundings, unshaded
from tsvision.images.candidates import (
    Trial,
    are_legs,
    could_cast,
    line_of_ridge,
    put_to_trial,
    swallows,
    within_view,
)
from tsvision.images.curve import find_curve
from tsvision.images.linear import to_linear
from tsvision.images.masks import masks_of
from tsvision.images.motion import motion_picture, moving_share
from tsvision.images.runs import leg_spread
from tsvision.images.seen import Seen, seen_by_hue, seen_in
from tsvision.images.shadow import find_shadow
from tsvision.images.sight import Sight, Told, _follow, _sight_along, find_sight
from tsvision.images.signal import LUMA, Signal, Way
from tsvision.images.strip import Axis, Strip, cut_strip, straight_axis
from tsvision.images.telling import find_hue

WIDTH_PX, HEIGHT_PX = 480, 270
START, END = np.array([60.0, 120.0]), np.array([420.0, 150.0])  # of the bundle's axis
BUNDLE_PX = 16.0


def bundle_film(
    ground: tuple[float, float, float],
    strands: tuple[tuple[float, float, float], ...],
    shadow: float = 0.0,
    cable: bool = False,
    spigot: bool = False,
) -> list[np.ndarray]:
    """Pictures (linear BGR colours in, 8-bit sRGB out) of strands 8 px thick on a ground."""
    random = np.random.default_rng(7)
    rows, columns = np.mgrid[0:HEIGHT_PX, 0:WIDTH_PX].astype(float)
    u = (END - START) / np.hypot(*(END - START))
    s = (columns - START[0]) * u[0] + (rows - START[1]) * u[1]
    n = -(columns - START[0]) * u[1] + (rows - START[1]) * u[0]
    inside = (s > 0) & (s < np.hypot(*(END - START)))
    pictures = []
    for turns in np.linspace(5.0, 12.0, 8):
        picture = np.ones((HEIGHT_PX, WIDTH_PX, 3)) * np.array(ground)
        cast = inside * np.exp(-0.5 * ((n - 14.0) / 6.0) ** 2)
        picture *= (1.0 - shadow * cast)[..., None]
        if cable:
            picture[np.abs(rows - 40.0 - 0.1 * columns) < 9] = 0.03
        for k, colour in enumerate(strands * (2 // len(strands))):
            phase = 2 * np.pi * turns * s / 360.0 + np.pi * k
            half = np.abs(n - 4.0 * np.cos(phase)) < 4.0
            picture[half & inside] = colour
        if spigot:
            picture[(np.abs(n) < 11.0) & (s > 330.0)] = 0.87
        picture = cv2.GaussianBlur(picture, (0, 0), 0.8)
        code = 255.0 * np.clip(picture, 0, 1) ** (1 / 2.2) + random.normal(0, 1.5, picture.shape)
        pictures.append(np.clip(np.round(code), 0, 255).astype(np.uint8))
    return pictures


def off_axis_px(sight: Sight) -> float:
    """How far the found axis passes from the drawn one's ends, px."""
    u = sight.axis.tangent(np.array(0.0))
    normal = np.array([-u[1], u[0]])
    return max(abs(float((p - sight.axis.at(np.array(0.0))) @ normal)) for p in (START, END))


@pytest.mark.parametrize("shadow", [0.35, pytest.param(0.5, marks=pytest.mark.slow)])
def test_shadow_beside_dark_strands_is_not_measured(shadow: float) -> None:
    """A shadow half as dark as the strands, soft and touching them: measured 17.9 px wide (16 and
    the blur); 38 to 45 px when it was taken for strings."""
    sight = find_sight(bundle_film((0.7, 0.7, 0.7), ((0.04, 0.04, 0.04),), shadow))
    assert sight is not None
    assert sight.width_px == pytest.approx(BUNDLE_PX, abs=3.0)
    assert off_axis_px(sight) < 1.5


def test_cable_that_stands_still_is_not_measured() -> None:
    """A cable thicker, darker and longer than the bundle."""
    sight = find_sight(bundle_film((0.6, 0.6, 0.6), ((0.2, 0.2, 0.2),), 0.0, cable=True))
    assert sight is not None and off_axis_px(sight) < 2.0


def test_a_line_of_soft_borders_has_less_support() -> None:
    """A strand 10 px wide, and a shadow as long and twice as wide whose borders are sharp in
    places only, as on waved cardboard: the wider one had the larger support."""
    rows, columns = np.mgrid[0:200, 0:400].astype(float)
    sharp = (np.abs(rows - 60.0) < 5.0) & (columns > 40.0)
    soft = 1.0 / (1.0 + np.exp((np.abs(rows - 140.0) - 10.0) / np.where(columns % 40 < 12, 0.5, 4)))
    random = np.random.default_rng(5)
    light = 0.5 - 0.4 * sharp - 0.3 * soft + random.normal(0.0, 0.004, sharp.shape)
    picture = cv2.GaussianBlur(light, (0, 0), 0.8).astype(np.float32)
    strand = put_to_trial(
        [picture], straight_axis(np.array([0.0, 60.0]), np.array([399.0, 60.0])), 12.0
    )
    shadow = put_to_trial(
        [picture], straight_axis(np.array([0.0, 140.0]), np.array([399.0, 140.0])), 22.0
    )
    assert strand.support > 300.0 > shadow.support


def test_what_is_darker_beside_strings_that_are_not_may_be_their_shadow() -> None:
    """Coloured strings and a dark line as wide beside them; not one that lies across, is twice as
    wide or far off, and not where both are darker than the ground: either may be the strings."""
    rows, columns = np.mgrid[0:200, 0:400].astype(float)
    picture = np.full((200, 400, 3), 0.2, np.float32)
    for k, colour in enumerate(((0.2, 0.62, 0.7), (0.55, 0.25, 0.1))):
        wave = 70.0 + 4.0 * np.cos(2 * np.pi * columns / 60.0 + np.pi * k)
        picture[np.abs(rows - wave) < 4.0] = colour
    picture[np.abs(rows - 100.0) < 7.0] = 0.05
    blurred = cv2.GaussianBlur(picture, (0, 0), 0.8)

    def along(row: float) -> Trial:
        axis = straight_axis(np.array([0.0, row]), np.array([399.0, row]))
        return put_to_trial([blurred], axis, 14.0)

    strings, dark = along(70.0), along(100.0)
    assert dark.darker and not strings.darker
    assert could_cast(dark, strings) and not could_cast(strings, dark)
    assert not could_cast(dark, replace(strings, darker=True))
    assert not could_cast(dark, replace(strings, width_px=2.5 * dark.width_px))
    across = straight_axis(np.array([200.0, 0.0]), np.array([200.0, 199.0]))
    far = straight_axis(np.array([0.0, 10.0]), np.array([399.0, 10.0]))
    assert not any(could_cast(dark, replace(strings, axis=axis)) for axis in (across, far))


def test_a_hue_shows_which_strings_cast_a_shadow_however_far_from_it() -> None:
    """Pale strands before wood, their shadow five widths off, as dark as they are bright: by light
    it stood out along more of the picture, and D was the shadow's."""
    rows, columns = np.mgrid[0:HEIGHT_PX, 0:WIDTH_PX].astype(float)
    random = np.random.default_rng(5)
    film = []
    for turn in (0.0, 0.4, 0.8):
        picture = np.full((HEIGHT_PX, WIDTH_PX, 3), (0.16, 0.29, 0.5))
        for k in range(2):
            wave = 140.0 + 4.0 * np.cos(2 * np.pi * columns / 60.0 + np.pi * (k + turn))
            picture[np.abs(rows - wave - 90.0) < 4.0] = 0.064, 0.116, 0.2
            strand = (np.abs(rows - wave) < 4.0) & (columns > 40.0)
            picture[strand] = 0.75, 0.75, 0.8
        code = 255.0 * cv2.GaussianBlur(picture, (0, 0), 0.8) ** (1 / 2.2)
        film.append(code + random.normal(0.0, 1.5, code.shape))
    sight = find_sight(coded(film))
    assert sight is not None
    assert abs(float(sight.axis.at(np.array([300.0]))[0, 1]) - 140.0) < 4.0


def test_strings_and_their_shadow_in_one_are_told_from_strings() -> None:
    """A run 58 px wide that holds one of 22 (seen: yellow and blue strings close to a grey ground)
    gives way to it; not to one that lies across or beside, nor to one nearly as wide."""

    def line(start: float, stop: float, width: float) -> Trial:
        axis = straight_axis(np.array([0.0, start]), np.array([399.0, stop]))
        return Trial(axis, width, 100.0, darker=False)

    strings, both = line(70.0, 60.0, 22.0), line(85.0, 78.0, 58.0)
    assert swallows(both, strings) and not swallows(strings, both)
    assert not swallows(both, replace(strings, width_px=40.0))
    assert not swallows(both, line(20.0, 120.0, 22.0))
    assert not swallows(both, line(20.0, 20.0, 22.0))


def test_a_line_askew_between_strings_and_their_shadow_holds_the_strings() -> None:
    """Cream strings close to green cloth: of a run 42 px wide, which a hue showed to be 30, the
    line lay half a width off at the picture's border, and D was told to 14 px of 28."""

    def line(start: float, stop: float, width: float, by_hue: bool = False) -> Trial:
        axis = straight_axis(np.array([0.0, start]), np.array([399.0, stop]))
        return Trial(axis, width, 100.0, darker=False, by_hue=by_hue)

    both = line(81.5, 66.0, 22.0)
    assert swallows(both, line(70.0, 60.0, 16.5, by_hue=True))
    assert not swallows(both, line(70.0, 60.0, 17.5, by_hue=True))


def test_two_colours_with_a_shadow() -> None:
    """Yellow and blue on grey: seen by colour across the ground's, in which shadows have none."""
    yellow, blue = (0.2, 0.62, 0.7), (0.55, 0.25, 0.1)
    sight = find_sight(bundle_film((0.2, 0.2, 0.2), (yellow, blue), 0.55))
    assert sight is not None
    assert sight.width_px == pytest.approx(BUNDLE_PX, abs=3.0)
    assert off_axis_px(sight) < 1.5


def patches(share: float) -> np.ndarray:
    """What an uneven light takes code by (H, W, 1): off by such a share, in patches as wide as the
    bundle."""
    random = np.random.default_rng(5)
    uneven = cv2.GaussianBlur(random.normal(0.0, 1.0, (HEIGHT_PX, WIDTH_PX)), (0, 0), 8.0)
    light = np.maximum(1.0 + share * uneven / uneven.std(), 0.05)
    return np.asarray(light[..., None] ** (1 / 2.2))


def coded(film: list[np.ndarray]) -> list[np.ndarray]:
    return [np.clip(np.round(p), 0, 255).astype(np.uint8) for p in film]


def patchy(film: list[np.ndarray], share: float) -> list[np.ndarray]:
    """A film under a light that is uneven by such a share."""
    return coded([p * patches(share) for p in film])


@pytest.mark.parametrize(("apart", "way"), [(2.0, Way.DISTANCE), (5.0, Way.HUE)])
def test_one_hue_of_two_colours_has_to_tell_them_by_far(
    apart: float, way: Way, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Orange and green on a patchy cream: told by a hue that hardly tells either, and by
    chroma that is blurred as wide as a strand, no frame had a pitch."""
    film = patchy(bundle_film((0.35, 0.47, 0.57), ((0.06, 0.3, 0.66), (0.14, 0.36, 0.09))), 0.15)
    axis = straight_axis(START, END)
    strips = [cut_strip(to_linear(p), axis, (0.0, axis.length_px), 60) for p in film]

    def found(*given: object) -> tuple[Signal, float]:
        return find_hue(*given)[0], apart  # type: ignore[arg-type]

    monkeypatch.setattr("tsvision.images.seen.find_hue", found)
    assert seen_in(strips, BUNDLE_PX, rough=False).signal.way is way


def test_a_hue_of_one_colour_is_no_way_out_of_a_shadow_that_is_the_other() -> None:
    """Black and red on a patchy pale ground: darker all along, but by two amounts, as strings and
    their shadow are. By a hue the red strand alone was seen, 10 px wide."""
    strands = (0.022, 0.02, 0.02), (0.03, 0.03, 0.2)
    film = patchy(bundle_film((0.236, 0.2, 0.165), strands), 0.2)
    random = np.random.default_rng(3)
    noisy = coded([p + random.normal(0.0, 4.0, p.shape) for p in film])
    sight = find_sight(noisy, Told(least_px=0.6 * BUNDLE_PX))
    assert sight is not None
    assert sight.signal.way is Way.LUMA
    assert sight.width_px == pytest.approx(BUNDLE_PX, abs=2.0)
    assert off_axis_px(sight) < 1.0


@pytest.mark.parametrize("shadow", [pytest.param(0.5, marks=pytest.mark.slow), 0.8])
@pytest.mark.parametrize(
    "red", [(0.06, 0.06, 0.35), pytest.param((0.08, 0.08, 0.45), marks=pytest.mark.slow)]
)
def test_red_on_green_with_a_shadow(red: tuple[float, float, float], shadow: float) -> None:
    """As dark as the ground or darker, and the shadow darker still: with the strings it made one
    run 35 px wide, or was measured in place of them. Its hue is the ground's."""
    ground = (0.1, 0.2, 0.1)
    sight = find_sight(bundle_film(ground, (red,), shadow))
    assert sight is not None
    assert sight.width_px == pytest.approx(BUNDLE_PX, abs=3.0)
    assert off_axis_px(sight) < 1.5
    assert abs(float(sight.signal.weights @ np.array(ground))) < 0.02


@pytest.mark.parametrize("pictures", [1, pytest.param(8, marks=pytest.mark.slow)])
@pytest.mark.parametrize("shadow", [0.35, 0.7])
@pytest.mark.parametrize(
    ("ground", "strand"),
    [((0.10, 0.22, 0.35), (0.38, 0.34, 0.29)), ((0.10, 0.21, 0.30), (0.47, 0.29, 0.75))],
    ids=["grey on wood", "pink on wood"],
)
def test_strings_as_bright_as_their_ground_are_told_from_their_shadow(
    ground: tuple[float, float, float],
    strand: tuple[float, float, float],
    shadow: float,
    pictures: int,
) -> None:
    """The opponent colours show a shadow as they do strings: every line began on both, twice as
    wide, and no hue was left to be told on it."""
    film = bundle_film(ground, (strand,), shadow)[-pictures:]
    sight = find_sight(film, Told(least_px=0.6 * BUNDLE_PX))
    assert sight is not None
    assert sight.signal.way is Way.HUE
    assert off_axis_px(sight) < 1.0
    assert sight.width_px == pytest.approx(BUNDLE_PX, rel=0.15)


def test_shares_of_light_show_no_shadow() -> None:
    """Measured: 2.5, as dark places show less of a hue; by the opponent colours 9.4."""
    picture = np.full((90, 120, 3), (90, 130, 165), np.uint8)
    shaded = picture.copy()
    shaded[40:50] = np.round(picture[40:50] * 0.6)
    by = {of: np.ptp(np.stack(of(shaded)), axis=(1, 2)) for of in (find_channels, unshaded)}
    assert max(by[unshaded]) < 3.0
    assert max(by[find_channels][1:]) > 8.0
    assert unshaded(picture[..., 0]) == []


def test_a_hue_is_asked_for_only_where_a_shadow_is_deep() -> None:
    """Luma's edges are sharper: without a shadow dark red strings are seen by it."""
    sight = find_sight(bundle_film((0.1, 0.2, 0.1), ((0.02, 0.03, 0.12),)))
    assert sight is not None
    assert sight.signal.way is Way.LUMA
    assert sight.width_px == pytest.approx(BUNDLE_PX, abs=3.0)


@pytest.mark.slow
def test_an_uneven_ground_is_no_shadow() -> None:
    """Red strings on sand of light and dark patches: a hue was asked for though no shadow is there,
    whose limbs are dim and whose edges are blurred, and D was found 6 % too large."""
    light = patches(0.08)
    film = bundle_film((0.3, 0.45, 0.5), ((0.08, 0.08, 0.45),))
    # Not the strings themselves, which are what is red.
    uneven = [np.where(p[..., 2:] > 1.5 * p[..., :1] + 9, p, p * light) for p in film]
    sight = find_sight(coded(uneven))
    assert sight is not None
    assert sight.signal.way is Way.LUMA
    assert sight.width_px == pytest.approx(BUNDLE_PX, abs=2.0)


def test_shadow_level_lies_above_a_soft_border_only() -> None:
    n = np.arange(-40, 41)[:, None] + np.zeros(200)
    noise = np.random.default_rng(1).normal(0.0, 0.01, n.shape)
    strand = 1.0 / (1.0 + np.exp((np.abs(n) - 10.0) / 0.6))
    shadow = 0.45 * np.exp(-0.5 * ((n - 14.0) / 7.0) ** 2)
    plain = find_shadow(strand + noise, 26.0, 0.1)
    assert plain.level == pytest.approx(0.1) and plain.soft < 0.05
    assert 0.4 < find_shadow(np.maximum(strand, shadow) + noise, 26.0, 0.1).level < 0.7


def test_strands_as_sharp_as_a_picture_can_be_are_no_shadow() -> None:
    """Bare steps, clean enough to look far down for shadows: rows apart see all of a step at any
    level, and by the steepness that would make of it half way up all borders were soft."""
    n = np.arange(-40, 41)[:, None] + np.zeros(200)
    noise = np.random.default_rng(1).normal(0.0, 0.004, n.shape)
    strand = np.where(np.abs(n) < 10.5, 1.0, 0.0)
    shadow = 0.45 / (1.0 + np.exp((np.abs(n - 16.0) - 12.0) / 3.0))
    found = find_shadow(np.maximum(strand, shadow) + noise, 26.0, 0.09)
    assert 0.4 < found.level < 0.6 and found.soft < 0.1


def test_motion_is_where_the_strands_are() -> None:
    pictures = bundle_film((0.6, 0.6, 0.6), ((0.2, 0.2, 0.2),), 0.0, cable=True)
    motion = motion_picture(pictures)
    assert motion is not None
    cable = straight_axis(np.array([0.0, 40.0]), np.array([479.0, 87.9]))
    assert moving_share(straight_axis(START, END), BUNDLE_PX, motion, WIDTH_PX) > 0.9
    assert moving_share(cable, 18.0, motion, WIDTH_PX) < 0.1
    assert motion_picture(pictures[:2]) is None
    assert motion_picture([pictures[0]] * 6) is None


def grain_and_plies() -> list[np.ndarray]:
    """Blue and yellow strands on brown ground with dark grain lines that run along them."""
    rows, columns = np.mgrid[0:600, 0:400].astype(float)
    pictures = []
    for turns in (4.0, 5.0, 6.0):
        grain = 1.0 - 0.45 * (np.sin(0.35 * columns + 3.0 * np.sin(rows / 60.0)) > 0.6)
        picture = grain[..., None] * np.array([0.08, 0.22, 0.45])
        phase = 2 * np.pi * turns * rows / 600.0
        for k, colour in enumerate(((0.55, 0.2, 0.08), (0.12, 0.55, 0.55))):
            picture[np.abs(columns - 200.0 - 9.0 * np.cos(phase + np.pi * k)) < 9.0] = colour
        picture = cv2.GaussianBlur(picture, (0, 0), 0.8)
        pictures.append(np.round(255.0 * picture ** (1 / 2.2)).astype(np.uint8))
    return pictures


@pytest.mark.parametrize("region", [None, (100, 50, 200, 500), (150, 20, 120, 560)])
def test_no_grain_is_followed_beside_strands_of_two_colours(
    region: tuple[int, int, int, int] | None,
) -> None:
    pictures = grain_and_plies()
    sight = find_sight(pictures, Told(roi_px=region))
    assert sight is not None and sight.signal.by_distance
    assert sight.width_px == pytest.approx(36.0, abs=5.0)
    curve = find_curve(pictures, sight, region, closely=True)
    assert curve is None or (curve.alike and not curve.bowed)


@pytest.mark.parametrize("grey", [True, False])
def test_black_and_white_strands_on_grey_are_both_seen(grey: bool) -> None:
    """Taken for white strands with gaps, a bundle was measured at any width from 16 to 37 px of
    27, and its pitch ten times too long."""
    film = bundle_film((0.2, 0.2, 0.2), ((0.8, 0.8, 0.8), (0.02, 0.02, 0.02)))
    sight = find_sight([p[..., 1] for p in film] if grey else film)
    assert sight is not None
    assert sight.signal.way is Way.DISTANCE
    assert sight.width_px == pytest.approx(BUNDLE_PX, abs=2.0)
    assert off_axis_px(sight) < 1.0


@pytest.mark.parametrize("red", [pytest.param(0.15, marks=pytest.mark.slow), 0.3])
def test_a_bright_spigot_is_not_what_tells_dark_strands(red: float) -> None:
    """Red and black on near-black stand out by little, the connector's spigot on their axis by
    five hundred times as much: it was taken for all that few turns leave of the bundle, and
    luma, in which it stands out, for what tells the strands."""
    film = bundle_film((0.03, 0.036, 0.04), ((0.03, 0.03, red), (0.025, 0.03, 0.033)), spigot=True)
    sight = find_sight(film, Told(least_px=0.6 * BUNDLE_PX))
    assert sight is not None
    assert sight.signal.in_colour
    assert off_axis_px(sight) < 1.0


@pytest.mark.parametrize(("support", "in_colour"), [(340.0, True), (380.0, False)])
def test_a_hue_tells_strands_that_hardly_stand_out_and_not_the_light_of_a_spigot(
    support: float, in_colour: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Grey before wood about as bright, in a shadow close by: two signals at odds told them by 1.5
    sd, luma the spigot by 6, and D was the spigot's (`tests.bench.colours --only 524`). A hue shows
    them by 12; not where less of the line speaks for it, as of one strand of two."""
    film = bundle_film((0.1, 0.235, 0.43), ((0.26, 0.22, 0.25),), shadow=0.3, spigot=True)[:3]

    def at_odds(
        linears: list[np.ndarray], axis: Axis, width: float, between: bool, by_hue: bool = False
    ) -> tuple[Trial, list[Strip], Seen]:
        found, strips, seen = _follow(linears, axis, width, False, by_hue)
        if by_hue:
            return found, strips, seen
        if between:
            seen = Seen(LUMA, 6.0, *masks_of(strips, LUMA, width, False, True))
            return replace(found, support=100.0, between=True), strips, seen
        return replace(found, support=support), strips, replace(seen, separation=1.5)

    monkeypatch.setattr("tsvision.images.sight._follow", at_odds)
    line = Trial(straight_axis(START, END), BUNDLE_PX, support, darker=False)
    sight = _sight_along(film, line, Told())
    assert sight.signal.in_colour == in_colour


def relief_film(lit: float) -> list[np.ndarray]:
    """Grey strands, brighter than their ground to one side and as much darker to the other."""
    random = np.random.default_rng(7)
    rows, columns = np.mgrid[0:HEIGHT_PX, 0:WIDTH_PX].astype(float)
    pictures = []
    for turns in np.linspace(5.0, 12.0, 8):
        picture = np.full((HEIGHT_PX, WIDTH_PX), 0.2)
        for k in range(2):
            phase = 2 * np.pi * turns * columns / 480.0 + np.pi * k
            across = (rows - 135.0 - 4.0 * np.cos(phase)) / 4.0
            picture += np.where(np.abs(across) < 1.0, lit * across, 0.0)
        picture = cv2.GaussianBlur(np.clip(picture, 0.0, 1.0), (0, 0), 0.8)
        code = 255.0 * picture ** (1 / 2.2) + random.normal(0, 1.5, picture.shape)
        pictures.append(np.clip(np.round(code), 0, 255).astype(np.uint8))
    return pictures


@pytest.mark.parametrize("lit", [0.08, 0.15])
def test_strands_as_bright_as_their_ground_in_all_are_one_relief(lit: float) -> None:
    """Lit from the side they are brighter than it on one side and darker on the other: by their
    lightness the line is one half of them."""
    film = relief_film(lit)
    half, whole = find_ridges(film, most=1), find_ridges(film, channels=off_surroundings, most=1)
    assert abs(half[0].centre_px[1] - 135.0) > 4.0
    assert half[0].width_px < 0.5 * BUNDLE_PX
    assert abs(whole[0].centre_px[1] - 135.0) < 2.0
    assert 0.8 * BUNDLE_PX < whole[0].width_px < 1.2 * BUNDLE_PX


def test_lines_that_mirror_each_other_about_a_third_are_its_legs() -> None:
    """Two legs that meet on the axis of their bundle; not two that cross it in different places or
    at different angles, and neither the bundle and a leg about the other leg."""

    def line(start: float, stop: float) -> Trial:
        axis = straight_axis(np.array([0.0, start]), np.array([400.0, stop]))
        return Trial(axis, 20.0, 100.0, darker=False)

    bundle, down, up = line(100.0, 100.0), line(100.0, 180.0), line(100.0, 20.0)
    assert are_legs(down, up, bundle) and are_legs(up, down, bundle)
    assert not are_legs(bundle, up, down)
    assert not are_legs(down, line(180.0, 100.0), bundle)
    assert not are_legs(down, line(100.0, 60.0), bundle)
    assert not are_legs(down, replace(up, width_px=50.0), bundle)


def close_up(turns: float) -> np.ndarray:
    """One picture of a film of the separator: two strands of different colours whose legs, which
    meet ever nearer to it on the axis of `bundle_film`, are mostly longer than what follows."""
    random = np.random.default_rng(round(100 * turns))
    rows, columns = np.mgrid[0:HEIGHT_PX, 0:WIDTH_PX].astype(float)
    u, length = (END - START) / np.hypot(*(END - START)), float(np.hypot(*(END - START)))
    s = (columns - START[0]) * u[0] + (rows - START[1]) * u[1]
    n = -(columns - START[0]) * u[1] + (rows - START[1]) * u[0]
    meet = (0.4 + 1.0 / turns) * length
    picture = np.full((HEIGHT_PX, WIDTH_PX, 3), 0.015)
    for side, colour in ((1, (0.05, 0.25, 0.6)), (-1, (0.3, 0.2, 0.6))):
        turn = 2 * np.pi * turns * (s - meet) / length + (np.pi if side < 0 else 0.0)
        leg = side * (4.0 + 42.0 * (meet - s) / length)
        place = np.where(s < meet, leg, 4.0 * np.cos(turn))
        half = np.where(s < meet, 6.0, 4.0)
        picture[(np.abs(n - place) < half) & (s > 0)] = colour
    picture = cv2.GaussianBlur(picture, (0, 0), 0.8)
    code = 255.0 * np.clip(picture, 0, 1) ** (1 / 2.2) + random.normal(0, 1.5, picture.shape)
    return np.clip(np.round(code), 0, 255).astype(np.uint8)


def test_a_film_of_the_separator_shows_the_bundle_and_not_a_leg_of_another_colour() -> None:
    """A leg was measured in all frames of such a film, a third too thin and without a flag."""
    film = [close_up(turns) for turns in np.linspace(2.2, 9.0, 8)]
    sight = find_sight(film, Told(least_px=0.6 * BUNDLE_PX, side="left"))
    assert sight is not None
    assert off_axis_px(sight) < 0.3 * BUNDLE_PX


def pale_blue(shown: float) -> np.ndarray:
    """Blue strands, lit from one side, before pale blue, on the last `shown` of an axis along the
    middle row: as bright as the ground where light falls on them, and darker elsewhere."""
    random = np.random.default_rng(round(10 * shown))
    rows, columns = np.mgrid[0:141, 0:360].astype(float)
    picture = np.ones((141, 360, 3)) * (0.25, 0.17, 0.12)
    for k in range(2):
        away = rows - 70.0 - 4.0 * np.cos(2 * np.pi * columns / 45.0 + np.pi * k + shown)
        here = (np.abs(away) < 4.0) & (columns > 360.0 * (1.0 - shown))
        light = 0.6 - 0.1 * away
        picture[here] = (light[..., None] * (0.9, 0.2, 0.08))[here]
    picture = cv2.GaussianBlur(picture, (0, 0), 0.8)
    code = 255.0 * picture ** (1 / 2.2) + random.normal(0, 1.5, picture.shape)
    return np.clip(np.round(code), 0, 255).astype(np.uint8)


def test_a_hue_serves_though_ground_lies_on_the_axis_most_of_the_way() -> None:
    """Nothing stands out by 1.5 sd there. Luma did by less than the hue and took the lit sides of
    the strands for their shadow's border: such a bundle was not measured at all."""
    axis = straight_axis(np.array([0.0, 70.0]), np.array([359.0, 70.0]))
    shares = (0.3, 0.4, 0.5, 0.6, 0.6, 0.7, 0.7, 0.7)
    linears = [to_linear(pale_blue(shown), float("nan")) for shown in shares]
    strips = [cut_strip(p, axis, (0.0, axis.length_px), 68) for p in linears]
    seen = seen_in(strips, BUNDLE_PX, rough=False)
    assert seen.signal.way is Way.HUE
    assert abs(float(seen.signal.weights @ (0.25, 0.17, 0.12))) < 0.02
    widths = seen.masks[-1][:, 150:].sum(axis=0)  # two strands, between a half and one bundle wide
    assert 8.0 <= np.median(widths) <= BUNDLE_PX + 1.0


def few_turns(
    apex: float,
    ground: tuple[float, float, float] = (0.08, 0.08, 0.08),
    strand: tuple[float, float, float] = (0.5, 0.5, 0.5),
    uneven: float = 0.0,
) -> np.ndarray:
    """One picture of two strands, 8 px thick, that come from 80 px apart on the left, meet at a
    share `apex` of the way along the axis of `bundle_film`, and turn once and a half behind it.
    The ground's light is `uneven` by so much of itself, in waves as wide as the bundle."""
    random = np.random.default_rng(11)
    rows, columns = np.mgrid[0:HEIGHT_PX, 0:WIDTH_PX].astype(float)
    u, length = (END - START) / np.hypot(*(END - START)), float(np.hypot(*(END - START)))
    s = (columns - START[0]) * u[0] + (rows - START[1]) * u[1]
    n = -(columns - START[0]) * u[1] + (rows - START[1]) * u[0]
    meet = apex * length
    waves = np.sin(columns / 9.0 + 0.3) * np.sin(rows / 7.0) + np.sin(columns / 23.0 - rows / 13.0)
    picture = (1.0 + 0.5 * uneven * waves)[..., None] * np.array(ground)
    for k, side in enumerate((1, -1)):
        turn = 2 * np.pi * 1.5 * (s - meet) / (length - meet) + np.pi * k
        leg = side * (4.0 + 36.0 * (meet - s) / meet)
        place = np.where(s < meet, leg, 4.0 * np.cos(turn))
        picture[(np.abs(n - place) < 4.0) & (s > 0) & (s < length)] = strand
    picture = cv2.GaussianBlur(picture, (0, 0), 0.8)
    code = 255.0 * np.clip(picture, 0, 1) ** (1 / 2.2) + random.normal(0, 1.5, picture.shape)
    return np.clip(np.round(code), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("apex", [0.5, 0.65, 0.75])
def test_one_picture_of_few_turns_shows_the_bundle_and_not_a_leg(apex: float) -> None:
    """The bundle is shorter than its legs: its axis runs over ground most of the way, and a leg
    was taken for a bundle of half the width."""
    sight = find_sight([few_turns(apex)], Told(least_px=0.6 * BUNDLE_PX))
    assert sight is not None
    assert off_axis_px(sight) < 0.3 * BUNDLE_PX
    assert sight.width_px == pytest.approx(BUNDLE_PX, rel=0.3)
    assert sight.legs_seen


def test_a_film_of_legs_shows_the_bundle_that_they_meet_in() -> None:
    """A fifth of the axis is bundle in the last frame, none in the first three; a leg of several
    strands is wide enough for a bundle, and was measured in all of such a film (`wild 555`)."""
    film = [few_turns(apex) for apex in np.linspace(1.1, 0.8, 8)]
    sight = find_sight(film, Told(least_px=0.4 * BUNDLE_PX))
    assert sight is not None
    assert off_axis_px(sight) < 0.3 * BUNDLE_PX


@pytest.mark.parametrize("latest", [0.55, 0.65])
def test_a_film_of_few_turns_shows_the_bundle_and_not_a_leg(latest: float) -> None:
    """A close-up in which the legs are longer than the bundle in every frame but the last: a leg
    was taken for it, too thin to be one, and nothing was measured."""
    film = [few_turns(apex) for apex in np.linspace(0.9, latest, 8)]
    sight = find_sight(film, Told(least_px=0.6 * BUNDLE_PX))
    assert sight is not None
    assert off_axis_px(sight) < 0.3 * BUNDLE_PX
    assert sight.width_px == pytest.approx(BUNDLE_PX, rel=0.3)
    assert sight.legs_seen


def test_a_hue_is_found_though_legs_run_beside_the_axis_in_most_frames() -> None:
    """Pink on an uneven pale green of about the same luma, the bundle shorter than its legs in most
    frames."""
    film = [
        few_turns(apex, ground=(0.45, 0.58, 0.42), strand=(0.42, 0.5, 0.9), uneven=0.15)
        for apex in (0.9, 0.9, 0.85, 0.8, 0.75, 0.7, 0.4, 0.35)
    ]
    sight = find_sight(film, Told(least_px=0.6 * BUNDLE_PX))
    assert sight is not None
    assert sight.signal.in_colour
    assert off_axis_px(sight) < 0.3 * BUNDLE_PX
    assert sight.width_px == pytest.approx(BUNDLE_PX, rel=0.3)


def test_legs_behind_a_plate_lie_before_the_bundle() -> None:
    """A plate that stands out as strings do, on the left, and four frames of legs alone behind it:
    the plate counted as a bundle, and the legs were told to lie beyond it."""
    rows = np.arange(-60, 61)[:, None]
    columns = np.arange(500)[None, :]

    def mask(apex: int) -> np.ndarray:
        plate = columns < 80
        away = np.abs(np.abs(rows) - np.maximum(40.0 * (apex - columns) / (apex - 80.0), 5.0))
        return (plate | (away < 5.0)).astype(np.uint8)

    near, far = leg_spread([mask(a) for a in (499, 499, 499, 499, 260, 220, 200, 180)], 60, 20.0)
    assert near > 10.0 * far


@pytest.mark.parametrize("degrees", [-59.0, -30.0, 0.0, 30.0, 59.0, 61.0, 80.0, 90.0, 100.0, 119.0])
def test_a_line_runs_left_to_right_and_a_steep_one_downwards(degrees: float) -> None:
    """Whichever way its ridge was told, as the angle or its opposite."""
    for turned in (0.0, 180.0):
        ridge = Ridge((50.0, 50.0), np.deg2rad(degrees + turned), 5.0, 1, 0, 1.0)
        (x0, y0), (x1, y1) = line_of_ridge(ridge, (101, 101), None).points_px
        steep = 60.0 < degrees < 120.0
        assert (y1 > y0 + 50.0) if steep else (x1 > x0 + 50.0)


@pytest.mark.parametrize("roi", [None, (20, 10, 120, 60)])
def test_a_line_that_was_turned_ends_where_the_view_does(
    roi: tuple[int, int, int, int] | None,
) -> None:
    """A leg's line that has come to lie along the bundle began 58 px before the picture."""
    axis = straight_axis(np.array([-58.0, 40.0]), np.array([300.0, 60.0]))
    seen = within_view(axis, (100, 200), roi)
    ends = seen.at(np.array([0.0, seen.length_px]))
    low, high = (0.0, 199.0) if roi is None else (20.0, 139.0)
    assert ends[:, 0] == pytest.approx([low, high])
    off = ends - np.array([-58.0, 40.0])
    along = axis.tangent(np.array([0.0]))[0]
    assert off[:, 0] * along[1] == pytest.approx(off[:, 1] * along[0])
    beyond = straight_axis(np.array([-58.0, 140.0]), np.array([300.0, 160.0]))
    assert within_view(beyond, (100, 200), roi) is beyond


@pytest.mark.parametrize(("share", "kept"), [(0.02, False), (0.2, False), (0.6, True)])
def test_a_hue_seen_on_hardly_any_of_the_line_gives_way(
    share: float, kept: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of green and grey strands on black the green alone was looked for, and seen in a plate: no
    bundle was measured (`tests.bench.colours --only 461`)."""
    film = bundle_film((0.02, 0.02, 0.02), ((0.05, 0.12, 0.05), (0.06, 0.06, 0.06)))
    linears = [to_linear(picture) for picture in film]

    def in_plate(strips: list[Strip], width: float) -> Seen:
        hue = seen_by_hue(strips, width)
        for mask in hue.masks:
            mask[:, : round((1.0 - share) * mask.shape[1])] = 0
            mask[:, round((1.0 - share) * mask.shape[1]) :] = 1
        return hue

    monkeypatch.setattr("tsvision.images.sight.seen_by_hue", in_plate)
    _, strips, seen = _follow(linears, straight_axis(START, END), BUNDLE_PX, True, by_hue=True)
    assert (seen.signal.way is Way.HUE) == kept
    middle = np.array([mask[strips[0].half_px] for mask in seen.masks])
    assert (middle > 0).mean() > (0.5 if kept else 0.9)
