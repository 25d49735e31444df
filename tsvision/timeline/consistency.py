"""Do the pictures follow the turn counts at all?

Turns given to the wrong frames (a reversed folder, a shuffled table) would give a precise and
wrong onset. The twist seen in the pictures rises with the turns, whatever else happens; where it
does not, no onset is told.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
from scipy.stats import spearmanr

from tsvision.records import Onset, Rig
from tsvision.timeline import evidence as speak
from tsvision.timeline.chain import Histories
from tsvision.timeline.criteria import Criteria
from tsvision.timeline.lengths import in_diameters
from tsvision.timeline.order import Order, numbers
from tsvision.timeline.repeats import extent_in_diameters

RISING = (
    ("turns_seen", 1),
    ("string_length_mm", 1),
    ("pitch_px", -1),
    ("unevenness", 1),
)
RISING_LENGTHS = ("coil_amplitude", "baseline_envelope")
TWISTED_TURNS = 3.0
LEAST_SEEN = 0.3
MOST_BLUR = 0.38  # sd over a string's diameter: strings side by side then differ by 6 % of contrast
LEAST_OF_SOLID = 0.7  # scale, edges and hard light may be off by so much, not by more
MOST_OF_RING = 1.6
LEAST_FRAMES = 8  # of which a series that does not follow tells against the turns
# Of fewer one in 700 would follow so well by chance: they may tell for them.
FEWEST_FRAMES, FEW_RANK_CORRELATION = 6, 0.95
LEAST_TURNS = 5.0
LEAST_RANK_CORRELATION = 0.4
CHANCE_SDS = 2.6  # a shuffled series of n frames correlates by 1 / sqrt(n - 1), one sd
MOST_AGAINST = 0.3
MISCOUNT = 0.2  # relative; the count of turns in one view is a tenth off at most
MISCOUNT_SPREAD = 0.12  # relative; more says that the strands are misread, not the turns
LEAST_COUNTED_TURNS = 2.5
STRONG = 2.0
LEAST_TWISTED = 0.3  # tan of the mean helix angle below which no bundle under load coils; the
# paper's begin to at 1.1 to 1.3


def mismatch(frames: pd.DataFrame, order: Order, rig: Rig = Rig()) -> str:
    """A reason not to believe the turn counts, or "" where the pictures agree with them."""
    given = order.known & np.isfinite(order.wind)
    if given.sum() < 0.5 * len(frames):
        return f"the turns of {len(frames) - int(given.sum())} of {len(frames)} frames are unknown"
    unseen = not_the_strings(frames, order, rig) or _not_of_their_width(frames, rig)
    if unseen:
        return unseen
    followed, ranks = _following(frames, order, given)
    if followed or not ranks:
        return ""
    how = "fall" if any(rank <= -least for rank, least in ranks) else "do not follow"
    return (
        f"the twist and coiling in the pictures and the turn counts disagree "
        f"(the pictures {how} where the turns rise): are the frames in the right order?"
    )


def _following(
    frames: pd.DataFrame, order: Order, given: np.ndarray
) -> tuple[bool, list[tuple[float, float]]]:
    """Whether anything that rises with the turns does follow them, and of what is seen often enough
    the rank correlation and what chance could reach at most. One that does is enough: any of them
    can be misread for a whole stretch (a wrong harmonic of the strands) or be level (no coiling
    yet)."""
    series = [(numbers(frames, column), sign) for column, sign in RISING]
    series += [(in_diameters(frames, name, frames), 1) for name in RISING_LENGTHS]
    ranks, followed = [], False
    for values, sign in series:
        seen = np.abs(values[order.rows])
        both = np.isfinite(seen) & given
        if both.sum() < FEWEST_FRAMES or np.ptp(order.wind[both]) < LEAST_TURNS:
            continue
        if np.ptp(seen[both]) == 0:
            continue
        rank = float(spearmanr(order.wind[both], sign * seen[both]).statistic)
        if both.sum() < LEAST_FRAMES:
            followed |= rank >= FEW_RANK_CORRELATION
            continue
        by_chance = min(CHANCE_SDS / np.sqrt(both.sum() - 1), 0.85)
        ranks.append((rank, max(LEAST_RANK_CORRELATION, float(by_chance))))
    return followed or any(rank >= least for rank, least in ranks), ranks


def miscounted(frames: pd.DataFrame, order: Order, criteria: Criteria = Criteria()) -> str:
    """A note where the straight bundle shows another number of turns than was given: frames that
    are missing from a film without turn counts of its own, or a count of something else."""
    straight = speak.ratio_of(frames, "coil_amplitude") < criteria.coil_ratio
    seen = np.where(straight, numbers(frames, "turns_seen"), np.nan)[order.rows]
    good = order.known & np.isfinite(seen) & (order.wind >= LEAST_COUNTED_TURNS)
    if good.sum() < 4:
        return ""
    share = np.abs(seen[good]) / order.wind[good]
    middle = float(np.median(share))
    spread = 1.4826 * float(np.median(np.abs(share - middle)))
    if abs(middle - 1.0) < MISCOUNT or spread > MISCOUNT_SPREAD:
        return ""
    return (
        f"the pictures show {middle:.2f} times the turns given: are frames missing, or do the turn "
        "counts belong to something else?"
    )


def too_early(frames: pd.DataFrame, coiling: Onset) -> str:
    """A reason where coiling is told before the bundle is twisted at all: what was read as a swing
    of its centre line is the strands themselves, or edges that jump."""
    if coiling.status != "observed" or coiling.high is None:
        return ""
    tangent = np.pi * abs(coiling.high) / extent_in_diameters(frames)
    if tangent >= LEAST_TWISTED:
        return ""
    return (
        f"coiling is read from {abs(coiling.high):.3g} turns on, before the strings are twisted "
        "enough to coil: their edges are not seen well"
    )


def not_the_strings(frames: pd.DataFrame, order: Order, rig: Rig) -> str:
    """A reason to believe that nothing in these frames was read off the strings, or ""."""
    return _no_twist_seen(frames, order) or _as_soft_as_a_shadow(frames, rig)


def _as_soft_as_a_shadow(frames: pd.DataFrame, rig: Rig) -> str:
    """A reason where the edges are so blurred that strings of diameter d cannot be told apart. The
    shadow that a bundle casts coils and knots as it does, shows no strands, and is soft."""
    string_px = rig.strings.diameter_mm / numbers(frames, "mm_per_px")
    soft = numbers(frames, "blur_px") / string_px
    soft = soft[np.isfinite(soft)]
    if len(soft) < 3 or np.median(soft) <= MOST_BLUR:
        return ""
    return (
        f"the edges that were measured are blurred over {float(np.median(soft)):.2g} of a string's "
        "diameter, in which no strings can be told apart: look at the overlay whether it is the "
        "bundle and not its shadow, and give view.roi_px if not"
    )


def _no_twist_seen(frames: pd.DataFrame, order: Order) -> str:
    """A reason where hardly any frame shows a twist that must be there: then something else than
    the bundle was measured, and its silence about knots means nothing."""
    there = [name for name in ("pitch_px", "pitch_mm", "turns_seen") if name in frames]
    if not there:
        return ""
    wound = speak.measured(frames)[order.rows] & (order.wind >= TWISTED_TURNS)
    seen = np.any([np.isfinite(numbers(frames, name)) for name in there], axis=0)[order.rows]
    if wound.sum() < LEAST_FRAMES or seen[wound].mean() >= LEAST_SEEN:
        return ""
    return (
        f"the strings' twist was recognised in only {int(seen[wound].sum())} of "
        f"{int(wound.sum())} frames: look at the overlay whether it is the bundle that was "
        "measured, and give view.roi_px if not"
    )


def _not_of_their_width(frames: pd.DataFrame, rig: Rig) -> str:
    """A reason where the measured D is none that N strings of diameter d can make."""
    count, string = rig.strings.count, rig.strings.diameter_mm
    diameters = numbers(frames, "diameter_mm")
    diameters = diameters[np.isfinite(diameters)]
    if count is None or count < 2 or not np.isfinite(string) or len(diameters) < 3:
        return ""
    ring = string * (1.0 + 1.0 / np.sin(np.pi / count))  # the widest tight section there is
    solid = string * np.sqrt(count)  # all string and no air: the thinnest
    measured = float(np.median(diameters))
    if LEAST_OF_SOLID * solid <= measured <= MOST_OF_RING * ring:
        return ""
    return (
        f"D = {measured:.3g} mm was measured, which {count} strings of {string:.3g} mm cannot "
        f"make ({solid:.2g} to {ring:.2g} mm): look at the overlay whether it is the bundle, "
        "and mend the scale or give view.roi_px"
    )


def disorder(histories: Histories, evidence: np.ndarray, seen: np.ndarray) -> float:
    """Share of the measured frames that speak strongly against what the whole series says."""
    strong = seen & (np.abs(evidence) >= STRONG)
    if strong.sum() < LEAST_FRAMES:
        return 0.0
    against = (evidence[strong] > 0) != (histories.there[strong] > 0.5)
    return float(against.mean())
