"""Lines along which the bundle may lie, and how much speaks for each."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from tsvision.images.axis import Ridge, find_ridges
from tsvision.images.contrast import core_of
from tsvision.images.runs import leg_columns, refine, single_columns
from tsvision.images.seen import seen_by_hue, seen_in
from tsvision.images.strip import Axis, cut_strip, straight_axis

PARALLEL = 0.1  # sine of the angle between strings and their shadow on a ground beneath
CAST_D, CAST_SHARE = 4.0, 0.4  # widths beside them; what speaks for them over what for the shadow
SWALLOWED, SWALLOWED_SHARE = 1.8, 0.6  # widths of strings with their shadow; what speaks for them
BY_HUE, AS_MUCH = 1.3, 0.9  # the same beside strings by a hue, which shows no shadow
WITHIN = 0.25, 0.75  # of a line's length, between which it lies in another's run
APART = 1.5  # spreads between strings and ground from which nothing speaks against a line
# Angle of a leg to the bundle, rad; by how much the two may differ, of their mean, and how far
# apart they may cross it, in widths; what speaks for the bundle between over what for a leg.
LEG_RAD, MIRRORED, MEET_D, LEG_SHARE = (0.07, 1.0), 0.3, 2.0, 0.4
# Widths, in its legs', of the bundle that they go over into: where the strip is too narrow it holds
# legs beside ground, which looks like dark strings.
LEGS_TO_BUNDLE = (1.0, 1.6)
MOSTLY_LEGS = 0.5  # columns with legs for one with the bundle, where the axis runs between legs
# Times as wide as the other a leg may look at the size that ridges are sought at: of one colour,
# and of two, of which one may stand out less.
LEGS_ALIKE, LEGS_UNLIKE = 2.0, 3.0
SWINGS = 0.06  # share of a bundle's outline that changes between frames, at least


@dataclass(frozen=True)
class Trial:
    """A candidate axis, its width, how many columns speak for it, whether it is nothing but darker
    than the ground, as shadows are, whether it may run between legs most of the way, and whether it
    was followed by a hue alone."""

    axis: Axis
    width_px: float
    support: float
    darker: bool
    between: bool = False
    by_hue: bool = False


def put_to_trial(
    linears: list[np.ndarray],
    axis: Axis,
    width: float,
    turns: int = 3,
    between: bool = False,
    beside: bool = False,
    by_hue: bool = False,
) -> Trial:
    """Refine a candidate axis on some frames and say how much speaks for it.

    between: whether it may run between legs most of the way; beside: or beside the bundle at first;
    by_hue: whether to look by a hue alone, for a shadow close by misleads what is seen by light.

    What speaks for a bundle: columns with one run of its width on the axis, and beyond them
    columns with a leg on either side. A leg taken for the axis has neither behind the apex. A
    shadow's borders are soft, and what hardly differs from the ground is no bundle.
    """
    support = 0.0
    for turn in range(turns):
        half = int(np.ceil(3.2 * width)) + 6
        strips = [cut_strip(p, axis, (0.0, axis.length_px), half) for p in linears]
        if by_hue:
            seen = seen_by_hue(strips, width)
        else:
            seen = seen_in(strips, width, turn < turns - 1 and beside, between)
        masks = seen.masks
        if turn == turns - 1:
            support = sum(support_of(m, half, width, between) for m in masks) / len(masks)
            support *= _liveliness(masks, half, width) * (1.0 - seen.shadow.soft)
            support *= float(np.nan_to_num(np.clip(seen.separation / APART, 0.05, 1.0), nan=1.0))
            by_light = not seen.signal.in_colour
            darker = by_light and core_of(strips, seen.signal, width, between) < 0.0
        axis, width = refine(axis, masks, half, width)
    return Trial(axis, width, support, bool(darker), between, by_hue)


def could_cast(trial: Trial, other: Trial, farthest_d: float = CAST_D) -> bool:
    """Whether what is darker than the ground may be the shadow of something beside it, at most so
    many widths off, that is not: a shadow coils and knots as its strings do, and may stand out by
    more than they."""
    if not trial.darker or other.darker or not 0.5 < trial.width_px / other.width_px < 2.0:
        return False
    middle = other.axis.at(np.array([0.5 * other.axis.length_px]))[0]
    half = np.array([0.5 * trial.axis.length_px])
    along = trial.axis.tangent(half)[0]
    away = middle - trial.axis.at(half)[0]
    aside = abs(float(along[0] * away[1] - along[1] * away[0]))
    there = other.axis.tangent(np.array([0.0]))[0]
    turned = abs(float(along[0] * there[1] - along[1] * there[0]))
    return turned < PARALLEL and 0.8 * trial.width_px < aside < farthest_d * trial.width_px


def are_legs(trial: Trial, third: Trial, other: Trial) -> bool:
    """Whether two lines mirror each other about the other one: legs that outshine their bundle, of
    which a close-up of the separator shows little."""
    angles, places = [], []
    start, u = other.axis.at(np.array([0.0]))[0], other.axis.tangent(np.array([0.0]))[0]
    for line in (trial, third):
        if not 0.5 < line.width_px / other.width_px < 2.0:
            return False
        point, v = line.axis.at(np.array([0.0]))[0], line.axis.tangent(np.array([0.0]))[0]
        v = v if u @ v > 0.0 else -v
        angles.append(float(np.arctan2(u[0] * v[1] - u[1] * v[0], u @ v)))
        if not LEG_RAD[0] < abs(angles[-1]) < LEG_RAD[1]:
            return False
        along, _ = np.linalg.solve(np.stack([u, -v], axis=1), point - start)
        places.append(float(along))
    mirrored = abs(sum(angles)) < MIRRORED * 0.5 * abs(angles[0] - angles[1])
    return mirrored and abs(places[0] - places[1]) < MEET_D * other.width_px


def swallows(trial: Trial, other: Trial) -> bool:
    """Whether it is the other, much narrower, together with something beside it: strings and their
    shadow on a ground close behind make one run, twice as wide."""
    if trial.width_px < (BY_HUE if other.by_hue else SWALLOWED) * other.width_px:
        return False
    start = trial.axis.at(np.array([0.0]))[0]
    along = trial.axis.tangent(np.array([0.5 * trial.axis.length_px]))[0]
    # Not at the picture's borders: either line may be a little askew.
    within = other.axis.at(other.axis.length_px * np.array(WITHIN)) - start
    aside = np.abs(along[0] * within[:, 1] - along[1] * within[:, 0])
    return bool((aside < 0.5 * trial.width_px).all())


def _liveliness(masks: list[np.ndarray], half: int, width: float) -> float:
    """From about 0 for an outline that stands still between frames to 1 for one that swings as
    twisting strings do: a plate's edge or a rod is as long and even as a bundle, but still."""
    if len(masks) < 2:
        return 1.0
    reach = max(int(width), 2)
    stack = np.stack([m[max(half - reach, 0) : half + reach + 1] > 0 for m in masks])
    area = max(float(stack.mean(axis=0).sum()), 1.0)
    changed = float((stack.any(axis=0) & ~stack.all(axis=0)).sum()) / area
    return float(np.clip(changed / SWINGS, 0.05, 1.0))


