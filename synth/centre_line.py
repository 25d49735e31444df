"""The bundle's own centre line, the turns it makes, and the frame the strands are laid on.

Strategy: C(x) = (x, Re w, Im w) with w = R(x) exp(i psi(x)), right-handed. The strands sit on the
frame got by turning e_y, e_z from e_x onto the tangent by the smallest rotation. That frame comes
back to e_y, e_z where the line is straight, so the strands' rotation against it is the linking
number itself; its own rotation about the tangent is the writhe density (1 - cos theta) psi_t'
(Fuller), here in a form without a singularity.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

# x (M,) -> radius R (M,) and wave number k (M,) of the coil
CoilShape = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class CentreLine:
    """Along x from the apex to the connector, all arrays (M,): position, tangent, arc length,
    strand angle `chi` against the smallest-rotation frame (rad), and the two totals."""

    x_mm: np.ndarray
    y_mm: np.ndarray
    z_mm: np.ndarray
    tangent: np.ndarray  # (M, 3)
    arc_mm: np.ndarray
    chi_rad: np.ndarray
    radius_mm: np.ndarray
    turns: float  # linking number of the bundle
    writhe_turns: float  # the part of it that the centre line makes


def centre_line(
    apex_mm: float, zone_mm: float, shape: CoilShape | None, pitch_mm: float, grid_mm: float
) -> CentreLine:
    """Lay the line; a bundle of zero length gives two coinciding points and no turns."""
    count = max(int(np.ceil((zone_mm - apex_mm) / grid_mm)), 1) + 1
    x = np.linspace(apex_mm, zone_mm, count)
    if shape is None or zone_mm - apex_mm < 1e-9:
        return _straight(x, pitch_mm)
    radius, wave = shape(x)
    if not radius.any():
        return _straight(x, pitch_mm)
    step = x[1] - x[0]
    psi = _cumulative(wave, step)
    slope = np.gradient(radius, step)
    w = radius * np.exp(1j * psi)
    dw = (slope + 1j * radius * wave) * np.exp(1j * psi)
    speed = np.sqrt(1.0 + np.abs(dw) ** 2)
    tangent = np.stack([1.0 / speed, dw.real / speed, dw.imag / speed], axis=1)
    d_tangent = np.gradient(tangent, step, axis=0)
    writhe = (tangent[:, 1] * d_tangent[:, 2] - tangent[:, 2] * d_tangent[:, 1]) / (
        1.0 + tangent[:, 0]
    )
    arc = _cumulative(speed, step)
    own = _cumulative(writhe, step)
    chi = 2.0 * np.pi * arc / pitch_mm + own
    return CentreLine(
        x, w.real, w.imag, tangent, arc, chi, radius, chi[-1] / (2 * np.pi), own[-1] / (2 * np.pi)
    )


def _straight(x: np.ndarray, pitch_mm: float) -> CentreLine:
    zero = np.zeros_like(x)
    tangent = np.tile([1.0, 0.0, 0.0], (len(x), 1))
    arc = x - x[0]
    chi = 2.0 * np.pi * arc / pitch_mm
    return CentreLine(x, zero, zero, tangent, arc, chi, zero, chi[-1] / (2 * np.pi), 0.0)


def _cumulative(density: np.ndarray, step: float) -> np.ndarray:
    total = np.zeros_like(density)
    np.cumsum(0.5 * step * (density[1:] + density[:-1]), out=total[1:])
    return total


def smallest_rotation_frame(tangent: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """e_y and e_z turned along with e_x -> tangent; two arrays (M, 3)."""
    share = tangent + np.array([1.0, 0.0, 0.0])
    n1 = np.array([0.0, 1.0, 0.0]) - (tangent[:, 1] / share[:, 0])[:, None] * share
    n2 = np.array([0.0, 0.0, 1.0]) - (tangent[:, 2] / share[:, 0])[:, None] * share
    return n1, n2
