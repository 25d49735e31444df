"""Standard uncertainties of one frame's numbers: the fit's own part and the systematic ones.

Combined in the GUM's way, as variances. The fit's covariance assumes independent residuals; edge
residuals of neighbouring columns share a lobe, so the covariance is widened by their correlation
length. The edge model's own error is the largest part on front-lit strands: a share of the blur,
and of how far limb darkening and cross light pull the half level inwards.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tsvision.measures.edges.shading import Shading, limb_level
from tsvision.measures.helix.fit import HelixFit
from tsvision.measures.helix.silhouette import RHO
from tsvision.measures.helix.weigh import unsure

# A mean edge's fit knows its noise and its light's prior, not what both leave out (occlusion,
# gleam): against path-traced films of known width its errors are this much larger.
EDGE_MODEL_FACTOR = 1.6
# Of the blur: what it hides of the ramp at the limb, both sides together; of a strand thinner than
# about seven blurs it hides more, as the blur over the radius.
BLUR_SHARE = 0.15
CORRELATION_SHARE = 0.5  # residuals stay alike over about half a strand diameter
# In a bend strands that touch give way: by how much is fitted, to first order, and of four not
# asked. What is left leads more than two strands astray by such shares (own renderer, whose strands
# touch; rigid sections do not give).
BENT_DIAMETER, BENT_PITCH = 0.025, 0.02
# A coil of whose strands neither the outline nor the light inside is sure may be another one. Two
# in three of such lie within these shares (own renderer), one in twenty beyond three times that. A
# bundle so badly described as straight may begin to coil (path-traced: up to 8 % thin).
UNSURE_DIAMETER, UNSURE_PITCH = 0.04, 0.06
# Strands of a coil that goes wider and narrower are held near what frames before told of them; as
# the one makes up for the other, they lie within such shares (own renderer, N = 2 to 8).
UNEVEN_DIAMETER, UNEVEN_PITCH = 0.02, 0.02
# A limb that no light reaches is not seen. With the lamp far to the other side D rests on what the
# lit limb shows of the outline's shape, right to such a share (own renderer, lamp at 70 degrees).
UNSEEN_DIAMETER = 0.06
UNSEEN_LIMB, LAMP_BESIDE = 0.05, 1.1  # of the core's contrast: less at that limb, more at the lit
# A coil's strands are told from its own shape by what is small beside D. Beyond a blur of so much
# of D that is gone, and pitches that differ by a multiple of the excess look alike (own renderer).
BLURRED_D, BLURRED_PITCH = 0.04, 1.5
# Both edges of half a pitch show the section from all sides once. Of less some sides are not seen,
# and what the legs that part there do to the others is taken for them: shares of D and of the pitch
# for a section of which nothing is seen (path-traced close-ups, a quarter to half a pitch).
HALF_UNSEEN_DIAMETER, HALF_UNSEEN_PITCH = 0.13, 0.4


def _coil_sds(fit: HelixFit) -> tuple[float, float]:
    """Shares of D and of the pitch by which a coil leads them astray."""
    d = pitch = 0.0
    if fit.coiled and fit.section.count > 2:
        d, pitch = BENT_DIAMETER, BENT_PITCH
    if fit.uneven:
        d, pitch = float(np.hypot(d, UNEVEN_DIAMETER)), float(np.hypot(pitch, UNEVEN_PITCH))
    if unsure(fit):
        d, pitch = float(np.hypot(d, UNSURE_DIAMETER)), float(np.hypot(pitch, UNSURE_PITCH))
    return d, pitch


def _sides_unseen(fit: HelixFit) -> float:
    """Share of the section that a stretch of less than half a pitch does not show."""
    first, last = fit.z_px
    return float(max(1.0 - 2.0 * (last - first) / fit.pitch_px, 0.0))


def _widening(fit: HelixFit) -> float:
    return float(max(1.0, CORRELATION_SHARE * 2.0 * fit.p[RHO]))


def light_sd_px(shading: tuple[Shading, Shading]) -> float:
    """Uncertainty of the width that light and shape told together, px."""
    return float(EDGE_MODEL_FACTOR * np.hypot(shading[0].place_sd_px, shading[1].place_sd_px))


def place_sd_px(width_sd_px: float) -> float:
    """Of either edge's place, that makes a width so unsure: the inverse of `light_sd_px`."""
    return width_sd_px / (EDGE_MODEL_FACTOR * float(np.sqrt(2.0)))


