"""Linear light to stored pixels: photon and read noise, gamma, quantisation; seeded."""

from __future__ import annotations

import numpy as np
from numba import njit
from scipy.special import ndtri

from synth.settings import Sensor

_STEPS = 4096
# equal-probability samples of the normal distribution, drawn with 12 random bits each
_NORMALS = ndtri((np.arange(4096) + 0.5) / 4096.0).astype(np.float32)


def encode_table(gamma: float, bits: int) -> np.ndarray:
    """(STEPS + 1,) stored value over the square root of linear light 0..1."""
    top = 255.0 if bits == 8 else 65535.0
    root = np.linspace(0.0, 1.0, _STEPS + 1)
    return (top * root ** (2.0 / gamma)).astype(np.float32)


def expose(linear: np.ndarray, sensor: Sensor, seed: int) -> np.ndarray:
    """Linear light (h, w, C) float32 -> uint8 or uint16 of the same shape.

    Shot noise is Gaussian of the photon count's variance; equal seeds give equal pixels.
    """
    table = encode_table(sensor.gamma, sensor.bits)
    out = np.empty(linear.shape, np.uint8 if sensor.bits == 8 else np.uint16)
    _expose(
        np.ascontiguousarray(linear).reshape(-1),
        sensor.exposure,
        sensor.full_well_e,
        sensor.read_noise_e,
        table,
        _NORMALS,
        np.uint64(seed * 2 + 1),
        out.reshape(-1),
    )
    return out


@njit(cache=True, fastmath=True, error_model="numpy")
def _expose(linear, exposure, well, read, table, normals, seed, out):
    state = seed * np.uint64(0x9E3779B97F4A7C15) + np.uint64(0xD1B54A32D192ED03)
    steps = len(table) - 1
    noisy = well > 0.0
    word = np.uint64(0)
    left = 0
    bits = np.uint64(12)
    mask = np.uint64(4095)
    dark = read * read / (well * well) if noisy else 0.0
    shot = 1.0 / well if noisy else 0.0
    for i in range(len(linear)):
        value = linear[i] * exposure
        if noisy:
            if left == 0:
                state ^= state >> np.uint64(12)
                state ^= state << np.uint64(25)
                state ^= state >> np.uint64(27)
                word = state * np.uint64(0x2545F4914F6CDD1D)
                left = 5
            value += normals[word & mask] * np.sqrt(max(value, 0.0) * shot + dark)
            word = word >> bits
            left -= 1
        if value <= 0.0:
            out[i] = 0
            continue
        root = np.sqrt(value) * steps
        low = int(root)
        if low >= steps:
            out[i] = np.uint16(table[steps] + np.float32(0.5))
            continue
        part = np.float32(root - low)
        out[i] = np.uint16(table[low] + (table[low + 1] - table[low]) * part + np.float32(0.5))
