"""The blur of single frames, where a recording's frames are not equally sharp: shake, refocusing.

The light on the strands is the recording's, learnt once; how far a frame is blurred is read from
its own mean edges. A template too sharp, or not sharp enough, for a frame takes the ramp at the
limb for the edge, or the edge for the ramp: 6 px of shake moved D by 2 px.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tsvision.measures.edges.cut import Cut
from tsvision.measures.edges.shading import (
    TEMPLATE_STEP_PX,
    TRUNCATED,
    EdgeProfile,
    Shading,
    averaged_blur_px,
    looked_up,
)
from tsvision.measures.helix.bundle import BundleFit
from tsvision.measures.helix.silhouette import model_edges
from tsvision.measures.light.profiles import edge_profiles
from tsvision.measures.light.separable import changes, fit_separable, projected
from tsvision.measures.numeric.smoothing import blurred

SHARPEST_PX, MOST_BLURRED_PX = 0.35, 6.0
STEADY, STEADY_PX = 0.25, 0.4  # of the blur, and at least: frames that differ by no more are alike
FEWEST, LEAST = 3, 0.12  # frames, and spread of their blurs, from which diameters can decide
# Of the diameters' scatter under one blur: what blurs that are the frames' leave. Path-traced films
# shaken by 2 to 5 px leave 0.05 to 0.45 of it, those held still that were taken for shaken 0.6.
AGREE = 0.5
NOTCH_PX = 0.02  # by which blur moves an edge outwards where it is a notch's
FURTHEST_PX = 2.5  # from the fitted silhouette: where the edge may lie


def model_rows(cut: Cut, found: BundleFit) -> tuple[np.ndarray, np.ndarray]:
    """Rows of the fitted silhouette's edges, (M,) each, NaN outside the fitted window and in the
    notches between strands: there two limbs are seen at once, and the strand in front shades the
    other."""
    inside = (cut.s_px >= found.s_low_px) & (cut.s_px <= found.s_high_px)
    upper, lower = np.full(inside.size, np.nan), np.full(inside.size, np.nan)
    z0 = found.s_low_px - found.middle_px
    count = int(inside.sum())
    up, low = found.fit.seen_edges(z0, count)
    sharp_up, sharp_low = model_edges(found.fit.p, found.fit.section, z0, count)
    up = np.where(up - sharp_up > NOTCH_PX, np.nan, up)
    low = np.where(sharp_low - low > NOTCH_PX, np.nan, low)
    upper[inside], lower[inside] = up + cut.half_px, low + cut.half_px
    return upper, lower


def frame_blur_px(cut: Cut, found: BundleFit, shading: tuple[Shading, Shading]) -> float:
    """sd of a frame's blur, px, from both sides' mean edges along its fitted silhouette under the
    recording's light; NaN where too little of them is seen."""
    profiles = edge_profiles([cut], shading[0].rho_px, [model_rows(cut, found)])
    return float("nan") if profiles is None else blur_of(profiles, shading)


def blur_of(profiles: tuple[EdgeProfile, EdgeProfile], shading: tuple[Shading, Shading]) -> float:
    """Blur (px) that both mean profiles share; depth, ground and place of each are free."""
    seen = _Seen(profiles, np.stack([s.template for s in with_blur(shading, SHARPEST_PX)]))
    start = float(np.clip(shading[0].blur_px, SHARPEST_PX + 0.05, MOST_BLURRED_PX - 0.05))
    places = (-FURTHEST_PX, FURTHEST_PX)
    fit = fit_separable(
        seen.residuals,
        seen.slopes,
        np.array([start, 0.0, 0.0]),
        [(SHARPEST_PX, MOST_BLURRED_PX), places, places],
        x_scale=[0.2, 0.2, 0.2],
        max_nfev=15,
    )
    return float(fit.x[0])


@dataclass(frozen=True)
class _Seen:
    """Mean profiles explained by the sharpest templates (2, T), each blurred, moved, of a depth and
    on a ground of its own; q (3,) = blur and both places."""

    profiles: tuple[EdgeProfile, EdgeProfile]
    sharpest: np.ndarray

    def residuals(self, q: np.ndarray) -> np.ndarray:
        return np.concatenate([off for off, _ in self._sides(q, slopes=False)])

    def slopes(self, q: np.ndarray) -> np.ndarray:
        """How they change (R, 3) with q."""
        found = []
        for side, (_, (by_blur, by_place)) in enumerate(self._sides(q, slopes=True)):
            moved = np.zeros((by_blur.size, q.size))
            moved[:, 0], moved[:, 1 + side] = by_blur, by_place
            found.append(moved)
        return np.concatenate(found)

    def _sides(self, q: np.ndarray, slopes: bool) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Of each side residuals (K,), and how they change (2, K) with blur and place."""
        more = max(averaged_blur_px(q[0]) ** 2 - SHARPEST_PX**2, 1e-6)
        templates = blurred(self.sharpest, np.sqrt(more) / TEMPLATE_STEP_PX, truncate=TRUNCATED)
        for p, template, place in zip(self.profiles, templates, q[1:], strict=True):
            t_px = p.t_px - place
            seen = looked_up(template[None], t_px)
            design = np.hstack([seen, np.ones_like(seen)])
            depth = np.linalg.lstsq(design, p.value, rcond=None)[0]
            moved = np.empty((t_px.size, 0))
            if slopes:
                each = changes(depth[0] * template, t_px, float(q[0]))
                moved = projected(np.stack(each, axis=1), design, np.ones(2))
            yield design @ depth - p.value, moved.T


def with_blur(shading: tuple[Shading, Shading], blur_px: float) -> tuple[Shading, Shading]:
    """The same light under another blur."""
    upper, lower = (replace(s, blur_px=blur_px) for s in shading)
    return upper, lower


def shading_of(
    cut: Cut, found: BundleFit, shading: tuple[Shading, Shading]
) -> tuple[Shading, Shading]:
    """The recording's light under this frame's own blur; as it is where that is not seen."""
    blur_px = frame_blur_px(cut, found, shading)
    return with_blur(shading, blur_px) if np.isfinite(blur_px) else shading


def alike(blurs_px: np.ndarray) -> bool:
    """Whether frames of these blurs (K,) are equally sharp, as far as is known."""
    known = blurs_px[np.isfinite(blurs_px)]
    if known.size < 2:
        return True
    return bool(np.ptp(known) <= max(STEADY * float(np.median(known)), STEADY_PX))


def undecided(blurs_px: np.ndarray) -> bool:
    """Whether blurs (K,) may be the frames' or only what light does to a reading, and there are
    frames enough for `agree_better` to tell."""
    known = blurs_px[np.isfinite(blurs_px)]
    return bool(known.size >= FEWEST and np.ptp(known) > LEAST * float(np.median(known)))


def agree_better(shared_px: np.ndarray, own_px: np.ndarray) -> bool:
    """Whether a straight bundle's diameters (K,) agree much better under each frame's own blur than
    under one for all: it is the same bundle in every frame."""
    known = np.isfinite(shared_px) & np.isfinite(own_px)
    if np.count_nonzero(known) < 2:
        return False
    return bool(np.std(own_px[known]) < AGREE * np.std(shared_px[known]))
