"""Two peers on the battery's tables: a tolerance-whitened matched filter, and tuned STLSQ.

Both are handed what a user would have to supply: the shelf's signatures (finite effects at the
mechanisms' own starting values), the inputs' tolerances as covariance, and the noise level that
the diagnosis found. STLSQ is pysindy's; its threshold was tuned on other seeds.
"""

from __future__ import annotations

import numpy as np

from tsvision.diagnosis.candidates import usable_shapes
from tsvision.diagnosis.fit import Fit, fit
from tsvision.diagnosis.larger_sets import SCREENED_STARTS, change_by
from tsvision.diagnosis.layout import start_grid
from tsvision.diagnosis.noise import Noise
from tsvision.diagnosis.problem import Problem, prepare
from tsvision.diagnosis.table import Table
from tsvision.mechanisms import MECHANISMS, Simulation
from tsvision.mechanisms.shelf import Part

FILTER_ALARM = 30.0  # half the squared signal-to-noise ratio, tuned on seeds of its own
FILTER_SECOND = 0.05
STLSQ_THRESHOLD = 8.0  # of coefficients of unit columns, in units of the noise; tuned
STLSQ_ALPHA = 0.01


def signatures(problem: Problem, sigma: np.ndarray) -> tuple[list[str], np.ndarray, np.ndarray]:
    """Names (K,), whitened signatures (n, K) and the whitened residual (n,) of the base."""
    nominal = _nominal(problem)
    noise = Noise(problem, sigma, np.zeros(len(sigma)))
    residual = noise.whiten(problem.table.value - nominal.predicted)
    residual = np.clip(residual, -1e6, 1e6)
    tolerances = noise.whiten(nominal.jacobian[None])[0]
    # (I + J J')^-1/2 by the singular values of J: the tolerances' covariance is whitened away.
    left, values, _ = np.linalg.svd(tolerances, full_matrices=False)
    shrink = 1.0 / np.sqrt(1.0 + values**2) - 1.0

    def whiten(array: np.ndarray) -> np.ndarray:
        return array + (array @ left * shrink) @ left.T

    names: list[str] = []
    columns: list[np.ndarray] = []
    for name in MECHANISMS:
        for shape in usable_shapes(problem, name)[:1]:
            starts = start_grid(shape.parameters, SCREENED_STARTS)
            change = noise.whiten(change_by(problem, nominal, Part(name, shape), starts))
            names += [name] * len(starts)
            columns += list(whiten(change))
    return names, np.array(columns).T, whiten(residual)


def _nominal(problem: Problem) -> Fit:
    """The base with all inputs as stated, with the Jacobian of its nuisances."""
    fitted = fit(problem, Simulation(base=problem.base), most_steps=0)
    zero = np.zeros_like(fitted.z)
    rows = problem.predict(Simulation(base=problem.base), zero[None, :0], zero[None])[0]
    return Fit(
        **{
            **fitted.__dict__,
            "z": zero,
            "offsets": np.zeros_like(fitted.offsets),
            "predicted": rows,
        }
    )


def matched_filter(names: list[str], columns: np.ndarray, residual: np.ndarray) -> set[str]:
    """The strongest signature over the alarm, and a second that still stands out without it."""
    found: set[str] = set()
    first = 0.0
    left = residual
    for _ in range(2):
        norm = np.linalg.norm(columns, axis=0) + 1e-12
        score = 0.5 * (columns.T @ left / norm) ** 2
        score[[n in found for n in names]] = 0.0
        best = int(np.argmax(score))
        if score[best] < max(FILTER_ALARM, FILTER_SECOND * first):
            break
        first = max(first, score[best])
        found.add(names[best])
        unit = columns[:, best] / norm[best]
        left = left - unit * (unit @ left)
        columns = columns - np.outer(unit, unit @ columns)
    return found


def stlsq(names: list[str], columns: np.ndarray, residual: np.ndarray) -> set[str]:
    """Mechanisms with a coefficient left after sequentially thresholded least squares."""
    import warnings

    from pysindy.optimizers import STLSQ

    norm = np.linalg.norm(columns, axis=0) + 1e-12
    score = np.abs(columns.T @ residual) / norm
    # One column a mechanism, the start that matches best: collinear columns share a coefficient
    # among them, and thresholding then throws all of them out.
    keep = [
        max((i for i, n in enumerate(names) if n == name), key=lambda i: score[i])
        for name in dict.fromkeys(names)
    ]
    keep = [i for i in keep if norm[i] > 1e-9]
    unit = columns[:, keep] / norm[keep]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model = STLSQ(threshold=STLSQ_THRESHOLD, alpha=STLSQ_ALPHA, max_iter=50)
        model.fit(unit, residual[:, None])
    weight = np.abs(np.ravel(model.coef_))
    return {names[i] for i, w in zip(keep, weight, strict=True) if w > 0}


def ask_peers(table: Table, sigma: np.ndarray) -> dict[str, tuple[str, ...]]:
    """What each peer names, sorted."""
    names, columns, residual = signatures(prepare(table), sigma)
    # Outliers would own the least squares: both peers get the residuals cut at six sigma.
    return {
        "matched filter": tuple(sorted(matched_filter(names, columns, residual))),
        "STLSQ": tuple(sorted(stlsq(names, columns, residual))),
    }
