"""Light, blur and place of both edges, fitted to their mean profiles.

Light that is spread over many lamps and light that comes from one explain a profile about equally
well, with edges some tenths of a px apart: what tells them apart lies within one blur of the limb.
Neither is right, so that the place is the mean of both, weighed by how common each is - rigs have a
lamp, and the prior of spread light draws a limb with little of it inwards - and a little by how
well it describes the profiles: the better description is as often as not the worse place. Their
difference enters the uncertainty.

A limb that no lamp reaches is as dark before a bright ground as before a black one: darker than the
ground, then. But most limbs do get light, from the ground not least, and to let them fall below it
costs what the profiles know of their places. Both are fitted and count by how well they describe
the profiles, to a power: a limb that does fall below its ground, taken for no darker, draws the
edge in by up to 3 px and is described worse, mostly by several times.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.optimize import OptimizeResult, minimize_scalar

from tsvision.measures.edges.shading import (
    BLUR_RANGE_PX,
    LAMPS_RAD,
    MIRRORED_SD,
    PLACE_RANGE_PX,
    RAMPS,
    EdgeProfile,
    Shading,
    averaged_blur_px,
    is_resolved,
    lamp_shapes,
    limb_loss,
    looked_up,
    mirror_shape,
    mirrored_share,
    ramp_prior,
    ramps_outside,
)
from tsvision.measures.light.beside import NONE, SHARP_PX, Beside
from tsvision.measures.light.beside import UNKNOWNS as UNKNOWNS_BESIDE
from tsvision.measures.light.separable import (
    Bounds,
    Separable,
    changes,
    distinct,
    far_out_px,
    fit_separable,
    projected,
)
from tsvision.measures.light.shading_lamp import fit_lamp
from tsvision.measures.light.shape import UNKNOWN, Shape

# Before anything is seen: so much of the core's light comes from lamps, most of them beside the
# camera; all lamps together may differ from that by LAMP_SD.
LAMP_SHARE = 0.45
LAMP_SD = 0.5
AMBIENT_SHARE, AMBIENT_SD = 0.4, 0.3  # of lit strands; before a bright ground nothing is known
TIE_SD = 0.1  # how much a lamp may differ between the two limbs
FLOOR = 0.003  # of a profile's span: what the model cannot describe at the limb, ...
FLOOR_GROWTH = 20.0  # ... growing inwards, where neighbours shade and gleam
# Of the light that a dark strand sends itself, over its contrast: an outline has hardly any to
# shade or to gleam with.
LEAST_LIT = 1.0 / 3.0
HELD_SD = 0.01  # of a share that nothing tells
REWEIGHED, REWEIGHED_BINS = 2, 9  # times, over this stretch of a profile
RIVAL = 1.5  # times the best cost
WIDTH_PX = 0.02  # by which a width may be off
SHOWN_UNLIT = 0.5  # of the core's contrast without light, from which on no limb hides in the dark
LAMP_ODDS = 4.0  # that one lamp and a sky light the strings, before the profiles are seen
LAMP_POWER = 0.5  # of the two misfits' ratio: the better description counts a little more
GROUND_LIGHT = 0.02  # of the core's contrast: a ground no brighter is as good as black
UNLIT_POWER = 4.0  # of both misfits' ratio: by which limbs may be darker than their ground
SHARP_TO = 0.03  # of itself, that the blur of what is beside is told to


def fit_shading(
    profiles: tuple[EdgeProfile, EdgeProfile],
    rho_px: float,
    black: float = 0.0,
    blur_start_px: float = 1.0,
    shape: Shape = UNKNOWN,
    grooved: bool = False,
    beside: Beside = NONE,
    by_hue: bool = False,
) -> tuple[Shading, Shading, np.ndarray]:
    """Fit both sides' mean edge profiles (upper, lower) with one blur and nearly the same lamps.

    Signals in units of the core's contrast, > 0 inside. black: the contrast of a strand without
    light: 0 before a black ground, less where the ground beside bright strands is lit, more where
    strings are told by a hue or by being darker, above 1 before a bright ground, where light
    reduces the contrast. shape: what the outline's shape tells of both edges' places together.
    grooved: whether neighbours may take light from a strand: there are more than two. beside: the
    same edges by brightness, under the same light. by_hue: whether strands are told by their
    colour, of which no groove takes any, and a lamp that they mirror has none.
    Returns upper and lower shading and (2,) the true edges' places on the profiles' axis (negative:
    outside the edge assumed).
    """
    grooved, glossy = grooved and not by_hue, not by_hue
    if beside.profiles and black < 1.0:
        beside = beside.looked_at(profiles, black)
    known = rho_px, blur_start_px, shape, grooved, beside, glossy
    light = _fit_light(profiles, max(black, 0.0), *known)
    if black < -GROUND_LIGHT:
        light = _either(light, _fit_light(profiles, black, *known))
    system, q, width_sd = light.system, light.q, light.width_sd_px
    hides = not (by_hue and black > SHOWN_UNLIT)
    told = shape.joined(float(q[1:].sum()), width_sd, hides)
    q, width_sd = system.fit_width(q, told.width_px), told.sd_px
    gain = 1.0 - system.black
    sides = []
    lights, mirrored = system.light(q)
    for i, own in enumerate(lights):
        ambient, lamps = system.black + gain * float(own[0]), gain * own[1 : 1 + LAMPS_RAD.size]
        sides.append(
            Shading(
                rho_px,
                float(q[0]),
                ambient,
                lamps,
                width_sd / np.sqrt(2.0),
                loss=system.loss,
                mirrored=mirrored,
                sunk=profiles[i].sunk,
            )
        )
    return sides[0], sides[1], q[1:]


@dataclass(frozen=True)
class _Light:
    """A system solved: q (3,) = blur and both places, and the width's sd."""

    system: _SpreadSystem
    q: np.ndarray
    width_sd_px: float


