"""What the relief of the strands explains of the light inside the outline.

The outline repeats itself: strands that turn half a turn more or less from one coil to the next
show nearly the same lobes. The ridges inside it do not. A fit is drawn as the front of its tubes.
Light from any direction on a matt surface goes as the surface's normal, and less of it comes down
between the strands; so one linear fit tells how much of what is seen the drawing explains, however
the light falls. Where nothing is seen inside, against the light, all drawings explain as little.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numba
import numpy as np

from tsvision.measures.helix.silhouette import (
    KC,
    OPEN,
    PHI,
    PHIC,
    RC,
    RHO,
    SLOPE,
    Y0,
    K,
    Section,
    rescaled,
)

SAMPLED = 0.3  # of the strand's radius: from ball to ball along a strand
INNER_PX = 2  # from the outline on, where the ground shines in
LEAST_PX = 60  # of the front, below which nothing is told
DRAWN_RHO_PX = 4.0  # strand radius at which a fit is drawn, where it is not smaller by itself, ...
SCANNED_RHO_PX = 2.5  # ... and at which many are: ridges are told apart still
SHRUNK_BLUR = 0.5  # blur of a light made smaller
TERMS = 6  # of the light: level, slope along z, and what is drawn
BOTH = np.array([1.0, -1.0])  # sides to which a bundle may be twisted


class _Front(NamedTuple):
    """Height towards the camera (-inf: ground) and the normal's parts across and along, (S, R, M):
    of the bundle twisted to each of some sides."""

    height: np.ndarray
    across: np.ndarray
    along: np.ndarray


def explained(light: np.ndarray, p: np.ndarray, section: Section, blur_px: float) -> float:
    """Share of the variance of `light` (R, M) inside the outline that a bundle `p` (12,) explains,
    twisted to whichever side explains more; 0 where too little is seen.

    Rows lie evenly about n = 0, columns about z = 0.
    """
    factor = max(float(p[RHO]) / DRAWN_RHO_PX, 1.0)
    small, scaled = _shrunk(light, factor), rescaled(p, factor)
    blur = max(float(np.hypot(blur_px / factor, SHRUNK_BLUR if factor > 1.0 else 0.0)), 0.5)
    front = _empty(BOTH.size, small.shape)
    _draw(scaled, section.radius_d, section.angle_rad, BOTH, *front)
    sides = (_Front(*of_side) for of_side in zip(*front, strict=True))
    return max(_explained(small, side, scaled[RHO], blur) for side in sides)


def _explained(light: np.ndarray, front: _Front, rho_px: float, blur_px: float) -> float:
    """Of one side's front, (R, M) each."""
    seen = np.isfinite(front.height)
    kernel = np.ones((2 * INNER_PX + 1, 2 * INNER_PX + 1), dtype=np.uint8)
    inner = cv2.erode(seen.astype(np.uint8), kernel).astype(bool)
    if np.count_nonzero(inner) < LEAST_PX:
        return 0.0
    facing = np.sqrt(np.clip(1.0 - front.across**2 - front.along**2, 0.0, 1.0)) * seen
    height = np.where(seen, front.height / rho_px, 0.0).astype(np.float32)
    drawn = (
        cv2.GaussianBlur(d, (0, 0), blur_px) for d in (facing, front.across, front.along, height)
    )
    return float(_share(light, inner, *drawn))


@numba.njit(cache=True)
def _share(light, inner, facing, across, along, height):  # pragma: no cover - compiled
    """Of the variance of a light (R, M) where `inner`, what the drawn terms (R, M) explain."""
    rows, columns = light.shape
    term, system, right = np.empty(TERMS), np.zeros((TERMS, TERMS)), np.zeros(TERMS)
    square = 0.0
    for r in range(rows):
        for c in range(columns):
            if not inner[r, c]:
                continue
            term[0], term[1] = 1.0, 2.0 * c / columns - 1.0
            term[2], term[3] = facing[r, c], across[r, c]
            term[4], term[5] = along[r, c], height[r, c]
            _add(term, light[r, c], system, right)
            square += light[r, c] ** 2
    return _told(system, right, square)


@numba.njit(cache=True, inline="always")
def _add(term, value, system, right):  # pragma: no cover - compiled
    """One pixel's terms and light, into the lower half of the normal equations."""
    for m in range(term.size):
        right[m] += term[m] * value
        for n in range(m + 1):
            system[m, n] += term[m] * term[n]


@numba.njit(cache=True)
def _told(system, right, square):  # pragma: no cover - compiled
    """Share of the light's variance that the terms explain, the first of which is 1 throughout;
    square: sum of the light's squares."""
    count = system[0, 0]
    for m in range(right.size):
        system[m, m] += 1e-9 * count
        for n in range(m + 1, right.size):
            system[m, n] = system[n, m]
    mean = right[0] * right[0] / count
    told = (np.linalg.solve(system, right) * right).sum()
    return max((told - mean) / max(square - mean, 1e-30), 0.0)


def scan_relief(
    light: np.ndarray, p: np.ndarray, section: Section, rates: np.ndarray, phases: np.ndarray
) -> np.ndarray:
    """As `explained`, (K, P), for bundles as `p` (12,) but with strand rates (K,) and phases (P,):
    at reduced size, without blur, and twisted to the side to which `p` itself explains more."""
    factor = max(float(p[RHO]) / SCANNED_RHO_PX, 1.0)
    small = _shrunk(light, factor)
    scaled = rescaled(p, factor)
    front = _empty(1, small.shape)

    def shares(side: float, rates: np.ndarray, phases: np.ndarray) -> np.ndarray:
        told: np.ndarray = _scan(
            small,
            scaled,
            section.radius_d,
            section.angle_rad,
            np.array([side]),
            rates,
            phases,
            *front,
        )
        return told

    side = max((1.0, -1.0), key=lambda s: float(shares(s, scaled[[K]], scaled[[PHI]])[0, 0]))
    return shares(side, rates * factor, phases)


