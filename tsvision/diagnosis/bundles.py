"""A bundle model as the simulation that is questioned: measured D against N and d.

Few rows and one or two parameters a cause: evidence is integrated on a grid, exactly, over the
parameters and over how far the stated scatter is from the true one.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from tsvision.diagnosis.bundle_table import LEAST_COUNTS, Diameters
from tsvision.diagnosis.gain import rms
from tsvision.diagnosis.select import CLASS_WIDTH
from tsvision.diagnosis.verdict import Cause, Estimate, Verdict
from tsvision.diagnosis.words import bundle_paragraph
from tsvision.errors import InputError
from tsvision.mechanisms.bundle_causes import BUNDLE_CAUSES, BundleCause
from tsvision.models import SECTIONS

POINTS = {1: 161, 2: 61}  # of each parameter's grid, by the number of causes
REACH = 3.5  # the grid spans so many `typical` about the centre, cut at the bounds
SCALES = np.geomspace(0.3, 6.0, 13)  # true scatter over stated scatter
SCALE_SD = 0.6  # of its log
FURTHER = 5.0  # log evidence that a second cause must gain


@dataclass(frozen=True)
class BundleFit:
    """Causes with their values at the posterior mean, 95 % intervals, and log evidence."""

    causes: tuple[BundleCause, ...]
    values: tuple[float, ...]
    intervals: tuple[tuple[float, float], ...]
    log_evidence: float


def diagnose_bundles(data: Diameters, base: str = "pair_core") -> Verdict:
    """What a section model gets wrong about measured diameters; InputError on too few."""
    if base not in SECTIONS:
        raise InputError(
            f"no section model '{base}', which a table of diameters against N questions; there "
            f"are: {', '.join(SECTIONS)}"
        )
    if len(np.unique(data.count)) < LEAST_COUNTS:
        raise InputError(f"diameters of at least {LEAST_COUNTS} different N are needed")
    fits = fit_all(data, base)
    return _verdict(data, base, fits, _choose(fits))


def _verdict(data: Diameters, base: str, fits: list[BundleFit], chosen: BundleFit) -> Verdict:
    null, several = fits[0], data.count > 1
    sets = _equivalent(fits, chosen)
    explained = bool(chosen.causes)
    status = "no_discrepancy" if not explained else "explained" if len(sets) == 1 else "ambiguous"
    plain = _predict(data, base, null)
    off = rms((data.value - plain)[several])
    extended = rms((data.value - _predict(data, base, chosen))[several])
    gain = _gain(data, base, several)
    causes = _causes_of(chosen)
    ranked = sorted(fits[1:], key=lambda f: -f.log_evidence)
    following = _next(data, base, [f for f in ranked if _names(f) in sets] or ranked[:2], ranked)
    looks = {name: BUNDLE_CAUSES[name].looks for names in sets for name in names}
    told = {"model": base, "rmse_mm": off, "unit": "mm"}
    return Verdict(
        status=status,
        causes=causes,
        equivalent=tuple(sets),
        base=told,
        extended={"rmse_mm": extended, "unit": "mm"},
        gain=gain,
        evidence=tuple(
            {
                "causes": list(_names(f)),
                "log_evidence_gain": round(f.log_evidence - null.log_evidence, 2),
            }
            for f in ranked
        ),
        next_experiment=following if explained else None,
        residual={"lack_of_fit_p": None, "hint": "too few observations to tell"},
        exact_equivalences=(),
        data={
            "rows": len(data.value),
            "observables": ["diameter_mm"],
            "strings": sorted({int(n) for n in data.count}),
            "what_a_picture_would_show": looks,
        },
        model={"base": base, "parts": _parts(chosen)},
        rows=_rows(data, plain, _predict(data, base, chosen)),
        notes=data.notes,
        paragraph=bundle_paragraph(
            status, causes, sets, told, extended, gain, looks, following, _rivals(ranked, sets)
        ),
    )


def _causes_of(chosen: BundleFit) -> tuple[Cause, ...]:
    return tuple(
        Cause(
            c.name,
            c.title,
            "formula",
            c.equation,
            c.claim,
            {c.parameter: Estimate(value, *interval, c.unit)},
        )
        for c, value, interval in zip(chosen.causes, chosen.values, chosen.intervals, strict=True)
    )


def fit_all(data: Diameters, base: str) -> list[BundleFit]:
    """The base alone first, then every single cause and every pair."""
    sets: list[tuple[BundleCause, ...]] = [()]
    sets += [(cause,) for cause in BUNDLE_CAUSES.values()]
    sets += list(itertools.combinations(BUNDLE_CAUSES.values(), 2))
    return [_fit(data, base, causes) for causes in sets]


def _rivals(ranked: list[BundleFit], sets: list[tuple[str, ...]]) -> list[tuple[str, float]]:
    """Single causes outside the class, with how far in log evidence they fall behind."""
    if not sets:
        return []
    best = next(f.log_evidence for f in ranked if _names(f) == sets[0])
    outside = [f for f in ranked if len(f.causes) == 1 and _names(f) not in sets]
    return [(f.causes[0].title.lower(), best - f.log_evidence) for f in outside]


def _names(fit: BundleFit) -> tuple[str, ...]:
    return tuple(cause.name for cause in fit.causes)


def _grid(cause: BundleCause, points: int) -> np.ndarray:
    reach = REACH * cause.typical
    low, high = max(cause.low, cause.centre - reach), min(cause.high, cause.centre + reach)
    return np.linspace(low, high, points)


def _diameter(
    data: Diameters, base: str, causes: tuple[BundleCause, ...], values: list[np.ndarray]
) -> np.ndarray:
    """D (…, n) for parameter values (…, 1); the causes act one after the other."""
    section = SECTIONS[base].bundle_diameter_mm
    found = np.asarray(section(data.count.astype(int), data.string_mm), dtype=float)
    for cause, value in zip(causes, values, strict=True):
        found = cause.diameter_mm(found, data.string_mm, data.count, data.lay_rad, value)
    return found


def _fit(data: Diameters, base: str, causes: tuple[BundleCause, ...]) -> BundleFit:
    axes = [_grid(cause, POINTS[len(causes)]) for cause in causes]
    mesh = [m.reshape(-1, 1) for m in np.meshgrid(*axes, indexing="ij")] if axes else []
    seen = np.atleast_2d(_diameter(data, base, causes, mesh))
    log_prior = np.zeros(len(seen))
    for cause, axis, m in zip(causes, axes, mesh, strict=True):
        density = np.exp(-0.5 * ((axis - cause.centre) / cause.typical) ** 2)
        away = (m[:, 0] - cause.centre) / cause.typical
        log_prior += -0.5 * away**2 - np.log(density.sum())
    log_like, log_scale = _log_likelihood(data, seen)
    joint = log_like + log_prior[:, None] + log_scale[None, :]
    top = joint.max()
    weight = np.exp(joint - top).sum(axis=1)
    log_evidence = float(top + np.log(weight.sum()))
    share = weight / weight.sum()
    values = tuple(float(share @ m[:, 0]) for m in mesh)
    intervals = tuple(_interval(m[:, 0], share) for m in mesh)
    return BundleFit(causes, values, intervals, log_evidence)


def _log_likelihood(data: Diameters, seen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(G, K) Gaussian log likelihoods for every scale of the scatter, and the scales' prior (K,).

    d's own tolerance moves all diameters together; that is part of the covariance.
    """
    common = data.value / data.string_mm * data.string_sd_mm
    off = data.value - seen
    rows = []
    for scale in SCALES:
        covariance = np.diag((scale * data.sd) ** 2) + np.outer(common, common)
        lower = np.linalg.cholesky(covariance)
        white = np.linalg.solve(lower, off.T)
        rows.append(-0.5 * np.sum(white**2, axis=0) - np.sum(np.log(np.diag(lower))))
    prior = -0.5 * (np.log(SCALES) / SCALE_SD) ** 2
    prior -= np.log(np.exp(prior).sum())
    return np.array(rows).T - 0.5 * len(data.value) * np.log(2 * np.pi), prior


