"""Do D and beta beside the separator stay as they are while the bundle overtwists?

The paper says so, and models the bundle by one radius. That no change was found says nothing unless
one that matters would have been found. So this is a test of equivalence (two one-sided tests,
Schuirmann 1987): a value is constant where the whole 90 % interval of its change, along a straight
line in the turns from the first overtwisted frame to the last, lies within a margin; it changes
where its 95 % interval leaves out 0 and the other does not lie within. Else the recording is not
enough, and the smallest change that it would have shown, in four of five such recordings, says why.

Neighbouring frames are off together: their correlation widens the interval. What light and scale
are unsure of is the same in all frames and changes nothing; what coils lead a fit astray by depends
on how wide they are, and may.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
import pandas as pd
from scipy import stats

from tsvision.measures.helix.uncertainty import BENT_DIAMETER, BENT_PITCH
from tsvision.measures.numeric.line import line_through
from tsvision.timeline.evidence import flagged
from tsvision.timeline.order import numbers

OVERTWISTED = ("overtwist", "local overtwist")  # knots pull at what lies beside them
# No measurements of the strands here: what frames before told stands for them, or the outline.
NOT_OF_THIS_FRAME = ("COIL_UNEVEN", "ENVELOPE_ONLY", "COIL_UNSURE")
MARGIN_PERCENT, MARGIN_DEG = 5.0, 2.0  # a caliper's, and as much of beta
LEAST_FRAMES, LEAST_TURNS = 6, 2.0
# Of D and of the pitch, by which a coil leads strands astray as it widens from a tenth of D to two
# thirds (own renderer, two strands: D comes out 1.3 % thin first and 2 % thick in the end).
COIL_DIAMETER, COIL_PITCH = 0.025, 0.015
BENT_CHANGES = 0.5  # of what a bend leads more than two strands astray by, that comes with it
FITTED, HUBER = 3, 1.345  # times, and spreads beyond which a frame counts less the next time
MOST_ALIKE = 0.9  # correlation of neighbouring frames: more is a curve, not scatter
LEVEL, ONE_SIDED, POWER = 0.95, 0.95, 0.8


@dataclass(frozen=True)
class Constancy:
    """One quantity beside the separator, from the first turns to the last. status: constant,
    changes or undetermined; change, its sd, low and high (level 0.95), margin and the smallest
    change that would have been seen in its unit."""

    quantity: str
    unit: str
    status: str
    frames: int
    first_turns: float | None = None
    last_turns: float | None = None
    change: float | None = None
    sd: float | None = None
    low: float | None = None
    high: float | None = None
    margin: float | None = None
    detectable: float | None = None
    level: float = LEVEL


def near_separator(frames: pd.DataFrame) -> dict[str, object]:
    """Both, as plain values by the quantity's name. `frames`: the final table, phases told."""
    counts = numbers(frames, "strand_count")
    thick = bool(np.nanmedian(counts) > 2) if np.isfinite(counts).any() else True
    d = np.hypot(COIL_DIAMETER, BENT_CHANGES * BENT_DIAMETER if thick else 0.0)
    pitch = np.hypot(COIL_PITCH, BENT_CHANGES * BENT_PITCH if thick else 0.0)
    beta = numbers(frames, "helix_angle_rad")
    both = [
        _tested("diameter", "%", frames, 100.0 * np.log(_diameter(frames)), 100.0 * d),
        _tested(
            "helix_angle",
            "deg",
            frames,
            np.degrees(beta),
            float(np.degrees(np.hypot(d, pitch) * 0.5 * np.sin(2.0 * _typical(beta)))),
        ),
    ]
    return {each.quantity: asdict(each) for each in both}


def constancy_in_words(told: dict[str, dict[str, object]]) -> list[str]:
    """One sentence a quantity that was tested."""
    return [_sentence(each) for each in told.values() if each["change"] is not None]


