"""Where a helix fit may start: rates of strands and coiling read from the two edges.

The fit itself converges only from within a fraction of a lobe, and a start on a wrong harmonic is
the commonest gross error. So several starts compete and the best fit wins: peaks of the width's
spectrum under every harmonic that the section can show, what the motor's turns lead one to expect,
and the frame before.
"""

from __future__ import annotations

import numpy as np

from tsvision.measures.helix import (
    COILED,
    KC,
    PHI,
    PHIC,
    RC,
    RHO,
    SLOPE,
    STRAIGHT,
    Y0,
    Edges,
    HelixFit,
    K,
    Section,
    fit_helix,
)

_FREE_STRAIGHT = tuple(i for i in STRAIGHT if i < 8)
_FREE_COILED = tuple(i for i in COILED if i < 8)


def spectrum_peaks(
    s_px: np.ndarray, series: np.ndarray, weight: np.ndarray, band: tuple[float, float], most: int
) -> list[tuple[float, float, float]]:
    """Strongest rates (rad/px), amplitudes (px) and phases of a weighted series within `band`.

    Least-squares spectrum on a grid four times finer than the window resolves; phase such that
    the series goes as amplitude * cos(rate * (s - middle) + phase).
    """
    z = s_px - 0.5 * (s_px[0] + s_px[-1])
    span = max(float(z[-1] - z[0]), 1.0)
    count = int(np.clip((band[1] - band[0]) * span / (2 * np.pi) * 4, 8, 1200))
    rates = np.linspace(band[0], band[1], count)
    w = weight / max(weight.sum(), 1e-9)
    y = series - (w * series).sum()
    slope = (w * y * z).sum() / max((w * z * z).sum(), 1e-9)
    y = y - slope * z
    taper = w * (0.5 + 0.5 * np.cos(2 * np.pi * z / (2.1 * span)))
    taper /= max(taper.sum(), 1e-9)
    amplitude = 2.0 * (np.exp(-1j * np.outer(rates, z)) @ (taper * y))
    power = np.abs(amplitude)
    peaks = [
        i
        for i in range(count)
        if power[i] >= power[max(i - 1, 0)] and power[i] >= power[min(i + 1, count - 1)]
    ]
    peaks.sort(key=lambda i: -power[i])
    return [(float(rates[i]), float(power[i]), float(np.angle(amplitude[i]))) for i in peaks[:most]]


def _weighted_line(s: np.ndarray, y: np.ndarray, w: np.ndarray) -> tuple[float, float]:
    z = s - 0.5 * (s[0] + s[-1])
    design = np.stack([np.ones_like(z), z], 1) * w[:, None]
    c, *_ = np.linalg.lstsq(design, y * w, rcond=None)
    return float(c[0]), float(c[1])


def straight_starts(
    edges: Edges, section: Section, diameter_px: float, expected_rate: float
) -> list[np.ndarray]:
    """Starts (9,) for a straight bundle of about `diameter_px`; expected_rate rad/px or NaN."""
    w = np.minimum(edges.upper_weight, edges.lower_weight)
    width = edges.upper_px - edges.lower_px
    centre = 0.5 * (edges.upper_px + edges.lower_px)
    y0, slope = _weighted_line(edges.s_px, centre, w)
    span = float(edges.s_px[-1] - edges.s_px[0])
    band = (2 * np.pi / max(span, 1.0), 2 * np.pi / max(0.55 * diameter_px, 4.0))
    rates: list[float] = []
    for rate, _, _ in spectrum_peaks(edges.s_px, width, w, band, 3):
        rates += [rate / 2.0, rate / 4.0] if len(section.radius_d) == 8 else [rate / 2.0]
    if len(section.radius_d) in (3, 5, 7):
        rates += [r * 2.0 for r in rates[:1]] + [r * 2.0 / 3.0 for r in rates[:1]]
    if np.isfinite(expected_rate) and expected_rate > 0:
        rates += [expected_rate]
    starts = []
    fold = 1 if len(section.radius_d) % 2 else 2
    for rate in _distinct_rates(rates, 0.25 * 2 * np.pi / max(span, 1.0)):
        for phase in np.arange(4) * (2 * np.pi / fold / 4):
            p = np.zeros(9)
            p[RHO] = 0.5 * diameter_px / section.diameter_d
            p[K], p[PHI], p[Y0], p[SLOPE] = rate, phase, y0, slope
            starts.append(p)
    return starts


def _distinct_rates(rates: list[float], apart: float) -> list[float]:
    taken: list[float] = []
    for rate in rates:
        if rate > 0 and all(abs(rate - t) > apart for t in taken):
            taken.append(rate)
    return taken


