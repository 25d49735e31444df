"""What stands still in a recording, found once: axis, separator's side, connector, the signal.

The camera does not move, the strands do. A few frames spread over the recording vote; every later
frame is cut along the same axis and only its strands are measured anew.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tsvision.images.axis import Ridge, find_ridges, hue_off_ground, off_surroundings, unshaded
from tsvision.images.candidates import (
    AS_MUCH,
    CAST_SHARE,
    LEG_SHARE,
    LEGS_TO_BUNDLE,
    SWALLOWED_SHARE,
    Trial,
    are_legs,
    bisectors,
    could_cast,
    given_ridge,
    line_of_ridge,
    moving_ridges,
    plausible,
    put_to_trial,
    swallows,
    within_view,
)
from tsvision.images.contrast import core_of
from tsvision.images.linear import linear_signal, to_linear
from tsvision.images.masks import masks_of
from tsvision.images.motion import motion_picture, moving_share
from tsvision.images.runs import extent_of, leg_spread
from tsvision.images.seen import Seen, is_told, seen_by_any, seen_by_hue, seen_in
from tsvision.images.shadow import NO_SHADE, Shade
from tsvision.images.shrink import shrunk
from tsvision.images.signal import Signal
from tsvision.images.strip import Axis, Strip, cut_strip, straight_axis
from tsvision.images.telling import colours_of, find_cover, find_hue

MOVING_SHARE = 0.4  # of the axis' length that moves, from which nothing speaks against it
FEWEST_PX = 24  # on a picture's or region's short side
SEARCH_PX = 640  # long side of the pictures in which candidate axes are weighed
STRIP_WIDTHS = 4.0  # of the bundle, to either side, that are looked at along its axis
# Spreads by which strings stand out along a line, below which it may run between legs most of the
# way, how many times as many it is where they are looked for that way, and what speaks for that, of
# what speaks for the line.
FEEBLE, TWICE, SUPPORTED = 2.0, 2.0, 0.1
# Of what speaks for a line by a hue alone, from which the same one seen by light serves if it is as
# wide, nearly: a hue is stored at half the resolution, and may be that of some strands only.
YIELDS, ALIKE = 0.5, 1.25
ASTRAY = 0.5  # of what spoke for a line on small pictures, below which it was lost on full ones
# Of a line's columns, and of those where light shows anything on it: a hue seen in fewer is not the
# strings', but that of one colour of theirs and of a plate.
IN_FEW = 0.25
HARDLY = 0.1  # of SEARCH_PX: columns for a line, below which it is hardly one

Followed = tuple[Trial, list[Strip], Seen]  # a line refined, its strips, and what is seen there


@dataclass(frozen=True)
class Sight:
    """How to look at every frame of one recording.

    axis: s = 0 where the strings' side of the picture begins (refined to the separator's face by
    the measures), growing towards the motor connector. signal: in which strings stand out, and
    sense: +1 where they have more of it than the ground. width_px: rough outer width of the bundle.
    shadow_level: contrast below which cast shadows could be taken for strings (0: nowhere), and
    shade: on which side they could up to a higher one.
    start_px, end_px: s between which strings may lie. connector_px: s of the connector's face,
    NaN when out of view. legs_seen: whether the separator's side was decided by the legs.
    some_dim: whether strands may lie in their own bundle's shadow. sunk: on which side limbs are
    darker than their ground, +1 where n is larger, -1 where it is smaller, 0 on neither; None as
    long as every picture is asked for itself. faint_tone: contrast of the
    fainter strands of two brightnesses, of the brighter ones' (1: all are about alike).
    core_share: contrast of the core of the ground's light, in the frames that show it (0: unknown).
    colours: linear, blue, green, red (3,), of strings and of ground; None where they are not known.
    """

    axis: Axis
    signal: Signal
    sense: int
    width_px: float
    start_px: float
    end_px: float
    connector_px: float
    legs_seen: bool
    separation: float
    gamma: float
    shadow_level: float = 0.0
    shade: Shade = NO_SHADE
    some_dim: bool = True
    sunk: int | None = None
    faint_tone: float = 1.0
    core_share: float = 0.0
    colours: tuple[np.ndarray, np.ndarray] | None = None

    def reversed(self) -> Sight:
        """The same sight seen from the other end: s runs back, n changes its sign."""
        length = self.axis.length_px
        return replace(
            self,
            axis=self.axis.reversed(),
            start_px=length - self.end_px,
            end_px=length - self.start_px,
            connector_px=float("nan"),
            sunk=None if self.sunk is None else -self.sunk,
            shade=self.shade.reversed(),
        )


@dataclass(frozen=True)
class Told:
    """What is known of where to look before any picture is seen.

    roi_px: x, y, width, height. widths_px: smallest and largest bundle width that the rig makes
    possible. side: left | right | top | bottom | auto. along_px: two points on the axis, the
    separator's first, as a person gave them; the line is then only refined, not sought. least_px:
    what is thinner is a leg.
    """

    roi_px: tuple[int, int, int, int] | None = None
    widths_px: tuple[float, float] | None = None
    gamma: float = float("nan")
    side: str = "auto"
    along_px: tuple[tuple[float, float], ...] = ()
    least_px: float = 0.0


def find_sight(pictures: list[np.ndarray], told: Told = Told()) -> Sight | None:
    """Look at some frames of one recording (same size) and find what stands still: the likeliest of
    `find_sights`, None when no bundle is in view."""
    return next(find_sights(pictures, told), None)


def find_sights(pictures: list[np.ndarray], told: Told) -> Iterator[Sight]:
    """Where a bundle may lie in some frames of one recording (same size), likeliest first.

    pictures: uint8/uint16, grey or BGR.
    """
    roi_px, widths_px, least_px = told.roi_px, told.widths_px, told.least_px
    if min(*pictures[0].shape[:2], *(roi_px[2:] if roi_px else ())) < FEWEST_PX:
        return
    # Not the ends: a film that winds and unwinds begins and ends with hardly a turn, legs alone.
    few = [pictures[i] for i in sorted({len(pictures) * k // 4 for k in (1, 2, 3)})]
    ridges = find_ridges(few, roi_px, widths_px)
    motion = motion_picture(pictures)
    if motion is not None:
        ridges += moving_ridges(motion, pictures[0].shape[:2], roi_px, widths_px)
    elif least_px > 0.0:  # a cord of any make is sought by what it shows most of
        ridges += find_ridges(few, roi_px, widths_px, most=2, channels=hue_off_ground)
    if told.along_px:
        ridges = [given_ridge(told.along_px, ridges)]
    if not ridges:
        return
    shape = pictures[0].shape[:2]
    # Candidates are weighed on small pictures: only the winner is followed at full size.
    factor = min(1.0, SEARCH_PX / max(shape))
    small = [to_linear(shrunk(p, factor), told.gamma) for p in few]

    def tried(ridge: Ridge, beside: bool = len(small) > 1, **how: bool) -> Trial:
        axis = _scaled(line_of_ridge(ridge, shape, roi_px), factor)
        return put_to_trial(small, axis, ridge.width_px * factor, beside=beside, **how)

    # Of one colour first, which is the surer pair: few lines are tried of either kind.
    meeting = bisectors(ridges, shape) + bisectors(ridges, shape, one_colour=False)
    trials = [tried(r) for r in [*ridges, *dict.fromkeys(meeting)]]
    for times in LEGS_TO_BUNDLE:
        halfway = bisectors(ridges, shape, one_colour=False, times=times)
        trials += [tried(r, between=True) for r in halfway]
    for ridge in find_ridges(few, roi_px, widths_px, most=2, channels=unshaded):
        # Strings and the connector behind them make one ridge, as wide as that is.
        most = widths_px[1] if widths_px else np.inf
        trials.append(tried(replace(ridge, width_px=min(ridge.width_px, most)), by_hue=True))

    def merit(trial: Trial) -> float:
        support = trial.support * plausible(trial.width_px / factor, widths_px, least_px)
        if motion is not None:
            # Near its middle: beside a cable that lies by the strings something moves as well.
            across, size = 0.5 * trial.width_px, round(factor * max(shape))
            share = moving_share(trial.axis, across, motion, size)
            support *= float(np.clip(share / MOVING_SHARE, 0.02, 1.0))
        return support

    alone = [merit(t) for t in trials]
    # A hue may show but a plate. Cords that bow are followed anyhow.
    lit = max(own for trial, own in zip(trials, alone, strict=True) if not trial.by_hue)
    if least_px > 0.0 and lit < HARDLY * SEARCH_PX:
        again = find_ridges(few, roi_px, widths_px, most=2, channels=off_surroundings)
        if len(small) == 1:  # one picture does not tell the middle of a wide ridge
            again += ridges
        trials += [tried(r, beside=True) for r in again]
        alone = [merit(t) for t in trials]
    merits = [
        own if own >= _strongest_rival(trial, trials, alone) else 0.0
        for trial, own in zip(trials, alone, strict=True)
    ]
    for trial in _distinct(trials, merits):
        axis, width = _scaled(trial.axis, 1.0 / factor), trial.width_px / factor
        # A line that was turned may run on far beyond the view.
        inside = within_view(axis, shape, roi_px)
        axis = inside if inside.length_px < axis.length_px - width else axis
        there = replace(trial, axis=axis, width_px=width, support=trial.support / factor)
        yield _sight_along(pictures, there, told)


def _strongest_rival(trial: Trial, trials: list[Trial], merits: list[float]) -> float:
    """The greatest merit, as it counts against a line, of those whose leg, shadow, part or other
    colour that line may be; 0 where there is none."""
    against = [0.0]
    for other, merit in zip(trials, merits, strict=True):
        if any(are_legs(trial, third, other) for third in trials):
            against.append(merit / LEG_SHARE)
        if could_cast(trial, other):
            against.append(merit / CAST_SHARE)
        elif other.by_hue and could_cast(trial, other, farthest_d=np.inf):
            against.append(merit / AS_MUCH)
        if swallows(trial, other):
            against.append(merit / (AS_MUCH if other.by_hue else SWALLOWED_SHARE))
        if trial.by_hue and not other.by_hue and _alike(trial, other):
            against.append(merit / YIELDS)
    return max(against)


def _distinct(trials: list[Trial], merits: list[float]) -> Iterator[Trial]:
    """The likeliest line first, those left out that have come to lie where one before them does."""
    taken: list[Trial] = []
    for k in np.argsort(-np.array(merits), kind="stable"):
        if not any(_same(trials[k], other) for other in taken):
            taken.append(trials[k])
            yield trials[k]


def _same(trial: Trial, other: Trial) -> bool:
    """Whether two lines have come to lie in the same place, within half a width."""
    here, there = (t.axis.at(np.array([0.0, t.axis.length_px])) for t in (trial, other))
    apart = np.linalg.norm(here - there, axis=1).max()
    return bool(apart < 0.5 * min(trial.width_px, other.width_px))


def _alike(trial: Trial, other: Trial) -> bool:
    """Whether they have come to show about the same."""
    return _same(trial, other) and 1.0 / ALIKE < trial.width_px / other.width_px < ALIKE


def _sight_along(pictures: list[np.ndarray], trial: Trial, told: Told) -> Sight:
    """What is seen along a line in pictures of full size, where it is followed."""
    linears = [to_linear(p, told.gamma) for p in pictures]
    found, strips, seen = _followed(linears, trial)
    axis, width, between, half = found.axis, found.width_px, found.between, strips[0].half_px
    by_distance = seen.signal.by_distance
    sense = 1 if by_distance or core_of(strips, seen.signal, width, between) >= 0 else -1
    masks = seen.masks
    near, far = leg_spread(masks, half, width)
    legs = near != far
    flip = far > near if told.side == "auto" else _needs_flip(axis, told.side)
    if told.along_px:
        flip = bool(
            np.subtract(told.along_px[1], told.along_px[0]) @ axis.tangent(np.array(0.0)) < 0
        )
    shade = seen.shadow.shade
    if flip:
        axis, shade = axis.reversed(), shade.reversed()
        masks = [m[::-1, ::-1] for m in masks]
    start, end, connector = extent_of(masks, half, width)
    return Sight(
        axis=axis,
        signal=seen.signal,
        sense=sense,
        width_px=width,
        start_px=start,
        end_px=end,
        connector_px=connector,
        legs_seen=bool(legs),
        separation=seen.separation,
        gamma=told.gamma,
        shadow_level=seen.shadow.level,
        shade=shade,
        colours=colours_of(strips, 0.5 * width, between),
    )


def _followed(linears: list[np.ndarray], trial: Trial) -> Followed:
    """A line as what shows it best shows it. By light it may be led astray on pictures of full size
    only; then a hue that shows it better serves."""
    axis, width, between = trial.axis, trial.width_px, trial.between
    found, _, seen = followed = _follow(linears, axis, width, between, trial.by_hue)
    by_hue = None
    if not trial.by_hue and found.support < ASTRAY * trial.support:
        by_hue = _follow(linears, axis, width, between, by_hue=True)
        if by_hue[0].support > found.support:
            return by_hue
    # What a distance shows of several colours no weighted sum does, however well it stands out.
    plain = not (between or found.by_hue or seen.signal.by_distance)
    if not (plain and seen.separation < FEEBLE):
        return followed
    # Frames of few turns, which the line was told without, may show legs most of the way. Where
    # none are seen what stands out may be the connector, and nothing supports the line. At half its
    # width it may be what lies between crests.
    other, _, more = between_legs = _follow(linears, axis, width, True)
    shown = other.support > SUPPORTED * found.support and _alike(found, other)
    if not (shown and more.separation > TWICE * seen.separation):
        return followed
    # The brightest columns may be the connector's still, where a hue shows strings plainly.
    by_hue = by_hue or _follow(linears, axis, width, between, by_hue=True)
    plainer = by_hue[0].support > found.support and by_hue[2].separation > more.separation
    return by_hue if plainer else between_legs


def _follow(
    linears: list[np.ndarray], axis: Axis, width: float, between: bool, by_hue: bool = False
) -> Followed:
    """A line refined on all pictures, their strips along it, and what is seen there."""
    found = put_to_trial(linears, axis, width, turns=1, between=between, by_hue=by_hue)
    half = int(np.ceil(STRIP_WIDTHS * found.width_px)) + 6
    strips = [cut_strip(p, found.axis, (0.0, found.axis.length_px), half) for p in linears]
    hue = seen_by_hue(strips, found.width_px) if by_hue else None
    if hue is not None and _on_axis(hue) > IN_FEW:
        return found, strips, hue
    seen = seen_in(strips, found.width_px, False, between)
    if hue is not None and _on_axis(hue) > IN_FEW * _on_axis(seen):
        return found, strips, hue
    return found, strips, seen if is_told(seen) else seen_by_any(strips, found.width_px, between)


def _on_axis(seen: Seen) -> float:
    """Share of the line's columns where anything is seen on it, in the middle one of the strips."""
    return float(np.median([(mask[mask.shape[0] // 2] > 0).mean() for mask in seen.masks]))


def hue_along(sight: Sight, pictures: list[np.ndarray]) -> tuple[Signal, float]:
    """A hue that tells strings from their ground along the same line, and the separation in sd that
    it reaches; 0 where there is no colour."""
    strips = _strips_along(sight, (to_linear(p, sight.gamma) for p in pictures))
    return find_hue(strips, 0.5 * sight.width_px, between=True)


def cover_along(sight: Sight, pictures: list[np.ndarray]) -> tuple[Signal, float]:
    """A signal that tells by its colour how much of their ground strings cover, whatever light
    falls on them, and the separation in sd that it reaches; 0 where there is no colour."""
    strips = _strips_along(sight, (to_linear(p, sight.gamma) for p in pictures))
    return find_cover(strips, 0.5 * sight.width_px)


def _strips_along(sight: Sight, lights: Iterator[np.ndarray]) -> list[Strip]:
    """lights: one at a time, for large pictures in linear colour fill a memory."""
    half = int(np.ceil(STRIP_WIDTHS * sight.width_px)) + 6
    ends = sight.start_px, sight.end_px
    return [cut_strip(light, sight.axis, ends, half) for light in lights]


def seen_by(sight: Sight, pictures: list[np.ndarray], signal: Signal) -> Sight:
    """The same line in the same pictures, its strings told by another signal."""
    width = sight.width_px
    lights = (
        to_linear(p, sight.gamma)
        if signal.in_colour
        else linear_signal(p, signal.weights, sight.gamma)
        for p in pictures
    )
    strips = _strips_along(sight, lights)
    _, shadow = masks_of(strips, signal, width, rough=False)
    sense = 1 if core_of(strips, signal, width) >= 0 else -1
    return replace(
        sight, signal=signal, sense=sense, shadow_level=shadow.level, shade=shadow.shade,
        some_dim=True, sunk=None, faint_tone=1.0, core_share=0.0,
    )  # fmt: skip


def _scaled(axis: Axis, factor: float) -> Axis:
    """The axis in a picture resized by `factor` (pixel centres at integers)."""
    points = (axis.points_px + 0.5) * factor - 0.5
    return straight_axis(points[0], points[1])


def _needs_flip(axis: Axis, side: str) -> bool:
    u = axis.tangent(np.array(0.0))
    forward = {"left": u[0], "right": -u[0], "top": u[1], "bottom": -u[1]}
    return forward.get(side, 1.0) < 0.0
