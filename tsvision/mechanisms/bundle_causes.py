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
            name="packing_fraction",
            title="Loose packing",
            claim="strands fill a constant share of the bundle's circle, whatever their number",
            equation="D = c d √N for N > 1; the share filled is 1/c²",
            parameter="packing_constant",
            unit="1",
            centre=1.35,
            typical=0.2,
            low=1.0,
            high=2.2,
            looks="gaps between strands that wander from frame to frame; D the same at any lay "
            "angle",
            diameter_mm=_area,
        ),
        BundleCause(
            name="strand_gaps",
            title="Gaps between strands",
            claim="the section is the model's, but neighbouring strands do not touch",
            equation="D = d + (D₀ − d)(1 + g)",
            parameter="gap_share",
            unit="1",
            centre=0.0,
            typical=0.1,
            low=-0.3,
            high=0.8,
            looks="even gaps between neighbours, at N = 2 too",
            diameter_mm=_gaps,
        ),
        BundleCause(
            name="flattening",
            title="Flattened strands",
            claim="strands pressed against each other are no longer round: the outer ones stand "
            "wider",
            equation="D = D₀ + f d for N > 1",
            parameter="flattening_share",
            unit="1",
            centre=0.0,
            typical=0.15,
            low=-0.5,
            high=1.0,
            looks="a strand in the bundle seen wider than the strand alone",
            diameter_mm=_flat,
        ),
        BundleCause(
            name="lay_swelling",
            title="Swelling by the lay angle",
            claim="strands laid at an angle cut the section as ellipses and need more room",
            equation="D = D₀ + k (1/cos ψ − 1)(D₀ − d) for N > 2",
            parameter="swelling",
            unit="1",
            centre=0.0,
            typical=0.15,
            low=0.0,
            high=1.5,
            looks="D growing with the turns at an unchanged load",
            diameter_mm=_lay,
        ),
        BundleCause(
            name="strand_bias",
            title="Strand diameter off",
            claim="one string is thicker (or thinner) than stated, in every bundle and alone",
            equation="D = D₀ (1 + δ)",
            parameter="strand_share",
            unit="1",
            centre=0.0,
            typical=0.06,
            low=-0.4,
            high=0.4,
            looks="the single strand itself measuring more than d",
            diameter_mm=_strand,
        ),
    )
}
