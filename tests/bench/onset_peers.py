"""What a user of `ruptures` would do with the same series: PELT as its manual shows it, and the
best of a grid of searches, costs and penalties, chosen with the truth at hand."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Callable

import numpy as np

Detector = Callable[[np.ndarray], list[int]]


def detectors() -> dict[str, Detector]:
    """Name -> function from a series (n,) to the change points (indices)."""
    import ruptures

    def pelt(model: str, penalty: float) -> Detector:
        return lambda y: ruptures.Pelt(model=model, min_size=2, jump=1).fit_predict(y, penalty)[:-1]

    def one(search: type, model: str) -> Detector:
        return lambda y: search(model=model, min_size=2, jump=1).fit_predict(y, n_bkps=1)[:-1]

    def bottom_up(model: str, penalty: float) -> Detector:
        return lambda y: ruptures.BottomUp(model=model, min_size=2, jump=1).fit_predict(
            y, pen=penalty
        )[:-1]

    found: dict[str, Detector] = {"PELT rbf, pen 10 (manual)": pelt("rbf", 10.0)}
    for model, penalty in itertools.product(("l1", "l2", "rbf"), (3, 10, 30)):
        found[f"PELT {model}, pen {penalty}"] = pelt(model, penalty)
    for penalty in (10, 30):
        found[f"BottomUp l1, pen {penalty}"] = bottom_up("l1", penalty)
    for model in ("l1", "l2"):
        found[f"Dynp {model}, one change"] = one(ruptures.Dynp, model)
        found[f"Binseg {model}, one change"] = one(ruptures.Binseg, model)
    return found


def standardised(series: np.ndarray) -> np.ndarray:
    """Gaps bridged, scaled by the robust noise of single values, so that a penalty means the
    same for every series."""
    good = np.isfinite(series)
    place = np.arange(len(series))
    filled = np.interp(place, place[good], series[good]) if good.sum() > 1 else np.zeros(len(place))
    noise = 1.4826 * np.median(np.abs(np.diff(filled, n=2))) / np.sqrt(6)
    return (filled - filled[0]) / max(noise, 1e-3)


def onset_by(detector: Detector, series: np.ndarray, turns: np.ndarray, threshold: float) -> float:
    """Turns at the first change after which the raw series stays above `threshold` at its median
    (a user knows the criterion); NaN where there is no such change."""
    if len(series) < 8 or not np.isfinite(series).any():
        return float("nan")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            changes = detector(standardised(series))
        except Exception as problem:  # a peer that fails counts as one that does not answer
            if type(problem).__name__ not in ("BadSegmentationParameters", "ValueError"):
                raise
            return float("nan")
    for change in changes:
        if np.nanmedian(series[change:]) >= threshold:
            return float(turns[change])
    return float("nan")
