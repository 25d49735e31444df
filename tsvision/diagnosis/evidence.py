"""Laplace's log evidence of a fit, cut at the bounds of its priors."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

from tsvision.diagnosis.layout import Layout
from tsvision.diagnosis.noise import Noise, minus_log_likelihood, noise_cost
from tsvision.diagnosis.problem import Problem, to_value

MISLED = 0.1  # how often what the pictures of a run showed is wrong, or not there to be seen


def log_evidence_of(
    problem: Problem,
    layout: Layout,
    theta: np.ndarray,
    covariance: np.ndarray,
    innovation: np.ndarray,
    noise: Noise,
) -> float:
    """At the mode `theta` (P,) with its `covariance` (P, P); `innovation` (n,) from `noise`."""
    return (
        -float(minus_log_likelihood(innovation, noise))
        - _prior_cost(layout, theta)
        + layout.log_prior
        + 0.5 * float(np.linalg.slogdet(covariance)[1])
        + _inside(layout, theta, covariance)
        + _seen(problem, layout, theta)
        - noise_cost(problem, noise.sigma, noise.rho)
    )


def _prior_cost(layout: Layout, theta: np.ndarray) -> float:
    """The penalty of the Gaussian priors alone: the ridge on uniform ones is none of the prior."""
    gaussian = np.ones(layout.total, dtype=bool)
    gaussian[layout.nz : layout.moved] = layout.curved
    return 0.5 * float(np.sum(theta[gaussian] ** 2))


def _inside(layout: Layout, theta: np.ndarray, covariance: np.ndarray) -> float:
    """Log share of the posterior's Gaussian that lies within the bounds."""
    own = slice(layout.nz, layout.moved)
    sd = np.sqrt(np.diag(covariance)[own])
    inside = ndtr((layout.high[own] - theta[own]) / sd) - ndtr((layout.low[own] - theta[own]) / sd)
    return float(np.sum(np.log(np.maximum(inside, 1e-12))))


def _seen(problem: Problem, layout: Layout, theta: np.ndarray) -> float:
    """Log odds of what pictures showed, given the onsets at `theta`, against not having looked."""
    odds = 0.0
    for i, (key, p) in enumerate(layout.keys, start=layout.nz):
        mechanism, _, name = key.partition(".")
        if name != "onset_turns":
            continue
        onset = float(to_value(p, theta[i], problem.reference))
        for sight in problem.table.sightings:
            if sight.mechanism != mechanism:
                continue
            ratio = 0.0
            if sight.observed:
                width = max(sight.high - sight.low, 0.1 * problem.reference.span_turns)
                away = max(sight.low - onset, onset - sight.high, 0.0) / (0.25 * width)
                ratio = problem.reference.span_turns / width * float(np.exp(-0.5 * away**2))
            odds += float(np.log(MISLED + (1.0 - MISLED) * ratio))
    return odds
