"""Which signal is chosen, by samples of colour on the axis and beside it."""

from __future__ import annotations

import numpy as np
import pytest

from tsvision.images.cloud import Cloud, central_cloud
from tsvision.images.linear import best_weights, lightless_weights, shadeless_weights
from tsvision.images.signal import LUMA, Way
from tsvision.images.strip import Strip
from tsvision.images.telling import (
    are_both_ways,
    black_among,
    colours_of,
    distance_for,
    find_signal,
    loses_limbs,
    many_coloured,
)

Colour = tuple[float, float, float]
BLUE, YELLOW = (0.45, 0.25, 0.10), (0.12, 0.40, 0.42)


def seen(colour: Colour, count: int, dim: float = 0.8, noise: float = 0.003) -> np.ndarray:
    """Samples (count, 3) of one colour, lit by `dim` of its light to all of it."""
    random = np.random.default_rng(round(1e4 * sum(colour)) + count)
    light = random.uniform(dim, 1.0, (count, 1))
    return light * np.array(colour) + noise * random.standard_normal((count, 3))


def windows(samples: np.ndarray, count: int = 10) -> list[np.ndarray]:
    """Stretches (8, n, 3) of the axis that show samples (8 n, 3), the first of them now on one
    side of it and now on the other, as of strands that wind about each other."""
    stretch = samples.reshape(8, -1, 3)
    return [stretch[:: 1 - 2 * (i % 2)] for i in range(count)]


def test_two_colours_are_told_on_a_ground_of_uneven_brightness() -> None:
    """Concrete half in shadow: neither string is brighter or darker than all of it."""
    concrete = (0.30, 0.31, 0.31)
    ground = seen(concrete, 1500, 0.3)
    both = np.concatenate([seen(BLUE, 40, 0.3), seen(YELLOW, 40, 0.3)])
    assert many_coloured(windows(both), ground)
    assert not many_coloured(windows(seen(YELLOW, 80, 0.3)), ground)
    assert not many_coloured(windows(seen(concrete, 80, 0.3)), ground)
    # A speck of each colour on an axis that runs over the ground is no string.
    speck = np.concatenate([seen(BLUE, 6, 0.3), seen(YELLOW, 6, 0.3), seen(concrete, 68, 0.3)])
    assert not many_coloured(windows(speck), ground)


def test_a_connector_is_not_a_strand_of_another_colour() -> None:
    """Red strings before black, with a steel connector and a pale plate on two fifths of the axis:
    they were told by their distance from the ground's colour, and came out 1.1 px thin of 26."""
    ground = seen((0.02, 0.02, 0.02), 1500)
    colours = (0.6, 0.6, 0.6), (0.4, 0.33, 0.35), (0.06, 0.05, 0.4)
    steel, plate, red = (windows(seen(colour, 80)) for colour in colours)
    assert not many_coloured(red[:6] + steel[:3] + plate[:1], ground)


def test_colours_that_wind_about_each_other_need_not_lie_far_apart() -> None:
    """Cream and green on blue, nearly as bright as the green: of the two the cream alone was
    measured, by its brightness, and D came out 4 px off of 18. A fifth of it all is blends."""
    cream, green = (0.34, 0.5, 0.55), (0.09, 0.26, 0.11)
    mixed = seen((0.21, 0.38, 0.33), 16)
    both = np.concatenate([seen(cream, 32, 0.5), seen(green, 32, 0.5), mixed])
    shown = windows(both, 5) + windows(seen(cream, 80, 0.5), 5)
    assert many_coloured(shown, seen((0.15, 0.13, 0.1), 1500))


def test_strings_beside_their_shadow_are_of_one_colour() -> None:
    """Black strings before blue cloth, the axis first laid between them and their shadow: told by
    any difference from the lit cloth the shadow was theirs, and D 39 px of 58 too wide (`colours
    251`). In turns the same two colours are strands."""
    cloth = seen((0.2, 0.09, 0.05), 1500, 0.8)
    black, shadow = seen((0.035, 0.03, 0.03), 40, 0.8), seen((0.1, 0.045, 0.025), 40, 0.8)
    both = np.concatenate([black, shadow])
    assert many_coloured(windows(both), cloth)
    assert not many_coloured([both.reshape(8, -1, 3)] * 10, cloth)


