"""The edge of a strand lit by one lamp and by light from all around: few numbers a pair of edges.

In units of the core's contrast, t px inside the edge, sin phi = x = 1 - t / rho,

    I(t) = ground + black + ambient + u (1 + x) / 2 + v (1 - x) / 2 + w max(0, cos(phi - theta))
           + s max(0, cos(phi - theta / 2))^24 - g h(t) + r min(t, 0),

with `black` the contrast of a strand without light, theta, w and s common to both edges (the lamp
of one limb's side is at -theta from the other's). What comes from all around may come more from one
side than from the other, u or v, which change places between the limbs: a sky over a dark bench. It
goes on beyond the terminator, where the lamp's light ends; told as one lamp alone, both together
put the edge of the darker limb up to half a px too far in or out.

The limb lies open, but further in a strand faces its neighbours: the groove between them takes
light away, h(t) = max(0, t / rho - GROOVE_FROM)^2. Without it what falls off inwards passes for
light from the side, and the edge of so bright a limb is sought too far in. Outside, the ground may
slope a little, r.

Strands that are not matt mirror the lamp, s. Such a gleam rises within a few px of the limb as
steeply as a blurred edge does: told without it a picture is taken to be more blurred than it is,
and the edge to lie further in, by up to a px a side of strands 10 px thick.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import OptimizeResult

from tsvision.measures.edges.shading import (
    BLUR_RANGE_PX,
    PLACE_RANGE_PX,
    RAMPS,
    EdgeProfile,
    averaged_blur_px,
    is_resolved,
    lamp_shape,
    limb_loss,
    looked_up,
    ramp_prior,
    ramps_outside,
    sky_shapes,
)
from tsvision.measures.light.beside import NONE, Beside
from tsvision.measures.light.separable import (
    Separable,
    changes,
    distinct,
    far_out_px,
    fit_separable,
    projected,
)

GROOVE_FROM = 0.1  # of the radius: how far in the neighbours begin to take light away
GLEAM_RESOLVED = 2.5  # blurs in a strand's radius: of a thinner one no gleam is told, ...
GLEAM_SD = 0.5  # whose brightness, in units of the core's contrast, is so much at most likely
HEAD_ON_RAD = np.deg2rad(10.0)  # gleam and groove meet on the core: what falls off is the groove
OPEN_RAD = np.deg2rad(45.0)  # from the camera: beyond, 0.3 radii of a limb and more are dark
# From three of them one fit in four to fifteen, of lamps far aside, ended far off (drawn tubes);
# from five, none beyond 60 degrees, one in forty, at four times the misfit of the best.
STARTS_RAD = np.deg2rad([-85.0, -60.0, -30.0, 0.0, 30.0, 60.0, 85.0])
ASIDE_RAD = np.deg2rad(60.0)
FURTHEST_RAD = 1.6
FIRST_STEPS, LAST_STEPS = 5, 40
HOPELESS = 2.0  # times the least cost after the first steps: left there
TURNED_RAD = 1e-3  # by which a lamp is turned, to see what changes
UNEVEN_SD = 0.1  # of the core's contrast: by how much what comes from all around is uneven
COMMON = 4  # unknowns of both sides: the lamp, a sky of either side, and the lamp's gleam
GLEAM = 3  # of them
OWN = 4 + RAMPS  # unknowns of a side, the last of which are the ground's slopes


@dataclass(frozen=True)
class Lamp:
    """The lamp's direction from the upper limb's side, blur, both edges' places (2,) on the
    profiles' axis, and the sum of squared residuals in units of the sd given."""

    theta_rad: float
    blur_px: float
    places_px: np.ndarray
    misfit: float


def fit_lamp(
    profiles: tuple[EdgeProfile, EdgeProfile],
    sd: tuple[np.ndarray, ...],
    rho_px: float,
    blur_start_px: float,
    black: float = 0.0,
    grooved: bool = False,
    beside: Beside = NONE,
    glossy: bool = False,
) -> Lamp:
    """Fit the mean profiles (upper, lower) of strands brighter than their ground, each value with
    its sd (K,), those of what is beside after them. grooved, glossy: whether there may be a groove,
    and a gleam; where the lamp leaves one limb dark, neither is told from where its light ends, and
    where it stands by the camera a gleam is told from a groove where that alone does not describe
    the profiles to what is known of them."""
    known = profiles, sd, rho_px, blur_start_px, black, beside
    grooved &= is_resolved(rho_px, blur_start_px)
    glossy &= rho_px > GLEAM_RESOLVED * blur_start_px
    if glossy:
        gleaming = _fit(*known, grooved, True)
        aside_rad = abs(gleaming.theta_rad)
        if (HEAD_ON_RAD if grooved else 0.0) <= aside_rad < OPEN_RAD:
            return gleaming
    if grooved:
        lamp = _fit(*known, True, False)
        if glossy and aside_rad < HEAD_ON_RAD and lamp.misfit > sum(s.size for s in sd):
            return gleaming
        if abs(lamp.theta_rad) < OPEN_RAD:
            return lamp
    return _fit(*known, False, False)


