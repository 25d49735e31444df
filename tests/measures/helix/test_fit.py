"""The silhouette against discs drawn by brute force, its gradient, and fits of exact edges."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.crowded import given_way
from tsvision.measures.helix.fit import fit_helix
from tsvision.measures.helix.section import pair_core
from tsvision.measures.helix.silhouette import (
    COILED,
    CROWD,
    EDGE,
    KC,
    OPEN,
    PARAMETERS,
    PHI,
    PHIC,
    RC,
    RHO,
    SLOPE,
    STRAIGHT,
    TILT,
    Y0,
    K,
    Section,
    model_edges,
    rounded_off,
    waves,
)


def parameters(**values: float) -> np.ndarray:
    """(12,) with the names as given, the rest 0."""
    place = {"rho": RHO, "k": K, "phi": PHI, "y0": Y0, "slope": SLOPE, "rc": RC, "kc": KC,
             "phic": PHIC, "edge": EDGE, "tilt": TILT, "open": OPEN, "crowd": CROWD}  # fmt: skip
    p = np.zeros(PARAMETERS)
    for name, value in values.items():
        p[place[name]] = value
    return p


def section_of(strings: int, p: np.ndarray) -> Section:
    """The section, and what its strands give where that is asked."""
    section = pair_core(strings)
    if p[CROWD] == 0.0:
        return section
    return replace(section, give_d=given_way(section, 0.8, 0.3))


def centre(p: np.ndarray, section: Section, strand: int, z: np.ndarray) -> np.ndarray:
    """Projected strand centre (s, y), built from the line's Frenet frame and nothing else."""
    a = 2.0 * p[RHO] * (1.0 + p[OPEN]) * section.radius_d[strand]
    angle = section.angle_rad[strand]
    rc, kc = p[RC], p[KC]
    theta = kc * z + p[PHIC]
    if rc == 0.0:
        psi = p[K] * z + p[PHI] + angle
        return np.stack([z - p[TILT] * a * np.sin(psi), -a * np.cos(psi)])
    line = np.stack([z, rc * np.cos(theta), rc * np.sin(theta)])
    q = np.hypot(1.0, rc * kc)
    tangent = np.stack([np.ones_like(z), -rc * kc * np.sin(theta), rc * kc * np.cos(theta)]) / q
    normal = np.stack([0 * z, -np.cos(theta), -np.sin(theta)])
    binormal = np.cross(tangent, normal, axis=0)
    psi = p[K] * z + p[PHI] + angle
    outward = np.cos(psi) * normal + np.sin(psi) * binormal
    around = np.cos(psi) * binormal - np.sin(psi) * normal
    out, on = np.zeros((2, z.size))
    if section.give_d is not None:
        out, on = 2.0 * p[RHO] * p[CROWD] * (section.give_d[strand] @ waves(psi))
    along, height, depth = line + (a + out) * outward + on * around
    return np.stack([along + p[TILT] * depth, height])


def discs(p: np.ndarray, count: int, strings: int) -> tuple[np.ndarray, np.ndarray]:
    """Upper and lower edge at z = -count/2 ..., as the union of discs of radius rho."""
    section = section_of(strings, p)
    z = np.arange(-0.5 * count - 60.0, 0.5 * count + 60.0, 0.01)
    at = np.arange(count) - 0.5 * (count - 1)
    upper, lower = np.full(count, -np.inf), np.full(count, np.inf)
    for strand in range(section.count):
        s, y = centre(p, section, strand, z)
        for i, x in enumerate(at):
            near = np.abs(s - x) < p[RHO]
            half = np.sqrt(p[RHO] ** 2 - (s[near] - x) ** 2)
            upper[i] = max(upper[i], (y[near] + half).max())
            lower[i] = min(lower[i], (y[near] - half).min())
    line = p[Y0] + p[SLOPE] * at
    return upper + line + p[EDGE], lower + line - p[EDGE]


SHAPES = [
    (2, parameters(rho=6.0, k=0.07, phi=0.4, y0=1.3, slope=0.01, edge=0.2)),
    (4, parameters(rho=5.0, k=0.05, phi=1.0)),
    (8, parameters(rho=4.0, k=0.05, phi=0.3, y0=-2.0)),
    (2, parameters(rho=5.0, k=0.12, phi=0.4, rc=3.0, kc=0.09, phic=0.8)),
    (8, parameters(rho=4.0, k=0.05, phi=0.3, tilt=0.08)),
    (2, parameters(rho=5.0, k=0.12, phi=0.4, rc=3.0, kc=0.09, phic=0.8, tilt=-0.08)),
    (6, parameters(rho=4.0, k=0.08, phi=0.3, open=0.2)),
    (6, parameters(rho=4.0, k=0.08, phi=0.3, tilt=0.08, open=0.2)),
    (4, parameters(rho=4.0, k=0.1, phi=0.3, rc=3.0, kc=0.07, phic=0.8, open=0.1)),
    (6, parameters(rho=4.0, k=0.07, phi=0.3, rc=3.0, kc=0.06, phic=0.8, crowd=0.6)),
]


