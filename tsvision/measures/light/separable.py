"""Fits of blur and places whose light is linear: least squares of few unknowns about many.

A mean edge's profile is light that is summed, of shapes that blur and the edge's place change. For
given blur and places the light is found at once; what is left over is to be least (variable
projection: Golub and Pereyra 1973). How it changes need not be tried out place by place: an edge
moved shows its profile's slope, and a Gaussian blur of sd b, grown, b times its second derivative
(the heat equation); what light could make up for of that is taken off (Kaufman 1975). That is the
information that blur and places have once the light is not known.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import OptimizeResult, least_squares, nnls

from tsvision.measures.edges.shading import PLACE_RANGE_PX, TEMPLATE_STEP_PX, looked_up

# Of the cost and of the unknowns, in their own scale: a thousandth of what noise leaves unknown.
COST_TOLERANCE, STEP_TOLERANCE = 1e-5, 1e-4
MOST_STEPS = 3000  # of a fit of light that is nowhere negative
TRIED = 1e-3  # of an unknown: by which it is changed where slopes are not known

FAR_OUT = 0.7  # of the places there may be
SAME = 0.01  # of any unknown, px or rad, by which two fits that ended at one place differ

Residuals = Callable[[np.ndarray], np.ndarray]
Bounds = list[tuple[float, float]]


@dataclass(frozen=True)
class Solved:
    """For blur, places and what else is not linear, q (P,): the light (C,) by least squares, the
    design (R, C) that explains what is seen by it, and all residuals (R,) in their sd."""

    q: np.ndarray
    design: np.ndarray
    light: np.ndarray
    off: np.ndarray


class Separable(ABC):
    """What is to be explained by light that is nowhere negative."""

    def __init__(self) -> None:
        self._last: Solved | None = None

    @abstractmethod
    def rows(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Design (R, C) and target (R,) in units of the values' sd."""

    def solve(self, q: np.ndarray) -> Solved:
        """Kept until another is asked for: slopes are asked for where residuals were."""
        if self._last is None or not np.array_equal(q, self._last.q):
            design, target = self.rows(q)
            light, _ = nnls(design, target, maxiter=MOST_STEPS)
            self._last = Solved(q.copy(), design, light, design @ light - target)
        return self._last

    def residuals(self, q: np.ndarray) -> np.ndarray:
        return self.solve(q).off

    def forget(self) -> None:
        """What was solved: sds have changed."""
        self._last = None


def far_out_px(rho_px: float) -> float:
    """Place where an edge is sought as well. Where a lamp's light ends short of a limb that sends
    none, what is seen is the terminator: the edge then lies far outside, and a fit has to be told
    to look there."""
    return max(-0.7 * rho_px, FAR_OUT * PLACE_RANGE_PX[0])


def fit_separable(
    residuals: Residuals,
    slopes: Residuals | None,
    start: np.ndarray,
    bounds: Bounds,
    x_scale: list[float],
    max_nfev: int,
) -> OptimizeResult:
    """Unknowns (P,) within bounds that make residuals (R,) least, their slopes (R, P) known or
    tried out."""
    return least_squares(
        residuals,
        start,
        jac="2-point" if slopes is None else slopes,
        bounds=tuple(zip(*bounds, strict=True)),
        diff_step=TRIED if slopes is None else None,
        x_scale=x_scale,
        ftol=COST_TOLERANCE,
        xtol=STEP_TOLERANCE,
        max_nfev=max_nfev,
    )


def distinct(fits: list[OptimizeResult]) -> list[OptimizeResult]:
    """The best first, without those that ended where a better one did."""
    kept: list[OptimizeResult] = []
    for fit in sorted(fits, key=lambda f: f.cost):
        if all(np.abs(fit.x - other.x).max() > SAME for other in kept):
            kept.append(fit)
    return kept


def changes(profile: np.ndarray, t_px: np.ndarray, blur_px: float) -> tuple[np.ndarray, np.ndarray]:
    """How a profile (T,) on the template's grid changes at places t_px (K,) inside its edge, per px
    of the picture's blur and per px that the edge lies further in, (K,) each."""
    steep = np.gradient(profile, TEMPLATE_STEP_PX)
    bent = np.gradient(steep, TEMPLATE_STEP_PX)
    by_place, by_spread = looked_up(np.stack([steep, bent]), t_px).T
    # The mean over a px adds to the square of the blur's sd: b db is the same of both.
    return blur_px * by_spread, -by_place


def projected(moved: np.ndarray, design: np.ndarray, light: np.ndarray) -> np.ndarray:
    """How residuals (R,) change with each unknown, of what they would (R, P) under the same light,
    where all light (C,) that there is may change along: by the design (R, C)."""
    basis, _ = np.linalg.qr(design[:, light > 0.0])
    return np.asarray(moved - basis @ (basis.T @ moved))
