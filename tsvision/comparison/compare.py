"""Each model as given, refitted, and refitted without the group that it then predicts."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import minimize

from tsvision.comparison.sample import Sample
from tsvision.models import MODELS, DisplacementModel

BASE = "constant_radius"
REACH = np.log(5.0)  # a refit searches nominal / 5 to nominal × 5
GRID = {1: 61, 2: 31}  # points a parameter, by the number of parameters


@dataclass(frozen=True)
class Result:
    """One model on one sample. RMSEs in mm, NaN where the model has no answer.

    `as_given_mm` uses the stated geometry and fits nothing, so it is out of sample as it stands;
    `refit_mm` is in sample; `held_out_mm` predicts each group from a refit to the others.
    `defined` is the share of rows at which the model, as given, has a solution at all.
    """

    model: str
    as_given_mm: float
    defined: float
    refit_mm: float
    held_out_mm: float
    fold_mm: dict[str, float] = field(default_factory=dict)
    fitted: dict[str, float] = field(default_factory=dict)
    note: str = ""


@dataclass(frozen=True)
class Comparison:
    """All models on one sample, best first by their held-out RMSE."""

    sample: Sample
    results: tuple[Result, ...]
    best: str
    best_mm: float
    base_mm: float
    folds_won: int
    ratio_low: float
    ratio_high: float

    @property
    def ratio(self) -> float:
        """Held-out RMSE of the refitted base model over that of the best one."""
        return self.base_mm / self.best_mm


def compare(sample: Sample) -> Comparison:
    """Run every model of the shelf over the sample."""
    results = [evaluate(model, sample) for model in MODELS.values()]
    results.sort(key=lambda r: (math.isnan(r.held_out_mm), r.held_out_mm))
    best = results[0]
    base = next(r for r in results if r.model == BASE)
    won = sum(best.fold_mm[f] <= base.fold_mm[f] for f in best.fold_mm if f in base.fold_mm)
    low, high = _ratio_interval(base, best, sample)
    return Comparison(
        sample, tuple(results), best.model, best.held_out_mm, base.held_out_mm, won, low, high
    )


def evaluate(model: DisplacementModel, sample: Sample) -> Result:
    """One model as given, refitted, and with each fold left out."""
    if model.only_strings is not None and np.any(sample.strings != model.only_strings):
        return _silent(model, f"holds for N = {model.only_strings} only")
    nominal, guessed = _nominal(model, sample)
    lacking = [name for name in model.parameters if name not in nominal]
    if lacking:
        return _silent(model, f"needs {', '.join(lacking)}")
    every = np.ones(sample.turns.size, dtype=bool)
    x = model.displacement_mm(sample.turns, **nominal)
    given = _rmse(x - sample.displacement_mm) if not guessed else math.nan
    scale = _fit(model, sample, nominal, every)
    fold_mm, squares = {}, 0.0
    for k, name in enumerate(sample.folds):
        out = sample.fold == k
        without = _fit(model, sample, nominal, ~out)
        error = _residual(model, sample, nominal, without, out)
        fold_mm[name] = _rmse(error)
        squares += float(np.sum(error**2))
    return Result(
        model=model.name,
        as_given_mm=given,
        defined=float(np.mean(np.isfinite(x))),
        refit_mm=_rmse(_residual(model, sample, nominal, scale, every)),
        held_out_mm=math.sqrt(squares / sample.turns.size) if np.isfinite(squares) else math.nan,
        fold_mm=fold_mm,
        fitted={
            name: float(np.median(nominal[name]) * s)
            for name, s in zip(model.free, scale, strict=True)
        },
        note=f"{', '.join(guessed)} not given: fitted only" if guessed else "",
    )


def _silent(model: DisplacementModel, why: str) -> Result:
    return Result(model.name, math.nan, 0.0, math.nan, math.nan, note=why)


def _nominal(model: DisplacementModel, sample: Sample) -> tuple[dict[str, np.ndarray], list[str]]:
    """The model's keywords; a free one that is unknown starts from a guess and is named."""
    nominal = {name: sample.known[name] for name in model.parameters if name in sample.known}
    guessed = []
    if "pitch_mm" in model.free and "pitch_mm" not in nominal:
        # Half way through the data is as good a start as any; the search spans a factor of 25.
        nominal["pitch_mm"] = sample.known["twisting_zone_mm"] / (sample.turns.max() / 2)
        guessed.append("pitch_mm")
    return nominal, guessed


def _rmse(error: np.ndarray) -> float:
    return float(np.sqrt(np.mean(error**2))) if np.all(np.isfinite(error)) else math.nan


def _residual(
    model: DisplacementModel,
    sample: Sample,
    nominal: dict[str, np.ndarray],
    scale: np.ndarray,
    rows: np.ndarray,
) -> np.ndarray:
    keywords = {name: value[rows] for name, value in nominal.items()}
    for name, factor in zip(model.free, scale, strict=True):
        keywords[name] = keywords[name] * factor
    return model.displacement_mm(sample.turns[rows], **keywords) - sample.displacement_mm[rows]


def _fit(
    model: DisplacementModel, sample: Sample, nominal: dict[str, np.ndarray], rows: np.ndarray
) -> np.ndarray:
    """Factors on the free parameters that minimise the squared error: a grid, then a polish.

    Least squares on all rows; a value without a solution counts as no displacement at all.
    """
    observed = sample.displacement_mm[rows]

    def cost(log_scale: np.ndarray) -> float:
        error = _residual(model, sample, nominal, np.exp(log_scale), rows)
        return float(np.sum(np.where(np.isfinite(error), error, observed) ** 2))

    free = len(model.free)
    axes = np.meshgrid(*[np.linspace(-REACH, REACH, GRID[free])] * free, indexing="ij")
    grid = np.column_stack([axis.ravel() for axis in axes])
    start = grid[int(np.argmin([cost(point) for point in grid]))]
    polished = minimize(cost, start, method="Nelder-Mead", options={"xatol": 1e-7, "fatol": 1e-10})
    return np.exp(polished.x)


def _ratio_interval(base: Result, best: Result, sample: Sample) -> tuple[float, float]:
    """95 % interval of base/best held-out RMSE by resampling whole folds (few: read with care)."""
    if math.isnan(base.held_out_mm) or base.model == best.model:
        return 1.0, 1.0
    sizes = np.bincount(sample.fold, minlength=len(sample.folds))
    squares = np.array(
        [[r.fold_mm[name] ** 2 for name in sample.folds] for r in (base, best)]
    ) * sizes  # fmt: skip
    drawn = np.random.default_rng(20).integers(0, len(sizes), (2000, len(sizes)))
    ratios = np.sqrt(squares[0][drawn].sum(axis=1) / squares[1][drawn].sum(axis=1))
    low, high = np.quantile(ratios, [0.025, 0.975])
    return float(low), float(high)
