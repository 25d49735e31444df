"""What the page says in words and tables: onsets, uncertainties, flags, provenance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from tsvision.flags import MEANING
from tsvision.records import FrameRow
from tsvision.report.palette import phase_key
from tsvision.report.wording import ONSET_NAMES, UNKNOWN, onset_sentence, plain, with_sd

# label, column, sd column, unit, factor from the table's unit to the page's
QUANTITIES: tuple[tuple[str, str, str, str, float], ...] = (
    ("outer diameter D", "diameter_mm", "diameter_mm_sd", "mm", 1.0),
    ("outer diameter D", "diameter_px", "diameter_px_sd", "px", 1.0),
    ("pitch p", "pitch_mm", "pitch_mm_sd", "mm", 1.0),
    ("pitch p", "pitch_px", "pitch_px_sd", "px", 1.0),
    ("helix angle β", "helix_angle_rad", "helix_angle_rad_sd", "°", math.degrees(1)),
    ("lay angle", "lay_angle_rad", "lay_angle_rad_sd", "°", math.degrees(1)),
    ("mid-span diameter", "midspan_diameter_mm", "midspan_diameter_mm_sd", "mm", 1.0),
    ("turns seen in the picture", "turns_seen", "turns_seen_sd", "turns", 1.0),
    ("string length in the zone", "string_length_mm", "string_length_mm_sd", "mm", 1.0),
    ("scale", "mm_per_px", "mm_per_px_sd", "mm/px", 1.0),
)
_MORE: tuple[tuple[str, str, str], ...] = (
    ("coil amplitude A", "coil_amplitude_mm", "mm"),
    ("unevenness of E(s)", "unevenness", ""),
    ("turn budget error", "turn_budget_error", ""),
    ("strand repeat", "strand_repeat_px", "px"),
    ("measured displacement", "displacement_mm", "mm"),
    ("load", "load_N", "N"),
)


def frame_card(row: FrameRow) -> list[tuple[str, str]]:
    """(label, text) of what is known about one frame."""
    card = [("file", row.file), ("phase", phase_key(row.phase).replace("_", " ") or UNKNOWN)]
    for label, name, sd, unit, factor in QUANTITIES:
        value = getattr(row, name) * factor
        if math.isfinite(value) and label not in dict(card):  # px only where mm are unknown
            card.append((label, with_sd(value, getattr(row, sd) * factor, unit)))
    if row.handedness:
        card.append(("handedness", row.handedness))
    for label, name, unit in _MORE:
        value = getattr(row, name)
        if math.isfinite(value):
            card.append((label, with_sd(value, None, unit)))
    card.append(("knots", plain(row.knot_count)))
    return card


def onset_lines(summary: dict[str, Any]) -> list[tuple[str, str, str]]:
    """(name, sentence, reason) for each onset of the summary, in the order of the phases."""
    names = [n for n in ONSET_NAMES if isinstance(summary.get(n), dict)]
    reasons = summary.get("onset_reasons") or {}
    return [
        (ONSET_NAMES[n], onset_sentence(n, summary[n]), str(reasons.get(n) or "")) for n in names
    ]


def safe_sentence(summary: dict[str, Any]) -> str:
    """How far one can wind before the first knot can have begun; "" where that is not told."""
    safe = summary.get("safe") or {}
    if safe.get("turns") is None:
        return ""
    parts = [f"{plain(float(safe['turns']))} turns"]
    if safe.get("displacement_mm") is not None:
        parts.append(f"{plain(float(safe['displacement_mm']))}\u202fmm")
    if safe.get("contraction_percent") is not None:
        parts.append(f"{plain(float(safe['contraction_percent']))}\u202f% contraction")
    return f"Before that, safe at least up to {', '.join(parts)}."


def uncertainty_lines(frames: pd.DataFrame) -> list[tuple[str, str, str, str, str, str, int]]:
    """(quantity, median, median sd, smallest to largest sd, share of the value, the scale's share
    of the variance, frames)."""
    scale = frames[["mm_per_px", "mm_per_px_sd"]].to_numpy(float)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale_share = scale[:, 1] / scale[:, 0]
    lines = []
    for label, name, sd_name, unit, factor in QUANTITIES:
        value, sd = (frames[[name, sd_name]].to_numpy(float) * factor).T
        good = np.isfinite(value)
        if not good.any():
            continue
        sds = sd[good & np.isfinite(sd)]
        middle = float(np.median(value[good]))
        if not len(sds):
            text = ("not computed", UNKNOWN, UNKNOWN, UNKNOWN)
        else:
            typical = float(np.median(sds))
            span = f"{sds.min():.2g} to {sds.max():.2g}"
            share = f"{100 * typical / abs(middle):.2g}\u202f%" if middle else UNKNOWN
            text = (f"{typical:.2g}", span, share, _from_scale(value * scale_share, sd, unit))
        lines.append((label, with_sd(middle, None, unit), *text, int(good.sum())))
    return lines


def _from_scale(part: np.ndarray, sd: np.ndarray, unit: str) -> str:
    """The scale's share of the variance of a length in mm, in the median over the frames."""
    good = np.isfinite(part) & np.isfinite(sd) & (sd > 0)
    if unit != "mm" or not good.any():
        return UNKNOWN
    share = float(np.median(np.minimum((part[good] / sd[good]) ** 2, 1.0)))
    return f"{100 * share:.2g}\u202f%"