def _interval(values: np.ndarray, share: np.ndarray) -> tuple[float, float]:
    order = np.argsort(values)
    mass = np.cumsum(share[order])
    low, high = np.searchsorted(mass, [0.025, 0.975])
    return float(values[order][low]), float(values[order][min(high, len(order) - 1)])


def _choose(fits: list[BundleFit]) -> BundleFit:
    chosen = fits[0]
    for size in (1, 2):
        best = max((f for f in fits if len(f.causes) == size), key=lambda f: f.log_evidence)
        need = FURTHER if chosen.causes else CLASS_WIDTH
        if best.log_evidence - chosen.log_evidence > need:
            chosen = best
    return chosen


def _equivalent(fits: list[BundleFit], chosen: BundleFit) -> list[tuple[str, ...]]:
    if not chosen.causes:
        return []
    near = [
        f
        for f in fits
        if len(f.causes) == len(chosen.causes)
        and chosen.log_evidence - f.log_evidence < CLASS_WIDTH
    ]
    return [_names(f) for f in sorted(near, key=lambda f: -f.log_evidence)]


def _predict(data: Diameters, base: str, fit: BundleFit) -> np.ndarray:
    values = [np.array([[v]]) for v in fit.values]
    return np.atleast_2d(_diameter(data, base, fit.causes, values))[0]


