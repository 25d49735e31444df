"""Where a helix fit may start: a scan of strand rate and phase, and the centre line's coiling.

The fit itself converges only from within a fraction of a lobe, and a start on a wrong harmonic is
the commonest gross error. The silhouette itself, not a spectrum of it, is therefore compared with
the edges over all rates and phases that a bundle of this width can have; the lowest valleys are
fitted, and the best fit wins. Wide bundles are searched at reduced size first.
"""

from __future__ import annotations

from functools import lru_cache

import numba
import numpy as np

from tsvision.images.percentiles import percentile
from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.band import Band
from tsvision.measures.helix.fit import HelixFit, descend, fit_helix, with_relief
from tsvision.measures.helix.loose import loosened
from tsvision.measures.helix.reduced import SEARCH_DIAMETER_PX, Reduced, reduced
from tsvision.measures.helix.silhouette import (
    FREE_COILED,
    FREE_STRAIGHT,
    KC,
    OPEN,
    PARAMETERS,
    PHI,
    PHIC,
    RC,
    RHO,
    SLOPE,
    TILT,
    Y0,
    K,
    Section,
    silhouette,
)
from tsvision.measures.helix.weigh import POOR, doubt, is_plain, weighed
from tsvision.measures.numeric.line import line_through
from tsvision.measures.numeric.spectrum import spectrum

# Turn by which neighbouring rates differ at the ends of a window, rad, and phases tried over one
# repeat of the section: two strands make two lobes a turn, more make four.
STEP_RAD, PHASES = {2: 0.7, 4: 0.45}, {2: 5, 4: 8}
VALLEYS = 6  # of the scan, fitted for a few steps
WIDTH_IN_DOUBT = 0.08
# Other descents than the best that are fitted in full, and times its cost that they may have: where
# a straight bundle fits well (True), and elsewhere, where the light inside decides between them.
OTHERS, LIKELY = {True: 1, False: 3}, {True: 1.3, False: 1.6}
ALIKE_RAD = 0.15  # phases within which two descents are one
COILS = 2  # peaks of the centre line's spectrum tried as coiling rates


def search_straight(
    edges: Edges,
    section: Section,
    diameter_px: float,
    band: Band,
    scale_px: float,
) -> HelixFit | None:
    """The best straight helix with a rate within `band`."""
    bases = _bases(edges, section, diameter_px)
    best = _search(edges, section, bases, [band] * len(bases), False, scale_px)
    return None if best is None else loosened(edges, best, scale_px)


def straight_at(edges: Edges, like: HelixFit, rate: float, scale_px: float) -> HelixFit | None:
    """The straight helix like another but for its rate, which is nearly known: its phase is looked
    for, no more. None where the edges show two phases nearly as well, as of a section that is
    nearly four-fold."""
    section = like.section
    whole = _bases(edges, section, like.diameter_px)[0]
    whole[[RHO, TILT, OPEN]] = like.p[[RHO, TILT, OPEN]]
    small = reduced(edges, 2.0 * whole[RHO] * section.diameter_d / SEARCH_DIAMETER_PX)
    base = small.down(whole)
    phases, costs = _scanned(small.edges, section, base, np.array([rate * small.factor]))
    deep = np.sort(costs[0][_deep(costs)[0]])
    if deep.size > 1 and deep[1] < LIKELY[True] * deep[0] + 0.01:
        return None
    base[K], base[PHI] = rate * small.factor, _lowest(phases, costs[0])
    scale = scale_px / small.factor
    p, _ = descend(small.edges, section, base, FREE_STRAIGHT, scale, iterations=5)
    fit = fit_helix(edges, section, small.up(p), FREE_STRAIGHT, scale_px, near=True)
    return loosened(edges, fit, scale_px)


def search_coiled(
    edges: Edges,
    section: Section,
    diameter_px: float,
    bands: list[Band],
    coils: list[np.ndarray],
    scale_px: float,
) -> HelixFit | None:
    """The best coiled helix; `coils` (12,) each hold RC, KC, PHIC, `bands` the rates to each."""
    bases = []
    for coil in coils:
        base = _bases(edges, section, diameter_px)[0]
        base[[RC, KC, PHIC]] = coil[[RC, KC, PHIC]]
        bases.append(base)
    return _search(edges, section, bases, bands, True, scale_px)