@pytest.mark.parametrize(("grey", "way"), [(300, Way.ACROSS), (500, Way.DISTANCE)])
def test_strands_whose_mixture_is_grey_are_told_by_hue(grey: int, way: Way) -> None:
    """Yellow beside blue on concrete: up to a third of thin strands is where they meet. Where half
    of what is seen is grey one of them may be, and light has to count too."""
    each = (1000 - grey) // 2
    strings = [seen(BLUE, each), seen(YELLOW, each), seen((0.29, 0.33, 0.26), grey)]
    assert distance_for(np.concatenate(strings), seen((0.18, 0.18, 0.18), 2000)).way is way


def test_a_strand_of_the_ground_s_own_hue_does_not_vanish() -> None:
    """Red beside white on grey: what is white lies along the ground's colour, as its shadows do,
    and a bundle of both was measured on its red strand."""
    red, white = (0.17, 0.16, 0.95), (0.9, 0.9, 0.9)
    ground, blends = seen((0.21, 0.21, 0.21), 2000), seen((0.45, 0.45, 0.93), 150)
    both = np.concatenate([seen(red, 550), seen(white, 300), blends])
    assert distance_for(both, ground).way is Way.DISTANCE
    assert distance_for(np.concatenate([seen(red, 900), blends]), ground).way is Way.ACROSS


def test_a_bright_connector_on_the_axis_does_not_say_how_strings_stand_out() -> None:
    """Red beside black on grey, and a white connector on a fifth of the axis: beside it neither
    strand stood out, the black one vanished, and a bundle that anyone sees was not measured."""
    red, black, white = (0.06, 0.05, 0.3), (0.02, 0.02, 0.02), (0.95, 0.88, 0.87)
    axis = np.concatenate([seen(red, 400), seen(black, 400), seen(white, 200)])
    assert distance_for(axis, seen((0.2, 0.24, 0.19), 2000)).way is Way.DISTANCE


def test_a_black_strand_does_not_vanish_beside_a_far_brighter_one() -> None:
    """Blue beside black on brown: by the blue ones' measure black hardly differs from the ground,
    and lit it sends as much as brown in shadow. D and pitch were told in no frame of eight."""
    blue, black = (1.0, 0.35, 0.15), (0.08, 0.08, 0.08)
    ground = seen((0.12, 0.16, 0.2), 2000, 0.9, 0.008)
    axis = np.concatenate([seen(blue, 650, 0.7, 0.008), seen(black, 350, 0.5, 0.008)])
    assert distance_for(axis, ground).way is Way.DISTANCE
    both = [seen(blue, 500, 0.4, 0.008), seen((0.1, 0.5, 0.6), 500, 0.4, 0.008)]
    assert distance_for(np.concatenate(both), ground).way is Way.ACROSS


def test_a_lit_black_strand_does_not_vanish_on_a_dim_ground() -> None:
    """Black beside blue on dark brown, at half of its light: D came out up to 7 px of 37 wide, and
    pitches twice as long (`wild 798`)."""
    blue, black = (0.42, 0.13, 0.07), (0.05, 0.05, 0.05)
    axis = np.concatenate([seen(blue, 720, 0.4), seen(black, 200, 0.8), seen((0.4, 0.5, 0.5), 80)])
    assert distance_for(axis, seen((0.075, 0.1, 0.12), 2000, 0.9)).way is Way.DISTANCE


def test_a_ground_without_light_has_no_shadow_to_be_afraid_of() -> None:
    """Blue beside warm white before near-black: across the hardly any light of the ground the white
    strand stood out by a fifth of the blue one. Pitches were twice the true ones, D 4 px of 23
    thin."""
    axis = np.concatenate([seen((0.7, 0.18, 0.09), 500, 0.6), seen((0.5, 0.62, 0.7), 500, 0.6)])
    assert distance_for(axis, seen((0.03, 0.03, 0.03), 2000)).way is Way.DISTANCE
    assert distance_for(axis, seen((0.2, 0.2, 0.2), 2000)).way is Way.ACROSS


def test_a_connector_brighter_than_the_ground_makes_dark_strands_no_pair() -> None:
    """Half of the axis darker than the ground, a third brighter: but not in turns."""
    random = np.random.default_rng(6)

    def strip(turns: float) -> Strip:
        columns = np.arange(300)
        values = 0.2 + random.normal(0.0, 0.004, (61, 300))
        values[24:37] = np.where(np.sin(2 * np.pi * turns * columns / 300) > 0, 0.7, 0.03)
        return Strip(values.astype(np.float32), 0.0, 30)

    assert are_both_ways([strip(15.0)], 6.0)
    assert not are_both_ways([strip(1.0)], 6.0)
    # Bright strings beside their shadow all along.
    beside = 0.2 + random.normal(0.0, 0.004, (61, 300))
    beside[24:30], beside[30:37] = 0.7, 0.03
    assert not are_both_ways([Strip(beside.astype(np.float32), 0.0, 30)], 6.0)


