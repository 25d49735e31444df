"""The same edges by brightness, beside those by colour.

A hue tells strands from ground in any light, but files store it at half the resolution and blur it
at will: where a limb's light falls off within that blur, the edge could lie anywhere in it.
Brightness is stored in full. It may show one limb only, or none where limbs are as bright as their
ground; but these are the same strands under the same light,

    brightness(t) / ground = 1 + inside(t) (lit (L(t) + G(t)) - 1 + m (1 - cos phi)^4),

with the L(t) that the hue's contrast is made of and the edge at the same place; G(t), what they
mirror of lamps, has no colour. Where brightness shows the edge it tells the place, and where it
does not, how bright the limb is that the hue shows.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tsvision.measures.edges.shading import (
    GLEAMS_RAD,
    MIRRORED,
    MIRRORED_SD,
    RAMPS,
    EdgeProfile,
    averaged_blur_px,
    gleam_shapes,
    looked_up,
    mirror_shape,
    ramp_prior,
    ramps_outside,
)

# Unknowns of a side: the ground's error and slope, with either sign, and gleams without colour.
OWN = 2 + RAMPS + GLEAMS_RAD.size
# Of both: these, the share of the ground's light that limbs mirror, and by how much the edge by
# colour lies outside that by brightness, with either sign.
UNKNOWNS = 2 * OWN + 3
MIRROR, SHIFTS = -3, slice(-2, None)  # of them
SHIFT_SD_PX = 0.3  # that storing a colour at half the resolution may move its edge by
LEAST_SHIFT_SD_PX = 0.03  # of a colour that is stored in full
SHARP_PX = (0.4, 1.6)  # the blur, at least and at most, of a picture whose brightness tells none
# Of the brightest light there, from which on a place tells how bright strands are; the share of
# such places, at least, where no lamp gleams; how many times as bright as there what gleams is.
LIT, UNGLOSSED, GLEAMS = 0.5, 0.1, 1.1
LEAST_LIGHT = 1e-3  # of the core's
GLEAM_SD = 0.5  # of a gleam's brightness, over the core's light
DEEP = 0.5  # of how far inside edges are learnt, from which on both show the same light


@dataclass(frozen=True)
class Beside:
    """profiles: mean brightness about the upper and the lower edge, less the ground's and in units
    of it, () where it is not asked; blur_px: of the picture by its brightness; sought: whether that
    is a guess, and to be told along, within SHARP_PX; halved: whether colour is stored at half the
    resolution; gleaming: whether strands may mirror a lamp."""

    profiles: tuple[EdgeProfile, ...] = ()
    blur_px: float = SHARP_PX[0]
    sought: bool = False
    halved: bool = True
    gleaming: bool = True

    def lit(self, colour: tuple[EdgeProfile, EdgeProfile], black: float) -> float:
        """How bright a strand is, in units of the ground, where the light is the core's; colour:
        the same edges by a contrast that is `black` without light. What it mirrors of a lamp is
        brightness without its colour, and does not count."""
        return _matt(self._ratios(colour, black))

    def looked_at(self, colour: tuple[EdgeProfile, EdgeProfile], black: float) -> Beside:
        """The same, without gleams where brightness nowhere outgrows the light that the colour
        shows: what is not seen takes part in the place of the edge all the same."""
        ratios = self._ratios(colour, black)
        return replace(self, gleaming=bool((ratios > GLEAMS * _matt(ratios)).any()))

    def _ratios(self, colour: tuple[EdgeProfile, EdgeProfile], black: float) -> np.ndarray:
        """Of both sides, as far as they are known."""
        pairs = zip(self.profiles, colour, strict=True)
        ratios = np.concatenate([_ratio(mine, other, black) for mine, other in pairs])
        return ratios[np.isfinite(ratios)]

    def rows(
        self, side: int, place_px: float, shapes: np.ndarray, lit: float, rho_px: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of the profile of one side (K,), its edge there: what is to be explained (K,), by light
        of some shapes (S, T) on the template's grid (K, S), and by what it has of its own
        (K, UNKNOWNS)."""
        profile = self.profiles[side]
        t_px = profile.t_px - place_px
        seen = looked_up(shapes, t_px)
        own = np.zeros((t_px.size, UNKNOWNS))
        one = np.ones_like(t_px)
        blur_px = averaged_blur_px(self.blur_px)
        gleams = self.gleaming * looked_up(gleam_shapes(rho_px, blur_px), t_px)
        ground = np.stack([one, -one, *ramps_outside(t_px)], axis=1)
        own[:, side * OWN : (side + 1) * OWN] = np.hstack([lit * gleams, ground])
        mirror = mirror_shape(rho_px, blur_px)
        own[:, MIRROR] = looked_up(mirror[None], t_px)[:, 0]
        return profile.value + seen[:, 0], lit * seen, own

    def in_colour(
        self,
        side: int,
        colour: EdgeProfile,
        place_px: float,
        blur_px: float,
        black: float,
        lit: float,
        rho_px: float,
    ) -> np.ndarray:
        """What the unknowns here add (K, UNKNOWNS) to a side's profile by colour: an edge that lies
        a px farther out, with either sign, and gleams, in which a lamp of the ground's colour shows
        as that does, by -black."""
        adds = np.zeros((colour.t_px.size, UNKNOWNS))
        steepness = np.gradient(colour.value, colour.t_px)
        adds[:, SHIFTS] = np.stack([steepness, -steepness], axis=1)
        gleams = self.gleaming * looked_up(gleam_shapes(rho_px, blur_px), colour.t_px - place_px)
        adds[:, side * OWN : side * OWN + GLEAMS_RAD.size] = -black * lit * gleams
        return adds

    def prior(self) -> tuple[np.ndarray, np.ndarray]:
        """Rows (R, UNKNOWNS) and their target (R,): slopes, shifts and gleams are small, and so
        much may be mirrored."""
        shift = 1.0 / (SHIFT_SD_PX if self.halved else LEAST_SHIFT_SD_PX)
        each = np.eye(UNKNOWNS)
        slopes = np.pad(ramp_prior(OWN), ((0, 0), (0, UNKNOWNS - 2 * OWN)))
        gleams = np.concatenate([each[first : first + GLEAMS_RAD.size] for first in (0, OWN)])
        common = each[MIRROR:] * np.array([[1.0 / MIRRORED_SD], [shift], [shift]])
        rows = np.concatenate([slopes, gleams / GLEAM_SD, common])
        target = np.zeros(len(rows))
        target[MIRROR] = MIRRORED / MIRRORED_SD
        return rows, target


NONE = Beside()


def _matt(ratios: np.ndarray) -> float:
    """The mean of those (K,) where no lamp gleams."""
    if not ratios.size:
        return LEAST_LIGHT
    matt = ratios[ratios <= max(GLEAMS * np.quantile(ratios, UNGLOSSED), ratios.min())]
    return float(max(matt.mean(), LEAST_LIGHT))


def _ratio(bright: EdgeProfile, colour: EdgeProfile, black: float) -> np.ndarray:
    """Brightness (K,) of the first over the light that the second shows, in units of the ground;
    NaN near the edge, where either is blurred with the ground, and where there is little light."""
    seen = np.interp(bright.t_px, colour.t_px, colour.value)
    light = (seen - black) / (1.0 - black)
    deep = bright.t_px > DEEP * min(bright.t_px.max(), colour.t_px.max())
    told = deep & (light > max(LIT * light[deep].max(), LEAST_LIGHT))
    return np.where(told, (1.0 + bright.value) / np.where(told, light, 1.0), np.nan)
