"""One round of learning how a recording's edges look.

Edges are found, helices fitted to them, the edges averaged along those, and the mean edge says
where the true ones lie.

Aligned on measured edges the mean profile is smeared by their scatter; aligned on the fitted helix
it is not. The places found by the sharper profile say how far the edges were off.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from tsvision.measures.edges.cut import Cut
from tsvision.measures.edges.edges import Edges
from tsvision.measures.edges.find import find_edges
from tsvision.measures.edges.shading import Shading
from tsvision.measures.helix.bundle import SWINGS, BundleFit, fit_window, swing_px
from tsvision.measures.helix.silhouette import RHO, Y0, Section
from tsvision.measures.helix.uncertainty import light_sd_px
from tsvision.measures.helix.weigh import POOR
from tsvision.measures.helix.windows import learning_windows
from tsvision.measures.light.beside import NONE
from tsvision.measures.light.blur import (
    agree_better,
    alike,
    frame_blur_px,
    model_rows,
    undecided,
    with_blur,
)
from tsvision.measures.light.bright import BrightCuts
from tsvision.measures.light.profiles import black_of, edge_profiles
from tsvision.measures.light.shading_fit import fit_shading
from tsvision.measures.light.shape import Shape, hidden_px, shape_of, trust_of
from tsvision.measures.light.stored import Stored, StoredLuma, coded, without

AIMS, AIMED_PX = 3, 0.5  # times, until edges are looked along no farther than so from the true
SUREST_PX = 0.05  # sd of a width: none is surer
SHARP = 1.35  # times the sharpest frame's blur: these teach where frames differ


@dataclass(frozen=True)
class Round:
    """What a round found under the look before it. places_px: where it saw the true edges, inside
    (> 0) those found; strain: how far off, in squares of their sd, light and the outline's shape
    each found the bundles fitted; frames: in how many a bundle was fitted, rms_px: its residuals,
    the median, and matched: share of its columns whose edges were found; coils: fitted, each by its
    cut's id, which the next round begins from; shown: ids of the cuts that it was told by, those
    that fit best."""

    places_px: tuple[float, float] = (0.0, 0.0)
    strain: float = 0.0
    frames: int = 0
    rms_px: float = float("nan")
    matched: float = 0.0
    coils: dict[int, BundleFit] = field(default_factory=dict)
    shown: frozenset[int] = frozenset()

    @property
    def moved_px(self) -> float:
        """How far the edges went in it."""
        return max(abs(place) for place in self.places_px)

    @property
    def wide_px(self) -> float:
        """By how much D is too large by the edges found."""
        return sum(self.places_px)


@dataclass(frozen=True)
class EdgeLook:
    """shading of the upper and lower edge; diameter_px of the bundles fitted, and frames_px: how
    much thicker they are in each of the frames, by its picture's id; trust: how much either edge
    counts in a fit; steady: whether the frames are equally sharp; hidden_px: how much
    of the width may lie beyond edges that are no strand's; apart_px: sd of the widths that frames
    show, where rounds went to and fro; stored: how files keep the colour that strings are told by,
    where that is to be undone; bright: what shows the same edges by brightness, where that is asked
    as well; last: the round that taught it."""

    shading: tuple[Shading, Shading]
    diameter_px: float
    trust: tuple[float, float] = (1.0, 1.0)
    steady: bool = True
    hidden_px: float = 0.0
    apart_px: float = 0.0
    stored: Stored | StoredLuma | None = None
    bright: BrightCuts | None = None
    last: Round = Round()
    frames_px: dict[int, float] = field(default_factory=dict)


def wider_px(look: EdgeLook, other: EdgeLook) -> float:
    """By how much D is larger by one look than by another, in the frames that told both, if any
    did: six strings may be a twelfth thicker after four turns more, and which of the frames fit
    best is chance."""
    shared = look.frames_px.keys() & other.frames_px.keys()
    apart = [look.frames_px[frame] - other.frames_px[frame] for frame in shared] or [0.0]
    return look.diameter_px - other.diameter_px + float(np.median(apart))


def less_sure(look: EdgeLook, by_px: float) -> EdgeLook:
    """The same, with so much more of an sd of either edge's place."""
    upper, lower = (
        replace(s, place_sd_px=float(np.hypot(s.place_sd_px, by_px))) for s in look.shading
    )
    return replace(look, shading=(upper, lower))


