"""Pair-core section: strands on a hexagonal lattice around a core of two (the paper)."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import ArrayLike

from tsvision.errors import InputError
from tsvision.models.shelf import BundleSection

HALF_ROOT_3 = np.sqrt(3.0) / 2
# Pairs of opposite sites around the core pair, in the order in which they fill (units of d).
SITES = np.array(
    [
        (0.5, 0.0),
        (-0.5, 0.0),
        (0.0, HALF_ROOT_3),
        (0.0, -HALF_ROOT_3),
        (1.0, HALF_ROOT_3),
        (-1.0, -HALF_ROOT_3),
        (1.0, -HALF_ROOT_3),
        (-1.0, HALF_ROOT_3),
        (1.5, 0.0),
        (-1.5, 0.0),
    ]
)


def centres(count: int) -> np.ndarray:
    """Strand centres in units of d, shape (count, 2), for 1 to 10 strings."""
    if not 1 <= count <= len(SITES) or count != int(count):
        raise InputError(f"pair_core knows 1 to {len(SITES)} strings, not {count}; use `ring`")
    return np.zeros((1, 2)) if count == 1 else SITES[: int(count)].copy()


def smallest_circle_radius(points: np.ndarray) -> float:
    """Radius of the smallest circle around a few points (n, 2), exact, by pairs and triples."""
    candidates = [
        (np.mean([a, b], axis=0), np.hypot(*(a - b)) / 2)
        for a, b in itertools.combinations(points, 2)
    ]
    candidates += [
        found
        for triple in itertools.combinations(points, 3)
        if (found := _circumcircle(*triple)) is not None
    ]
    holding = [
        radius
        for middle, radius in candidates
        if np.all(np.hypot(*(points - middle).T) <= radius * (1 + 1e-9))
    ]
    return float(min(holding, default=0.0))


def _circumcircle(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> tuple[np.ndarray, float] | None:
    matrix = 2 * np.array([b - a, c - a])
    if abs(np.linalg.det(matrix)) < 1e-12:
        return None
    middle = np.linalg.solve(matrix, [b @ b - a @ a, c @ c - a @ a])
    return middle, float(np.hypot(*(a - middle)))


_WIDTH = {n: 1 + 2 * smallest_circle_radius(centres(n)) for n in range(1, len(SITES) + 1)}


def bundle_diameter_mm(count: ArrayLike, string_diameter_mm: ArrayLike) -> np.ndarray:
    """D = d (1 + 2 R) in mm, R the radius of the smallest circle around the first N sites."""
    numbers = np.asarray(count)
    wrong = [n for n in numbers.ravel().tolist() if n not in _WIDTH]
    if wrong:
        raise InputError(f"pair_core knows 1 to {len(SITES)} strings, not {wrong[0]}; use `ring`")
    width = np.array([_WIDTH[int(n)] for n in numbers.ravel()]).reshape(numbers.shape)
    return width * np.asarray(string_diameter_mm, dtype=float)


SECTION = BundleSection(
    name="pair_core",
    title="Pair core (the paper's section)",
    equation="D = d (1 + 2 R), R = smallest circle around the first N sites of the lattice",
    assumptions=(
        "strands are round, rigid and tightly packed",
        "the first pair forms the core, each later pair takes the nearest free opposite sites",
        "lay angle does not widen a strand's cross-section",
    ),
    source="Tavakoli, Batista & Neto, figure of the string sections and diameter table",
    fails="too thin except at N = 2 and 6: measured bundles are packed more loosely",
    bundle_diameter_mm=bundle_diameter_mm,
    centres=centres,
)
