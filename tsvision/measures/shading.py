"""What the edge of a round, blurred, lit strand looks like, learnt from many of them.

A strand is a tube: towards its limb the surface turns away, so that its brightness falls before
the edge is reached and every half-level edge lies inside the true one, by 0.5 to 4 px where the
light comes from one side. t px inside the edge of a tube of radius rho the surface faces an angle
phi from the camera, sin phi = x = 1 - t / rho, and whatever shines there, Lambert's law gives

    I(t) = ground + ambient + sum over lamps of w_j max(0, cos(phi - theta_j)),   all w_j >= 0,

blurred by the camera. Lamps stand all around the strand, in fixed directions across it; a lamp's
max(0, .) ends at its terminator, beyond which only the others light the limb. Light that cannot be
negative and is spread over few directions by a prior leaves little room for ramp and place of the
edge to trade against each other. Both limbs see the same lamps from opposite sides, nearly: the
bundle itself hides some.

The mean of many edges, aligned on the fitted silhouette, is almost free of noise; lamps, ground,
blur and the true edges' places are fitted to it (non-negative least squares within a least-squares
fit of blur and places).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.ndimage import gaussian_filter1d, uniform_filter1d
from scipy.optimize import OptimizeResult, least_squares, nnls

TEMPLATE_START_PX = -14.0
TEMPLATE_STEP_PX = 0.05
TEMPLATE_GRID_PX = np.arange(TEMPLATE_START_PX, 30.0, TEMPLATE_STEP_PX)
LAMPS_RAD = np.deg2rad(np.linspace(-90.0, 180.0, 13))
# Before anything is seen: so much of the core's light comes from lamps, most of them beside the
# camera; all lamps together may differ from that by LAMP_SD.
LAMP_SHARE = 0.45
LAMP_SD = 0.5
AMBIENT_SHARE, AMBIENT_SD = 0.4, 0.3  # of lit strands; before a bright ground nothing is known
TIE_SD = 0.1  # how much a lamp may differ between the two limbs
FLOOR = 0.003  # of a profile's span: what the model cannot describe at the limb, ...
FLOOR_GROWTH = 20.0  # ... growing inwards, where neighbours shade and gleam
BIN_PX = 0.25
REWEIGHED, REWEIGHED_BINS = 2, 9  # times, over this stretch of a profile
OUTSIDE_PX = 5.0
FURTHEST_PX = 4.5  # outside the edge assumed
RIVAL = 1.5  # times the best cost


@dataclass(frozen=True)
class EdgeProfile:
    """Mean signal `value` (K,) at `t_px` (K,) inside an edge, with the mean's sd (K,)."""

    t_px: np.ndarray
    value: np.ndarray
    sd: np.ndarray


@dataclass(frozen=True)
class Shading:
    """How the edge of one side looks.

    blur_px: sd of the blur; rho_px: strand radius; ambient and lamps (13,) in units of the core's
    contrast; place_sd_px: how well the edge's place was told (both sides' in quadrature give that
    of the width); template: the profile on the module's grid.
    """

    blur_px: float
    rho_px: float
    ambient: float
    lamps: np.ndarray
    residual: float = 0.0
    place_sd_px: float = 0.0
    template: np.ndarray = field(default_factory=lambda: np.empty(0))


def inside_px(rho_px: float) -> float:
    """How far inside an edge its profile is learnt."""
    return max(0.85 * rho_px, 2.5)


def light_shapes(rho_px: float, blur_px: float) -> np.ndarray:
    """Blurred profiles of ambient light and of every lamp, (1 + 13, T) on the template's grid."""
    # The sample on the edge itself counts half, else every edge lies half a step off.
    inside = np.clip(0.5 + TEMPLATE_GRID_PX / TEMPLATE_STEP_PX, 0.0, 1.0)
    x = np.clip(1.0 - TEMPLATE_GRID_PX / rho_px, -1.0, 1.0)
    facing = np.sqrt(1.0 - x * x)
    lit = np.cos(LAMPS_RAD)[:, None] * facing + np.sin(LAMPS_RAD)[:, None] * x
    shapes = inside * np.vstack([np.ones_like(x), np.maximum(lit, 0.0)])
    sd = max(blur_px, 0.2) / TEMPLATE_STEP_PX
    return np.asarray(gaussian_filter1d(shapes, sd, axis=1, mode="nearest", truncate=3.5))


def make_shading(
    rho_px: float,
    blur_px: float,
    ambient: float,
    lamps: np.ndarray,
    residual: float = 0.0,
    place_sd_px: float = 0.0,
) -> Shading:
    """Shading with its template; `lamps` (13,) carry their sign (< 0: they reduce the contrast)."""
    template = np.concatenate([[ambient], lamps]) @ light_shapes(rho_px, blur_px)
    return Shading(blur_px, rho_px, ambient, lamps, residual, place_sd_px, template)


def plain_shading(rho_px: float, blur_px: float = 1.0) -> Shading:
    """A strand evenly lit with some light from the camera's side, before anything is learnt."""
    lamps = np.where(np.isclose(LAMPS_RAD, 0.0), 0.2, 0.0)
    return make_shading(rho_px, blur_px, 0.8, lamps)