def _fit_light(
    profiles: tuple[EdgeProfile, EdgeProfile],
    black: float,
    rho_px: float,
    blur_start_px: float,
    shape: Shape,
    grooved: bool,
    beside: Beside,
    glossy: bool,
) -> _Light:
    """Spread light and one lamp together, for strands that show the contrast `black` without, under
    the blur of what is beside that describes both best where it is not known."""
    if beside.profiles and beside.sought and black < 1.0:
        known = rho_px, blur_start_px, shape, grooved

        @cache
        def told(log_px: float) -> _Light:
            sharp = replace(beside, blur_px=float(np.exp(log_px)), sought=False)
            return _fit_light(profiles, black, *known, sharp, glossy)

        def misfit(log_px: float) -> float:
            light = told(log_px)
            return float(np.log(light.system.misfit(light.q)))

        best = minimize_scalar(
            misfit, bounds=np.log(SHARP_PX), method="bounded", options={"xatol": SHARP_TO}
        )
        return told(best.x)
    system = _SpreadSystem(profiles, rho_px, black, is_resolved(rho_px, blur_start_px), beside)
    blur = float(np.clip(blur_start_px, 0.4, 5.5))
    far = far_out_px(rho_px)
    starts = [np.array([blur, *places]) for places in ((0.0, 0.0), (far, 0.0), (0.0, far))]
    starts += [np.array([blur, *places]) for places in shape.starts()]
    fits = distinct([system.fit(start) for start in starts])
    for _ in range(REWEIGHED):
        system.reweigh(fits[0].x)
        fits = distinct([system.fit(f.x) for f in fits])
    fit = fits[0]
    covariance = np.linalg.pinv(fit.jac.T @ fit.jac)
    width_sd = float(np.sqrt(max(covariance[1:, 1:].sum(), 0.0)))
    # Another place that explains the profiles nearly as well cannot be ruled out.
    apart = [abs(float((f.x - fit.x)[1:].sum())) for f in fits if f.cost < RIVAL * fit.cost + 1.0]
    q = fit.x
    if black < 1.0:
        about = rho_px, float(q[0]), black, grooved, beside, glossy
        lamp = fit_lamp(profiles, system.floor, *about)
        spread = system.misfit(q)
        odds = LAMP_ODDS / max(lamp.misfit / max(spread, 1e-12), 1e-3) ** LAMP_POWER
        share = odds / (1.0 + odds)
        apart.append(abs(float((lamp.places_px - q[1:]).sum())))
        q = system.blur_at(q[0], q[1:] + share * (lamp.places_px - q[1:]))
    width_sd = float(np.hypot(width_sd, 0.5 * max(apart)))
    return _Light(system, q, width_sd)


