"""Scale, blur and shading from a gauge pin: a straight cylinder of known diameter in view.

A front-lit cylinder gets darker towards its limb, so common edges lie inside the true ones. Here
both limbs are fitted at once: the ground, a + b max(0, √(1 − x²) cos θ + x sin θ) for a dull
surface lit from everywhere and from one direction θ (x = −1 … 1 across), blurred by the camera.
Centre, radius, blur and θ are found by least squares, the levels follow linearly. The middle of
the cylinder, where a shiny one has its highlight, is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import least_squares

from tsvision.errors import InputError
from tsvision.images.calibration import Calibration
from tsvision.images.depth import bits_of, filled
from tsvision.images.frames_picture import to_luma
from tsvision.images.linear import to_linear
from tsvision.images.strip import Axis, cut_strip, straight_axis
from tsvision.images.tone_curve import gamma_of

_FINE = 0.1  # px, grid of the model
_BLOCK_PX = 8  # columns averaged for one cross-section, at least
_FEWEST_BLOCKS = 5
_MOST_BLOCKS = 16
_MODEL_FLOOR_PX = 0.03
_MIDDLE = 0.6  # of the radius: what lies inside is not fitted
_DIRECTIONS_RAD = (-1.0, 0.0, 1.0)
_UNCLEAN = (
    "gauge: fewer than 5 clean cross-sections; give --roi-px or --points around a straight piece "
    "at least 40 px long"
)


@dataclass(frozen=True)
class Section:
    """One fitted cross-section: centre, radius and blur in px, the light's direction, levels
    (ground, its slope, light from everywhere, light from θ), rms of the residual."""

    centre_px: float
    radius_px: float
    blur_px: float
    theta_rad: float
    levels: np.ndarray
    residual: float


def calibrate_gauge(
    pixels: np.ndarray,
    diameter_mm: float,
    diameter_mm_sd: float = 0.0,
    roi_px: tuple[int, int, int, int] | None = None,
    ends_px: tuple[tuple[float, float], tuple[float, float]] | None = None,
    gamma: float = float("nan"),
) -> Calibration:
    """Scale from a cylinder of known diameter; `roi_px` or the two `ends_px` of its axis tell
    where it lies. `found` holds diameter_px, blur_px, the light and how far half-level edges
    would have been off. gamma encodes the picture; NaN: as its noise tells, else sRGB. Raises
    InputError when no straight cylinder is there."""
    notes: tuple[str, ...] = ()
    if np.isnan(gamma):
        gamma = gamma_of([pixels])
        if np.isfinite(gamma):
            notes = (f"by its noise the picture is not sRGB: decoded by a gamma of {gamma:g}",)
    picture = to_linear(to_luma(filled(pixels, bits_of([pixels]))), gamma)
    axis, width_px = _given_axis(ends_px) if ends_px else _find_axis(picture, roi_px)
    sections = []
    for _ in range(2):  # the first pass straightens the axis
        half_px = int(np.ceil(1.1 * width_px)) + 8
        strip = cut_strip(picture, axis, (0.0, axis.length_px), half_px).values
        sections = fit_sections(strip, 0.5 * width_px)
        axis, width_px = _straightened(axis, sections)
    radius = np.array([section.radius_px for _, section in sections])
    spread = 1.4826 * np.median(np.abs(radius - np.median(radius)))
    diameter_px = 2.0 * float(np.median(radius))
    noise_px = 2.0 * float(spread) * 1.2533 / np.sqrt(len(radius))
    model_px = _model_px(strip, diameter_px)
    scale = diameter_mm / diameter_px
    parts = {
        "noise": scale * noise_px / diameter_px,
        "edge model": scale * model_px / diameter_px,
        "gauge": scale * diameter_mm_sd / diameter_mm,
    }
    typical = sections[len(sections) // 2][1]
    ground = typical.levels[0]
    found = {
        "diameter_px": diameter_px,
        "blur_px": float(np.median([section.blur_px for _, section in sections])),
        "light_everywhere": float(typical.levels[2]),
        "light_from_one_side": float(typical.levels[3]),
        "light_direction_deg": float(np.degrees(typical.theta_rad)),
        "half_level_bias_px": half_level_width(strip, ground) - diameter_px,
        "sections": float(len(sections)),
    }
    return Calibration(scale, parts, "gauge", found=found, notes=notes)


def fit_sections(strip: np.ndarray, radius_px: float) -> list[tuple[float, Section]]:
    """Fit the cross-section in blocks along a strip (rows across); (place along, Section) each.

    Sections that do not fit (something crosses the pin) are left out; raises InputError when fewer
    than five are left.
    """
    mean = _whole(np.nanmedian(strip, axis=1))
    first = best_section(mean, radius_px)
    blocks = np.array_split(np.arange(strip.shape[1]), _count_blocks(strip.shape[1]))
    fitted = []
    for block in blocks:
        values = strip[:, block].mean(axis=1, dtype=float)
        if np.isfinite(values).all():
            section = fit_section(values, first.radius_px, first.theta_rad, first.blur_px)
            fitted.append((float(block.mean()), section))
    if len(fitted) >= _FEWEST_BLOCKS:
        residual = np.array([section.residual for _, section in fitted])
        radius = np.array([section.radius_px for _, section in fitted])
        off = np.abs(radius - np.median(radius))
        good = (residual <= 3 * np.median(residual)) & (off <= 0.1 * np.median(radius))
        fitted = [pair for pair, keep in zip(fitted, good, strict=True) if keep]
    if len(fitted) < _FEWEST_BLOCKS:
        raise InputError(_UNCLEAN)
    return fitted


def _count_blocks(columns: int) -> int:
    return int(np.clip(columns // _BLOCK_PX, 1, _MOST_BLOCKS))


def _whole(values: np.ndarray) -> np.ndarray:
    if not np.isfinite(values).all():
        raise InputError(_UNCLEAN)
    return values.astype(float)


def best_section(values: np.ndarray, radius_px: float, middle: float = _MIDDLE) -> Section:
    """The best fit over a few directions of light to start from."""
    fits = [fit_section(values, radius_px, theta, middle=middle) for theta in _DIRECTIONS_RAD]
    return min(fits, key=lambda section: section.residual)


def fit_section(
    values: np.ndarray,
    radius_px: float,
    theta_rad: float,
    blur_px: float = 1.0,
    middle: float = _MIDDLE,
) -> Section:
    """Fit one cross-section `values` (n,); the centre is counted from the middle sample.

    `theta_rad` starts the light's direction; `middle` is the share of the radius left out.
    """
    n = np.arange(len(values)) - (len(values) - 1) / 2
    fine = np.arange(n[0] - 4, n[-1] + 4 + _FINE / 2, _FINE)
    centre_px, radius_px = _rough(values, n, radius_px)
    used = np.abs(n - centre_px) > middle * radius_px

    def basis(parameters: np.ndarray) -> np.ndarray:
        centre, radius, blur, theta = parameters
        x = np.clip((fine - centre) / radius, -1.0, 1.0)
        # the limb falls between grid points: the share of a cell that is inside moves smoothly
        inside = np.clip(0.5 + (radius - np.abs(fine - centre)) / _FINE, 0.0, 1.0)
        lit = np.sqrt(1.0 - x * x) * np.cos(theta) + x * np.sin(theta)
        shapes = [inside, inside * np.clip(lit, 0.0, None)]
        sampled = [
            np.interp(n, fine, gaussian_filter1d(shape, blur / _FINE, mode="nearest"))
            for shape in shapes
        ]
        return np.column_stack([np.ones_like(n), n / len(n), *sampled])[used]

    def solved(parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        matrix = basis(parameters)
        levels = np.linalg.lstsq(matrix, values[used], rcond=None)[0]
        return levels, matrix @ levels - values[used]

    low = np.array([n[0], 1.0, 0.25, -1.5])
    high = np.array([n[-1], 0.75 * len(n), 6.0, 1.5])
    start = np.array([centre_px, radius_px, blur_px, theta_rad])
    found = least_squares(
        lambda parameters: solved(parameters)[1],
        np.clip(start, low + 1e-3, high - 1e-3),
        bounds=(low, high),
        x_scale=[1.0, 1.0, 0.5, 0.3],
        diff_step=1e-3,
        max_nfev=60,
    )
    levels, rest = solved(found.x)
    centre_px, radius_px, blur_px, theta = (float(v) for v in found.x)
    rms = float(np.sqrt(np.mean(rest**2)))
    return Section(centre_px, radius_px, blur_px, theta, levels, rms)


def _rough(values: np.ndarray, n: np.ndarray, radius_px: float) -> tuple[float, float]:
    """Centre and radius from where the section first and last differs from its ground by a fifth
    of its contrast; the given radius where that fails."""
    edge = max(3, len(values) // 12)
    ground = np.median(np.r_[values[:edge], values[-edge:]])
    above = np.flatnonzero(np.abs(values - ground) > 0.2 * np.abs(values - ground).max())
    if len(above) < 4 or above[0] < 2 or above[-1] > len(values) - 3:
        return 0.0, radius_px
    return float(0.5 * (n[above[0]] + n[above[-1]])), float(0.5 * (n[above[-1]] - n[above[0]]))


def half_level_width(strip: np.ndarray, ground: float) -> float:
    """Width between half-level edges of the mean cross-section: what a common caliper reads."""
    values = np.abs(np.nanmean(strip, axis=1, dtype=float) - ground)
    level = 0.5 * values.max()
    above = np.flatnonzero(values >= level)
    first, last = above[0], above[-1]
    if first == 0 or last == len(values) - 1:
        return float("nan")
    left = first - (values[first] - level) / (values[first] - values[first - 1])
    right = last + (values[last] - level) / (values[last] - values[last + 1])
    return float(right - left)


def _model_px(strip: np.ndarray, diameter_px: float) -> float:
    """Standard uncertainty of the diameter from the edge model: how far it moves when more or less
    of the cylinder's middle is left out, and what even a perfect picture leaves open."""
    values = np.nanmedian(strip, axis=1).astype(float)
    radius = [
        best_section(values, diameter_px / 2, middle).radius_px for middle in (0.4, _MIDDLE, 0.8)
    ]
    return float(np.hypot(max(radius) - min(radius), _MODEL_FLOOR_PX))