def inside_at(shading: Shading, level: float) -> float:
    """How far inside the edge, px, the signal first reaches a level (core's contrast 1): outside,
    < 0, for low ones; 0 where it never does."""
    reached = shading.template >= level
    return float(TEMPLATE_GRID_PX[np.argmax(reached)]) if reached.any() else 0.0


def edge_samples(
    contrast: np.ndarray, edge_row: np.ndarray, slope: np.ndarray, outward: int, inside: float
) -> tuple[np.ndarray, np.ndarray]:
    """Every pixel near an edge: its distance inside the edge (K,) and its signal (K,), each column
    without its ground and scaled to the columns' median depth.

    contrast (R, M); edge_row, slope (M,). Nothing is interpolated, which would add to the blur.
    """
    rows = np.arange(contrast.shape[0])[:, None]
    t = outward * (edge_row - rows) / np.sqrt(1.0 + slope**2)
    far, deep = (t < -3.5) & (t > -OUTSIDE_PX - 2.0), (t > 0.4 * inside) & (t < inside)
    near = (t >= -OUTSIDE_PX) & (t < inside)
    enough = (far.sum(0) >= 2) & (deep.sum(0) >= 1) & ~np.isnan(np.where(near, contrast, 0)).any(0)
    with np.errstate(invalid="ignore", divide="ignore"):
        ground = np.where(far, contrast, 0.0).sum(0) / far.sum(0)
        depth = np.where(deep, contrast, 0.0).sum(0) / deep.sum(0) - ground
    if not enough.any():
        return np.empty(0), np.empty(0)
    typical = float(np.median(depth[enough]))
    good = enough & (depth > 0.4 * typical) if typical > 0 else np.zeros_like(enough)
    t, near = t[:, good], near[:, good]
    value = (contrast[:, good] - ground[good]) / depth[good] * typical
    return t[near], value[near]


def mean_profile(t_px: np.ndarray, value: np.ndarray) -> EdgeProfile | None:
    """Trimmed mean of samples in bins of a quarter pixel; None with fewer than 8 filled bins."""
    if t_px.size == 0:
        return None
    order = np.lexsort((value, np.floor(t_px / BIN_PX)))
    t, v = t_px[order], value[order]
    bins = np.floor(t / BIN_PX)
    starts = np.flatnonzero(np.diff(bins, prepend=-np.inf))
    ends = np.append(starts[1:], t.size)
    found = []
    for a, b in zip(starts, ends, strict=True):
        if b - a < 8:
            continue
        cut = (b - a) // 10
        kept = v[a + cut : b - cut]
        found.append((t[a:b].mean(), kept.mean(), v[a:b].std() / np.sqrt(b - a)))
    if len(found) < 8:
        return None
    places, means, sds = np.array(found).T
    return EdgeProfile(places, means, sds)


def fit_shading(
    profiles: tuple[EdgeProfile, EdgeProfile],
    rho_px: float,
    sense: int = 1,
    blur_start_px: float = 1.0,
    brightness: float = 1.0,
) -> tuple[Shading, Shading, np.ndarray]:
    """Fit both sides' mean edge profiles (upper, lower) with one blur and nearly the same lamps.

    Signals in units of the core's contrast, > 0 inside. sense: +1 strings brighter than the
    ground, -1 darker: there light reduces the contrast. brightness: the core's light over its
    contrast; dark strings before a bright ground send little light, however it falls. Returns
    upper and lower shading and (2,) the true edges' places on the profiles' axis (negative:
    outside the edge assumed).
    """
    system = _System(profiles, rho_px, sense, brightness)
    blur = float(np.clip(blur_start_px, 0.4, 5.5))
    # Where a lamp's light ends short of a limb that sends none, what is seen is the terminator:
    # the edge then lies far outside, and the fit has to be told to look there.
    starts = [
        np.array([blur, *places])
        for places in ((0.0, 0.0), (-0.7 * rho_px, 0.0), (0.0, -0.7 * rho_px))
        if min(places) > -FURTHEST_PX
    ]
    fits = [system.fit(start) for start in starts]
    for _ in range(REWEIGHED):
        system.reweigh(min(fits, key=lambda f: f.cost).x)
        fits = [system.fit(f.x) for f in fits]
    fit = min(fits, key=lambda f: f.cost)
    light = system.solve(fit.x)[0]
    covariance = np.linalg.pinv(fit.jac.T @ fit.jac)
    width_sd = float(np.sqrt(max(covariance[1:, 1:].sum(), 0.0)))
    # Another place that explains the profiles nearly as well cannot be ruled out.
    apart = [abs(float((f.x - fit.x)[1:].sum())) for f in fits if f.cost < RIVAL * fit.cost + 1.0]
    width_sd = float(np.hypot(width_sd, 0.5 * max(apart)))
    sides = []
    for i, own in enumerate(light.reshape(2, -1)):
        lamps = sense * own[1 : 1 + LAMPS_RAD.size]
        residual = system.rms(fit.x, i)
        sides.append(
            make_shading(
                rho_px, float(fit.x[0]), float(own[0]), lamps, residual, width_sd / np.sqrt(2.0)
            )
        )
    return sides[0], sides[1], fit.x[1:]


