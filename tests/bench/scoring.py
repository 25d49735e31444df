"""How far off, and whether the interval holds it: what the benchmarks' tables have in common."""

from __future__ import annotations

import numpy as np
import pandas as pd

HELD = 1.96  # sd: a 95 % interval


def rms(values: pd.Series) -> float:
    """Of what is known; NaN where nothing is."""
    known = values.dropna().to_numpy(float)
    return float(np.sqrt(np.mean(known**2))) if len(known) else np.nan


def held(sigmas: pd.Series) -> float:
    """Share of errors over their sd that a 95 % interval holds; NaN where none is known."""
    known = sigmas.dropna()
    return float((known.abs() <= HELD).mean()) if len(known) else np.nan