def _gain(data: Diameters, base: str, several: np.ndarray) -> dict[str, object]:
    """Leave one N out, choosing anew each time; over bundles of several strings."""
    before, after, chosen = [], [], []
    for count in np.unique(data.count[several]):
        test = data.count == count
        fits = fit_all(data.take(~test), base)
        best = _choose(fits)
        chosen.append(list(_names(best)))
        before += list((data.value - _predict(data, base, fits[0]))[test])
        after += list((data.value - _predict(data, base, best))[test])
    off, left = np.array(before), np.array(after)
    draw = np.random.default_rng(0).integers(0, len(off), (1000, len(off)))
    ratios = np.sqrt(np.sum(off[draw] ** 2, axis=1) / np.sum(left[draw] ** 2, axis=1))
    low, high = np.quantile(ratios, [0.025, 0.975])
    return {
        "held_out_rmse_base_mm": rms(off),
        "held_out_rmse_extended_mm": rms(left),
        "ratio": rms(off) / rms(left),
        "low": float(low),
        "high": float(high),
        "scheme": "leave-one-N-out",
        "observable": "diameter_mm",
        "chosen_in_folds": chosen,
    }


def _next(
    data: Diameters, base: str, rivals: list[BundleFit], ranked: list[BundleFit]
) -> dict[str, object] | None:
    """The N (up to 10) at which the two likeliest causes differ most, against the scatter."""
    pair = (rivals + [f for f in ranked if f not in rivals])[:2]
    if len(pair) < 2:
        return None
    counts = np.arange(1, 11)
    ask = Diameters(
        count=counts.astype(float),
        string_mm=np.full(10, data.string_mm.mean()),
        string_sd_mm=np.zeros(10),
        value=np.ones(10),
        sd=np.full(10, np.median(data.sd)),
        lay_rad=np.full(
            10, np.nanmean(data.lay_rad) if np.isfinite(data.lay_rad).any() else np.nan
        ),
    )
    apart = np.abs(_predict(ask, base, pair[0]) - _predict(ask, base, pair[1]))
    best = int(np.argmax(apart))
    return {
        "observable": "diameter_mm",
        "strings": int(counts[best]),
        "turns": None,
        "load_N": None,
        "separates": ["+".join(_names(f)) for f in pair],
        "expected_difference": float(apart[best]),
        "noise": float(ask.sd[best]),
        "unit": "mm",
    }


def _parts(chosen: BundleFit) -> list[dict[str, object]]:
    return [
        {"mechanism": c.name, "shape": "formula", "values": {c.parameter: v}}
        for c, v in zip(chosen.causes, chosen.values, strict=True)
    ]


def _rows(
    data: Diameters, plain: np.ndarray, extended: np.ndarray
) -> tuple[dict[str, object], ...]:
    return tuple(
        {
            "strings": int(n),
            "observable": "diameter_mm",
            "value": float(v),
            "base": float(a),
            "extended": float(b),
        }
        for n, v, a, b in zip(data.count, data.value, plain, extended, strict=True)
    )
