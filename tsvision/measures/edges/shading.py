"""What the edge of a round, blurred, lit strand looks like, learnt from many of them.

A strand is a tube: towards its limb the surface turns away, so that its brightness falls before
the edge is reached and every half-level edge lies inside the true one, by 0.5 to 4 px where the
light comes from one side. t px inside the edge of a tube of radius rho the surface faces an angle
phi from the camera, sin phi = x = 1 - t / rho, and whatever shines there, Lambert's law gives

    L(t) = ambient + sum over lamps of w_j max(0, cos(phi - theta_j)),   all w_j >= 0,
    I(t) = ground + black + (1 - black) L(t),

blurred by the camera. Surfaces send less of what fell on them the more they turn away: what is
seen is (1 - loss (1 - cos phi)^5) L, loss 0 for a matt surface, 1 for a smooth dielectric (Schlick
1994), which mirrors what lies beyond instead, the ground. `black` is the contrast of a strand
without light, known from the ground's colour: strings that are told by being redder or darker than
their ground do not vanish at a limb in the dark, and those before a bright ground (black > 1) lose
contrast where they are lit, and by black m (1 - cos phi)^4 where their limbs mirror that ground: a
screen close behind as a rough dielectric does, a lamp far behind hardly. How much, m, is seen on
thick strands.

Lamps stand all around the strand, in fixed directions across it; a lamp's max(0, .) ends at its
terminator, beyond which only the others light the limb. Light that cannot be negative and is spread
over few directions by a prior leaves little room for ramp and place of the edge to trade against
each other. Both limbs see the same lamps from opposite sides, nearly: the bundle itself hides some.

The mean of many edges, aligned on the fitted silhouette, is almost free of noise; `shading_fit`
finds light, ground, blur and the true edges' places from it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from tsvision.measures.numeric.interpolated import interpolated
from tsvision.measures.numeric.smoothing import blurred

TEMPLATE_START_PX = -14.0
TEMPLATE_STEP_PX = 0.05
TEMPLATE_GRID_PX = np.arange(TEMPLATE_START_PX, 30.0, TEMPLATE_STEP_PX)
# A strand's share of each sample: half of that on the edge, else every edge lies half a step off.
INSIDE = np.clip(0.5 + TEMPLATE_GRID_PX / TEMPLATE_STEP_PX, 0.0, 1.0)
TRUNCATED = 5.0  # sds of a blur: nearer, a profile jumps as one more sample counts
ASIDE_RAD = 0.5 * np.pi
LAMPS_RAD = np.deg2rad(np.linspace(-90.0, 180.0, 13))
BEHIND = LAMPS_RAD > ASIDE_RAD + 1e-6  # what these light begins at the limb and soon fades
RESOLVED = 3.0  # blurs in a strand's radius: of a thinner one no groove is told from the limb
# Blinn's lobe (1977), cos^GLEAM_POWER about halfway between a lamp and the camera, of plastic: half
# as bright 14 degrees to either side. A power of 10 or 50 moves edges by hardly 0.1 px.
GLEAM_POWER = 24.0
GLEAMS_RAD = np.deg2rad([10.0, 25.0, 40.0])  # from the camera, side by side as they are wide
AVERAGED_SD_PX = 12.0**-0.5  # of a mean over one px
BLUR_RANGE_PX = (0.35, 6.0)
PLACE_RANGE_PX = (-4.5, 2.5)  # of the true edge on a profile's axis: < 0 outside the edge assumed
OUTSIDE_PX = 5.0
# The ground beside a strand need not be even: a shadow's border, light scattered by the bundle. So
# much it may change a px, in units of the core's contrast; before a limb with little light of its
# own such a slope is easily taken for the limb.
RAMP_SD = 0.002
# Of the light at a limb: between a matt surface and a smooth dielectric, for strings are rough, and
# of plastic. Profiles do not tell: a strand without any loss is taken for as much too thick as a
# dielectric one for too thin.
LIMB_LOSS = 1.0 / 3.0
# Of a bright ground's light that is seen mirrored at the limb, before any profile is: of strands as
# lit as LIT (in units of `black`); what sends hardly any light, up to OUTLINE, is lit from behind
# alone, by what may be a lamp far off as well as a screen.
MIRRORED, MIRRORED_SD = 0.2, 0.25
OUTLINE, LIT = 1.05, 1.25
MIRROR_POWER = 4  # of 1 - cos phi: Fresnel's law from 50 to 80 degrees; Schlick's is steeper
RAMPS = 2  # unknowns that they are, for either sign: a light fit by nnls has no negative ones


@dataclass(frozen=True)
class EdgeProfile:
    """Mean signal `value` (K,) over the px about `t_px` (K,) inside an edge, with its sd (K,);
    sunk: of limbs that were found by being darker than their ground."""

    t_px: np.ndarray
    value: np.ndarray
    sd: np.ndarray
    sunk: bool = False


@dataclass(frozen=True)
class Shading:
    """How the edge of one side looks.

    rho_px: strand radius; blur_px: sd of the blur; ambient and lamps (13,) in units of the core's
    contrast, with their sign (< 0: they reduce it); place_sd_px: how well the edge's place was told
    (both sides' in quadrature give that of the width); beyond_px: how much farther out the true
    edge lies than where the template is found; loss: of light at the limb; mirrored: contrast that
    is lost there to the ground's light; sunk: whether the limb is seen, darker than its ground;
    added: (T,) what storing the picture adds to the profile, on the module's grid; undivided:
    whether all of the profile counts as a step, to be scaled by one factor.
    """

    rho_px: float
    blur_px: float
    ambient: float
    lamps: np.ndarray
    place_sd_px: float = 0.0
    beyond_px: float = 0.0
    loss: float = 0.0
    mirrored: float = 0.0
    sunk: bool = False
    added: np.ndarray | None = None
    undivided: bool = False

    @cached_property
    def template(self) -> np.ndarray:
        """The profile (T,) on the module's grid."""
        shapes = lamp_shapes(self.rho_px, self.blur_px, self.loss)
        lit = np.concatenate([[self.ambient], self.lamps]) @ shapes - self._lost
        return np.asarray(lit if self.added is None else lit + self.added)

    @cached_property
    def step(self) -> np.ndarray:
        """The share (T,) of it that begins at the limb itself, at full height, with what storing
        adds there: what else there is begins further in, where lamps reach. What shines from behind
        fades there: told as a lamp's that reaches more or less of a column, less of it would be
        taken for an edge farther out."""
        if self.undivided:
            return self.template
        shapes = lamp_shapes(self.rho_px, self.blur_px, self.loss)
        # Before a bright ground, where lamps count as negative, what fades is that ground mirrored.
        resolved = is_resolved(self.rho_px, self.blur_px)
        fading = np.where(BEHIND & resolved, np.maximum(self.lamps, 0.0), 0.0)
        step = limb_level(self.ambient, self.lamps - fading) * shapes[0] + fading @ shapes[1:]
        step -= self._lost
        return np.asarray(step if self.added is None else step + self.added)

    @property
    def _lost(self) -> np.ndarray | float:
        """What the limb mirrors of the ground's light (T,)."""
        return self.mirrored * mirror_shape(self.rho_px, self.blur_px) if self.mirrored else 0.0


def inside_px(rho_px: float) -> float:
    """How far inside an edge its profile is learnt."""
    return max(0.85 * rho_px, 2.5)


def is_resolved(rho_px: float, blur_px: float) -> bool:
    """Whether what lies within a strand of this radius, a groove say, is told from its limb."""
    return rho_px > RESOLVED * blur_px


def limb_loss(black: float) -> float:
    """Of contrast at the limb, for strands that show the contrast `black` without any light of
    their own: bright ones send less of it. What is mirrored of a bright ground counts apart."""
    return LIMB_LOSS * max(1.0 - black, 0.0)


def mirrored_share(black: float) -> float:
    """Of a bright ground's light, before anything is seen, what the limbs mirror of strands that
    show the contrast `black` without any light of their own."""
    return MIRRORED * float(np.clip((black - OUTLINE) / (LIT - OUTLINE), 0.0, 1.0))


def looked_up(shapes: np.ndarray, t_px: np.ndarray) -> np.ndarray:
    """Shapes (S, T) on the template's grid at some places (K,), (K, S)."""
    return np.asarray(interpolated(t_px, TEMPLATE_GRID_PX, shapes))


@lru_cache(maxsize=8)
def _facing(rho_px: float) -> tuple[np.ndarray, np.ndarray]:
    """Sine and cosine (T,) of the angle that the surface faces away from the camera, as if the
    strand's edge went on outside; to be read only, as all that is kept."""
    x = np.clip(1.0 - TEMPLATE_GRID_PX / rho_px, -1.0, 1.0)
    return x, np.sqrt(1.0 - x * x)


@lru_cache(maxsize=8)
def _sent(rho_px: float, loss: float) -> np.ndarray:
    """What the surface sends (T,) of ambient light."""
    return np.asarray(1.0 - loss * (1.0 - _facing(rho_px)[1]) ** 5)


def _lamplit(rho_px: float, lamps_rad: np.ndarray, loss: float) -> np.ndarray:
    """What the surface sends (K, T) of lamps (K,)."""
    x, facing = _facing(rho_px)
    falls = np.cos(lamps_rad)[:, None] * facing + np.sin(lamps_rad)[:, None] * x
    return np.asarray(_sent(rho_px, loss) * np.maximum(falls, 0.0))


def _lit(rho_px: float, lamps_rad: np.ndarray, loss: float) -> np.ndarray:
    """What the surface sends (1 + K, T) of ambient light and of lamps (K,)."""
    return np.vstack([_sent(rho_px, loss), _lamplit(rho_px, lamps_rad, loss)])


def _gleaming(rho_px: float, gleams_rad: np.ndarray) -> np.ndarray:
    """Gleams (K, T), 1 where they are brightest, so far around (K,) from the camera's side."""
    return _lamplit(rho_px, gleams_rad, 0.0) ** GLEAM_POWER


def _mirrored(rho_px: float) -> np.ndarray:
    """What the surface mirrors (T,) of a bright ground, 1 at the limb."""
    return np.asarray((1.0 - _facing(rho_px)[1]) ** MIRROR_POWER)


def surface_contrast(shading: Shading) -> np.ndarray:
    """The signal (T,) of the strand's surface itself, not blurred and without the ground beside
    it."""
    light = np.concatenate([[shading.ambient], shading.lamps])
    lit = light @ _lit(shading.rho_px, LAMPS_RAD, shading.loss)
    return np.asarray(lit - shading.mirrored * _mirrored(shading.rho_px))


def _seen(shapes: np.ndarray, blur_px: float) -> np.ndarray:
    """Profiles (K, T) on the template's grid as a camera sees them."""
    return np.asarray(blurred(shapes, max(blur_px, 0.2) / TEMPLATE_STEP_PX, truncate=TRUNCATED))


@lru_cache(maxsize=8)
def mirror_shape(rho_px: float, blur_px: float) -> np.ndarray:
    """Blurred profile (T,) of what limbs mirror of the ground, 1 at the limb; to be read only."""
    shape = _seen((INSIDE * _mirrored(rho_px))[None], blur_px)[0]
    shape.flags.writeable = False
    return shape


@lru_cache(maxsize=8)
def gleam_shapes(rho_px: float, blur_px: float) -> np.ndarray:
    """Blurred profiles (3, T) of what limbs mirror of lamps at twice GLEAMS_RAD on their own side,
    1 where that is brightest but for the blur; to be read only."""
    shapes = _seen(INSIDE * _gleaming(rho_px, GLEAMS_RAD), blur_px)
    shapes.flags.writeable = False
    return shapes


@lru_cache(maxsize=8)
def lamp_shapes(rho_px: float, blur_px: float, loss: float = 0.0) -> np.ndarray:
    """Blurred profiles of ambient light and of LAMPS_RAD, (1 + K, T) on the template's grid, to be
    read only: three in four steps of a fit move the edges under the same blur."""
    shapes = _seen(INSIDE * _lit(rho_px, LAMPS_RAD, loss), blur_px)
    shapes.flags.writeable = False
    return shapes


@lru_cache(maxsize=8)
def sky_shapes(rho_px: float, blur_px: float, loss: float = 0.0) -> np.ndarray:
    """Blurred profiles of ambient light and of a lamp square to the camera, which lights a limb by
    the sine of how far it faces away, positive all over a profile: (2, T), to be read only."""
    shapes = _seen(INSIDE * _lit(rho_px, np.array([ASIDE_RAD]), loss), blur_px)
    shapes.flags.writeable = False
    return shapes


@lru_cache(maxsize=16)
def lamp_shape(rho_px: float, blur_px: float, lamp_rad: float, loss: float = 0.0) -> np.ndarray:
    """Blurred profiles of one lamp's light and of its gleam, on the limb of its own side and on the
    other, (2, 2, T), to be read only: blurred together, which takes as long as one of them."""
    sides = np.array([lamp_rad, -lamp_rad])
    shapes = np.stack([_lamplit(rho_px, sides, loss), _gleaming(rho_px, 0.5 * sides)], axis=1)
    seen = _seen((INSIDE * shapes).reshape(4, -1), blur_px).reshape(shapes.shape)
    seen.flags.writeable = False
    return seen


def limb_level(ambient: float, lamps: np.ndarray) -> float:
    """The signal at the limb itself, where only what shines from its own side falls."""
    return ambient + float(lamps @ np.maximum(np.sin(LAMPS_RAD), 0.0))


def plain_shading(rho_px: float, blur_px: float = 1.0) -> Shading:
    """A strand evenly lit with some light from the camera's side, before anything is learnt."""
    lamps = np.where(np.isclose(LAMPS_RAD, 0.0), 0.2, 0.0)
    return Shading(rho_px, blur_px, 0.8, lamps)


def ramps_outside(t_px: np.ndarray) -> list[np.ndarray]:
    """Of either sign: ground that changes steadily away from the strand, 0 at its edge and inside,
    at t_px (K,) inside the edge."""
    ramp = np.minimum(t_px, 0.0)
    return [ramp, -ramp]


def ramp_prior(own: int, common: int = 0) -> np.ndarray:
    """Rows (2 * RAMPS, common + 2 * own) that hold both sides' slopes near 0: the last RAMPS of the
    `own` unknowns of each, which follow those in common."""
    rows = np.zeros((2 * RAMPS, common + 2 * own))
    for side in range(2):
        ends = common + own * (side + 1)
        rows[RAMPS * side : RAMPS * (side + 1), ends - RAMPS : ends] = np.eye(RAMPS) / RAMP_SD
    return rows


def inside_at(shading: Shading, level: float) -> float:
    """How far inside the edge, px, the signal first reaches a level (core's contrast 1): outside,
    < 0, for low ones; 0 where it never does."""
    reached = shading.template >= level
    return float(TEMPLATE_GRID_PX[np.argmax(reached)]) if reached.any() else 0.0


def averaged_blur_px(blur_px: float) -> float:
    """sd of what smears a mean profile: the picture's blur, and the px over which it is a mean."""
    return float(np.hypot(blur_px, AVERAGED_SD_PX))
