"""What files do to edges of colours.

JPEG and video store brightness in full and colour at half the resolution, both of the encoded
picture. Where a bright strand's colour is mixed into dark ground beside it, or that ground's into
its limb, decoding makes hardly any light of it: in linear light an edge by colour is not only twice
as blurred, but lies further in, by some tenths of a px a side before a dark ground, and the ramp
that this leaves passes for a limb's. Decoding is no sum, so that no blur of the light describes it.

What it does follows from the colours of strands and ground, from the light found, and from how
sharp the picture is by its brightness: an edge of this light is drawn as it reaches the sensor, and
as a file gives it back. The difference is taken off the mean edges before light is fitted to them
anew, until their places stay.

What is told by its brightness is decoded as if it were grey. That is right of a strand in any
light, whose channels keep their ratios; but where a red strand is mixed with a dark ground half of
each looks brighter than half, for channels that differ do not encode alike: its edge seems to lie
0.1 to 0.3 px too far out. That is taken off in the same way.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from tsvision.images.linear import decoded, encoded
from tsvision.measures.edges.cut import Cut
from tsvision.measures.edges.shading import (
    INSIDE,
    TEMPLATE_GRID_PX,
    TEMPLATE_STEP_PX,
    EdgeProfile,
    Shading,
    surface_contrast,
)
from tsvision.measures.numeric.smoothing import blurred

# BT.601, blue, green, red: how JPEG and video part brightness from colour, of encoded values.
STORED_LUMA_BGR = np.array([0.114, 0.587, 0.299])
# What is read at a px of colours stored as means of two and drawn straight between their middles:
# px away and their share, of one that is stored with the next; mirrored, with the one before.
MIXED = ((-2, 0.125), (-1, 0.125), (0, 0.375), (1, 0.375))
LEAST_GAIN = 0.1  # of a strand's light in its contrast: less tells nothing of the light
# Share of the strand that a mixture seems off by, at least, for it to be asked, and mixtures tried.
BENT, SHARES = 0.005, 65
ADDED_PX = 0.7  # of blur, in squares, at least: mixing colours so adds 1 px


@dataclass(frozen=True)
class Stored:
    """Linear colours (3,), blue, green, red, of strands and of the ground beside them; weights (3,)
    of the signal; gamma as `to_linear` takes it; sharp_px: the picture's blur by its brightness."""

    strand: np.ndarray
    ground: np.ndarray
    weights: np.ndarray
    gamma: float
    sharp_px: float

    @property
    def contrast(self) -> float:
        return float(self.weights @ (self.strand - self.ground))

    @property
    def black(self) -> float:
        """The contrast of a strand without light, in units of the core's."""
        return -float(self.weights @ self.ground) / self.contrast


@dataclass(frozen=True)
class StoredLuma:
    """Linear colours (3,), blue, green, red, of strands as bright as their cores and of the ground
    beside them, told apart by the luma that files store; gamma as `to_linear` takes it."""

    strand: np.ndarray
    ground: np.ndarray
    gamma: float

    def seen(self, colours: np.ndarray) -> np.ndarray:
        """Light (K,) that luma stored of linear colours (K, 3) is decoded to, as of grey."""
        code = encoded(colours, self.gamma) @ STORED_LUMA_BGR
        return np.asarray(decoded(code, self.gamma))

    @property
    def levels(self) -> tuple[float, float]:
        """Of strands and ground."""
        strand, ground = self.seen(np.stack([self.strand, self.ground]))
        return float(strand), float(ground)


def is_halved(blur_px: float, sharp_px: float) -> bool:
    """Whether edges by colour are so much more blurred than by brightness that colours are stored
    at half the resolution."""
    return blur_px**2 >= sharp_px**2 + ADDED_PX**2


def stored_in(cuts: list[Cut], sharp_px: float, blur_px: float) -> Stored | None:
    """How the colour that some cuts show was stored, by their blur and that of their brightness;
    None where both are as sharp, or where colours are not known."""
    return colours_in(cuts, sharp_px) if is_halved(blur_px, sharp_px) else None


def colours_in(cuts: list[Cut], sharp_px: float) -> Stored | None:
    """The colours that some cuts show, of pictures so sharp; None where they are not known."""
    sight = cuts[0].sight
    pairs = [pair for cut in cuts if (pair := cut.strand_and_ground()) is not None]
    if not pairs:
        return None
    strand, ground = (np.median(each, axis=0) for each in zip(*pairs, strict=True))
    weights = sight.sense * np.asarray(sight.signal.weights, float)
    found = Stored(strand, ground, weights, sight.gamma, sharp_px)
    usable = found.contrast > 0.0 and abs(1.0 - found.black) > LEAST_GAIN
    return found if usable else None