def coils_of(edges: Edges, diameter_px: float) -> list[list[np.ndarray]]:
    """Radius, rate and phase of coiling, (12,) each, at every rate that the centre line's spectrum
    shows; likeliest rate first."""
    centre, w = _centre(edges)
    span = float(edges.s_px[-1] - edges.s_px[0])
    band = (2 * np.pi / max(span, 1.0), 2 * np.pi / max(0.9 * diameter_px, 4.0))
    rates = [r for r, _, _ in spectrum_peaks(edges.s_px, centre, w, band, COILS)]
    # A spectrum's peak is a sixth of a turn off at the window's ends, and where edges are missing
    # its height is not the amplitude: the line itself is fitted about it.
    near = np.linspace(-0.5, 0.5, 7) * np.pi / max(span, 1.0)
    known = w > 0.3
    reach = percentile(edges.upper_px[known], 97.0) - percentile(edges.lower_px[known], 3.0)
    wide = 0.5 * (reach - diameter_px)
    found = []
    for number, rate in enumerate(rates):
        tried, explained = _coils_at(edges, rate + near)
        p = tried[int(np.argmax(explained))].copy()
        p[RC] = max(p[RC], 0.02 * diameter_px)
        options = [p]
        # Where the line runs steeply edges are lost, and the fitted swing is too small: the
        # envelope, D + 2 R, tells it better then.
        if number == 0 and wide > 1.25 * p[RC]:
            options.append(p.copy())
            options[-1][RC] = wide
        found.append(options)
    return found


def coil_at(edges: Edges, rate: float) -> np.ndarray:
    """Radius and phase with which the centre line coils at a known rate, as (12,)."""
    return _coils_at(edges, np.array([rate]))[0][0]