def _fit(
    profiles: tuple[EdgeProfile, EdgeProfile],
    sd: tuple[np.ndarray, ...],
    rho_px: float,
    blur_start_px: float,
    black: float,
    beside: Beside,
    grooved: bool,
    glossy: bool,
) -> Lamp:
    system = _LampSystem(profiles, sd, rho_px, black, beside, grooved, glossy)

    def fit(start: np.ndarray, max_nfev: int) -> OptimizeResult:
        return fit_separable(
            system.residuals,
            None if beside.profiles else system.slopes,
            start,
            [BLUR_RANGE_PX, PLACE_RANGE_PX, PLACE_RANGE_PX, (-FURTHEST_RAD, FURTHEST_RAD)],
            x_scale=[0.2, 0.2, 0.2, 0.3],
            max_nfev=max_nfev,
        )

    # Of several starts most come near one place in a few steps, or are left far behind.
    begun = [
        fit(np.array([blur_start_px, *places_px, theta]), FIRST_STEPS)
        for places_px, theta in starts(rho_px)
    ]
    fits = distinct(begun)
    fits = [fit(f.x, LAST_STEPS) for f in fits if f.cost <= HOPELESS * fits[0].cost]
    best = min(fits, key=lambda f: f.cost)
    return Lamp(float(best.x[3]), float(best.x[0]), best.x[1:3], float(2.0 * best.cost))


def starts(rho_px: float) -> list[tuple[tuple[float, float], float]]:
    """Both places and the lamp's direction to begin from: edges where they were found, and for a
    lamp far aside the limb away from it far out in the dark."""
    far = far_out_px(rho_px)
    near = [((0.0, 0.0), theta) for theta in STARTS_RAD]
    return [*near, ((far, 0.0), -ASIDE_RAD), ((0.0, far), ASIDE_RAD)]