def luma_in(cuts: list[Cut]) -> StoredLuma | None:
    """How the luma that some cuts show was stored; None where they are told otherwise, where no
    colours are known, and where a mixture of strand and ground looks like one of greys."""
    sight = cuts[0].sight
    if sight.signal.in_colour or sight.colours is None:
        return None
    found = StoredLuma(*sight.colours, sight.gamma)
    strand, ground = found.levels
    if strand <= 0.0:
        return None
    core = ground + float(np.median([cut.core_level for cut in cuts]))
    found = replace(found, strand=max(core, 0.0) / strand * found.strand)
    strand, ground = found.levels
    if sight.sense * (strand - ground) <= LEAST_GAIN * max(strand, ground):
        return None
    share = np.linspace(0.0, 1.0, SHARES)
    mixed = found.ground + share[:, None] * (found.strand - found.ground)
    seems = (found.seen(mixed) - ground) / (strand - ground)
    return found if np.abs(seems - share).max() > BENT else None


def coded(stored: Stored | StoredLuma, shading: Shading) -> np.ndarray:
    """What storing adds (T,) to the profile of an edge so lit, on the template's grid and in units
    of the core's contrast, each value over one px as mean edges are."""
    if isinstance(stored, StoredLuma):
        return _coded_luma(stored, shading)
    strand = surface_light(shading, stored.black)[:, None] * stored.strand
    sharp = INSIDE[:, None] * strand + (1.0 - INSIDE)[:, None] * stored.ground
    seen = blurred(sharp.T, stored.sharp_px / TEMPLATE_STEP_PX, truncate=3.5)
    added = stored.weights @ (_given_back(seen, stored.gamma) - seen) / stored.contrast
    return _over_px(np.asarray(added))


def _coded_luma(stored: StoredLuma, shading: Shading) -> np.ndarray:
    """The same of strands told by their luma."""
    level, ground = stored.levels
    light = surface_light(shading, -ground / (level - ground))
    return luma_added(stored, light, shading.blur_px) / (level - ground)


def surface_light(shading: Shading, black: float) -> np.ndarray:
    """Light (T,) on the strand's surface over the core's, of strands that show the contrast `black`
    without any; the core's all over where contrast does not tell it."""
    if abs(1.0 - black) <= LEAST_GAIN:
        return np.ones(TEMPLATE_GRID_PX.size)
    return np.maximum((surface_contrast(shading) - black) / (1.0 - black), 0.0)


def luma_added(stored: StoredLuma, light: np.ndarray, blur_px: float) -> np.ndarray:
    """What luma read as of greys adds (T,) to the light about an edge, averaged over a px, where
    the surface has so much light (T,), over the core's."""
    level, ground = stored.levels
    blur = blur_px / TEMPLATE_STEP_PX
    covered = INSIDE * light
    sharp = covered[:, None] * stored.strand + (1.0 - INSIDE)[:, None] * stored.ground
    read = stored.seen(blurred(sharp.T, blur, truncate=3.5).T)
    summed = blurred((covered * level + (1.0 - INSIDE) * ground)[None], blur, truncate=3.5)[0]
    return _over_px(read - summed)


def without(profile: EdgeProfile, added: np.ndarray) -> EdgeProfile:
    """The mean edge less what storing added (T,) to it."""
    off = np.interp(profile.t_px, TEMPLATE_GRID_PX, added)
    return replace(profile, value=profile.value - off)


def _given_back(light: np.ndarray, gamma: float) -> np.ndarray:
    """Linear light (3, T) as it is read from a file that stores its colour at half the resolution,
    on the mean of both places that a px has among those it is stored with."""
    code = encoded(light, gamma)
    luma = STORED_LUMA_BGR @ code
    at = np.arange(luma.size)
    read = []
    for way in (1, -1):
        steps = [(round(way * px / TEMPLATE_STEP_PX), share) for px, share in MIXED]
        whole = [share * (code - luma)[:, np.clip(at + k, 0, luma.size - 1)] for k, share in steps]
        read.append(decoded(np.clip(luma + np.sum(whole, axis=0), 0.0, 1.0), gamma))
    return np.asarray(np.mean(read, axis=0))


def _over_px(values: np.ndarray) -> np.ndarray:
    """Values (T,) averaged over a px."""
    size = round(1.0 / TEMPLATE_STEP_PX)
    return np.asarray(uniform_filter1d(values, size, mode="nearest"))