def _given_axis(
    ends_px: tuple[tuple[float, float], tuple[float, float]],
) -> tuple[Axis, float]:
    axis = straight_axis(np.array(ends_px[0], dtype=float), np.array(ends_px[1], dtype=float))
    if not axis.length_px >= _FEWEST_BLOCKS * _BLOCK_PX:
        raise InputError("gauge: the two ends must lie at least 40 px apart")
    return axis, min(0.25 * axis.length_px, 60.0)


def _find_axis(picture: np.ndarray, roi_px: tuple[int, int, int, int] | None) -> tuple[Axis, float]:
    """Axis and width of the largest elongated thing in the region that differs from its ground."""
    x0, y0, width, height = roi_px or (0, 0, picture.shape[1], picture.shape[0])
    part = picture[y0 : y0 + height, x0 : x0 + width]
    if min(part.shape) < 16:
        raise InputError("gauge: the region lies outside the picture or is smaller than 16 px")
    scaled = cv2.normalize(part, None, 0, 255, cv2.NORM_MINMAX).astype(np.uint8)  # type: ignore[call-overload]
    _, mask = cv2.threshold(cv2.GaussianBlur(scaled, (0, 0), 1.5), 0, 255, cv2.THRESH_OTSU)
    if np.mean(mask) > 127:
        mask = 255 - mask
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask)
    if count < 2:
        raise InputError("gauge: nothing stands out of the ground; give --roi-px around the pin")
    largest = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    points = np.argwhere(labels == largest)[:, ::-1].astype(float) + np.array([x0, y0])
    centre = points.mean(axis=0)
    values, vectors = np.linalg.eigh(np.cov((points - centre).T))
    along = (points - centre) @ vectors[:, 1]
    width_px = float(np.sqrt(12 * values[0]))
    if along.max() - along.min() < 2 * width_px:
        raise InputError("gauge: no long straight thing in the region; give --points of its axis")
    low, high = np.quantile(along, [0.08, 0.92])
    return straight_axis(centre + low * vectors[:, 1], centre + high * vectors[:, 1]), width_px


def _straightened(axis: Axis, sections: list[tuple[float, Section]]) -> tuple[Axis, float]:
    s = np.array([place for place, _ in sections])
    n = np.array([section.centre_px for _, section in sections])
    slope, offset = np.polyfit(s, n, 1)
    u = axis.tangent(np.array(0.0))
    normal = np.array([-u[1], u[0]])
    ends = [axis.at(np.array(e)) + (offset + slope * e) * normal for e in (0.0, axis.length_px)]
    radius = float(np.median([section.radius_px for _, section in sections]))
    return straight_axis(ends[0], ends[1]), 2 * radius
