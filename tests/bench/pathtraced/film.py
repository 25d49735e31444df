"""From linear light to the file: blur, motion, photon noise, encoding."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np


@dataclass(frozen=True)
class Film:
    """`exposure` scales light so that 1.0 is full well; `motion_px` is a shake along a line;
    `gamma` encodes the light, 1 not at all, NaN as sRGB."""

    exposure: float = 1.0
    gauss_blur_px: float = 0.8
    defocus_px: float = 0.0
    motion_px: float = 0.0
    motion_deg: float = 0.0
    full_well_e: float = 4000.0
    read_noise_e: float = 8.0
    mono: bool = False
    gamma: float = float("nan")
    jpeg_quality: int | None = 85


def disc_kernel(radius: float) -> np.ndarray:
    n = int(np.ceil(radius)) * 2 + 3
    y, x = np.mgrid[:n, :n] - (n - 1) / 2
    k = np.clip(radius + 0.5 - np.hypot(x, y), 0, 1)
    return k / k.sum()


def line_kernel(length: float, degrees: float) -> np.ndarray:
    n = int(np.ceil(length)) * 2 + 3
    k = np.zeros((n, n))
    mid = (n - 1) / 2
    for t in np.linspace(-length / 2, length / 2, 200):
        x, y = mid + t * np.cos(np.deg2rad(degrees)), mid + t * np.sin(np.deg2rad(degrees))
        i, j, fx, fy = int(x), int(y), x % 1, y % 1
        k[j : j + 2, i : i + 2] += np.outer([1 - fy, fy], [1 - fx, fx])
    return k / k.sum()


def develop(light: np.ndarray, film: Film, rng: np.random.Generator) -> np.ndarray:
    """Linear RGB (H, W, 3) to an 8-bit BGR or grey picture."""
    image: np.ndarray = np.clip(light.astype(np.float64) * film.exposure, 0, 4)
    if film.mono:
        image = (image @ [0.2126, 0.7152, 0.0722])[..., None]
    if film.defocus_px > 0:
        image = cv2.filter2D(image, -1, disc_kernel(film.defocus_px))
    if film.motion_px > 0:
        image = cv2.filter2D(image, -1, line_kernel(film.motion_px, film.motion_deg))
    image = cv2.GaussianBlur(image, (0, 0), film.gauss_blur_px).reshape(*light.shape[:2], -1)
    electrons = rng.poisson(np.clip(image, 0, 1.2) * film.full_well_e).astype(float)
    electrons += rng.normal(0, film.read_noise_e, electrons.shape)
    value = np.clip(electrons / film.full_well_e, 0, 1)
    if np.isfinite(film.gamma):
        coded = value ** (1.0 / film.gamma)
    else:
        coded = np.where(value < 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)
    return (coded[..., ::-1] * 255 + 0.5).astype(np.uint8).squeeze()