@pytest.mark.parametrize(("strings", "p"), SHAPES)
def test_the_silhouette_is_the_union_of_discs(strings: int, p: np.ndarray) -> None:
    """Measured: 0.001 px straight; 0.013 px coiled, where the outline turns sharply and the chords
    of 0.4 px between contact points cut its corners."""
    atol = 0.002 if p[RC] == 0.0 else 0.02
    count = 90
    upper, lower = model_edges(p, section_of(strings, p), -0.5 * (count - 1), count)
    want_upper, want_lower = discs(p, count, strings)
    np.testing.assert_allclose(upper, want_upper, atol=atol)
    np.testing.assert_allclose(lower, want_lower, atol=atol)


def test_untwisted_strands_side_by_side_are_as_wide_as_their_diameters() -> None:
    p = parameters(rho=6.0, k=0.0, phi=0.0)
    upper, lower = model_edges(p, pair_core(2), -20.0, 41)
    np.testing.assert_allclose(upper - lower, 24.0, atol=1e-9)


@pytest.mark.parametrize(("strings", "p"), SHAPES)
def test_the_gradient_is_that_of_finite_differences(strings: int, p: np.ndarray) -> None:
    """Summed over the window: single columns jump where the outermost strand changes."""
    from tsvision.measures.helix.fit import UNHELD, Problem, _normal_equations

    count, z0 = 80, -39.5
    section = section_of(strings, p)
    ones = np.ones((2, count))
    exact = np.stack(model_edges(p, section, z0, count))
    asked = (*(STRAIGHT if p[RC] == 0.0 else COILED), TILT, OPEN)
    if p[CROWD] != 0.0:
        asked = (*asked, CROWD)

    def right_side(index: int, side: int) -> float:
        # Edges seen 1 px above the model: the right side is the gradient's sum.
        seen = exact.copy()
        seen[side] += 1.0
        normal, right = np.empty((PARAMETERS, PARAMETERS)), np.empty(PARAMETERS)
        free = np.arange(PARAMETERS)
        give = np.zeros((section.count, 2, 5)) if section.give_d is None else section.give_d
        outline = section.radius_d, section.angle_rad, give
        problem = Problem(*outline, z0, seen, ones, ones, 1e4, 0.35, UNHELD)
        _normal_equations(p, free, problem, normal, right)
        return float(right[index])

    for index in asked:
        step = 1e-4 * (1.0 if index in (RHO, PHI, Y0, RC, PHIC, EDGE, TILT, OPEN, CROWD) else 1e-2)
        moved = []
        for sign in (1.0, -1.0):
            q = p.copy()
            q[index] += sign * step
            moved.append(model_edges(q, section, z0, count))
        for side in (0, 1):
            numeric = float(((moved[0][side] - moved[1][side]) / (2 * step)).sum())
            size = float(np.abs((moved[0][side] - moved[1][side]) / (2 * step)).sum())
            assert right_side(index, side) == pytest.approx(numeric, abs=0.02 * size + 1e-3), index


FINER = 4  # samples a px of the picture that is blurred
TWISTED = [
    (2, parameters(rho=5.2, k=0.20, phi=0.4), 1.4),
    (4, parameters(rho=5.0, k=0.13, phi=1.0), 1.4),
    (2, parameters(rho=5.0, k=0.12, phi=0.4, rc=3.0, kc=0.09, phic=0.8), 0.9),
]


def blurred(
    p: np.ndarray, count: int, strings: int, blur_px: float
) -> tuple[np.ndarray, np.ndarray]:
    """Upper and lower edge (count,) where a blurred picture of the discs is half as bright."""
    fine = p.copy()
    fine[[RHO, RC, Y0]] *= FINER
    fine[[K, KC]] /= FINER
    upper, lower = discs(fine, FINER * count, strings)
    half = int(FINER * 30)
    rows = np.arange(-half, half + 1)[:, None]
    shown = np.clip(upper - rows + 0.5, 0, 1) - np.clip(lower - rows + 0.5, 0, 1)
    light = gaussian_filter(shown, FINER * blur_px, mode="nearest")
    edges = []
    for picture in (light[::-1], light):  # from outside in
        first = np.argmax(picture > 0.5, axis=0)
        column = np.arange(first.size)
        before, after = picture[first - 1, column], picture[first, column]
        row = first - 1 + (0.5 - before) / (after - before)
        at = (row - half).reshape(count, FINER).mean(axis=1) / FINER
        edges.append(at)
    return -edges[0], edges[1]


