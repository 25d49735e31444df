"""The mean and scatter of most of a set of colours, whatever the rest of them shows.

Samples along the strings' axis hold the separator, the connector's shaft, a clip: a tenth of them,
far off, and of another colour. Their scatter would tell a discriminant to shun that very hue.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import gammainc, gammaincinv

KEPT = 0.75  # of the samples: less than all that is hardware in any sensible view
STEPS = 5
FAINT = 1e-9  # added to the scatter (linear light squared), so that grey samples have an inverse


@dataclass(frozen=True)
class Cloud:
    """mean (C,) and scatter (C, C) of colours in linear light."""

    mean: np.ndarray
    scatter: np.ndarray


def central_cloud(samples: np.ndarray) -> Cloud:
    """Minimum covariance determinant (Rousseeuw) by concentration steps from the median: the
    three quarters of `samples` (n, C) nearest to their own mean in their own scatter, which is
    then made that of a whole normal cloud."""
    dimensions = samples.shape[1]
    away = np.linalg.norm(samples - np.median(samples, axis=0), axis=1)
    for _ in range(STEPS):
        kept = samples[away <= np.quantile(away, KEPT)]
        mean, scatter = kept.mean(axis=0), np.cov(kept.T)
        off = samples - mean
        precision = np.linalg.inv(scatter + FAINT * np.eye(dimensions))
        away = np.einsum("ni,ij,nj->n", off, precision, off)
    return Cloud(mean, scatter * _consistency(dimensions))


def _consistency(dimensions: int) -> float:
    """What the scatter of a normal cloud's central part falls short by: its squared distances
    follow the chi-squared law of as many degrees of freedom as there are dimensions."""
    reach = gammaincinv(0.5 * dimensions, KEPT)
    return float(KEPT / gammainc(0.5 * dimensions + 1.0, reach))
