"""The noun of this folder: where both edges of a bundle lie, and how surely."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tsvision.measures.numeric.line import slope_of

SEEN = 0.2  # weight from which an edge was found
SLOPE_SD_PX = 1.0  # over which the slope of an edge is told


@dataclass(frozen=True)
class Edges:
    """Two edges of a strip: n of the upper (larger n) and lower edge at s_px, weights 0..1.

    trust: by how much less than its weights either side counts in a fit. Where a dark limb's light
    ends depends on where the strands around it lie, and follows the outline roughly only.
    blur_px: of the picture the edges were found in (sd), which rounds off what they show of the
    outline along s.
    light: (R, M) what is seen between and beside the edges, rows evenly about n = 0; None where
    only edges are known. painted: of strands of several colours, whose bands are no relief.
    half_slope: slope of the outline at which a residual along n, squared, counts half of what it
    does where the outline is level; 1 is to count by how far it lies from the edge."""

    s_px: np.ndarray
    upper_px: np.ndarray
    lower_px: np.ndarray
    upper_weight: np.ndarray
    lower_weight: np.ndarray
    trust: tuple[float, float] = (1.0, 1.0)
    blur_px: float = 0.0
    light: np.ndarray | None = None
    painted: bool = False
    half_slope: float = float("inf")

    def window(self, s_low: float, s_high: float) -> Edges:
        """The columns in s_low..s_high, which lie in order: nothing is copied."""
        first, last = self.s_px.searchsorted(s_low), self.s_px.searchsorted(s_high, "right")
        keep = slice(first, last)
        return Edges(
            self.s_px[keep],
            self.upper_px[keep],
            self.lower_px[keep],
            self.upper_weight[keep],
            self.lower_weight[keep],
            self.trust,
            self.blur_px,
            None if self.light is None else self.light[:, keep],
            self.painted,
            self.half_slope,
        )

    def within(self, inside: np.ndarray) -> Edges:
        """The same with no weight where `inside` (M,) is False."""
        upper, lower = (np.where(inside, w, 0.0) for w in (self.upper_weight, self.lower_weight))
        return replace(self, upper_weight=upper, lower_weight=lower)

    @property
    def relief_light(self) -> np.ndarray | None:
        """The light whose ridges are the strands' relief; None where none shows it."""
        return None if self.painted else self.light

    @property
    def both_seen(self) -> np.ndarray:
        """Columns (M,) bool in which both edges were found."""
        return np.minimum(self.upper_weight, self.lower_weight) > SEEN

    @property
    def shares(self) -> tuple[float, float]:
        """By how much the upper and the lower edge are trusted, together 1."""
        upper, lower = self.trust
        return upper / (upper + lower), lower / (upper + lower)

    @cached_property
    def observed(self) -> np.ndarray:
        """The upper and the lower edge, (2, M), px."""
        return np.array([self.upper_px, self.lower_px])

    @cached_property
    def trusted(self) -> np.ndarray:
        """Weights (2, M) of the upper and the lower edge in a fit."""
        return np.array(self.trust)[:, None] * np.array([self.upper_weight, self.lower_weight])

    @cached_property
    def worth(self) -> np.ndarray:
        """Of a squared residual along n of either edge (2, M), by the outline's slope there."""
        if np.isinf(self.half_slope):
            return np.ones((2, self.s_px.size))
        both = ((self.upper_px, self.upper_weight), (self.lower_px, self.lower_weight))
        slopes = np.stack([slope_of(edge, weight > 0.0, SLOPE_SD_PX) for edge, weight in both])
        return np.asarray(1.0 / (1.0 + (slopes / self.half_slope) ** 2))