@pytest.mark.parametrize(("strings", "p", "blur_px"), TWISTED)
def test_blur_rounds_off_the_outline(strings: int, p: np.ndarray, blur_px: float) -> None:
    """Against a picture of the discs, blurred in both directions. Measured: 0.01 px in the median
    and 0.02 in nine of ten columns, where the sharp outline is 0.04 to 0.09 and 0.1 to 0.3 px
    off."""
    count, section = 240, pair_core(strings)
    z0 = -0.5 * (count - 1)
    seen = blurred(p, count, strings, blur_px)
    sharp = model_edges(p, section, z0, count)
    off = rounded_off(p, section, z0, count, blur_px)
    inner = slice(20, -20)
    for got, edge, rounded in zip(seen, sharp, off, strict=True):
        error = np.abs(got - edge - rounded)[inner]
        plain = np.abs(got - edge)[inner]
        assert np.median(error) < 0.02
        assert np.percentile(error, 90) < 0.25 * np.percentile(plain, 90)


@pytest.mark.parametrize(("strings", "p", "blur_px"), TWISTED)
def test_a_fit_that_knows_the_blur_finds_the_width(
    strings: int, p: np.ndarray, blur_px: float
) -> None:
    count, section = 240, pair_core(strings)
    upper, lower = blurred(p, count, strings, blur_px)
    s, sure = np.arange(count, dtype=float), np.ones(count)
    seen = Edges(s, upper, lower, sure, sure, blur_px=blur_px)
    seen = seen.window(20.0, count - 21.0)
    free = tuple(i for i in (STRAIGHT if p[RC] == 0.0 else COILED) if i != EDGE)
    fit = fit_helix(seen, section, p, free)
    assert fit.diameter_px == pytest.approx(2.0 * p[RHO] * section.diameter_d, abs=0.04)
    assert fit.p[K] == pytest.approx(p[K], rel=1e-3)
    assert fit.cost < 0.01


@pytest.mark.parametrize(("strings", "p"), SHAPES)
def test_a_fit_of_exact_edges_returns_what_drew_them(strings: int, p: np.ndarray) -> None:
    """From a start 5 % off, on edges that come from the discs. Measured: D within 0.01 px straight
    and 0.023 px coiled (the same cut corners), the rate within 0.1 %."""
    count = 300
    upper, lower = discs(p, count, strings)
    s = np.arange(count, dtype=float)
    seen = Edges(s, upper - p[EDGE], lower + p[EDGE], np.ones(count), np.ones(count))
    start = p.copy()
    start[EDGE] = 0.0
    start[RHO] *= 1.05
    start[PHI] += 0.1
    free = tuple(i for i in (STRAIGHT if p[RC] == 0.0 else COILED) if i != EDGE)
    if p[CROWD] > 0.0:
        start[CROWD], free = 0.3, (*free, CROWD)
    section = section_of(strings, p)
    fit = fit_helix(seen, section, start, free)
    out = (1.0 + p[OPEN]) * section.radius_d
    if section.give_d is not None:
        out = out[:, None] + p[CROWD] * (section.give_d[:, 0] @ waves(np.linspace(0.0, 6.3, 400)))
    drawn = 2.0 * p[RHO] * (1.0 + 2.0 * out.max())
    assert fit.diameter_px == pytest.approx(drawn, abs=0.02 if p[RC] == 0.0 else 0.04)
    assert fit.p[K] == pytest.approx(p[K], rel=1e-3)
    assert fit.rms_px < 0.03


def test_twisting_about_a_coiled_line_counts_its_torsion() -> None:
    """Pitch along the bundle's own line from linking number less writhe."""
    from tsvision.measures.helix.fit import HelixFit

    p = parameters(rho=5.0, k=0.12, rc=3.0, kc=0.09)
    fit = HelixFit(p, np.zeros((9, 9)), 0.0, 0.0, 0, pair_core(2), (0.0, 1.0))
    kappa = p[RC] * p[KC]
    q = np.sqrt(1.0 + kappa**2)
    linking = (p[K] + p[KC]) / (2 * np.pi)  # per px of axis
    writhe = (1.0 - 1.0 / q) * p[KC] / (2 * np.pi)
    assert fit.pitch_px == pytest.approx(q / (linking - writhe), rel=1e-9)
