"""How likely a reading is to leave one set of causes standing, read all along the runs at hand.

Each rival predicts the new readings with its own uncertainty, a Gaussian. Were one of them true,
the log evidence that it gains on another by them has a mean (the Kullback-Leibler divergence) and a
spread; with what the table has for both already follows how likely it is that the other leaves the
class. What parts two rivals splendidly is no use where a third stays beside the true one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from tsvision.diagnosis.confounding import SMALLER_WIDTH
from tsvision.diagnosis.fit import Fit
from tsvision.diagnosis.linearised import STEP
from tsvision.diagnosis.problem import Problem
from tsvision.diagnosis.select import CLASS_WIDTH, SECOND_ALARM


@dataclass(frozen=True)
class Rival:
    """A set that may be true, as it was fitted, with the evidence of all its shapes."""

    fitted: Fit
    log_evidence: float


@dataclass(frozen=True)
class Expected:
    """New readings as a rival expects them: `mean` (m,), and by its parameters' uncertainty
    `spread` (m, P), whose square is their covariance."""

    mean: np.ndarray
    spread: np.ndarray

    @property
    def variance(self) -> np.ndarray:
        """Of each reading alone, the noise apart, (m,)."""
        variance: np.ndarray = np.sum(self.spread**2, axis=1)
        return variance


def expected(asked: Problem, fitted: Fit) -> Expected:
    """What a fit expects of the rows of `asked`, nuisances that the fit did not know included."""
    old = len(fitted.z)
    new = asked.nuisances
    used = old + len(fitted.u)
    position = np.array([*range(old), *range(new, new + len(fitted.u))])
    centre = np.zeros(new + len(fitted.u))
    centre[position] = np.concatenate([fitted.z, fitted.u])
    covariance = np.eye(len(centre))
    covariance[np.ix_(position, position)] = fitted.covariance[:used, :used]
    block = centre + np.vstack([np.zeros(len(centre)), STEP * np.eye(len(centre))])
    rows = asked.predict(fitted.simulation, block[:, new:], block[:, :new])
    slope = (rows[1:] - rows[0]) / STEP
    # By its eigenvectors: what the data fix to the last digit may have lost its sign.
    values, vectors = np.linalg.eigh(covariance)
    return Expected(rows[0], slope.T @ (vectors * np.sqrt(np.maximum(values, 0.0))))


def chance_to_resolve(
    rivals: list[Rival], seen: list[Expected], noise: np.ndarray, base: Rival, alarm: float
) -> float:
    """Probability that only the true one of the `rivals` stays in the class, each as likely to be
    true as the table has it. `seen` is what each expects of the readings and, last, what the base
    does, which would have to stay `alarm` behind."""
    evidence = np.array([r.log_evidence for r in rivals])
    share = np.exp(evidence - evidence.max())
    covariance = [s.spread @ s.spread.T + np.diag(noise**2) for s in seen]
    others = [*rivals, base]
    chances = []
    for a, true in enumerate(rivals):
        beaten = [1.0]
        for b, other in enumerate(others):
            if b == a:
                continue
            need = alarm if other is base else _width(true.fitted, other.fitted)
            gain, spread = _gain(seen[a].mean - seen[b].mean, covariance[a], covariance[b])
            ahead = true.log_evidence - other.log_evidence + gain - need
            beaten.append(float(ndtr(ahead / max(spread, 1e-9))))
        chances.append(min(beaten))
    return float(share @ np.array(chances) / share.sum())


def _width(true: Fit, other: Fit) -> float:
    """How far the other has to fall behind the true one to be no rival of it any more."""
    more = len(other.names) - len(true.names)
    if more > 0:  # it has to earn its further cause
        return -SECOND_ALARM
    return CLASS_WIDTH if more == 0 else SMALLER_WIDTH


def _gain(apart: np.ndarray, own: np.ndarray, other: np.ndarray) -> tuple[float, float]:
    """Mean and standard deviation of the log evidence that the true one gains on another: `apart`
    (m,) is how far their means differ, `own` and `other` (m, m) what either allows for."""
    lower = np.linalg.cholesky(other)
    off = np.linalg.solve(lower, apart)
    ratio = np.linalg.solve(lower, np.linalg.solve(lower, own).T)
    excess = ratio - np.eye(len(off))
    gain = 0.5 * (off @ off + np.trace(excess) - np.linalg.slogdet(ratio)[1])
    return float(gain), float(np.sqrt(off @ ratio @ off + 0.5 * np.sum(excess**2)))
