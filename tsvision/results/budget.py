"""Where each stated uncertainty comes from, the GUM's way: one line a source, squares add up.

What comes from the picture and what from the scale are told apart,

    u²(D_mm) = (mm_per_px · u(D_px))² + (D_px · u(mm_per_px))²,   the pitch likewise,
    u²(β)    = (sin β cos β)² [ (u(D_px)/D_px)² + (u(p_px)/p_px)² ],   from tan β = π D / p,

in which the scale drops out; of a diameter that a helix tells, also what in the picture it comes
from. A remainder is told as such and not spread over the others.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from tsvision.atomic import write_text

COLUMNS = ("frame", "quantity", "unit", "value", "source", "sd", "share_percent")
_PICTURE = "picture (edges, blur, shading, fit)"
_IN_THE_PICTURE = {
    "noise": "picture: noise of the edges",
    "light": "picture: light at the limbs",
    "blur": "picture: blur at the limbs",
    "section": "picture: how the strands lie",
}
_SCATTER = "picture: scatter about the frames beside it"
_REMAINDER = "other (as stated less the above)"
LEAST_SHARE = 0.01  # of a stated uncertainty: a remainder below is none


def budget_table(frames: pd.DataFrame) -> pd.DataFrame:
    """One row a frame, quantity and source: `sd` in the quantity's unit, its share of the variance.

    `frames` has FrameRow's columns; frames without a value give no rows.
    """
    parts = [
        _lengths(frames, "diameter", "bundle diameter", _of_diameter(frames)),
        _lengths(frames, "pitch", "pitch", {_PICTURE: _numbers(frames, "pitch_px_sd")}),
        _angle(frames),
    ]
    table = pd.concat(parts, ignore_index=True)
    return table.sort_values("frame", kind="stable", ignore_index=True)[list(COLUMNS)]


def typical_budget(table: pd.DataFrame) -> pd.DataFrame:
    """The median over frames of each quantity and source: what to show a person."""
    if table.empty:
        return table.drop(columns="frame")
    grouped = table.groupby(["quantity", "unit", "source"], sort=False)
    return grouped[["value", "sd", "share_percent"]].median().reset_index()


def write_budget(folder: Path, frames: pd.DataFrame) -> Path:
    """budget.csv of a measured recording, at once."""
    path = folder / "budget.csv"
    write_text(path, budget_table(frames).to_csv(index=False, lineterminator="\n"))
    return path


def _of_diameter(frames: pd.DataFrame) -> dict[str, np.ndarray]:
    """What in the picture makes a diameter unsure, px: by source where a helix tells it (the parts
    are NaN elsewhere), as one where nothing else does."""
    whole = _numbers(frames, "diameter_px_sd")
    parts = {
        words: _numbers(frames, f"diameter_px_sd_{source}")
        for source, words in _IN_THE_PICTURE.items()
    }
    told = np.sqrt(sum(sd**2 for sd in parts.values()))
    parts[_SCATTER] = _left(whole, told)
    parts[_PICTURE] = np.where(np.isfinite(told), np.nan, whole)
    return parts


def _left(stated: np.ndarray, told: np.ndarray) -> np.ndarray:
    """What of stated uncertainties is left beside those told, NaN where that is nothing."""
    rest = np.sqrt(np.clip(stated**2 - told**2, 0.0, None))
    return np.where(rest < LEAST_SHARE * stated, np.nan, rest)


def _lengths(
    frames: pd.DataFrame, name: str, quantity: str, pictured: dict[str, np.ndarray]
) -> pd.DataFrame:
    """`pictured`: in px, by source."""
    value_px, sd_px = _numbers(frames, f"{name}_px"), _numbers(frames, f"{name}_px_sd")
    scale, scale_sd = _numbers(frames, "mm_per_px"), _numbers(frames, "mm_per_px_sd")
    known = np.isfinite(scale)
    unit = np.where(known, "mm", "px")
    value = np.where(known, value_px * scale, value_px)
    stated = np.where(known, _numbers(frames, f"{name}_mm_sd"), sd_px)
    sources = {words: np.where(known, sd * scale, sd) for words, sd in pictured.items()}
    sources["scale"] = np.where(known, value_px * scale_sd, np.nan)
    return _rows(frames, quantity, unit, value, stated, sources)


def _angle(frames: pd.DataFrame) -> pd.DataFrame:
    beta = _numbers(frames, "helix_angle_rad")
    gain = np.degrees(np.sin(beta) * np.cos(beta))
    sources = {
        "diameter": gain * _numbers(frames, "diameter_px_sd") / _numbers(frames, "diameter_px"),
        "pitch": gain * _numbers(frames, "pitch_px_sd") / _numbers(frames, "pitch_px"),
    }
    stated = np.degrees(_numbers(frames, "helix_angle_rad_sd"))
    unit = np.full(len(frames), "deg")
    return _rows(frames, "helix angle", unit, np.degrees(beta), stated, sources)


def _rows(
    frames: pd.DataFrame,
    quantity: str,
    unit: np.ndarray,
    value: np.ndarray,
    stated: np.ndarray,
    sources: dict[str, np.ndarray],
) -> pd.DataFrame:
    told = np.sqrt(np.nansum([sd**2 for sd in sources.values()], axis=0))
    blocks = []
    for source, sd in {**sources, _REMAINDER: _left(stated, told)}.items():
        blocks.append(
            pd.DataFrame(
                {
                    "frame": frames["frame"].to_numpy(),
                    "quantity": quantity,
                    "unit": unit,
                    "value": value,
                    "source": source,
                    "sd": sd,
                    "share_percent": 100.0 * sd**2 / np.where(stated > 0, stated, np.nan) ** 2,
                }
            )
        )
    table = pd.concat(blocks, ignore_index=True)
    return table[np.isfinite(table["value"]) & np.isfinite(table["sd"])]


def _numbers(frames: pd.DataFrame, column: str) -> np.ndarray:
    """(n,) of a column; NaN where an older table has none."""
    if column not in frames:
        return np.full(len(frames), np.nan)
    return frames[column].to_numpy(dtype=float)