def blur_sd_px(shading: tuple[Shading, Shading]) -> float:
    """What blur hides of the limbs, both sides together, px."""
    blur = shading[0].blur_px
    return max(BLUR_SHARE, blur / max(shading[0].rho_px, 1.0)) * blur


def limb_unseen(shading: tuple[Shading, Shading]) -> bool:
    """Whether one limb sends no light and the other more than the strands' middle; a limb that is
    seen to be darker than its ground is seen."""
    dark, bright = sorted(limb_level(s.ambient, s.lamps) for s in shading)
    return dark < UNSEEN_LIMB and bright > LAMP_BESIDE and not any(s.sunk for s in shading)


def rests_on_shape(shading: tuple[Shading, Shading], diameter_px: float) -> bool:
    """Whether light tells D no better than the outline's shape does where one limb is dark."""
    return limb_unseen(shading) or light_sd_px(shading) > UNSEEN_DIAMETER * diameter_px


@dataclass(frozen=True)
class DiameterSources:
    """What makes a diameter unsure, each a standard uncertainty of D in px, independent of the
    others. noise: of the edges, as the fit passes it on; light: where the limbs' light ends; blur:
    what it hides of them; section: of coils what strands give way, and of either what the stretch
    or a dark limb does not show."""

    noise_px: float
    light_px: float
    blur_px: float
    section_px: float

    @property
    def total_px(self) -> float:
        """Standard uncertainty of D."""
        return math.hypot(self.noise_px, self.light_px, self.blur_px, self.section_px)


def diameter_sources(fit: HelixFit, shading: tuple[Shading, Shading]) -> DiameterSources:
    """Of the diameter of a fit to edges so shaded."""
    share = math.hypot(
        _coil_sds(fit)[0],
        UNSEEN_DIAMETER * limb_unseen(shading),
        HALF_UNSEEN_DIAMETER * _sides_unseen(fit),
    )
    return DiameterSources(
        noise_px=fit.diameter_px_sd * math.sqrt(_widening(fit)),
        light_px=light_sd_px(shading),
        blur_px=blur_sd_px(shading),
        section_px=share * fit.diameter_px,
    )


def diameter_sd_px(fit: HelixFit, shading: tuple[Shading, Shading]) -> float:
    """Standard uncertainty of D in px."""
    return diameter_sources(fit, shading).total_px


def pitch_sd_px(fit: HelixFit, blur_px: float) -> float:
    """Standard uncertainty of the pitch in px, in a picture so blurred."""
    _, covariance = fit.derived
    own = float(np.sqrt(max(covariance[1, 1], 0.0) * _widening(fit)))
    model = np.hypot(max(_coil_sds(fit)[1], 0.001), HALF_UNSEEN_PITCH * _sides_unseen(fit))
    excess = max(blur_px / fit.diameter_px - BLURRED_D, 0.0) if fit.coiled else 0.0
    return float(np.hypot(own, np.hypot(model, BLURRED_PITCH * excess) * fit.pitch_px))


def angle_sd(diameter: float, diameter_sd: float, pitch: float, pitch_sd: float) -> float:
    """Standard uncertainty of beta in rad, from tan beta = pi D / p."""
    tangent = np.pi * diameter / pitch
    relative = np.hypot(diameter_sd / diameter, pitch_sd / pitch)
    return float(tangent / (1.0 + tangent * tangent) * relative)