def _either(light: _Light, unlit: _Light) -> _Light:
    """Of limbs that reach the ground's light and no less, and of such as may fall below it, each by
    how well it describes the profiles; what they differ by is not known."""
    ratio = light.system.misfit(light.q) / max(unlit.system.misfit(unlit.q), 1e-12)
    odds = ratio**UNLIT_POWER
    share = odds / (1.0 + odds)
    off = unlit.q[1:] - light.q[1:]
    between = np.sqrt(share * (1.0 - share)) * abs(float(off.sum()))
    system = unlit.system if share > 0.5 else light.system
    q = system.blur_at(unlit.q[0], light.q[1:] + share * off)
    sd = (1.0 - share) * light.width_sd_px + share * unlit.width_sd_px
    return _Light(system, q, float(np.hypot(sd, between)))


class _SpreadSystem(Separable):
    """The linear part: given blur and places, the light of both sides by least squares.

    Unknowns of a side: ambient and the lamps, over the core's light, and the ground's error and
    slope with either sign; of both together, before a bright ground, what share of it their limbs
    mirror, and last the UNKNOWNS of what is beside. thick: whether a mirrored share is seen apart
    from the blur.
    """

    def __init__(
        self,
        profiles: tuple[EdgeProfile, EdgeProfile],
        rho_px: float,
        black: float,
        thick: bool,
        beside: Beside,
    ) -> None:
        super().__init__()
        self.profiles, self.rho_px, self.black = profiles, rho_px, black
        self.loss, self.mirrors = limb_loss(black), black >= 1.0
        self.sd = []
        lit = float(np.clip(abs(1.0 - black), LEAST_LIT, 1.0)) if self.mirrors else 1.0
        for p in profiles:
            deep = np.maximum(p.t_px - 1.0, 0.0) / rho_px
            floor = FLOOR * lit * np.ptp(p.value) * (1.0 + FLOOR_GROWTH * deep**2)
            self.sd.append(np.hypot(p.sd, np.maximum(floor, 1e-6)))
        ends = np.cumsum([0, *(p.t_px.size for p in profiles)])
        # Of the residuals, as all that is by sides: the profiles', then what is beside them.
        self.parts: tuple[slice, ...] = (slice(ends[0], ends[1]), slice(ends[1], ends[2]))
        lamps = LAMPS_RAD.size
        self.unknowns = 1 + lamps + 2 + RAMPS
        own = np.zeros((lamps, 2 * self.unknowns))
        own[:, 1 : 1 + lamps] = np.eye(lamps) * np.sqrt(lamps) / LAMP_SD
        other = np.roll(own, self.unknowns, axis=1)
        ties = self._ties()
        ambient = np.zeros((2, 2 * self.unknowns))
        if black < 1.0:
            ambient[[0, 1], [0, self.unknowns]] = 1.0 / AMBIENT_SD
        self.prior = np.vstack([own, other, ambient, ties, ramp_prior(self.unknowns)])
        share = np.empty(0)
        if self.mirrors:
            sd = MIRRORED_SD if thick else HELD_SD
            share = np.array([mirrored_share(black) / sd])
            rows, columns = self.prior.shape
            self.prior = np.pad(self.prior, ((0, 1), (0, 1)))
            self.prior[rows, columns] = 1.0 / sd
        front = np.maximum(np.cos(LAMPS_RAD), 0.0)
        typical = LAMP_SHARE * front / np.sum(front**2)
        expected = typical * np.sqrt(lamps) / LAMP_SD
        self.target = np.concatenate(
            [
                *(p.value / s for p, s in zip(profiles, self.sd, strict=True)),
                expected,
                expected,
                np.full(2, AMBIENT_SHARE / AMBIENT_SD if black < 1.0 else 0.0),
                np.zeros(len(ties) + 2 * RAMPS),
                share,
            ]
        )
        self.beside, self.lit = beside, 1.0
        if beside.profiles and not self.mirrors:
            self._join(beside)
        self.floor = tuple(self.sd)

    def _join(self, beside: Beside) -> None:
        """Add what brightness shows of the same light, after all else."""
        self.lit = beside.lit(self.profiles, self.black)
        rows, target = beside.prior()
        below = np.zeros((len(rows), self.prior.shape[1]))
        wider = np.zeros((len(self.prior), UNKNOWNS_BESIDE))
        self.prior = np.block([[self.prior, wider], [below, rows]])
        self.target = np.concatenate([self.target, target])
        for p in beside.profiles:
            first = self.target.size
            deep = np.maximum(p.t_px - 1.0, 0.0) / self.rho_px
            sd = np.hypot(p.sd, FLOOR * self.lit * (1.0 + FLOOR_GROWTH * deep**2))
            self.parts += (slice(first, first + p.t_px.size),)
            self.sd.append(sd)
            self.target = np.concatenate([self.target, p.value / sd])

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

    def light(self, q: np.ndarray) -> tuple[np.ndarray, float]:
        """Each side's own light (2, unknowns), and the contrast that mirrored ground takes."""
        light = self.solve(q).light
        mirrored = self.black * float(light[-1]) if self.mirrors else 0.0
        return light[: 2 * self.unknowns].reshape(2, -1), mirrored

    def rows(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Design (R, C) and target (R,) in units of the values' sd."""
        blur_px = averaged_blur_px(float(q[0]))
        shapes = lamp_shapes(self.rho_px, blur_px, self.loss)
        blocks, target, gain = [], self.target.copy(), 1.0 - self.black
        for i, (p, sd) in enumerate(zip(self.profiles, self.sd[:2], strict=True)):
            t_px = p.t_px - q[1 + i]
            seen = looked_up(shapes, t_px)
            block = np.zeros((t_px.size, self.prior.shape[1]))
            target[self.parts[i]] -= self.black * seen[:, 0] / sd
            own = block[:, i * self.unknowns : (i + 1) * self.unknowns]
            lit = seen.shape[1]
            own[:, :lit] = gain * seen
            own[:, lit], own[:, lit + 1] = 1.0, -1.0  # the ground's error
            own[:, lit + 2], own[:, lit + 3] = ramps_outside(t_px)
            own /= sd[:, None]
            if self.mirrors:
                lost = looked_up(mirror_shape(self.rho_px, blur_px)[None], t_px)[:, 0]
                block[:, -1] = -self.black * lost / sd
            elif self._bright:
                about = q[1 + i], blur_px, self.black, self.lit, self.rho_px
                adds = self.beside.in_colour(i, p, *about)
                block[:, -UNKNOWNS_BESIDE:] = adds / sd[:, None]
            blocks.append(block)
        bright = []
        for i, sd in enumerate(self.sd[2:]):  # of what is beside, where anything is
            sharp = lamp_shapes(self.rho_px, averaged_blur_px(self.beside.blur_px), self.loss)
            known, lit, own = self.beside.rows(i, q[1 + i], sharp, self.lit, self.rho_px)
            block = np.zeros((sd.size, self.prior.shape[1]))
            first = i * self.unknowns
            block[:, first : first + 1 + LAMPS_RAD.size] = lit / sd[:, None]
            block[:, -UNKNOWNS_BESIDE:] = own / sd[:, None]
            target[self.parts[2 + i]] = known / sd
            bright.append(block)
        return np.vstack([*blocks, self.prior, *bright]), target

    @property
    def _bright(self) -> bool:
        """Whether what is beside takes part."""
        return len(self.sd) > 2

    @property
    def slopes(self) -> Callable[[np.ndarray], np.ndarray] | None:
        """How residuals change with q, where that is known: not of what is beside."""
        return None if self._bright else self._slopes

    def _slopes(self, q: np.ndarray) -> np.ndarray:
        """Of residuals (R, 3) with blur and places."""
        solved = self.solve(q)
        blur_px = averaged_blur_px(float(q[0]))
        shapes = lamp_shapes(self.rho_px, blur_px, self.loss)
        lights, mirrored = self.light(q)
        moved = np.zeros((solved.off.size, q.size))
        for i, (p, sd, own) in enumerate(zip(self.profiles, self.sd, lights, strict=True)):
            level = (1.0 - self.black) * own[: len(shapes)]
            level[0] += self.black
            profile = level @ shapes
            if self.mirrors:
                profile -= mirrored * mirror_shape(self.rho_px, blur_px)
            t_px = p.t_px - q[1 + i]
            by_blur, by_place = changes(profile, t_px, float(q[0]))
            by_place -= (own[-2] - own[-1]) * (t_px < 0.0)
            moved[self.parts[i], 0] = by_blur / sd
            moved[self.parts[i], 1 + i] = by_place / sd
        return projected(moved, solved.design, solved.light)

    def fit(self, start: np.ndarray) -> OptimizeResult:
        """Blur and both places (3,), from a start."""
        return fit_separable(
            self.residuals,
            self.slopes,
            start,
            [BLUR_RANGE_PX, PLACE_RANGE_PX, PLACE_RANGE_PX],
            x_scale=[0.2, 0.2, 0.2],
            max_nfev=40,
        )

    def fit_within(
        self, fixed: np.ndarray, by: np.ndarray, start: np.ndarray, bounds: Bounds
    ) -> OptimizeResult:
        """Of q (3,) = fixed + free @ by, what is free (P,), by (P, 3), from a start on."""
        slopes = self.slopes
        return fit_separable(
            lambda free: self.residuals(fixed + free @ by),
            None if slopes is None else lambda free: slopes(fixed + free @ by) @ by.T,
            start,
            bounds,
            x_scale=[0.2] * len(by),
            max_nfev=25,
        )

    def blur_at(self, blur_px: float, places_px: np.ndarray) -> np.ndarray:
        """(blur, both places) (3,) with the best blur for given places (2,)."""
        fixed, by = np.concatenate([[0.0], places_px]), np.eye(3)[:1]
        found = self.fit_within(fixed, by, np.array([blur_px]), [BLUR_RANGE_PX])
        return np.concatenate([found.x, places_px])

    def fit_width(self, q: np.ndarray, width_px: float) -> np.ndarray:
        """(blur, both places) (3,) from `q` on with the places' sum given: which limb it is that
        goes on unseen, and how blurred both are, the profiles tell."""
        if abs(width_px - float(q[1:].sum())) < WIDTH_PX:
            return q
        # Poor fits tell of widths that no two places have: then the nearest that two have.
        least, most = (2.0 * place for place in PLACE_RANGE_PX)
        width_px = float(np.clip(width_px, least + WIDTH_PX, most - WIDTH_PX))
        fixed = np.array([0.0, 0.0, width_px])
        by = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, -1.0]])
        middle = 0.5 * (width_px - float(q[1:].sum()))
        low = max(PLACE_RANGE_PX[0], width_px - PLACE_RANGE_PX[1]) + 1e-3
        high = min(PLACE_RANGE_PX[1], width_px - PLACE_RANGE_PX[0]) - 1e-3
        fits = [
            self.fit_within(
                fixed,
                by,
                np.array([q[0], np.clip(place, low + 1e-3, high - 1e-3)]),
                [BLUR_RANGE_PX, (low, high)],
            )
            for place in (q[1] + middle, q[1] + 2.0 * middle, q[1])
        ]
        return fixed + min(fits, key=lambda f: f.cost).x @ by

    def misfit(self, q: np.ndarray) -> float:
        """Sum of squared residuals of both profiles in units of what is allowed at the limb."""
        off = self.residuals(q)
        sides = zip(self.parts, self.sd, self.floor, strict=True)
        return float(sum(np.sum((off[part] * sd / floor) ** 2) for part, sd, floor in sides))

    def reweigh(self, q: np.ndarray) -> None:
        """Count each stretch of the profiles by how well the model describes it about there: bins
        side by side are off together (gleam, strands in front, few sub-pixel phases)."""
        off = self.residuals(q)
        for i, part in enumerate(self.parts):
            square = uniform_filter1d((off[part] * self.sd[i]) ** 2, REWEIGHED_BINS, mode="nearest")
            sd = np.maximum(self.floor[i], np.sqrt(square))
            self.target[part] *= self.sd[i] / sd
            self.sd[i] = sd
        self.forget()
