"""What tells coloured strings from their ground: hardware beside them, limbs in the dark."""

from __future__ import annotations

import numpy as np
import pytest

from tsvision.images.cloud import central_cloud
from tsvision.images.contrast import black_contrast
from tsvision.images.linear import best_weights
from tsvision.images.signal import DISTANCE, LUMA, summed

RED, GROUND, STEEL = (0.03, 0.03, 0.2), (0.041, 0.057, 0.065), (0.19, 0.19, 0.2)  # BGR, linear


def red_strings(rng: np.random.Generator, count: int) -> np.ndarray:
    """Lit from 0.2 to full, with sensor noise."""
    light = rng.uniform(0.2, 1.2, count)[:, None]
    return light * np.array(RED) + rng.normal(0.0, 0.002, (count, 3))


def test_a_normal_cloud_is_told_as_it_is() -> None:
    rng = np.random.default_rng(1)
    scatter = np.array([[2.0, 1.0, 0.0], [1.0, 2.0, 0.5], [0.0, 0.5, 1.0]])
    samples = rng.multivariate_normal([1.0, 2.0, 3.0], scatter, 20000)
    cloud = central_cloud(samples)
    np.testing.assert_allclose(cloud.mean, [1.0, 2.0, 3.0], atol=0.05)
    np.testing.assert_allclose(cloud.scatter, scatter, atol=0.1)


@pytest.mark.parametrize("share", [0.05, 0.1, 0.2])
def test_hardware_on_the_axis_does_not_choose_the_hue(share: float) -> None:
    """A steel shaft on the axis: the weights of clean samples within a tenth (measured: 0.03). With
    plain means and scatters they turn by 50 degrees and more."""
    rng = np.random.default_rng(2)
    strings = red_strings(rng, 4000)
    steel = np.array(STEEL) * rng.uniform(0.8, 2.0, (int(4000 * share), 1))
    ground = np.array(GROUND) + rng.normal(0.0, 0.002, (4000, 3))
    clean, _ = best_weights(central_cloud(strings), central_cloud(ground))
    spoilt, _ = best_weights(central_cloud(np.concatenate([strings, steel])), central_cloud(ground))
    np.testing.assert_allclose(spoilt, clean, atol=0.1)


def test_grey_samples_have_a_cloud() -> None:
    grey = np.repeat(np.random.default_rng(3).uniform(0.1, 0.2, (500, 1)), 3, axis=1)
    assert np.isfinite(central_cloud(grey).scatter).all()


def test_what_a_limb_in_the_dark_shows() -> None:
    """A weighted sum of channels goes straight to black, and so does the answer. The distance from
    the ground's colour does not: red at 0.4 of its light lies no farther off than 0.46 of it."""
    ground = np.array(GROUND)
    hue = np.array([-0.33, -0.52, 0.15], np.float32)
    strings = np.repeat(np.array([RED]), 50, axis=0)
    exact = float(-ground @ hue / ((strings[0] - ground) @ hue))
    assert black_contrast(strings, ground, summed(hue)) == pytest.approx(exact, rel=1e-5)
    lit, dim = (float(np.linalg.norm(light * strings[0] - ground)) for light in (1.0, 0.4))
    told = black_contrast(strings, ground, DISTANCE)
    assert 0.4 + 0.6 * told == pytest.approx(dim / lit, rel=1e-5)


@pytest.mark.parametrize(("string", "black"), [(0.05, 1.0 + 0.05 / 0.45), (0.7, -0.5 / 0.2)])
def test_black_beside_one_channel(string: float, black: float) -> None:
    """Dark strings before bright ground get darker without light; bright ones go below it."""
    strings, ground = np.full((10, 1), string), np.array([0.5])
    assert black_contrast(strings, ground, LUMA) == pytest.approx(black)