class _System:
    """The linear part: given blur and places, the light of both sides by least squares.

    Unknowns of a side: ambient, the lamps, and the ground's error with either sign.
    """

    def __init__(
        self,
        profiles: tuple[EdgeProfile, EdgeProfile],
        rho_px: float,
        sense: int,
        brightness: float,
    ) -> None:
        self.profiles, self.rho_px, self.sense = profiles, rho_px, sense
        self.sd = []
        for p in profiles:
            deep = np.maximum(p.t_px - 1.0, 0.0) / rho_px
            floor = FLOOR * np.ptp(p.value) * (1.0 + FLOOR_GROWTH * deep**2)
            self.sd.append(np.hypot(p.sd, np.maximum(floor, 1e-6)))
        self.floor = tuple(self.sd)
        lamps = LAMPS_RAD.size
        self.unknowns = 1 + lamps + 2
        own = np.zeros((lamps, 2 * self.unknowns))
        bright = float(np.clip(brightness, 0.02, 1.0))
        own[:, 1 : 1 + lamps] = np.eye(lamps) * np.sqrt(lamps) / (LAMP_SD * bright)
        other = np.roll(own, self.unknowns, axis=1)
        ties = self._ties()
        ambient = np.zeros((2, 2 * self.unknowns))
        if sense > 0:
            ambient[[0, 1], [0, self.unknowns]] = 1.0 / AMBIENT_SD
        self.prior = np.vstack([own, other, ambient, ties])
        front = np.maximum(np.cos(LAMPS_RAD), 0.0)
        typical = LAMP_SHARE * bright * front / np.sum(front**2)
        expected = typical * np.sqrt(lamps) / (LAMP_SD * bright)
        self.target = np.concatenate(
            [
                *(p.value / s for p, s in zip(profiles, self.sd, strict=True)),
                expected,
                expected,
                np.full(2, AMBIENT_SHARE / AMBIENT_SD if sense > 0 else 0.0),
                np.zeros(len(ties)),
            ]
        )

    def _ties(self) -> np.ndarray:
        """A lamp at angle theta from the upper limb's side is one at -theta from the lower's."""
        rows = []
        for j, angle in enumerate(LAMPS_RAD):
            k = int(np.argmin(np.abs(LAMPS_RAD + angle)))
            if abs(LAMPS_RAD[k] + angle) < 1e-6:
                row = np.zeros(2 * self.unknowns)
                row[1 + j], row[self.unknowns + 1 + k] = 1.0, -1.0
                rows.append(row * np.sqrt(LAMPS_RAD.size) / TIE_SD)
        return np.array(rows)

    def solve(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Light (2 * unknowns,) and all residuals in their sd, for q = (blur, both places)."""
        shapes = light_shapes(self.rho_px, float(q[0]))
        shapes[1:] *= self.sense
        blocks = []
        for i, (p, sd) in enumerate(zip(self.profiles, self.sd, strict=True)):
            one = np.ones_like(p.t_px)
            seen = [np.interp(p.t_px - q[1 + i], TEMPLATE_GRID_PX, shape) for shape in shapes]
            block = np.zeros((p.t_px.size, 2 * self.unknowns))
            place = slice(i * self.unknowns, (i + 1) * self.unknowns)
            block[:, place] = np.stack([*seen, one, -one], axis=1) / sd[:, None]
            blocks.append(block)
        design = np.vstack([*blocks, self.prior])
        light, _ = nnls(design, self.target, maxiter=3000)
        return light, design @ light - self.target

    def fit(self, start: np.ndarray) -> OptimizeResult:
        """Blur and both places (3,), from a start."""
        return least_squares(
            self.residuals,
            start,
            bounds=([0.35, -FURTHEST_PX, -FURTHEST_PX], [6.0, 2.5, 2.5]),
            diff_step=1e-3,
            x_scale=[0.2, 0.2, 0.2],
            max_nfev=40,
        )

    def reweigh(self, q: np.ndarray) -> None:
        """Count each stretch of the profiles by how well the model describes it about there: bins
        side by side are off together (gleam, strands in front, few sub-pixel phases)."""
        off = self.residuals(q)
        first = 0
        for i, p in enumerate(self.profiles):
            part = slice(first, first + p.t_px.size)
            square = uniform_filter1d((off[part] * self.sd[i]) ** 2, REWEIGHED_BINS, mode="nearest")
            sd = np.maximum(self.floor[i], np.sqrt(square))
            self.target[part] *= self.sd[i] / sd
            self.sd[i] = sd
            first += p.t_px.size

    def residuals(self, q: np.ndarray) -> np.ndarray:
        return self.solve(q)[1]

    def rms(self, q: np.ndarray, side: int) -> float:
        """rms residual of one side's profile, in the signal's units."""
        counts = [p.t_px.size for p in self.profiles]
        part = slice(side * counts[0], counts[0] + side * counts[1])
        return float(np.sqrt(np.mean((self.residuals(q)[part] * self.sd[side]) ** 2)))