def flag_lines(frames: pd.DataFrame) -> list[tuple[str, str, int, str]]:
    """(flag, why, number of frames, which) for each flag that was raised, commonest first."""
    raised: dict[str, list[int]] = {}
    for frame, text in zip(frames["frame"], frames["flags"], strict=True):
        for name in filter(None, str(text or "").split("|")):
            if name != "nan":
                raised.setdefault(name, []).append(int(frame))
    lines = [
        (name, MEANING.get(name, "(not in the list of this version)"), len(which), ranges(which))
        for name, which in raised.items()
    ]
    return sorted(lines, key=lambda line: -line[2])


def ranges(numbers: Sequence[int]) -> str:
    """1, 2, 3, 7 to `1–3, 7`; a long list ends in `…`."""
    runs: list[list[int]] = []
    for n in sorted(numbers):
        if runs and n == runs[-1][1] + 1:
            runs[-1][1] = n
        else:
            runs.append([n, n])
    texts = [f"{a}" if a == b else f"{a}–{b}" for a, b in runs]
    return ", ".join(texts[:12]) + (", …" if len(texts) > 12 else "")


def frame_lines(frames: pd.DataFrame, in_px: bool, most: int = 400) -> list[list[str]]:
    """The table of frames as text; evenly thinned when there are more than `most`."""
    unit = "px" if in_px else "mm"
    chosen = np.unique(np.linspace(0, len(frames) - 1, min(most, len(frames))).round().astype(int))
    degrees = math.degrees(1)
    lines = []
    for _, r in frames.iloc[chosen].iterrows():
        lines.append(
            [
                f"{r['frame']}",
                str(r["file"]),
                plain(r["turns"]),
                phase_key(r["phase"] or "").replace("_", " "),
                with_sd(r[f"diameter_{unit}"], r[f"diameter_{unit}_sd"]),
                with_sd(r[f"pitch_{unit}"], r[f"pitch_{unit}_sd"]),
                with_sd(r["helix_angle_rad"] * degrees, r["helix_angle_rad_sd"] * degrees),
                str(r["handedness"] or ""),
                plain(r["knot_count"]),
                plain(r["turn_budget_error"]),
                str(r["flags"] or "").replace("|", " "),
            ]
        )
    return lines


def rig_lines(rig: dict[str, Any]) -> list[tuple[str, str]]:
    """(key, text) of everything known of the rig."""
    return [(k, plain(v) if isinstance(v, float) else str(v)) for k, v in rig.items()]
