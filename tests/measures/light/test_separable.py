"""Fits of blur and places about light that is linear: how residuals change is known."""

from __future__ import annotations

import numpy as np
import pytest

from tests.measures.tube import offsets_for, px_tube, seen
from tsvision.measures.edges.shading import EdgeProfile, lamp_shapes, looked_up
from tsvision.measures.light import blur, shading_fit, shading_lamp
from tsvision.measures.light.beside import NONE
from tsvision.measures.light.separable import changes, distinct, fit_separable, projected

RHO_PX = 8.0


def sides(black: float = 0.0) -> tuple[EdgeProfile, EdgeProfile]:
    """Both limbs of a tube lit from one side, edges 0.2 px farther out; darker than a bright ground
    where `black` is above 1."""
    offsets = offsets_for(RHO_PX)
    upper, lower = (
        seen(
            RHO_PX,
            px_tube(offsets + 0.2, RHO_PX, 1.1, 0.3, 0.6, sign * 0.35)
            * (1.0 - 0.5 * (black > 1.0)),
            offsets,
        )
        for sign in (1.0, -1.0)
    )
    return upper, lower


def test_a_profile_changes_with_blur_and_place_as_tried_out() -> None:
    t_px, blur_px, tried = np.linspace(-3.0, 5.0, 33), 1.2, 1e-3
    light = np.array([0.3, *np.linspace(0.0, 0.2, 13)])

    def profile(b: float, place: float) -> np.ndarray:
        return light @ looked_up(lamp_shapes(RHO_PX, b), t_px - place).T

    by_blur, by_place = changes(light @ lamp_shapes(RHO_PX, blur_px), t_px, blur_px)
    wider, narrower = profile(blur_px + tried, 0.0), profile(blur_px - tried, 0.0)
    np.testing.assert_allclose(by_blur, (wider - narrower) / (2.0 * tried), atol=2e-3)
    further, nearer = profile(blur_px, 0.05), profile(blur_px, -0.05)
    np.testing.assert_allclose(by_place, (further - nearer) / 0.1, atol=2e-3)


@pytest.mark.parametrize("kind", ["spread", "mirroring", "lamp", "frame"])
def test_slopes_are_those_that_residuals_have(kind: str) -> None:
    """The gradient of the cost, off the best place; what light makes up for is no part of it."""
    q = np.array([1.4, -0.3, 0.2])
    system: shading_fit._SpreadSystem | shading_lamp._LampSystem | blur._Seen
    if kind == "lamp":
        profiles = sides()
        sd = tuple(np.hypot(p.sd, 0.003) for p in profiles)
        system = shading_lamp._LampSystem(profiles, sd, RHO_PX, 0.0, NONE, True, True)
        q = np.append(q, 0.35)
    elif kind == "frame":
        template = 0.7 * lamp_shapes(RHO_PX, blur.SHARPEST_PX)[:2]
        system = blur._Seen(sides(), template)
    else:
        black = 1.2 if kind == "mirroring" else 0.0
        system = shading_fit._SpreadSystem(sides(black), RHO_PX, black, True, NONE)
    assert system.slopes is not None
    gradient = system.slopes(q).T @ system.residuals(q)
    tried = 0.02 * np.eye(q.size)
    costs = np.array(
        [[0.5 * float(np.sum(system.residuals(p) ** 2)) for p in (q + h, q - h)] for h in tried]
    )
    numeric = (costs[:, 0] - costs[:, 1]) / 0.04
    np.testing.assert_allclose(gradient, numeric, atol=0.03 * np.abs(numeric).max())


def test_what_light_makes_up_for_does_not_count() -> None:
    rng = np.random.default_rng(3)
    design, light = rng.random((20, 3)), np.array([1.0, 0.0, 2.0])
    moved = design @ np.array([[2.0, 0.0], [0.0, 1.0], [1.0, 0.0]])
    left = projected(moved, design, light)
    np.testing.assert_allclose(left[:, 0], 0.0, atol=1e-12)
    assert np.abs(left[:, 1]).max() > 0.05  # light that there is none of does not change


def test_fits_that_ended_at_one_place_are_one() -> None:
    def off(q: np.ndarray) -> np.ndarray:
        return np.array([(q[0] ** 2 - 1.0) * (2.0 + q[0])])

    def fit(start: float) -> object:
        return fit_separable(off, None, np.array([start]), [(-3.0, 3.0)], [0.2], 60)

    ends = [float(f.x[0]) for f in distinct([fit(s) for s in (0.7, 1.5, -0.8, -1.2)])]
    assert sorted(np.round(ends, 2)) == [-1.0, 1.0]