def next_look(cuts: list[Cut], section: Section, look: EdgeLook) -> EdgeLook:
    """What a look's own template makes of the edges."""
    seen = [(cut, replace(find_edges(cut, look.shading), trust=look.trust)) for cut in cuts]
    fits = _fitted(seen, section, look.diameter_px, coil=False)
    if not any(f.bundle.fit.cost < POOR for f in fits):
        fits += _fitted(seen, section, look.diameter_px, coil=True, last=look.last.coils)
    if not fits:
        unmoved = replace(look.last, places_px=(0.0, 0.0))
        return less_sure(replace(look, steady=True, last=unmoved), look.last.moved_px)
    coils = {id(f.cut): f.bundle for f in fits if f.bundle.fit.coiled}
    frames = len({id(f.cut) for f in fits})
    blurs = _blurs_px(fits, look.shading)
    steady = _steady(fits, blurs, section, look)
    if not steady:  # the sharpest tell light from blur best
        limit = SHARP * np.nanmin(list(blurs.values()))
        fits = [f for f in fits if not blurs[id(f.cut)] > limit]
    fits = _best(fits)
    told_px = _of_frames(fits, np.array([f.bundle.fit.diameter_px for f in fits]))
    diameter = float(np.median(list(told_px.values())))
    each = [(f.edges, f.bundle) for f in fits]
    shape = shape_of(each, look.shading[0].blur_px)
    found = Round(
        strain=look.last.strain,
        frames=frames,
        rms_px=float(np.median([f.bundle.fit.rms_px for f in fits])),
        matched=float(np.median([f.edges.both_seen[f.cut.silhouette.bundle].mean() for f in fits])),
        coils=coils,
        shown=frozenset(id(f.cut) for f in fits),
    )
    frames_px = {f.cut.picture: told_px[id(f.cut)] - diameter for f in fits}
    fitted = replace(look, diameter_px=diameter, frames_px=frames_px, steady=steady, last=found)
    taught = _taught(fits, shape, look)
    if taught is None:  # what the round before moved edges by is not proved
        return less_sure(fitted, look.last.moved_px)
    (upper, lower), places_px = taught
    upper_px, lower_px = map(float, places_px)
    strain = (float(places_px.sum()) / max(light_sd_px((upper, lower)), SUREST_PX)) ** 2
    strain += (shape.width_px / shape.sd_px) ** 2
    return replace(
        fitted,
        shading=(upper, lower),
        trust=trust_of(each),
        hidden_px=hidden_px(each),
        last=replace(found, places_px=(upper_px, lower_px), strain=strain),
    )


def widths_px(cuts: list[Cut], section: Section, look: EdgeLook) -> dict[int, float]:
    """D as each of the frames shows it under a look, by its cut's id and in the cuts' order, by its
    own blur where they are not equally sharp; those left out that show none."""
    seen = [(cut, replace(find_edges(cut, look.shading), trust=look.trust)) for cut in cuts]
    fits = _fitted(seen, section, look.diameter_px, coil=False)
    straight = {id(f.cut) for f in fits}
    rest = [(cut, edges) for cut, edges in seen if id(cut) not in straight]
    fits += _fitted(rest, section, look.diameter_px, coil=True, last=look.last.coils)
    if look.steady:
        found = [f.bundle.fit.diameter_px for f in fits]
    else:
        found = _own_diameters_px(fits, _blurs_px(fits, look.shading), section, look)
    each = _of_frames(fits, np.array(found))
    return {id(cut): each[id(cut)] for cut in cuts if np.isfinite(each.get(id(cut), np.nan))}


def _taught(
    fits: list[_Fitted], shape: Shape, look: EdgeLook
) -> tuple[tuple[Shading, Shading], np.ndarray] | None:
    """The shading of either side that the mean edges along some bundles teach, and (2,) where the
    true edges lie; None where too little is seen.

    Along an outline far from the true one, as of bundles whose dark limb was taken to end where
    its light does, the mean edge is smeared: lobes are as high as their strands are thick. So
    bundles are made as thick as they are said to be, and looked along again.
    What storing made of the edges is taken off by what the light known so far says of it.
    """
    shading, places_px, light = None, np.zeros(2), look.shading
    cuts = [f.cut for f in fits]
    for _ in range(AIMS):
        aimed = [_moved(f.bundle, places_px) for f in fits]
        rho = float(np.median([b.fit.p[RHO] for b in aimed]))
        rows = [model_rows(f.cut, b) for f, b in zip(fits, aimed, strict=True)]
        mean = edge_profiles(cuts, rho, rows)
        if mean is None:
            break
        if look.stored is not None:
            added = (coded(look.stored, light[0]), coded(look.stored, light[1]))
            mean = (without(mean[0], added[0]), without(mean[1], added[1]))
        upper, lower, off_px = fit_shading(
            mean,
            rho,
            black_of(cuts),
            look.shading[0].blur_px,
            replace(shape, width_px=shape.width_px - float(places_px.sum())),
            grooved=fits[0].bundle.fit.section.count > 2,
            beside=NONE if look.bright is None else look.bright.beside(cuts, rho, rows, light),
            by_hue=fits[0].cut.in_colour,
        )
        if look.stored is not None:
            upper, lower = replace(upper, added=added[0]), replace(lower, added=added[1])
        shading, places_px = (upper, lower), places_px + off_px
        light = shading
        if np.abs(off_px).max() < AIMED_PX:
            break
    return None if shading is None else (shading, places_px)