def _coils_at(edges: Edges, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Radius, rate and phase of a coil at each of `rates` (K,), as (K, 12), and how much of the
    line's variance about a straight one each explains (K,). Weighted least squares."""
    centre, w = _centre(edges)
    z = edges.s_px - 0.5 * (edges.s_px[0] + edges.s_px[-1])
    waves, explained = _waves_at(z, centre, w, rates)
    p = np.zeros((rates.size, PARAMETERS))
    p[:, RC], p[:, KC] = np.hypot(*waves.T), rates
    p[:, PHIC] = np.arctan2(-waves[:, 1], waves[:, 0])
    return p, explained


@numba.njit(cache=True, error_model="numpy")
def _waves_at(z, line, weight, rates):  # pragma: no cover - compiled
    """Cosine's and sine's part (K, 2) in a line (M,) about the straight one, at each of `rates`
    (K,), and the share of its variance that both explain (K,)."""
    count = z.size
    level, slope = np.ones(count) * weight, z * weight
    level /= max(np.sqrt((level * level).sum()), 1e-12)
    slope = slope - (slope * level).sum() * level
    slope /= max(np.sqrt((slope * slope).sum()), 1e-12)
    rest = line * weight
    rest = rest - (rest * level).sum() * level
    rest = rest - (rest * slope).sum() * slope
    before = max((rest * rest).sum(), 1e-12)
    parts, explained = np.empty((rates.size, 2)), np.empty(rates.size)
    for k in range(rates.size):
        cosine, sine = np.cos(rates[k] * z) * weight, np.sin(rates[k] * z) * weight
        cosine = cosine - (cosine * level).sum() * level - (cosine * slope).sum() * slope
        sine = sine - (sine * level).sum() * level - (sine * slope).sum() * slope
        cc, cs, ss = (cosine * cosine).sum(), (cosine * sine).sum(), (sine * sine).sum()
        least = 1e-9 * (cc + ss) + 1e-12  # where no column shows both edges
        cc, ss = cc + least, ss + least
        c, s = (cosine * rest).sum(), (sine * rest).sum()
        whole = cc * ss - cs * cs
        parts[k, 0], parts[k, 1] = (ss * c - cs * s) / whole, (cc * s - cs * c) / whole
        explained[k] = (parts[k, 0] * c + parts[k, 1] * s) / before
    return parts, explained


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
    amplitude = 2.0 * spectrum(taper * y, float(z[0]), rates)
    power = np.abs(amplitude)
    peaks = [
        i
        for i in range(count)
        if power[i] >= power[max(i - 1, 0)] and power[i] >= power[min(i + 1, count - 1)]
    ]
    peaks.sort(key=lambda i: -power[i])
    return [(float(rates[i]), float(power[i]), float(np.angle(amplitude[i]))) for i in peaks[:most]]


def _centre(edges: Edges) -> tuple[np.ndarray, np.ndarray]:
    """The middle of both edges (M,), nearer to the one trusted more, and its weights (M,)."""
    w = np.minimum(edges.upper_weight, edges.lower_weight)
    up, down = edges.shares
    return up * edges.upper_px + down * edges.lower_px, w


def _bases(edges: Edges, section: Section, diameter_px: float) -> list[np.ndarray]:
    """Parameters without rate and phase: the axis as the middles lie, the width as known, and as
    the edges show it where that is something else."""
    centre, w = _centre(edges)
    z = edges.s_px - 0.5 * (edges.s_px[0] + edges.s_px[-1])
    # Half a bundle inside the edges, of which one may be trusted more than the other.
    up, down = edges.shares
    inside = (up - down) * section.mean_half_d * diameter_px / section.diameter_d
    middle, slope = line_through(z, centre - inside, w**2)
    clear = w > 0.3
    widths = [diameter_px]
    if clear.any():
        seen = percentile((edges.upper_px - edges.lower_px)[clear], 95.0)
        if abs(seen / diameter_px - 1.0) > WIDTH_IN_DOUBT:
            widths.append(seen)
    bases = []
    for width in widths:
        p = np.zeros(PARAMETERS)
        p[RHO], p[Y0], p[SLOPE] = 0.5 * width / section.diameter_d, middle, slope
        bases.append(p)
    return bases


def _search(
    edges: Edges,
    section: Section,
    bases: list[np.ndarray],
    bands: list[Band],
    coiled: bool,
    scale_px: float,
) -> HelixFit | None:
    if not bases:
        return None
    small = reduced(edges, 2.0 * bases[0][RHO] * section.diameter_d / SEARCH_DIAMETER_PX)
    led: list[tuple[float, np.ndarray]] = []
    valleys: list[tuple[float, np.ndarray]] = []
    for base, band in zip(bases, bands, strict=True):
        led_to, deep = _valleys(small.edges, section, small.down(base), band, small.factor)
        led += led_to
        valleys += deep
    # The rate led to is followed whatever it costs before it is fitted.
    led.sort(key=lambda start: start[0])
    likeliest = led[:1]
    starts = likeliest + sorted(valleys + led[1:], key=lambda start: start[0])
    expected = bands[0].expected
    best: HelixFit | None = None
    # What is no good fit after the deepest valleys may have missed its own.
    for first, last, heard in ((0, VALLEYS, len(likeliest)), (VALLEYS, 3 * VALLEYS, 0)):
        some = [p for _, p in starts[first:last]]
        if not some or (best is not None and best.cost < POOR):
            break
        for fit in _fits_from(edges, small, section, some, heard, expected, coiled, scale_px):
            if best is None or weighed(fit, expected) < weighed(best, expected):
                best = fit
    return best


def _fits_from(
    edges: Edges,
    small: Reduced,
    section: Section,
    starts: list[np.ndarray],
    heard: int,
    expected: float,
    coiled: bool,
    scale_px: float,
) -> list[HelixFit]:
    """The fits to which the likeliest of some starts (12,) at reduced size lead. Where the outline
    alone does not tell, with the light inside, and the first `heard` starts, likely or not."""
    free = FREE_COILED if coiled else FREE_STRAIGHT
    half = 0.5 * float(small.edges.s_px[-1] - small.edges.s_px[0])
    scale = 2.0 * scale_px / small.factor
    reached = [descend(small.edges, section, p, free, scale, iterations=5) for p in starts]
    tried = [(p, cost * doubt(p, expected * small.factor)) for p, cost in reached]
    tried.sort(key=lambda found: found[1])
    # Two valleys that are nearly as deep at reduced size may change places at full size.
    first = fit_helix(edges, section, small.up(tried[0][0]), free, scale_px)
    plain = not coiled and is_plain(edges, first, scale_px)
    deep = [p for p, cost in tried if cost < LIKELY[plain] * tried[0][1] + 0.01]
    unlike = _unlike(deep, section, half)[: 1 + OTHERS[plain]]
    if not plain:
        unlike = _unlike(unlike + [p for p, _ in reached[:heard]], section, half)
    fits = [first, *(fit_helix(edges, section, small.up(p), free, scale_px) for p in unlike[1:])]
    # Lobes that blur and coding have all but levelled fit at the half of their pitch, too.
    return fits if plain else [with_relief(edges, fit) for fit in fits]


def _unlike(descents: list[np.ndarray], section: Section, half_px: float) -> list[np.ndarray]:
    """Those of some descents (12,) that have come to other strands than any before them."""
    kept: list[np.ndarray] = []
    for p in descents:
        if not any(_same(other, p, section, half_px) for other in kept):
            kept.append(p)
    return kept


def _same(p: np.ndarray, q: np.ndarray, section: Section, half_px: float) -> bool:
    """Whether two descents (12,) have come to the same strands: phases alike at both ends of a
    window half_px to either side, up to what the section repeats by, and width and coil alike."""
    turn = 2.0 * np.pi / section.fold
    ends = (p[PHI] - q[PHI]) + (p[K] - q[K]) * half_px * np.array([-1.0, 1.0])
    off = np.abs((ends + 0.5 * turn) % turn - 0.5 * turn)
    far = np.abs(p[[RHO, Y0, RC]] - q[[RHO, Y0, RC]])
    return bool(off.max() < ALIKE_RAD and far.max() < 0.05 * p[RHO])


def _valleys(
    edges: Edges, section: Section, base: np.ndarray, band: Band, factor: float
) -> tuple[list[tuple[float, np.ndarray]], list[tuple[float, np.ndarray]]]:
    """(cost, start) at the rate that `band` leads to, and at the lowest places of the scan; `band`
    in rad per px of the full picture."""
    half = 0.5 * float(edges.s_px[-1] - edges.s_px[0])
    lobes = section.lobes
    count = (band.high - band.low) * factor * half / STEP_RAD[lobes]
    count = int(np.clip(count, 3, 300)) + 1
    rates = np.linspace(band.low, band.high, count) * factor
    alone = (band.led - (base[KC] / factor if base[RC] > 0.0 else 0.0)) * factor
    if np.isfinite(alone) and rates[0] < alone < rates[-1]:
        rates = np.append(rates, alone)
    phases, costs = _scanned(edges, section, base, rates)
    # A section that is nearly four-fold has two deep valleys at one rate, a quarter turn apart.
    at = np.flatnonzero(_deep(costs[:count]))
    at = at[np.argsort(costs.ravel()[at])][: 3 * VALLEYS]

    def start(i: int, j: int) -> tuple[float, np.ndarray]:
        p: np.ndarray = base.copy()
        p[K], p[PHI] = rates[i], phases[j]
        return float(costs[i, j]) * doubt(p, band.expected * factor), p

    led = [start(i, int(np.argmin(costs[i]))) for i in range(count, rates.size)]
    valleys = [start(*divmod(one, phases.size)) for one in at.tolist()]
    return led, valleys


def _lowest(phases: np.ndarray, costs: np.ndarray) -> float:
    """Where a parabola through the least of the costs (P,) and its neighbours is lowest."""
    j = int(np.argmin(costs))
    before, least, after = costs[j - 1], costs[j], costs[(j + 1) % costs.size]
    bend = before - 2.0 * least + after
    off = 0.5 * (before - after) / bend if bend > 0.0 else 0.0
    return float(phases[j] + off * (phases[1] - phases[0]))


def _scanned(
    edges: Edges, section: Section, base: np.ndarray, rates: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Phases (P,) over one repeat of the section, and how far its silhouette lies from the edges
    at each of them and of the rates (K,), (K, P)."""
    phases = _phases(section.lobes, section.fold)
    costs = np.empty((rates.size, phases.size))
    rho = float(base[RHO])
    # The coil is known roughly only, and the grid is coarse: a deviation counts up to a fair part
    # of a strand.
    scan(
        base,
        rates,
        phases,
        *section.outer,
        -0.5 * float(edges.s_px[-1] - edges.s_px[0]),
        edges.observed,
        edges.trusted,
        edges.worth,
        0.25 * rho,
        max(0.35, min(1.0, 0.4 * rho)),
        costs,
    )
    return phases, costs


@lru_cache(maxsize=16)
def _phases(lobes: int, fold: int) -> np.ndarray:
    """Phases tried over one repeat of the section, to be read only."""
    return np.arange(PHASES[lobes]) * (2.0 * np.pi / fold / PHASES[lobes])


@numba.njit(cache=True)
def _deep(costs):  # pragma: no cover - compiled
    """Where (K, P) no neighbour costs less, in rate or in phase, which comes round again."""
    rates, phases = costs.shape
    deep = np.ones((rates, phases), np.bool_)
    for i in range(rates):
        for j in range(phases):
            for k in range(max(i - 1, 0), min(i + 2, rates)):
                for beside in range(j - 1, j + 2):
                    if costs[k, beside % phases] < costs[i, j]:
                        deep[i, j] = False
    return deep


@numba.njit(cache=True)
def scan(
    base,
    rates,
    phases,
    site_radius,
    site_angle,
    give,
    z0,
    observed,
    weights,
    cos2,
    scale,
    step,
    costs,
):  # pragma: no cover - compiled
    """Mean robust deviation of the silhouette from both edges for every rate and phase.

    Along a straight axis another phase is the same silhouette further along: one turn of it is
    drawn for each rate, and every phase read from that.
    """
    count = observed.shape[1]
    upper, lower = np.empty(count), np.empty(count)
    at_u, at_l = np.zeros((count, 2)), np.zeros((count, 2))
    p = base.copy()
    total = max(weights.sum(), 1e-9)
    for i in range(rates.size):
        p[K] = rates[i]
        turn = 2.0 * np.pi / max(rates[i], 1e-9)
        once = base[5] <= 0.0 and turn < 0.5 * count * phases.size
        if once:
            p[PHI], p[Y0], p[SLOPE] = 0.0, 0.0, 0.0
            drawn = int(turn) + 3
            high, low = np.empty(drawn), np.empty(drawn)
            at_h, at_w = np.zeros((drawn, 2)), np.zeros((drawn, 2))
            silhouette(p, site_radius, site_angle, give, 0.0, drawn, high, low, at_h, at_w, step)
            p[Y0], p[SLOPE] = base[3], base[4]
        for j in range(phases.size):
            p[PHI] = phases[j]
            if once:
                x = (z0 + phases[j] / rates[i]) % turn
                for c in range(count):
                    k = int(x)
                    w = x - k
                    line = p[Y0] + p[SLOPE] * (c + z0)
                    upper[c] = line + (1.0 - w) * high[k] + w * high[k + 1]
                    lower[c] = line + (1.0 - w) * low[k] + w * low[k + 1]
                    x += 1.0
                    if x >= turn:
                        x -= turn
            else:
                silhouette(
                    p, site_radius, site_angle, give, z0, count, upper, lower, at_u, at_l, step
                )
            cost = 0.0
            for c in range(count):
                t = ((observed[0, c] - upper[c]) / scale) ** 2 * cos2[0, c]
                cost += weights[0, c] * t / (1.0 + t)
                t = ((observed[1, c] - lower[c]) / scale) ** 2 * cos2[1, c]
                cost += weights[1, c] * t / (1.0 + t)
            costs[i, j] = cost / total
