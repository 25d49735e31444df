"""Parameters with intervals that also cover the other shapes that the data support as well.

A fit's own interval is given its shape. Where a straight line rounded in and one with a first jump
fit alike, their onsets lie further apart than either's interval reaches.
"""

from __future__ import annotations

import numpy as np
from scipy.special import stdtr

from tsvision.diagnosis.candidates import Candidate, weighed
from tsvision.diagnosis.fit import Fit, standing_of
from tsvision.diagnosis.problem import Problem, bounds, parameters, to_value
from tsvision.diagnosis.select import CLASS_WIDTH
from tsvision.mechanisms.shelf import Parameter

TAIL = 0.025
REACH, STEPS = 20.0, 8000  # standard deviations that are looked at, in so many steps


def posterior_over_shapes(
    problem: Problem, candidate: Candidate
) -> dict[str, tuple[float, float, float]]:
    """Each parameter of the best fit with a 95 % interval in its own unit, over all shapes of the
    set within CLASS_WIDTH that have that very parameter, weighed by their evidence."""
    best = candidate.best
    behind = [weighed(best) - weighed(f) for f in candidate.fits]
    fits = zip(candidate.fits, behind, strict=True)
    alike = [(f, np.exp(-b)) for f, b in fits if b < CLASS_WIDTH]
    out = {}
    for key, parameter in parameters(best.simulation):
        having = [(f, share) for f, share in alike if _has(f, key, parameter)]
        low, high = _ends(problem, having, key)
        ends = np.clip([standing_of(problem, best, key)[0], low, high], *bounds(parameter))
        value, a, b = (float(to_value(parameter, u, problem.reference)) for u in ends)
        out[key] = (value, a, b)
    return out


def _has(fitted: Fit, key: str, parameter: Parameter) -> bool:
    """Whether a fit has a parameter that means the same; one of the same name may not."""
    return (key, parameter) in list(parameters(fitted.simulation))


def _ends(problem: Problem, fits: list[tuple[Fit, float]], key: str) -> tuple[float, float]:
    """Where the mixture of the fits' Student-t distributions leaves TAIL on either side, in prior
    units."""
    mean, sd = np.array([standing_of(problem, f, key) for f, _ in fits]).T
    share = np.array([s for _, s in fits])
    u = np.linspace((mean - REACH * sd).min(), (mean + REACH * sd).max(), STEPS)
    dof = np.array([[max(f.dof, 1.0)] for f, _ in fits])
    below = share @ stdtr(dof, (u - mean[:, None]) / sd[:, None]) / share.sum()
    low, high = np.interp([TAIL, 1.0 - TAIL], below, u)
    return float(low), float(high)