SEARCH_DIAMETER_PX = 20.0  # wider bundles are searched on a coarser grid, then fitted in full


def _shrunk(edges: Edges, factor: float) -> Edges:
    """The same outline in units of `factor` px, resampled on unit spacing."""
    s = edges.s_px / factor
    grid = np.arange(np.ceil(s[0]), np.floor(s[-1]) + 1e-9)
    nearest = np.clip(np.searchsorted(s, grid), 0, s.size - 1)
    return Edges(
        grid,
        np.interp(grid, s, edges.upper_px / factor),
        np.interp(grid, s, edges.lower_px / factor),
        edges.upper_weight[nearest],
        edges.lower_weight[nearest],
    )


def _rescaled(p: np.ndarray, factor: float, shift: float = 0.0) -> np.ndarray:
    """Parameters in units of `factor` px; z counted from a middle `shift` px further on."""
    q = p.copy()
    q[PHI] += p[K] * shift
    q[PHIC] += p[KC] * shift
    q[Y0] += p[SLOPE] * shift
    for i in (RHO, Y0, RC):
        q[i] /= factor
    for i in (K, KC):
        q[i] *= factor
    return q


def best_fit(
    edges: Edges,
    section: Section,
    starts: list[np.ndarray],
    coiled: bool,
    scale_px: float,
    keep: int = 3,
) -> HelixFit | None:
    """Run all starts for a few steps, the best `keep` to the end; None without any start."""
    free = _FREE_COILED if coiled else _FREE_STRAIGHT
    if not starts:
        return None
    width = 2.0 * starts[0][RHO] * section.diameter_d
    factor = max(1.0, width / SEARCH_DIAMETER_PX)
    coarse = _shrunk(edges, factor) if factor > 1.0 else edges
    shift = 0.5 * (coarse.s_px[0] + coarse.s_px[-1]) * factor - 0.5 * (
        edges.s_px[0] + edges.s_px[-1]
    )
    tried = [
        fit_helix(
            coarse,
            section,
            _rescaled(p, factor, shift),
            free,
            2.0 * scale_px / factor,
            iterations=4,
        )
        for p in starts
    ]
    tried.sort(key=lambda f: f.cost)
    final = [
        fit_helix(
            edges,
            section,
            _rescaled(f.p, 1.0 / factor, -shift / factor),
            free,
            scale_px,
            iterations=25,
        )
        for f in tried[:keep]
    ]
    return min(final, key=lambda f: f.cost)


def coiled_starts(
    edges: Edges,
    section: Section,
    straight: HelixFit | None,
    diameter_px: float,
    expected_rate: float,
) -> list[np.ndarray]:
    """Starts (9,) for a coiled bundle: the coil from the centre line's spectrum, the strands from
    the width's, from the straight fit and from the turns to be expected."""
    w = np.minimum(edges.upper_weight, edges.lower_weight)
    centre = 0.5 * (edges.upper_px + edges.lower_px)
    width = edges.upper_px - edges.lower_px
    y0, slope = _weighted_line(edges.s_px, centre, w)
    span = float(edges.s_px[-1] - edges.s_px[0])
    low = 2 * np.pi / max(span, 1.0)
    coil_band = (low, 2 * np.pi / max(0.9 * diameter_px, 4.0))
    strand_band = (low, 2 * np.pi / max(0.45 * diameter_px, 3.0))
    rates = [r / 2.0 for r, _, _ in spectrum_peaks(edges.s_px, width, w, strand_band, 4)]
    if straight is not None:
        rates.insert(0, float(straight.p[K]))
    if len(section.radius_d) == 8:
        rates += [r / 2.0 for r in rates[:2]]
    starts = []
    for kc, radius, phase in spectrum_peaks(edges.s_px, centre, w, coil_band, 2):
        options = list(rates)
        if np.isfinite(expected_rate) and expected_rate > kc:
            options += [expected_rate - kc]
        # Sidebands: what looks like the strand rate is often the sum of strands and coiling.
        options += [r - kc for r in rates[:2] if r > 1.3 * kc]
        for rate in _distinct_rates(options, 0.25 * low):
            for turn in np.arange(4) * (np.pi / 4):
                p = np.zeros(9)
                p[RHO] = 0.5 * diameter_px / section.diameter_d
                p[K], p[PHI], p[Y0], p[SLOPE] = rate, turn, y0, slope
                p[RC], p[KC], p[PHIC] = max(radius, 0.02 * diameter_px), kc, phase
                starts.append(p)
    return starts