def _diameter(frames: pd.DataFrame) -> np.ndarray:
    """In px, in which a scale's error changes nothing; NaN where there is none."""
    px = numbers(frames, "diameter_px")
    return np.asarray(np.where(px > 0.0, px, np.nan))


def _typical(values: np.ndarray) -> float:
    return float(np.nanmedian(values)) if np.isfinite(values).any() else 0.0


def _tested(
    name: str, unit: str, frames: pd.DataFrame, values: np.ndarray, coil_sd: float
) -> Constancy:
    turns = np.abs(numbers(frames, "turns"))
    phases = frames["phase"].astype(str).str.replace("_", " ").isin(OVERTWISTED).to_numpy()
    good = phases & np.isfinite(turns) & np.isfinite(values) & ~flagged(frames, *NOT_OF_THIS_FRAME)
    count = int(good.sum())
    margin = MARGIN_PERCENT if unit == "%" else MARGIN_DEG
    if count < LEAST_FRAMES or np.ptp(turns[good]) < LEAST_TURNS:
        return Constancy(name, unit, "undetermined", count, margin=margin)
    x, y = turns[good], values[good]
    change, own_sd, freedom = _along_a_line(x, y)
    sd = float(np.hypot(own_sd, coil_sd))
    freedom *= (sd / max(own_sd, 1e-12)) ** 4  # Welch-Satterthwaite; the coil's share has no end
    half = float(stats.t.ppf(0.5 + 0.5 * LEVEL, freedom)) * sd
    inside = abs(change) + float(stats.t.ppf(ONE_SIDED, freedom)) * sd < margin
    status = "constant" if inside else "changes" if abs(change) > half else "undetermined"
    seen = half + float(stats.t.ppf(POWER, freedom)) * sd
    ends = float(x.min()), float(x.max())
    return Constancy(
        name, unit, status, count, *ends, change, sd, change - half, change + half, margin, seen
    )


def _along_a_line(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float]:
    """Change of y (n,) from the least x (n,) to the largest, its sd and degrees of freedom, with
    residuals that are alike from each to the next; outliers count less (Huber's weights)."""
    order = np.argsort(x, kind="stable")
    x, y = x[order], y[order]
    weight, slope, off = np.ones(x.size), 0.0, y
    for _ in range(FITTED):
        constant, slope = line_through(x, y, weight)
        off = y - constant - slope * x
        spread = max(1.4826 * float(np.median(np.abs(off))), 1e-9)
        weight = np.minimum(1.0, HUBER * spread / np.maximum(np.abs(off), 1e-12))
    variance = float((weight * off**2).sum()) / max(weight.sum() - 2.0, 1.0)
    alike = float((off[1:] * off[:-1]).sum() / max((off**2).sum(), 1e-18))
    alike = min(max(alike + 1.0 / x.size, 0.0), MOST_ALIKE)  # a short series' own is biased low
    worth = (1.0 - alike) / (1.0 + alike)
    span = float(np.ptp(x))
    own = variance / float((weight * (x - x.mean()) ** 2).sum())
    sd = span * float(np.sqrt(own / worth))
    return float(slope) * span, sd, max(worth * x.size - 2.0, 2.0)


def _sentence(told: dict[str, object]) -> str:
    unit = "\u202f%" if told["unit"] == "%" else "°"
    name = "D" if told["quantity"] == "diameter" else "β"
    verdict = {
        "constant": f"constant within {told['margin']:g}{unit}",
        "changes": "not constant",
        "undetermined": f"not enough to say whether it stays within {told['margin']:g}{unit}",
    }[str(told["status"])]
    text = (
        f"{name} beside the separator changes by {told['change']:+.2g}{unit} "
        f"({told['low']:+.2g} to {told['high']:+.2g}) from {told['first_turns']:.4g} to "
        f"{told['last_turns']:.4g} turns: {verdict}; a change of {told['detectable']:.2g}{unit} "
        "would have been seen"
    )
    return text.replace("-", "\u2212")
