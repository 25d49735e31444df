"""How fits to the same edges count against each other."""

from __future__ import annotations

import numpy as np

from tsvision.measures.helix import HelixFit
from tsvision.measures.silhouette import KC, RC, K

POOR = 0.45  # cost above which a fit is not believed without having looked further, ...
PLAIN = 0.12  # ... unless so little of it is left by what it explains of the light inside


def doubt(p: np.ndarray, expected_rate: float) -> float:
    """By how much the cost of a fit (9,) counts more, 1 or above, because strands and coils turn
    much more often, or much less, than the motor has. Where two fits are nearly as good the motor
    decides; a good fit stands against it, for a motor's count can be wrong."""
    total = float(p[K] + (p[KC] if p[RC] > 0.0 else 0.0))
    if not (np.isfinite(expected_rate) and expected_rate > 0.0) or total <= 0.0:
        return 1.0
    off = np.log(total / expected_rate)
    return float(np.exp(0.5 * max(off - 0.2, -0.8 - off, 0.0)))


def weighed(fit: HelixFit, expected_rate: float) -> float:
    """Cost of a fit as it counts against others of the same edges: less by as much as it explains
    of the light inside the outline (in amplitude, as its residuals go), more where the motor speaks
    against it."""
    unexplained = float(np.sqrt(1.0 - fit.relief))
    return fit.cost * doubt(fit.p, expected_rate) * unexplained


def believed(fit: HelixFit) -> bool:
    """Whether a fit need not be looked further for."""
    return fit.cost < POOR or fit.cost * (1.0 - fit.relief) < PLAIN


def unsure(fit: HelixFit) -> bool:
    """Whether a coil may be another one than was fitted."""
    return fit.coiled and not believed(fit)
