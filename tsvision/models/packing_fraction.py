"""Constant packing fraction: the bundle's section grows with the strings' section."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from tsvision.data import table
from tsvision.errors import InputError
from tsvision.models.shelf import BundleSection


def fit_widening(count: ArrayLike, string_diameter_mm: ArrayLike, diameter_mm: ArrayLike) -> float:
    """c of D = c d √N by least squares over measured bundles of two or more strings."""
    thick = np.asarray(string_diameter_mm, dtype=float) * np.sqrt(np.asarray(count, dtype=float))
    measured = np.asarray(diameter_mm, dtype=float)
    return float(np.sum(thick * measured) / np.sum(thick * thick))


@lru_cache
def paper_widening() -> float:
    """c fitted to the paper's caliper diameters of 2 to 8 strings, about 1.47: 46 % filled."""
    data = table("diameter").set_index("strings")["diameter_mm"]
    bundles = data[data.index >= 2]
    return fit_widening(bundles.index.to_numpy(), float(data[1]), bundles.to_numpy())


def bundle_diameter_mm(
    count: ArrayLike, string_diameter_mm: ArrayLike, widening: float | None = None
) -> np.ndarray:
    """D = c d √N in mm (d for one string); `widening` is c, the paper's if not given."""
    numbers = np.asarray(count, dtype=float)
    if np.any(~(numbers >= 1) | (numbers != np.round(numbers))):
        raise InputError("a bundle needs a whole number of strings >= 1")
    c = paper_widening() if widening is None else widening
    wide = np.where(numbers > 1, c * np.sqrt(numbers), 1.0)
    return wide * np.asarray(string_diameter_mm, dtype=float)


SECTION = BundleSection(
    name="packing_fraction",
    title="Constant packing fraction",
    equation="D = c d √N, c = 1.47 from the paper's caliper (1/c² = 46 % filled)",
    assumptions=(
        "strings fill the same share of the bundle's round section at every N",
        "c holds for the load, lay and string that it was fitted on",
    ),
    source="this project, fitted to the diameter table of Tavakoli, Batista & Neto (N = 2 to 8)",
    fails="c is fitted: another string, load or lay angle may pack otherwise",
    bundle_diameter_mm=bundle_diameter_mm,
    centres=None,
)
