"""Pixels to linear light, and to the one signal in which the strings stand out.

Edges are found in linear light because blur acts there: an encoded picture makes a bright strand
wider and a dark one narrower by up to half a pixel a side. The signal is luma where luma carries
the strings, else the colour direction that separates them from the ground (equal luma, another
hue).
"""

from __future__ import annotations

from functools import lru_cache

import cv2
import numba
import numpy as np

from tsvision.images.cloud import Cloud
from tsvision.images.frames_picture import to_luma

# BT.709 luma weights in OpenCV's channel order (blue, green, red), for linear light.
LUMA_BGR = np.array([0.0722, 0.7152, 0.2126], dtype=np.float32)


@lru_cache(maxsize=8)
def _decode_table(levels: int, gamma: float) -> np.ndarray:
    return decoded(np.linspace(0.0, 1.0, levels), gamma).astype(np.float32)


def decoded(code: np.ndarray, gamma: float) -> np.ndarray:
    """The light of codes, both in 0..1; gamma as `to_linear` takes it."""
    if np.isfinite(gamma):
        return code**gamma
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


def encoded(light: np.ndarray, gamma: float) -> np.ndarray:
    """The codes of light, both in 0..1: `decoded` backwards."""
    light = np.clip(light, 0.0, 1.0)
    if np.isfinite(gamma):
        return light ** (1.0 / gamma)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1.0 / 2.4) - 0.055)


def to_linear(pixels: np.ndarray, gamma: float = float("nan")) -> np.ndarray:
    """Linear light in 0..1, float32, same shape as `pixels` (uint8 or uint16, grey or BGR).

    `gamma` is the decoding exponent; NaN means the sRGB curve, which cameras and phones write
    into 8-bit files; 1 means that the file holds linear light.
    """
    if pixels.dtype == np.uint8:
        return cv2.LUT(pixels, _decode_table(256, gamma))
    if pixels.dtype == np.uint16:
        return _decode_table(65536, gamma)[pixels]
    raise TypeError(f"pixels must be uint8 or uint16, not {pixels.dtype}")


def project(linear: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """The signal, (H, W) float32: `linear` itself when grey, else its weighted sum of channels."""
    if linear.ndim == 2:
        return linear
    row = np.asarray(weights, dtype=np.float32).reshape(1, 3)
    return cv2.transform(linear, row).reshape(linear.shape[:2])


def light_of_codes(gamma: float) -> np.ndarray:
    """What 8-bit codes stand for (256,), float32; gamma as `to_linear` takes it."""
    return _decode_table(256, gamma)


def grey_codes(pixels: np.ndarray, weights: np.ndarray) -> np.ndarray | None:
    """The one 8-bit code a pixel (H, W) that `linear_signal` is the light of; None where it is not
    that of one."""
    if pixels.dtype != np.uint8:
        return None
    if pixels.ndim == 3 and np.array_equal(weights, LUMA_BGR):
        return to_luma(np.ascontiguousarray(pixels))
    return pixels if pixels.ndim == 2 else None


def linear_signal(
    pixels: np.ndarray, weights: np.ndarray, gamma: float = float("nan")
) -> np.ndarray:
    """`project` of `to_linear`, (H, W) float32. Luma is taken as files store it, in full: mixed
    anew from channels it would have the edges of chroma, which JPEG and video store at half the
    resolution. Of 8-bit colour without the picture in between: three numbers a pixel take longer to
    write and to read again than to look up."""
    codes = grey_codes(pixels, weights)
    if codes is not None:
        return to_linear(np.ascontiguousarray(codes), gamma)
    if pixels.ndim == 3 and np.array_equal(weights, LUMA_BGR):
        pixels = to_luma(np.ascontiguousarray(pixels))
    if pixels.ndim == 2 or pixels.dtype != np.uint8:
        return project(to_linear(np.ascontiguousarray(pixels), gamma), weights)
    light = _decode_table(256, gamma)
    # To the last bit as `project` adds: green is rounded, then blue and red are each added to it.
    blue, green, red = light[:, None].astype(float).T * np.asarray(weights, float)[:, None]
    return np.asarray(_looked_up(pixels, blue, green.astype(np.float32), red))


@numba.njit(cache=True)
def _looked_up(pixels, blue, green, red):  # pragma: no cover - compiled
    rows, columns, _ = pixels.shape
    out = np.empty((rows, columns), np.float32)
    for r in range(rows):
        for c in range(columns):
            two = np.float32(blue[pixels[r, c, 0]] + green[pixels[r, c, 1]])
            out[r, c] = two + red[pixels[r, c, 2]]
    return out


SHADED = 0.6  # sd of the ground's light in shadow, of itself
LIT = 2.0  # sd of the light on strings, of itself: none at a limb, gloss on the crests


def luma_is_enough(separation: float) -> bool:
    """Luma is kept while it separates strings from ground by this many standard deviations: its
    edges are sharper than those of JPEG and video chroma, which are stored at half resolution."""
    return separation >= 3.0


def best_weights(strings: Cloud, ground: Cloud) -> tuple[np.ndarray, float]:
    """Channel weights (3,) and the separation (in sd) that they reach.

    strings, ground: linear BGR colours on the bundle and beside it. Fisher's linear discriminant
    with a ridge, so that a channel without light cannot dominate.
    """
    luma = _separation(LUMA_BGR, strings, ground)
    if luma_is_enough(luma):
        return LUMA_BGR.copy(), luma
    weights = _discriminant(strings, ground, 0.0)
    reached = _separation(weights, strings, ground)
    # A small advantage does not pay for chroma's coarser edges.
    if reached < 1.5 * luma:
        return LUMA_BGR.copy(), luma
    return weights.astype(np.float32), reached


def shadeless_weights(strings: Cloud, ground: Cloud) -> tuple[np.ndarray, float]:
    """The same where the light on the ground may be any: a shadow lies close along the strings, and
    is no part of what is seen of the ground further off."""
    weights = _discriminant(strings, ground, SHADED)
    return weights.astype(np.float32), _separation(weights, strings, ground)


def lightless_weights(strings: Cloud, ground: Cloud) -> tuple[np.ndarray, float]:
    """The same where the light on the strings may be any: they are as dark as black then, and what
    is seen is how much of the ground they leave."""
    weights = -_discriminant(ground, strings, LIT)
    return weights.astype(np.float32), _separation(weights, strings, ground)


def _discriminant(these: Cloud, those: Cloud, shaded: float) -> np.ndarray:
    """Fisher's, for light on those whose sd is `shaded` of itself more than is seen."""
    shade = shaded * those.mean
    scatter = _scatter(these, those) + shade[:, None] * shade
    weights = np.linalg.solve(scatter, these.mean - those.mean)
    return np.asarray(weights / np.abs(weights).sum())


def _scatter(strings: Cloud, ground: Cloud) -> np.ndarray:
    scatter = 0.5 * (strings.scatter + ground.scatter)
    return np.asarray(scatter + np.eye(3) * (1e-6 + 0.02 * np.trace(scatter)))


def _separation(weights: np.ndarray, strings: Cloud, ground: Cloud) -> float:
    apart = abs(weights @ (strings.mean - ground.mean))
    return float(apart / np.sqrt(weights @ _scatter(strings, ground) @ weights))
