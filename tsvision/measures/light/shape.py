"""What the outline's shape alone tells of the width: rigid round strands that touch.

By how much an outline swells and narrows along a turn depends on the strands' radius and not on
how far outside, or inside, the true edges the measured ones lie. Strands are not quite rigid and
not quite round, so that this tells the width within a few per cent only; but where one limb sends
no light, and the light tells nothing of where it ends, that is far better.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import t as student_t

from tsvision.measures.edges.edges import Edges
from tsvision.measures.edges.shading import PLACE_RANGE_PX
from tsvision.measures.helix.bundle import BundleFit, usable
from tsvision.measures.helix.fit import HelixFit, fit_helix
from tsvision.measures.helix.loose import WIDENED, aslant_hold
from tsvision.measures.helix.silhouette import COILED, RHO, STRAIGHT, TILT
from tsvision.measures.helix.uncertainty import EDGE_MODEL_FACTOR

SHARE = 0.035  # of D: how far strands that are not rigid circles lead astray
# How far off the rounding by blur may be: of blur^2 / rho, by which it moves edges as curved as a
# strand. Notches are more so, and what is seen there is not one limb alone.
ROUNDED = 2.0
FREED = 3  # times
CONTRADICTED = 0.023  # chance: two sd of a width whose sd is known
UNTOLD_PX = 1e3
BLUNT = 0.5  # of a strand's radius: what is known no better contradicts no light
FINEST_PX = 0.05  # residuals below which sides are equally good
# Where a limb that sends no light is taken for ground, what is outlined there is the border of what
# is lit. It keeps to no outline: its edges lie off that by such shares of a strand's radius, from
# which on it is likely and at which it is sure (path-traced limbs, all seen, up to 0.07).
LIKELY, SURE = 0.07, 0.11
HIDDEN = 0.6  # of a strand's radius, by which what such a border hides is known beforehand


@dataclass(frozen=True)
class Shape:
    """width_px: by how much the true width is less than that of the edges assumed, with its sd and
    the degrees of freedom that this was estimated with."""

    width_px: float
    sd_px: float
    freedom: float = np.inf

    def joined(self, width_px: float, sd_px: float, hides: bool = True) -> Shape:
        """Together with what the light tells of the same width. Where the two contradict each
        other it is the light's model that does not hold, where a limb `hides`: it may send none."""
        light = (EDGE_MODEL_FACTOR * sd_px) ** 2
        off = self.width_px - width_px
        if hides:
            # A few widths that scatter may well lie off by several times what their scatter tells.
            contradicted = float(student_t.isf(CONTRADICTED, self.freedom))
            light = max(light, (off / contradicted) ** 2 - self.sd_px**2)
        share = light / (light + self.sd_px**2)
        together = float(np.sqrt(share) * self.sd_px) / EDGE_MODEL_FACTOR
        return Shape(width_px + share * off, together)

    def starts(self) -> list[tuple[float, float]]:
        """Places of both edges that agree with the shape, where it differs from those assumed."""
        if abs(self.width_px) < self.sd_px:
            return []
        low, high = PLACE_RANGE_PX
        place = min(max(self.width_px, low + 0.1), high - 0.1)
        return [(place, 0.0), (0.0, place)]


UNKNOWN = Shape(0.0, UNTOLD_PX)


def shape_of(fitted: list[tuple[Edges, BundleFit]], blur_px: float) -> Shape:
    """From the edges of some frames, so blurred, and the bundles fitted to them with the edges
    held."""
    freed = [(fit, _freed(part, fit)) for part, fit in _usable(fitted)]
    if not freed:
        return UNKNOWN
    wider = [fit.diameter_px - free.diameter_px for fit, free in freed]
    own, aslant = np.median([_sds_px(free) for _, free in freed], axis=0)
    seen, expected = 1.25 * float(np.std(wider)), WIDENED * float(own)
    scatter = max(seen, expected) / np.sqrt(len(wider))
    width = float(np.median([found.fit.diameter_px for _, found in fitted]))
    strand = float(np.median([found.fit.p[RHO] for _, found in fitted]))
    model = np.hypot(SHARE * width, ROUNDED * blur_px**2 / strand)
    # One camera looks at all frames as much aslant: that does not average out.
    sd_px = float(np.sqrt(model**2 + (WIDENED * aslant) ** 2 + scatter**2))
    # Welch-Satterthwaite: what is expected beforehand has no end of degrees of freedom.
    freedom = float((len(wider) - 1) * (sd_px / scatter) ** 4) if seen > expected else np.inf
    told = Shape(float(np.median(wider)), sd_px, freedom)
    # An sd of nan, where no fit came to an end, is no better known either.
    return told if told.sd_px < BLUNT * strand else UNKNOWN


