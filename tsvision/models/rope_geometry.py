"""Geometry of N touching strands laid as one rope, after Olsen & Bohr. Lengths in units of d.

All N centre lines are helices of one centre radius a and pitch p, equally spaced around; each
touches its nearest neighbour. The pitch angle v (from the cross-section) has tan v = p / (2π a).
Two things happen as such a rope is twisted on: below some pitch the strands no longer touch
straight across but along the helix, so a grows; and at one angle the string length of a turn,
√(p² + (2π a)²), is smallest, so that a given string can hold no more turns: the ZERO-TWIST angle.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar

STEPS = 20001


def centre_radius(tan_pitch_angle: float, strands: int) -> float:
    """a in units of d at which the nearest strands just touch; `strands` >= 2.

    The squared distance of two points t apart on strands 2πk/N apart is
    a² (2 - 2 cos(t + 2πk/N) + (t tan v)²); its smallest value has to be 1.
    """
    t = np.linspace(-2 * np.pi, 2 * np.pi, STEPS)
    apart = 2 * np.pi * np.arange(1, strands // 2 + 1)[:, None] / strands
    squared = 2 - 2 * np.cos(t + apart) + (t * tan_pitch_angle) ** 2
    strand, at = np.unravel_index(np.argmin(squared), squared.shape)
    below, lowest, above = squared[strand, max(at - 1, 0) : at + 2]
    # A parabola through the three samples: the grid alone is too coarse for a flat optimum.
    dip = (above - below) ** 2 / (8 * (above - 2 * lowest + below))
    return float(1 / np.sqrt(lowest - dip))


def turn_length(pitch_angle_rad: float, strands: int) -> float:
    """String length of one turn, √(p² + (2π a)²), in units of d."""
    a = centre_radius(float(np.tan(pitch_angle_rad)), strands)
    return 2 * np.pi * a / float(np.cos(pitch_angle_rad))


@lru_cache
def zero_twist_angle_rad(strands: int) -> float:
    """Pitch angle (from the cross-section) at which string holds most turns: 39.4° for N = 2."""
    found = minimize_scalar(
        turn_length,
        bounds=(np.radians(30), np.radians(60)),
        args=(strands,),
        method="bounded",
        options={"xatol": 1e-6},
    )
    return float(found.x)


def pair_centre_radius(pitch: ArrayLike) -> np.ndarray:
    """Centre radius of two touching strands at a pitch, both in units of d; any shape.

    1/2 down to p = π, where contact leaves the axis; growing below; NaN under 2 (no solution).
    Below π the contact lies t apart with q² = sin t / t, q = p/(2π a).
    """
    t = np.linspace(np.pi, 0.0, STEPS)[1:-1]
    radius = 1 / np.sqrt(2 * (1 + np.cos(t)) + t * np.sin(t))
    contact_pitch = 2 * np.pi * radius * np.sqrt(np.sin(t) / t)
    wanted = np.asarray(pitch, dtype=float)
    grown = np.interp(wanted, contact_pitch, radius)
    return np.where(wanted >= np.pi, 0.5, np.where(wanted > 2.0, grown, np.nan))


def coil_pitch(coil_radius: ArrayLike) -> np.ndarray:
    """Smallest pitch of a coiled tube, tube DIAMETER and coil radius R in units of D; any shape.

    Held by the tube's own bend, R (1 + (P/2πR)²) >= D/2, and by contact of neighbouring coils.
    """
    radius = np.asarray(coil_radius, dtype=float)
    bend = 2 * np.pi * np.sqrt(np.maximum(radius * (0.5 - radius), 0.0))
    touching_radius, touching_pitch = _touching_coils()
    contact = np.interp(radius, touching_radius, touching_pitch, left=0.0, right=1.0)
    return np.maximum(bend, contact)


@lru_cache
def _touching_coils() -> tuple[np.ndarray, np.ndarray]:
    """R (rising) and P of helical tubes whose neighbouring coils touch, in units of D.

    The nearest point of the next coil lies t along, where the squared distance
    2 R² (1 - cos t) + (P t/2π)² is stationary and 1; tan t = t is the narrowest such coil.
    """
    t = np.linspace(4.493409457909064, 2 * np.pi, STEPS)[:-1]
    radius = 1 / np.sqrt(2 * (1 - np.cos(t)) - t * np.sin(t))
    return radius, 2 * np.pi * radius * np.sqrt(-np.sin(t) / t)


@lru_cache
def tightest_coil() -> tuple[float, float]:
    """R and P in units of D of the coil that bends and touches at once (the ideal helix).

    There the bend limit, falling with R, meets the contact limit; P/R = 2.51.
    """
    radius, contact = _touching_coils()
    bend = 2 * np.pi * np.sqrt(np.maximum(radius * (0.5 - radius), 0.0))
    at = int(np.argmin(np.abs(bend - contact)))
    return float(radius[at]), float(contact[at])