def plausible(width: float, possible: tuple[float, float] | None, least_px: float) -> float:
    """1 for a width that the rig's strings can have, less for one they cannot (d is rarely known
    to better than a third) and for one below `least_px`, which is 0 where nothing is known."""
    if width < least_px:
        return 0.1
    if possible is None:
        return 1.0
    low, high = 0.6 * possible[0], 1.4 * possible[1]
    return 1.0 if low <= width <= high else 0.1


def support_of(mask: np.ndarray, half: int, width: float, between: bool = False) -> float:
    single = single_columns(mask, half, width)
    legs = leg_columns(mask, half, width)
    middle = np.median(np.flatnonzero(single)) if single.any() else 0.0
    s = np.arange(mask.shape[1])
    one_end = max(legs[s < middle].sum(), legs[s >= middle].sum())
    if between and one_end < MOSTLY_LEGS * single.sum():
        return 0.0  # it does not
    return float(single.sum() + 2.0 * one_end)


def line_of_ridge(ridge: Ridge, shape: tuple[int, int], roi) -> Axis:
    """The ridge's line across the picture (or the region), from left to right or top to bottom."""
    u = np.array([np.cos(ridge.angle_rad), np.sin(ridge.angle_rad)])
    along_x = abs(u[0]) > 0.5
    if (u[0] if along_x else u[1]) < 0:
        u = -u
    return _clip_line(np.array(ridge.centre_px), u, shape, roi)


