"""Why a bundle is not as thick as its section model says: a shelf of its own.

A bundle model (pair core, ring) is a simulation too: it draws strands as round, rigid and tightly
packed. Each cause here turns the base diameter of N strings into another; D, d in mm.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class BundleCause:
    """One cause with one parameter, its Gaussian prior cut at the bounds, and its formula.

    `diameter_mm(base, d, count, lay_rad, value)` broadcasts; `base` is the section model's D.
    """

    name: str
    title: str
    claim: str
    equation: str
    parameter: str
    unit: str
    null: float | None
    centre: float
    typical: float
    low: float
    high: float
    looks: str
    diameter_mm: Callable[..., np.ndarray]


def _area(
    base: np.ndarray, d: np.ndarray, count: np.ndarray, lay_rad: np.ndarray, value: np.ndarray
) -> np.ndarray:
    return np.where(count > 1, value * d * np.sqrt(count), base)


def _gaps(
    base: np.ndarray, d: np.ndarray, count: np.ndarray, lay_rad: np.ndarray, value: np.ndarray
) -> np.ndarray:
    return d + (base - d) * (1.0 + value)


def _flat(
    base: np.ndarray, d: np.ndarray, count: np.ndarray, lay_rad: np.ndarray, value: np.ndarray
) -> np.ndarray:
    return base + np.where(count > 1, value * d, 0.0)


def _lay(
    base: np.ndarray, d: np.ndarray, count: np.ndarray, lay_rad: np.ndarray, value: np.ndarray
) -> np.ndarray:
    """Cut across the axis, a strand laid at an angle is an ellipse, longer by 1/cos along the lay.

    Where the lay is unknown the value is 1/cos − 1 itself, alike for all bundles of several.
    """
    known = np.isfinite(lay_rad)
    swell = np.where(known, 1.0 / np.cos(np.where(known, lay_rad, 0.0)) - 1.0, 1.0)
    return base + np.where(count > 2, value * swell * (base - d), 0.0)


def _strand(
    base: np.ndarray, d: np.ndarray, count: np.ndarray, lay_rad: np.ndarray, value: np.ndarray
) -> np.ndarray:
    return base * (1.0 + value)


BUNDLE_CAUSES: dict[str, BundleCause] = {
    cause.name: cause
    for cause in (
        BundleCause(
            "packing_fraction",
            "Loose packing",
            "strands fill a constant share of the bundle's circle, whatever their number",
            "D = c d √N for N > 1; the share filled is 1/c²",
            "packing_constant",
            "1",
            None,
            1.35,
            0.2,
            1.0,
            2.2,
            "gaps between strands that wander from frame to frame; D the same at any lay angle",
            _area,
        ),
        BundleCause(
            "strand_gaps",
            "Gaps between strands",
            "the section is the model's, but neighbouring strands do not touch",
            "D = d + (D₀ − d)(1 + g)",
            "gap_share",
            "1",
            0.0,
            0.0,
            0.1,
            -0.3,
            0.8,
            "even gaps between neighbours, at N = 2 too",
            _gaps,
        ),
        BundleCause(
            "flattening",
            "Flattened strands",
            "strands pressed against each other are no longer round: the outer ones stand wider",
            "D = D₀ + f d for N > 1",
            "flattening_share",
            "1",
            0.0,
            0.0,
            0.15,
            -0.5,
            1.0,
            "a strand in the bundle seen wider than the strand alone",
            _flat,
        ),
        BundleCause(
            "lay_swelling",
            "Swelling by the lay angle",
            "strands laid at an angle cut the section as ellipses and need more room",
            "D = D₀ + k (1/cos ψ − 1)(D₀ − d) for N > 2",
            "swelling",
            "1",
            0.0,
            0.0,
            0.15,
            0.0,
            1.5,
            "D growing with the turns at an unchanged load",
            _lay,
        ),
        BundleCause(
            "strand_bias",
            "Strand diameter off",
            "one string is thicker (or thinner) than stated, in every bundle and alone",
            "D = D₀ (1 + δ)",
            "strand_share",
            "1",
            0.0,
            0.0,
            0.06,
            -0.4,
            0.4,
            "the single strand itself measuring more than d",
            _strand,
        ),
    )
}
