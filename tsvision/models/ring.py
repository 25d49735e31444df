"""Ring section: N strands side by side in one ring (the earlier model)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from tsvision.errors import InputError
from tsvision.models.shelf import BundleSection


def centres(count: int) -> np.ndarray:
    """Strand centres in units of d, shape (count, 2)."""
    if count < 1 or count != int(count):
        raise InputError(f"a bundle needs a whole number of strings >= 1, not {count}")
    if count == 1:
        return np.zeros((1, 2))
    angle = 2 * np.pi * np.arange(count) / count
    return np.column_stack([np.cos(angle), np.sin(angle)]) / (2 * np.sin(np.pi / count))


def bundle_diameter_mm(count: ArrayLike, string_diameter_mm: ArrayLike) -> np.ndarray:
    """D = d (1 + 1/sin(π/N)) in mm; one string is d."""
    numbers = np.asarray(count, dtype=float)
    if np.any(~(numbers >= 1) | (numbers != np.round(numbers))):
        raise InputError("a bundle needs a whole number of strings >= 1")
    over = 1 / np.sin(np.pi / np.where(numbers > 1, numbers, 2.0))
    return np.asarray(string_diameter_mm, dtype=float) * np.where(numbers > 1, 1 + over, 1.0)


SECTION = BundleSection(
    name="ring",
    title="Ring (the earlier section)",
    equation="D = d (1 + 1/sin(π/N))",
    assumptions=(
        "strands are round and rigid and touch their two neighbours",
        "the middle is empty or holds an unloaded core",
    ),
    source="Palli, Natale, May, Melchiorri & Würtz 2013, as read by Tavakoli, Batista & Neto",
    fails="far too thin from N = 3 on; a hollow ring is not stable under load",
    bundle_diameter_mm=bundle_diameter_mm,
    centres=centres,
)