def _sds_px(free: HelixFit) -> tuple[float, float]:
    """sd of a fit's D were the view's tilt known, and what that adds."""
    per_rho = free.diameter_px / float(free.p[RHO])
    rho, tilt = free.covariance[RHO, RHO], free.covariance[TILT, TILT]
    by_tilt = free.covariance[RHO, TILT] ** 2 / tilt if tilt > 0.0 else 0.0
    return per_rho * float(np.sqrt(max(rho - by_tilt, 0.0))), per_rho * float(np.sqrt(by_tilt))


def trust_of(fitted: list[tuple[Edges, BundleFit]]) -> tuple[float, float]:
    """How much either side's edges count in a fit: 1 for the smoother, less for the other as they
    lie, typically, farther from the outline fitted to both."""
    each = [_trust(part, fit) for part, fit in _usable(fitted)]
    upper, lower = np.median(each, axis=0) if each else (1.0, 1.0)
    return float(upper), float(lower)


def hidden_px(fitted: list[tuple[Edges, BundleFit]]) -> float:
    """How much of the width may lie beyond edges that are no strand's: by how much the shape told
    by the other side differs, where one side's edges keep to no outline; 0 where both do."""
    parts = _usable(fitted)
    if not parts:
        return 0.0
    rough = max(np.median([_roughness_px(part, fit) for part, fit in parts], axis=0))
    strand = float(np.median([fit.p[RHO] for _, fit in parts]))
    likely = np.clip((rough / strand - LIKELY) / (SURE - LIKELY), 0.0, 1.0)
    if likely == 0.0:
        return 0.0
    off = np.median([_freed(part, fit).diameter_px - fit.diameter_px for part, fit in parts])
    return float(likely * min(abs(off), HIDDEN * strand))


def _usable(fitted: list[tuple[Edges, BundleFit]]) -> list[tuple[Edges, HelixFit]]:
    """The edges that each bundle was fitted to, where both sides show enough of them."""
    parts = [(edges.window(found.s_low_px, found.s_high_px), found.fit) for edges, found in fitted]
    return [(part, fit) for part, fit in parts if usable(part)]


def _freed(part: Edges, fit: HelixFit) -> HelixFit:
    """The fit with its width no longer held by both sides."""
    upper, lower = _trust(part, fit)
    smooth = replace(part, trust=(upper**2, lower**2))
    free = (*(COILED if fit.coiled else STRAIGHT), TILT)
    for _ in range(FREED):  # what edges are off by is known when they are no longer held
        fit = fit_helix(smooth, fit.section, fit.p, free, hold=aslant_hold(fit.rms_px))
    return fit


def _trust(part: Edges, fit: HelixFit) -> tuple[float, float]:
    """Where a limb's light ends depends on where the strands around it lie: it does not follow the
    outline. Such edges are off together over a lobe or two, and count less than as the square."""
    rough = _roughness_px(part, fit)
    best = max(min(rough), FINEST_PX)
    up, low = (best / max(r, best) for r in rough)
    return up, low


def _roughness_px(part: Edges, fit: HelixFit) -> tuple[float, float]:
    """How far the upper and the lower edge lie, typically, from the outline fitted to both."""
    z0 = 0.5 * float(part.s_px[0] - part.s_px[-1])
    upper, lower = fit.seen_edges(z0, part.s_px.size)
    up, low = (
        float(np.median(np.abs(seen - model)[weight > 0])) if (weight > 0).any() else np.inf
        for seen, model, weight in (
            (part.upper_px, upper, part.upper_weight),
            (part.lower_px, lower, part.lower_weight),
        )
    )
    return up, low
