"""How many of 16 bits pictures fill.

Sensors count to 10, 12 or 14 bits, and many cameras write such counts into 16 bits as they are.
Taken as shares of 65535 they are all but black: contrast is called none, burnt-out strings are not
seen to be, and what is encoded for the eye is decoded from the curve's dark foot. So they are
raised to fill the 16 bits as soon as pictures are looked at.

One picture may be dark by itself: over all that are known, the brightest pixel decides. A whole
film in the lowest sixteenth of 16 bits is taken for 12 bits; light that is linear is the same but
for its unit then.
"""

from __future__ import annotations

import numpy as np

DEPTHS = (10, 12, 14, 16)  # of sensors whose counts are stored in 16 bits


def bits_of(pictures: list[np.ndarray]) -> int:
    """The bits that some pictures (uint8 or uint16) fill: 8, or one of DEPTHS."""
    deep = [int(p.max(initial=0)) for p in pictures if p.dtype == np.uint16]
    return next(bits for bits in DEPTHS if max(deep) < 2**bits) if deep else 8


def filled(pixels: np.ndarray, bits: int) -> np.ndarray:
    """The same picture with codes that fill their 16 bits; what lies above the `bits` is full.
    8-bit pictures and those that fill 16 pass through."""
    if pixels.dtype == np.uint8 or not 8 < bits < 16:
        return pixels
    full = np.uint16(2**bits - 1)
    # The lower bits repeat the upper ones, so that a full pixel is full.
    raised = np.minimum(pixels, full)
    return np.asarray((raised << (16 - bits)) | (raised >> (2 * bits - 16)))