def _moved(found: BundleFit, places_px: np.ndarray) -> BundleFit:
    """The bundle whose edges lie so far (2,) inside those fitted."""
    p = found.fit.p.copy()
    p[RHO] *= 1.0 - float(places_px.sum()) / found.fit.diameter_px
    p[Y0] += 0.5 * float(places_px[1] - places_px[0])
    return replace(found, fit=replace(found.fit, p=p))


@dataclass(frozen=True)
class _Fitted:
    """A cut, its edges under the shading so far, and the bundle fitted to them."""

    cut: Cut
    edges: Edges
    bundle: BundleFit


def _fitted(
    seen: list[tuple[Cut, Edges]],
    section: Section,
    diameter: float,
    coil: bool,
    last: dict[int, BundleFit] | None = None,
) -> list[_Fitted]:
    """The cuts that a helix describes; coils, costly to search, on demand only. last: what was
    fitted to a cut, by its id, in the round before; else a cut begins from the one before it."""
    fits: list[_Fitted] = []
    before = None
    for cut, edges in seen:
        windows = learning_windows(cut, diameter)
        for window in windows[:1] if coil else windows:
            if not coil and swing_px(edges.window(*window)) > SWINGS * diameter:
                break
            start = (last or {}).get(id(cut), before)
            fit = fit_window(edges, section, *window, diameter, float("nan"), start, coil=coil)
            if fit is None or fit.fit.rms_px >= max(0.6, 0.03 * diameter):
                break
            fits.append(_Fitted(cut, edges, fit))
            before = fit if fit.fit.cost < POOR else None
    return fits


def _of_frames(fits: list[_Fitted], values: np.ndarray) -> dict[int, float]:
    """Each frame's own value, by its cut: the median of its stretches' (K,) that are known."""
    by_cut: dict[int, list[float]] = {}
    for f, value in zip(fits, values, strict=True):
        of_cut = by_cut.setdefault(id(f.cut), [])
        if np.isfinite(value):
            of_cut.append(float(value))
    return {cut: float(np.median(known or [np.nan])) for cut, known in by_cut.items()}


def _blurs_px(fits: list[_Fitted], shading: tuple[Shading, Shading]) -> dict[int, float]:
    """Each frame's own blur, by its cut. Along a silhouette that does not fit the mean edge is
    smeared, however sharp the frame is: such tell none."""
    each = [
        frame_blur_px(f.cut, f.bundle, shading) if f.bundle.fit.cost < POOR else np.nan
        for f in fits
    ]
    return _of_frames(fits, np.array(each))


def _steady(
    fits: list[_Fitted], blurs_px: dict[int, float], section: Section, look: EdgeLook
) -> bool:
    """Whether the frames are equally sharp. Light moves a blur's reading by as much as shake does:
    where readings differ, the straight bundle's diameters say whose they are. A coil's differ for
    other reasons by more than a little blur moves them, and where colour is stored at half the
    resolution its blocks outdo what readings alone could say."""
    blurs = np.array(list(blurs_px.values()))
    if not undecided(blurs):
        return fits[0].cut.in_colour or alike(blurs)
    fits = [f for f in fits if not f.bundle.fit.coiled]
    if not fits:
        return True
    shared = _of_frames(fits, np.array([f.bundle.fit.diameter_px for f in fits]))
    own = _of_frames(fits, np.array(_own_diameters_px(fits, blurs_px, section, look)))
    return not agree_better(np.array(list(shared.values())), np.array(list(own.values())))


def _own_diameters_px(
    fits: list[_Fitted], blurs_px: dict[int, float], section: Section, look: EdgeLook
) -> list[float]:
    return [_own_diameter_px(f, blurs_px[id(f.cut)], section, look) for f in fits]


def _own_diameter_px(found: _Fitted, blur_px: float, section: Section, look: EdgeLook) -> float:
    """D under the frame's own blur; NaN where that is not known."""
    if not np.isfinite(blur_px):
        return float("nan")
    edges = replace(find_edges(found.cut, with_blur(look.shading, blur_px)), trust=look.trust)
    old = found.bundle
    fit = fit_window(
        edges,
        section,
        old.s_low_px,
        old.s_high_px,
        look.diameter_px,
        float("nan"),
        old,
        coil=old.fit.coiled,
    )
    return float("nan") if fit is None else fit.fit.diameter_px


def _best(fits: list[_Fitted]) -> list[_Fitted]:
    """Those that fit nearly as well as the best: a mean edge aligned on poor fits is smeared, looks
    blurred, and its ramp is taken for shading. Legs before the first turn fit well, but as a
    bundle of any width: where any fit shows half a turn, those that do not are left out. Along a
    coil the light falls on a limb from ever new sides: straight bundles tell it better."""
    fits = [
        f for f in fits if f.bundle.s_high_px - f.bundle.s_low_px > 0.5 * f.bundle.fit.pitch_px
    ] or fits
    fits = [f for f in fits if not f.bundle.fit.coiled] or fits
    limit = 1.25 * min(f.bundle.fit.rms_px for f in fits)
    return [f for f in fits if f.bundle.fit.rms_px <= limit]
