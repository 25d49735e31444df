"""Whether a picture holds its colour in full, or was stored with half of its resolution."""

from __future__ import annotations

import numpy as np

ROWS = 4  # apart that are looked at
# Of red less green in 8-bit codes, from one pixel to the next: more than rounding makes, and as
# much rougher than over two pixels as noise is that neighbours do not share (1.7 times; colour that
# was drawn out over two pixels, 0.7).
LEAST, ROUGHER = 2.0, 1.3


def colour_in_full(pixels: np.ndarray) -> bool:
    """Whether neighbouring pixels of a picture (H, W, 3), uint8 or uint16, have colour noise of
    their own. JPEG and video share it by twos and more; without noise that is not known: False."""
    if pixels.ndim != 3 or pixels.shape[1] < 3:
        return False
    some = pixels[::ROWS].astype(np.float32) * (255.0 / np.iinfo(pixels.dtype).max)
    hue = some[..., 2] - some[..., 1]
    bend = _spread(hue[:, :-2] - 2.0 * hue[:, 1:-1] + hue[:, 2:])
    step = _spread(hue[:, 2:] - hue[:, :-2])
    return bend > max(LEAST, ROUGHER * step)


def _spread(values: np.ndarray) -> float:
    """Robust sd: most of a picture is ground."""
    return 1.4826 * float(np.median(np.abs(values - np.median(values))))
