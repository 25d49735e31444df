"""Where the strands sit in the bundle's cross-section, and how far they must move apart.

Strategy: sites in units of d (pair-core lattice or ring). Laid as helices, neighbours that lie
side by side come closer by about the cosine of the lay angle, so the whole section is widened by
the smallest factor that keeps every two strands at least `1 - OVERLAP_ALLOWED` of d apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from tsvision.errors import InputError

OVERLAP_ALLOWED = (
    0.015  # of d; below what `contact` would push apart, so straight bundles are exact
)
_H = np.sqrt(3.0) / 2.0
_PAIR_CORE = (
    (0.5, 0.0),
    (-0.5, 0.0),
    (0.0, _H),
    (0.0, -_H),
    (1.0, _H),
    (-1.0, -_H),
    (1.0, -_H),
    (-1.0, _H),
    (1.5, 0.0),
    (-1.5, 0.0),
)


@dataclass(frozen=True)
class Section:
    """Strand centres in units of d: `sites` (N, 2); `radius` is the largest distance."""

    name: str
    sites: np.ndarray

    @property
    def radius(self) -> float:
        return float(np.hypot(*self.sites.T).max())


def make_section(name: str, count: int) -> Section:
    """`pair_core` (the paper's) or `ring` with N = `count` strands; N = 1..10."""
    if not 1 <= count <= len(_PAIR_CORE):
        raise InputError(
            f"strings.count = {count} cannot be drawn; give 1 to {len(_PAIR_CORE)} strings"
        )
    if name not in ("pair_core", "ring"):
        raise InputError(f"section '{name}' is unknown; choose pair_core or ring")
    if count == 1:
        return Section(name, np.zeros((1, 2)))
    if name == "ring" or count == 3:
        angle = 2.0 * np.pi * np.arange(count) / count
        radius = 0.5 / np.sin(np.pi / count)
        return Section(name, radius * np.stack([np.cos(angle), np.sin(angle)], axis=1))
    return Section(name, np.array(_PAIR_CORE[:count]))


def section_diameter_mm(name: str, count: int, diameter_mm: float) -> float:
    """D of the straight bundle: d (1 + 2 R) (paper, string section model)."""
    return diameter_mm * (1.0 + 2.0 * make_section(name, count).radius)


def closest_strands(sites: np.ndarray, pitch: float, steps: int = 721) -> float:
    """Smallest distance between any two helices through `sites` (same unit as `pitch`)."""
    i, j = np.triu_indices(len(sites), 1)
    if len(i) == 0:
        return np.inf
    radius = np.hypot(*sites.T)
    phase = np.arctan2(sites[:, 1], sites[:, 0])
    shift = pitch * np.linspace(-0.5, 0.5, steps)
    angle = (phase[j] - phase[i])[:, None] + 2.0 * np.pi * shift[None, :] / pitch
    square = (
        (radius[i] ** 2 + radius[j] ** 2)[:, None]
        - 2.0 * (radius[i] * radius[j])[:, None] * np.cos(angle)
        + shift[None, :] ** 2
    )
    return float(np.sqrt(square.min()))


@lru_cache(maxsize=64)
def _widening_table(name: str, count: int) -> tuple[np.ndarray, np.ndarray]:
    """(pitch in units of d, factor): the contact relaxation, solved once a section."""
    sites = make_section(name, count).sites
    pitch = np.geomspace(1.2, 400.0, 160)
    factor = np.array([_widening_at(sites, p) for p in pitch])
    return pitch, np.maximum.accumulate(factor[::-1])[::-1]


def _widening_at(sites: np.ndarray, pitch: float) -> float:
    apart = 1.0 - OVERLAP_ALLOWED
    if closest_strands(sites, pitch) >= apart:
        return 1.0
    low, high = 1.0, 4.0
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (
            (low, middle) if closest_strands(sites * middle, pitch) >= apart else (middle, high)
        )
    return high


def widening(name: str, count: int, pitch_mm: float, diameter_mm: float) -> float:
    """Factor (>= 1) by which the section opens at this pitch so that strands do not merge."""
    pitch, factor = _widening_table(name, count)
    return float(np.interp(np.log(pitch_mm / diameter_mm), np.log(pitch), factor))