@pytest.mark.parametrize("black", [0.03, 0.5])
def test_strands_darker_than_an_uneven_ground_are_seen_in_noise(black: float) -> None:
    """Cream and black before dark grey with a lit side, half as much light off black strands as off
    the ground, in noise (`wild 1276`): D was 1 px of 27 off and stated to 6, of the cream strands
    alone."""
    random = np.random.default_rng(7)
    columns = np.arange(600)
    values = np.linspace(0.09, 0.055, 600) + np.zeros((61, 1))
    values[24:37] = np.where(np.sin(2 * np.pi * columns / 31) > 0, 0.5, black)
    values = values + random.normal(0.0, 0.01, values.shape)
    strip = Strip(values.astype(np.float32), 0.0, 30)
    assert are_both_ways([strip], 6.0) == (black < 0.055)


def test_a_plate_across_the_view_is_not_what_stands_out_on_the_axis() -> None:
    """Black strings in a film of the separator: they lie on the axis for a third of its length, and
    its lavender plate for a fifth. The plate's hue was sought, and a leg measured."""
    random = np.random.default_rng(4)
    light = random.uniform(0.7, 1.3, (1, 400, 1))  # uneven, as far as luma is concerned
    values = 0.13 * light + random.normal(0.0, 0.004, (81, 400, 3))
    values[32:49, :130] = 0.02 + 0.02 * random.random((17, 130, 1))
    values[:, 320:] = light[:, 320:] * (0.4, 0.2, 0.2)
    strip = Strip(values.astype(np.float32), 0.0, 40)
    signal, _ = find_signal([strip], 8.0, between=True)
    assert signal.way is Way.LUMA


ORANGE, BLACK, BROWN = (0.02, 0.19, 0.5), (0.012, 0.012, 0.012), (0.06, 0.08, 0.1)


def wound(colours: tuple[Colour, ...], noise: float, grey: bool = False) -> Strip:
    """Strands of these colours in turns about the axis, before brown; in colour, unevenly lit."""
    random = np.random.default_rng(8)
    light = 1.0 + (0.1 if grey else 0.4) * np.sin(np.arange(480) / 40.0)[None, :, None]
    values = light * np.array(BROWN) * np.ones((181, 480, 3))
    which = np.arange(480) // 20 % len(colours)
    values[74:107] = np.array(colours)[which] * np.ones((33, 480, 3))
    if grey:
        values = values.mean(axis=2)
    values += random.normal(0.0, noise, values.shape)
    return Strip(values.astype(np.float32), 0.0, 90)


def test_black_has_no_hue_and_is_a_colour_all_the_same() -> None:
    """Black and orange before brown, noisy: black lies no further off the ground's light than that
    from its own, and nothing was told of a bundle that anyone sees (`--wild 672`)."""
    ground = seen(BROWN, 1500, 0.6)
    both = np.concatenate([seen(ORANGE, 50, 0.5), seen(BLACK, 30, 0.5)])
    assert black_among(windows(both, 5) + windows(seen(BROWN, 80, 0.6), 5), ground)
    assert not black_among(windows(seen(ORANGE, 80, 0.5)), ground)
    assert not black_among(windows(seen(BLACK, 80, 0.5)), ground)
    # Before a ground as dark what is dark is ground.
    assert not black_among(windows(both), seen(BLACK, 1500, 0.6))
    # What lies beside the strings all along is their shadow.
    assert not black_among([both.reshape(8, -1, 3)] * 10, ground)


def test_a_limb_in_the_dark_is_no_black_strand() -> None:
    """Orange strings lit from above before grey: told by any difference from it, as if black ones
    wound about them, nothing was found of a bundle that anyone sees."""
    grey: Colour = (0.1, 0.1, 0.1)
    dark: Colour = (0.003, 0.015, 0.037)
    ground = seen(grey, 1500, 0.6)
    lit = np.concatenate([seen(ORANGE, 50, 0.5), seen(dark, 30, 0.5, noise=0.001)])
    assert not black_among(windows(lit), ground)
    both = np.concatenate([seen(ORANGE, 50, 0.5), seen(BLACK, 30, 0.5)])
    assert black_among(windows(both), ground)


