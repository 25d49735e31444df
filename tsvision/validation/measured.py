"""Which bundle model do one's own measured diameters support, and by how much?

Each model predicts D for N strings of diameter d. A model is judged by its marginal likelihood:
the measured diameters scatter about it by their own uncertainty, by that of d, and by a misfit τ
of the model itself that is not known and is integrated out (half-Cauchy, scale 3 % of D). A
model with a fitted constant has that integrated out too (flat in its range), so freedom costs.
Equal prior odds; the weights sum to 1. One recording can decide little, and then says so.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from tsvision.errors import InputError
from tsvision.models import SECTIONS, packing_fraction

MISFIT_SCALE = 0.03  # of the mean diameter
WIDENING_RANGE = (1.0, 2.2)  # c of D = c d √N: from solid to a quarter filled
DECISIVE = 3.0  # odds under which nothing is decided
GRID = 400


@dataclass(frozen=True)
class Bundles:
    """Measured bundles, arrays of shape (n,); `sd_mm` the standard uncertainty of D, with that
    of d in `string_sd_mm`. `load_N` NaN where unknown. `source` names where each came from."""

    source: tuple[str, ...]
    strings: np.ndarray
    string_diameter_mm: np.ndarray
    string_sd_mm: np.ndarray
    diameter_mm: np.ndarray
    sd_mm: np.ndarray
    load_N: np.ndarray


@dataclass(frozen=True)
class Verdict:
    """One bundle model against all bundles. mm; `left_out_mm` predicts each number of strings
    from a fit to the others (equals `rmse_mm` for a model without a fitted constant)."""

    model: str
    rmse_mm: float
    bias_mm: float
    left_out_mm: float
    log_evidence: float
    weight: float
    predicted_mm: tuple[float, ...]
    fitted: dict[str, float]


@dataclass(frozen=True)
class Support:
    """All models, best first; `odds` of the best over `rival`, the best that is another model
    (the two packing fractions are one); `decided` when they suffice.

    `load_slope` is the slope of the best model's relative error against log10(load), with its
    95 % interval; NaN with fewer than three loads.
    """

    verdicts: tuple[Verdict, ...]
    odds: float
    rival: str
    decided: bool
    load_slope: tuple[float, float, float]


def judge(bundles: Bundles) -> Support:
    """Weigh every bundle section of the shelf, and the packing fraction with c fitted here."""
    scored = [_fixed(name, bundles) for name in SECTIONS]
    scored.append(_packing_fitted(bundles))
    top = max(v.log_evidence for v in scored)
    total = sum(math.exp(v.log_evidence - top) for v in scored)
    weighed = sorted(
        (replace(v, weight=math.exp(v.log_evidence - top) / total) for v in scored),
        key=lambda v: -v.weight,
    )
    rival = next(v for v in weighed if _family(v.model) != _family(weighed[0].model))
    odds = math.exp(min(weighed[0].log_evidence - rival.log_evidence, 700.0))
    slope = _load_slope(weighed[0], bundles)
    return Support(tuple(weighed), odds, rival.model, odds >= DECISIVE, slope)


def _family(model: str) -> str:
    return model.removesuffix("_refitted")


def _fixed(name: str, bundles: Bundles) -> Verdict:
    model = SECTIONS[name].bundle_diameter_mm
    predicted = model(bundles.strings, bundles.string_diameter_mm)
    error = predicted - bundles.diameter_mm
    rmse = float(np.sqrt(np.mean(error**2)))
    evidence = float(np.logaddexp.reduce(_log_likelihoods(predicted, bundles)))
    return Verdict(
        name, rmse, float(error.mean()), rmse, evidence, 0.0, tuple(predicted.tolist()), {}
    )


def _packing_fitted(bundles: Bundles) -> Verdict:
    """D = c d √N with c integrated over its range; N = 1 knows nothing of c."""
    thick = bundles.strings > 1
    values = np.linspace(*WIDENING_RANGE, GRID)
    each = [
        np.logaddexp.reduce(_log_likelihoods(_packing(bundles, float(c)), bundles)) for c in values
    ]
    evidence = float(np.logaddexp.reduce(each) - math.log(GRID))
    best = _best_widening(bundles, thick)
    predicted = _packing(bundles, best)
    error = predicted - bundles.diameter_mm
    return Verdict(
        "packing_fraction_refitted",
        float(np.sqrt(np.mean(error**2))),
        float(error.mean()),
        _left_out(bundles, thick),
        evidence,
        0.0,
        tuple(predicted.tolist()),
        {"c": best, "filled_share": 1 / best**2},
    )


def _packing(bundles: Bundles, widening: float) -> np.ndarray:
    return packing_fraction.bundle_diameter_mm(
        bundles.strings, bundles.string_diameter_mm, widening
    )


def _best_widening(bundles: Bundles, rows: np.ndarray) -> float:
    if not rows.any():
        return packing_fraction.paper_widening()
    return packing_fraction.fit_widening(
        bundles.strings[rows], bundles.string_diameter_mm[rows], bundles.diameter_mm[rows]
    )


def _left_out(bundles: Bundles, thick: np.ndarray) -> float:
    """RMSE when every N above 1 is predicted by c fitted to the others; NaN with one N only."""
    counts = np.unique(bundles.strings[thick])
    if counts.size < 2:
        return float("nan")
    errors: list[float] = []
    for count in counts:
        out = bundles.strings == count
        c = _best_widening(bundles, thick & ~out)
        errors += (_packing(bundles, c) - bundles.diameter_mm)[out].tolist()
    return float(np.sqrt(np.mean(np.square(errors))))


def _log_likelihoods(predicted: np.ndarray, bundles: Bundles) -> np.ndarray:
    """Log-likelihood at each quantile of the misfit's prior, shared weight included; (GRID,)."""
    share = (np.arange(GRID) + 0.5) / GRID
    scale = MISFIT_SCALE * float(bundles.diameter_mm.mean())
    misfit = stats.halfcauchy.ppf(share) * scale
    by_string = predicted / bundles.string_diameter_mm * bundles.string_sd_mm
    variance = bundles.sd_mm**2 + by_string**2 + misfit[:, None] ** 2
    square = (bundles.diameter_mm - predicted) ** 2 / variance
    return -0.5 * np.sum(square + np.log(2 * math.pi * variance), axis=1) - math.log(GRID)


def _load_slope(best: Verdict, bundles: Bundles) -> tuple[float, float, float]:
    known = np.isfinite(bundles.load_N) & (bundles.load_N > 0)
    if np.unique(bundles.load_N[known]).size < 3:
        return (math.nan, math.nan, math.nan)
    error = bundles.diameter_mm[known] / np.array(best.predicted_mm)[known] - 1
    found = stats.linregress(np.log10(bundles.load_N[known]), error)
    half = float(stats.t.ppf(0.975, int(known.sum()) - 2)) * float(found.stderr)
    slope = float(found.slope)
    return (slope, slope - half, slope + half)


def check(bundles: Bundles) -> Bundles:
    """The bundles themselves when every one is usable; InputError naming the first that is not."""
    for name in ("strings", "string_diameter_mm", "diameter_mm", "sd_mm"):
        values = getattr(bundles, name)
        wrong = np.flatnonzero(~(np.isfinite(values) & (values > 0)))
        if wrong.size:
            raise InputError(
                f"{bundles.source[wrong[0]]}: {name} is {values[wrong[0]]:g}; give a number above "
                "0 (in the rig, the table, or by --strings, --string-diameter)"
            )
    return bundles
