"""Coils whose strands give way to each other, where they are twisted and where they bend.

Strands laid steeply find no room on the section of straight ones and lie farther out all round.
And the inner side of a bend is shorter: of two strands that touch there, one a little farther along
than the other, each pushes the other off across the bundle. What is told here is, to first order in
the curvature, all of that: what strands do that keep their thickness and hold their place along the
bundle. Strands that flatten do less, and a bundle of rigid section that is but drawn along a curve
does nothing of it. One number for both, 0 (rigid) to 1, is fitted with the outline. In the notches
between outer strands laid so steeply inner ones show, so that here all are drawn.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tsvision.measures.edges.edges import Edges
from tsvision.measures.helix.fit import HelixFit, fit_helix
from tsvision.measures.helix.loose import held_about
from tsvision.measures.helix.section import room_needed
from tsvision.measures.helix.silhouette import (
    CROWD,
    FREE_COILED,
    KC,
    RC,
    Section,
    twist,
    waves,
)

FEWEST = 5  # strands: four lie in each other's valleys, and hardly give
STEPS = 6  # of a fit that begins close to where it ends
TOUCHING = 1.03  # of d, that two strands may lie apart and be taken to touch
ALONG = np.linspace(-0.99, 0.99, 199)  # d, at which two strands' distance is looked at
PLACES = 24  # round the bend
HALVINGS = 8


def crowded(edges: Edges, fit: HelixFit, scale_px: float) -> HelixFit:
    """A coiled fit whose strands give as far as its edges, and what is known beforehand, say, or as
    it is where those say that they do not."""
    if fit.section.count < FEWEST:
        return fit
    given = asked(edges, fit, scale_px)
    return given if given.p[CROWD] > 0.0 else fit


def asked(edges: Edges, fit: HelixFit, scale_px: float) -> HelixFit:
    """A coiled fit and what its strands give, below none where noise says so."""
    twisted = float(twist(fit.p))
    thick_px = 2.0 * _rho_px(fit.section, fit.diameter_px, twisted)
    curvature = float(fit.p[RC] * fit.p[KC] ** 2) / fit.stretch**2
    give_d = given_way(fit.section, thick_px * twisted, thick_px * curvature)
    hold = held_about(CROWD, *fit.section.gives, fit.rms_px)
    section = replace(fit.section, give_d=give_d)
    free = (*FREE_COILED, CROWD)
    given = fit_helix(edges, section, fit.p, free, scale_px, STEPS, near=True, hold=hold)
    return replace(given, relief=fit.relief)


def _rho_px(section: Section, diameter_px: float, twist_rad_per_px: float) -> float:
    """Radius of the strands that make a bundle so wide with all the room that they need."""
    low, high = 0.0, 0.5 * diameter_px / section.diameter_d
    for _ in range(HALVINGS):
        rho = 0.5 * (low + high)
        opened = 1.0 + room_needed(section, 2.0 * rho * twist_rad_per_px)
        wide = 2.0 * rho * (1.0 + (section.diameter_d - 1.0) * opened)
        low, high = (rho, high) if wide < diameter_px else (low, rho)
    return 0.5 * (low + high)


def given_way(section: Section, twist_rad_per_d: float, curvature_per_d: float) -> np.ndarray:
    """(N, 2, 5), as `Section.give_d`: what strands of full thickness give, twisted and bent so."""
    room = room_needed(section, twist_rad_per_d)
    radius, angle = (1.0 + room) * section.radius_d, section.angle_rad
    psi = np.linspace(0.0, 2.0 * np.pi, PLACES, endpoint=False)
    give = np.zeros((section.count, 2, PLACES))
    give[:, 0] = room * section.radius_d[:, None]
    for i in range(section.count):
        for j in range(section.count):
            apart = angle[j] - angle[i] + twist_rad_per_d * ALONG
            square = radius[i] ** 2 + radius[j] ** 2 - 2.0 * radius[i] * radius[j] * np.cos(apart)
            square += ALONG**2
            least = (square[1:-1] < square[:-2]) & (square[1:-1] <= square[2:])
            touch = np.flatnonzero(least & (square[1:-1] < TOUCHING**2)) + 1
            for at in touch if j != i else ():
                give[i] += _pushed(radius[i], radius[j], psi, apart[at], ALONG[at], curvature_per_d)
    of_psi = waves(psi)
    found: np.ndarray = give @ (of_psi / (of_psi**2).sum(axis=1, keepdims=True)).T
    return found


def _pushed(
    radius: float, others: float, psi: np.ndarray, apart: float, along: float, curvature: float
) -> np.ndarray:
    """(2, P) outward and on around, d: half of what keeps a strand at angles psi (P,) from the
    bend's inner side off another, `along` farther and `apart` rad on."""
    here = radius * np.exp(1j * psi)
    across = others * np.exp(1j * (psi + apart)) - here
    # The way along is shorter on the inner side by the share that both lie there.
    nearer = along**2 * curvature * (here + 0.5 * across).real
    push = -0.5 * np.maximum(nearer, 0.0) * across / np.abs(across) ** 2
    off = push * np.exp(-1j * psi)
    return np.array([off.real, off.imag])