def within_view(axis: Axis, shape: tuple[int, int], roi) -> Axis:
    """The straight axis' line from where it enters the picture (or the region) to where it leaves
    it; the axis as it is where its middle lies outside."""
    middle = axis.at(np.array([0.5 * axis.length_px]))[0]
    x0, y0, w, h = _view(shape, roi)
    if not (x0 <= middle[0] < x0 + w and y0 <= middle[1] < y0 + h):
        return axis
    return _clip_line(middle, axis.tangent(np.array([0.0]))[0], shape, roi)


def _view(shape: tuple[int, int], roi) -> tuple[float, float, float, float]:
    """x, y, width and height of the region, or of the whole picture."""
    return roi if roi else (0, 0, shape[1], shape[0])


def _clip_line(point: np.ndarray, u: np.ndarray, shape: tuple[int, int], roi) -> Axis:
    x0, y0, w, h = _view(shape, roi)
    low, high = -np.inf, np.inf
    for i, (a, b) in enumerate(((x0, x0 + w - 1), (y0, y0 + h - 1))):
        if abs(u[i]) < 1e-12:
            continue
        t = sorted(((a - point[i]) / u[i], (b - point[i]) / u[i]))
        low, high = max(low, t[0]), min(high, t[1])
    return straight_axis(point + low * u, point + high * u)


def bisectors(
    ridges: list[Ridge], shape: tuple[int, int], one_colour: bool = True, times: float = 1.0
) -> list[Ridge]:
    """Lines halfway between two crossing ridges of about one width, `times` as wide: with few turns
    the legs outshine the bundle, and the bundle goes on where they meet, between them."""
    lines: list[Ridge] = []
    for i, a in enumerate(ridges):
        for b in ridges[:i]:
            ua = np.array([np.cos(a.angle_rad), np.sin(a.angle_rad)])
            ub = np.array([np.cos(b.angle_rad), np.sin(b.angle_rad)])
            if ua @ ub < 0:
                ub = -ub
            opening = float(np.arccos(np.clip(ua @ ub, -1.0, 1.0)))
            most = LEGS_ALIKE if one_colour else LEGS_UNLIKE
            alike = 1.0 / most < a.width_px / b.width_px < most
            alike = alike and (not one_colour or a.channel == b.channel)
            if not alike or opening < np.deg2rad(8.0):
                continue
            t, _ = np.linalg.solve(
                np.stack([ua, -ub], 1), np.array(b.centre_px) - np.array(a.centre_px)
            )
            meet = np.array(a.centre_px) + t * ua
            if not (0 <= meet[0] < shape[1] and 0 <= meet[1] < shape[0]):
                continue
            middle = ua + ub
            angle = float(np.arctan2(middle[1], middle[0]))
            width = times * 0.5 * (a.width_px + b.width_px)
            lines.append(
                Ridge((float(meet[0]), float(meet[1])), angle, width, a.sense, a.channel, 0.0)
            )
    return lines[:3]


def moving_ridges(
    motion: np.ndarray,
    shape: tuple[int, int],
    roi_px: tuple[int, int, int, int] | None,
    widths_px: tuple[float, float] | None,
) -> list[Ridge]:
    """Lines along which a film moves, as ridges of its pictures."""
    big = cv2.resize(motion, (shape[1], shape[0]), interpolation=cv2.INTER_LINEAR)
    return [r for r in find_ridges([big], roi_px, widths_px, most=3) if r.sense > 0]


def given_ridge(along_px: tuple[tuple[float, float], ...], found: list[Ridge]) -> Ridge:
    """The line through two given points, as wide as the found ridge that lies nearest to it."""
    (x0, y0), (x1, y1) = along_px
    length = float(np.hypot(x1 - x0, y1 - y0))
    u = np.array([x1 - x0, y1 - y0]) / length

    def away(ridge: Ridge) -> float:
        d = np.array(ridge.centre_px) - (x0, y0)
        turn = abs(np.sin(ridge.angle_rad - np.arctan2(u[1], u[0])))
        return float(abs(u[0] * d[1] - u[1] * d[0]) + 0.5 * length * turn)

    near = min(found, key=away, default=None)
    wide = near.width_px if near is not None and away(near) < 0.1 * length else 0.02 * length
    centre = (0.5 * (x0 + x1), 0.5 * (y0 + y1))
    return Ridge(centre, float(np.arctan2(u[1], u[0])), wide, 1, 0, 0.0)