class _LampSystem(Separable):
    """The linear part: given q = (blur, both places, theta), the light of both profiles, and of
    what is beside them, by least squares."""

    def __init__(
        self,
        profiles: tuple[EdgeProfile, EdgeProfile],
        sd: tuple[np.ndarray, ...],
        rho_px: float,
        black: float,
        beside: Beside,
        grooved: bool,
        glossy: bool,
    ) -> None:
        super().__init__()
        self.profiles, self.sd, self.rho_px, self.black = profiles, sd, rho_px, black
        self.beside, self.grooved, self.glossy = beside, grooved, glossy
        self.loss = limb_loss(black)
        self.bright = beside.lit(profiles, black) if beside.profiles else 0.0
        self.seen = np.concatenate([p.value / s for p, s in zip(profiles, sd[:2], strict=True)])
        first = profiles[0].t_px.size
        self.parts = (slice(0, first), slice(first, self.seen.size))
        # What both skies give alike is ambient light: without a bound no solution is the best.
        prior = np.zeros((3, COMMON + 2 * OWN))
        prior[:2, 1:GLEAM] = [[0.5 / UNEVEN_SD, -0.5 / UNEVEN_SD], [1.0, 1.0]]
        prior[2, GLEAM] = 1.0 / GLEAM_SD
        self.prior = np.vstack([ramp_prior(OWN, common=COMMON), prior])

    def slopes(self, q: np.ndarray) -> np.ndarray:
        """How residuals change (R, 4) with each of q, where nothing is beside."""
        solved, black = self.solve(q), self.black
        light, moved = solved.light, np.zeros((solved.off.size, q.size))
        lamp, upper, lower, gleam = light[:COMMON]
        for side, (p, s, rows) in enumerate(zip(self.profiles, self.sd, self.parts, strict=True)):
            own = light[COMMON + OWN * side : COMMON + OWN * (side + 1)]
            way, t_px = 1.0 if side == 0 else -1.0, p.t_px - q[1 + side]
            shapes = self._shapes(q, side)
            around = black + own[0] + 0.5 * (upper + lower)
            level = np.array([around, lamp, 0.5 * way * (upper - lower), gleam])
            by_blur, by_place = changes(level @ shapes, t_px, float(q[0]))
            further = self._shapes(q + TURNED_RAD * np.eye(q.size)[3], side) - shapes
            by_theta = looked_up((level @ further)[None] / TURNED_RAD, t_px)[:, 0]
            by_place -= (own[4] - own[5]) * (t_px < 0.0)
            if self.grooved:
                by_place += own[3] * 2.0 * self._into_groove(t_px) / self.rho_px
            moved[rows, 0], moved[rows, 1 + side], moved[rows, 3] = by_blur, by_place, by_theta
            moved[rows] /= s[:, None]
        return projected(moved, solved.design, light)

    def _into_groove(self, t_px: np.ndarray) -> np.ndarray:
        return np.maximum(t_px / self.rho_px - GROOVE_FROM, 0.0)

    def _shapes(self, q: np.ndarray, side: int) -> np.ndarray:
        return _shapes(self.rho_px, averaged_blur_px(float(q[0])), float(q[3]), side, self.loss)

    def rows(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Design (R, C) and target (R,)."""
        target = self.seen.copy()
        # ambient, the ground's error, the groove and the ground's slope of each side
        design = np.zeros((target.size, COMMON + 2 * OWN))
        above = []
        blur_px = averaged_blur_px(float(q[0]))
        for side, (p, s, rows) in enumerate(
            zip(self.profiles, self.sd[:2], self.parts, strict=True)
        ):
            way = 1.0 if side == 0 else -1.0
            t_px = p.t_px - q[1 + side]
            around, lit, aside, gleam = looked_up(self._shapes(q, side), t_px).T
            target[rows] -= self.black * around / s
            seen = design[rows]
            seen[:, 0] = lit
            seen[:, 1], seen[:, 2] = 0.5 * (around + way * aside), 0.5 * (around - way * aside)
            if self.glossy:
                seen[:, GLEAM] = gleam
            own = seen[:, COMMON + OWN * side : COMMON + OWN * (side + 1)]
            own[:, 0], own[:, 1], own[:, 2] = around, 1.0, -1.0
            if self.grooved:
                own[:, 3] = -(self._into_groove(t_px) ** 2)
            own[:, 4], own[:, 5] = ramps_outside(t_px)
            seen /= s[:, None]
            if self.bright:
                about = q[1 + side], blur_px, self.black, self.bright, self.rho_px
                above.append(self.beside.in_colour(side, p, *about) / s[:, None])
        design = np.vstack([design, self.prior])
        target = np.concatenate([target, np.zeros(len(self.prior))])
        if self.bright:
            known = self.rho_px, self.loss, self.beside, self.bright, q
            return _joined(design, target, np.vstack(above), self.sd[2:], *known)
        return design, target


def _shapes(rho_px: float, blur_px: float, lamp_rad: float, side: int, loss: float) -> np.ndarray:
    """Blurred profiles (4, T) on the upper (0) or the lower limb of light from all around, of a
    lamp on the upper one's side, of what is uneven, and of the lamp's gleam."""
    around, aside = sky_shapes(rho_px, blur_px, loss)
    lamp, gleam = lamp_shape(rho_px, blur_px, lamp_rad, loss)[side]
    return np.stack([around, lamp, aside, gleam])


def _joined(
    design: np.ndarray,
    target: np.ndarray,
    above: np.ndarray,
    sd: tuple[np.ndarray, ...],
    rho_px: float,
    loss: float,
    beside: Beside,
    bright: float,
    q: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Design (R, C) and target (R,) with what brightness shows of the same light, each value with
    its sd (K,), below and its own unknowns to the right; above (K, UNKNOWNS): what those add to the
    first rows."""
    rows, aims = beside.prior()
    columns = design.shape[1]
    below, more = [np.hstack([np.zeros((len(rows), columns)), rows])], [aims]
    blur_px = averaged_blur_px(beside.blur_px)
    for side, s in enumerate(sd):
        way = 1.0 if side == 0 else -1.0
        shapes = _shapes(rho_px, blur_px, float(q[3]), side, loss)[:GLEAM]
        seen, light, own = beside.rows(side, q[1 + side], shapes, bright, rho_px)
        around, lit, aside = light.T
        block = np.zeros((s.size, columns))
        block[:, 0] = lit
        block[:, 1], block[:, 2] = 0.5 * (around + way * aside), 0.5 * (around - way * aside)
        block[:, COMMON + OWN * side] = around
        below.append(np.hstack([block, own]) / s[:, None])
        more.append(seen / s)
    wide = np.pad(design, ((0, 0), (0, rows.shape[1])))
    wide[: len(above), columns:] = above
    return np.vstack([wide, *below]), np.concatenate([target, *more])
