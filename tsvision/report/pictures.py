"""Pictures for eyes: any decoded frame to 8-bit BGR, smaller, and as text for a page."""

from __future__ import annotations

import base64

import cv2
import numpy as np


def display_bgr(pixels: np.ndarray) -> np.ndarray:
    """(H, W) or (H, W, 3) uint8/uint16 to (H, W, 3) uint8.

    16-bit pictures seldom use their whole range, so they are stretched between the 0.1 and
    99.9 percentile; 8-bit ones are shown as they are.
    """
    if pixels.dtype != np.uint8:
        low, high = np.percentile(pixels, (0.1, 99.9))
        stretched = (pixels.astype(np.float32) - low) / max(high - low, 1.0)
        pixels = (stretched.clip(0, 1) * 255 + 0.5).astype(np.uint8)
    if pixels.ndim == 2:
        return cv2.cvtColor(pixels, cv2.COLOR_GRAY2BGR)
    return np.ascontiguousarray(pixels[:, :, :3])


def fit_within(picture: np.ndarray, width: int, height: int) -> np.ndarray:
    """Shrink (never enlarge) so that the picture fits into width × height px."""
    factor = min(1.0, width / picture.shape[1], height / picture.shape[0])
    return picture if factor == 1.0 else resized(picture, factor)


def resized(picture: np.ndarray, factor: float) -> np.ndarray:
    """A new picture, `factor` times as large."""
    if factor == 1.0:
        return picture.copy()
    size = (max(1, round(picture.shape[1] * factor)), max(1, round(picture.shape[0] * factor)))
    way = cv2.INTER_AREA if factor < 1 else cv2.INTER_CUBIC
    return cv2.resize(picture, size, interpolation=way)


def jpeg_within(picture: np.ndarray, budget_bytes: int) -> bytes:
    """JPEG no larger than the budget if quality 30 allows it: lower quality first, then size."""
    while True:
        for quality in (88, 80, 70, 60, 50, 40, 30):
            done, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])
            if done and data.size <= budget_bytes:
                return data.tobytes()
        if min(picture.shape[:2]) < 120:
            return data.tobytes()
        picture = fit_within(picture, picture.shape[1] * 3 // 4, picture.shape[0])


def data_uri(data: bytes, kind: str) -> str:
    """Bytes of an image to a `data:` address; `kind` is jpeg or png."""
    return f"data:image/{kind};base64,{base64.b64encode(data).decode('ascii')}"