def test_noise_hides_no_strands() -> None:
    """And a distance, which noise lengthens, is taken of light that is averaged, if need be."""
    for noise, side in ((0.002, 1), (0.025, 3)):
        signal, _ = find_signal([wound((ORANGE, BLACK), noise)], 16.5)
        assert (signal.way, signal.averaged_px) == (Way.DISTANCE, side)
    bright: Colour = (0.2, 0.2, 0.2)
    assert find_signal([wound((bright, BLACK), 0.03, grey=True)], 16.5)[0].way is Way.DISTANCE
    assert find_signal([wound((bright,), 0.03, grey=True)], 16.5)[0].way is Way.LUMA


def test_a_hue_does_not_take_dark_limbs_for_the_ground() -> None:
    """Pink before pale grey: by red light less a little of the others a limb of a quarter of the
    light is darker than the ground, and 2 px of 22 were left out (`--wild 574`, whose colours and
    their scatter these are)."""
    random = np.random.default_rng(7)
    pink, grey = np.array([0.551, 0.409, 0.887]), np.array([0.614, 0.613, 0.614])
    of_pink = [[0.0195, 0.0192, 0.0055], [0.0192, 0.0260, -0.0070], [0.0055, -0.0070, 0.0268]]
    of_grey = 0.00168 * np.ones((3, 3)) + np.diag([9e-5, 6e-5, 3e-5])
    values = random.multivariate_normal(grey, of_grey, (181, 300))
    values[74:107] = random.multivariate_normal(pink, of_pink, (33, 300))
    signal, _ = find_signal([Strip(values.astype(np.float32), 0.0, 90)], 16.0)
    assert signal.way is Way.HUE
    strings, ground = Cloud(pink, np.array(of_pink)), Cloud(grey, of_grey)
    assert not loses_limbs(signal.weights, strings, ground)
    assert loses_limbs(best_weights(strings, ground)[0], strings, ground)
    # Luma is told in full: what it loses is another matter.
    assert not loses_limbs(LUMA.weights, Cloud(2.0 * grey, np.array(of_pink)), ground)


def test_what_strings_cover_does_not_depend_on_the_light_on_them() -> None:
    """However bright, they are as dark as black; a hue that no shadow changes fades with them."""
    strings, ground = seen((0.05, 0.04, 0.42), 600), seen((0.21, 0.07, 0.06), 600)
    clouds = central_cloud(strings.reshape(-1, 3)), central_cloud(ground.reshape(-1, 3))
    cover, apart = lightless_weights(*clouds)
    hue, _ = shadeless_weights(*clouds)
    whole = clouds[1].mean @ cover
    for light in (0.1, 0.5, 1.0, 1.5):
        colour = light * np.array([0.05, 0.04, 0.42])
        assert abs(colour @ cover) < 0.03 * abs(whole)
        assert abs(light * clouds[1].mean @ hue) < 0.12 * abs(clouds[0].mean @ hue)
    assert apart > 3.0 and whole < 0.0


def strip_of(*strands: Colour, ground: Colour) -> Strip:
    """Strands of these colours that take turns along the axis, 12 px thick, on their ground."""
    values = np.empty((61, 240, 3))
    values[:] = seen(ground, 61 * 240).reshape(61, 240, 3)
    along = np.arange(240) // 20 % len(strands)
    for i, colour in enumerate(strands):
        columns = np.flatnonzero(along == i)
        values[24:37, columns] = seen(colour, 13 * columns.size).reshape(13, -1, 3)
    return Strip(values.astype(np.float32), 0.0, 30)


def test_the_colours_of_strings_and_ground_are_known() -> None:
    """Where strings have one, and pictures have any."""
    strip = strip_of(YELLOW, ground=BLUE)
    found = colours_of([strip], 6.0, between=False)
    assert found is not None
    assert np.allclose(found[0], 0.9 * np.array(YELLOW), rtol=0.05)
    assert np.allclose(found[1], 0.9 * np.array(BLUE), rtol=0.05)
    of_two = strip_of(YELLOW, (0.05, 0.05, 0.6), ground=BLUE)
    assert colours_of([of_two], 6.0, between=False) is None
    grey = Strip(strip.values[..., 1], 0.0, 30)
    assert colours_of([grey], 6.0, between=False) is None