def _empty(sides: int, shape: tuple[int, ...]) -> _Front:
    return _Front(*(np.empty((sides, *shape), dtype=np.float32) for _ in range(3)))


def _shrunk(light: np.ndarray, factor: float) -> np.ndarray:
    """(R', M') in units of `factor` px, about the same middle; NaN as the median."""
    filled = np.array(light, dtype=np.float32)
    unseen = ~np.isfinite(filled)
    if unseen.any():
        filled[unseen] = np.nanmedian(light)
    if factor <= 1.0:
        return filled
    rows, columns = light.shape
    half = int((rows - 1) / 2 / factor)
    count = int((columns - 1) / factor) + 1
    y = np.arange(-half, half + 1) * factor + 0.5 * (rows - 1)
    x = (np.arange(count) - 0.5 * (count - 1)) * factor + 0.5 * (columns - 1)
    columns_at, rows_at = np.meshgrid(x.astype(np.float32), y.astype(np.float32))
    smooth = cv2.GaussianBlur(filled, (0, 0), SHRUNK_BLUR * factor)
    return cv2.remap(smooth, columns_at, rows_at, cv2.INTER_LINEAR)


@numba.njit(cache=True)
def _scan(
    light, p, site_radius, site_angle, side, rates, phases, heights, acrosses, alongs
):  # pragma: no cover - compiled
    """Shares (K, P) explained by every rate and phase."""
    rows, columns = light.shape
    height, across, along = heights[0], acrosses[0], alongs[0]
    shares = np.zeros((rates.size, phases.size))
    q = p.copy()
    term, system, right = np.empty(TERMS), np.empty((TERMS, TERMS)), np.empty(TERMS)
    for i in range(rates.size):
        for j in range(phases.size):
            q[1], q[2] = rates[i], phases[j]
            _draw(q, site_radius, site_angle, side, heights, acrosses, alongs)
            system[:] = 0.0
            right[:] = 0.0
            square = 0.0
            for r in range(1, rows - 1):
                for c in range(1, columns - 1):
                    h = height[r, c]
                    ground = min(height[r - 1, c], height[r + 1, c])
                    ground = min(ground, min(height[r, c - 1], height[r, c + 1]))
                    if min(h, ground) < -1e30:
                        continue
                    v = light[r, c]
                    a, b = across[r, c], along[r, c]
                    term[0], term[1] = 1.0, 2.0 * c / columns - 1.0
                    term[2] = np.sqrt(max(1.0 - a * a - b * b, 0.0))
                    term[3], term[4], term[5] = a, b, h / p[RHO]
                    _add(term, v, system, right)
                    square += v * v
            if system[0, 0] >= LEAST_PX:
                shares[i, j] = _told(system, right, square)
    return shares


@numba.njit(cache=True, error_model="numpy")
def _draw(p, site_radius, site_angle, sides, height, across, along):  # pragma: no cover - compiled
    """Draw the strands as rows of balls: the foremost ball's height and normal at every pixel,
    (S, R, M). sides (S,): +1 or -1, the sense of twist; only which strand lies in front differs."""
    _, rows, columns = height.shape
    height[:] = -np.inf
    across[:] = 0.0
    along[:] = 0.0
    rho, apart = p[RHO], 2.0 * p[RHO] * (1.0 + p[OPEN])
    half, z0 = 0.5 * (rows - 1), -0.5 * (columns - 1)
    step = max(SAMPLED * rho, 0.5)
    reach = rho + 2.0
    for i in range(site_radius.size):
        reach = max(reach, rho + apart * site_radius[i] + 2.0)
    kappa = p[RC] * p[KC]
    q = np.sqrt(1.0 + kappa * kappa)
    samples = int((columns + 2.0 * reach) / step) + 1
    for i in range(site_radius.size):
        a = apart * site_radius[i]
        for j in range(samples):
            z = z0 - reach + j * step
            psi = p[K] * z + p[PHI] + site_angle[i]
            cp, sp = np.cos(psi), np.sin(psi)
            ct, st = 1.0, 0.0
            if p[RC] > 0.0:
                theta = p[KC] * z + p[PHIC]
                ct, st = np.cos(theta), np.sin(theta)
            s = z + a * sp * kappa / q - z0
            y = p[RC] * ct - a * cp * ct + a * sp * st / q + p[Y0] + p[SLOPE] * z + half
            middle = p[RC] * st - a * cp * st - a * sp * ct / q
            for r in range(max(int(np.ceil(y - rho)), 0), min(int(y + rho), rows - 1) + 1):
                dy = r - y
                left = rho * rho - dy * dy
                if left <= 0.0:
                    continue
                w = np.sqrt(left)
                for c in range(max(int(np.ceil(s - w)), 0), min(int(s + w), columns - 1) + 1):
                    ds = c - s
                    up = left - ds * ds
                    if up <= 0.0:
                        continue
                    forward = np.sqrt(up)
                    for i_side in range(sides.size):
                        h = sides[i_side] * middle + forward
                        if h > height[i_side, r, c]:
                            height[i_side, r, c] = h
                            across[i_side, r, c] = dy / rho
                            along[i_side, r, c] = ds / rho
