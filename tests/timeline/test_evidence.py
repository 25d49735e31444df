"""How strongly one frame speaks for uneven coiling: no more surely than one view reads it."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tsvision.timeline.criteria import Criteria
from tsvision.timeline.evidence import MOST, UNEVEN_NOISE, uneven_evidence

LIMIT = Criteria().unevenness


def evidence(unevenness: float) -> float:
    """Of the middle frame of a series without any scatter."""
    frames = pd.DataFrame({"unevenness": np.full(21, unevenness)})
    return float(uneven_evidence(frames, Criteria())[10])


def test_a_smooth_series_is_no_surer_than_one_view() -> None:
    """Which lobes show changes over several frames: neighbours agree and are wrong together."""
    assert evidence(LIMIT) == pytest.approx(0.0)
    assert evidence(LIMIT + 0.5 * UNEVEN_NOISE) == pytest.approx(0.77, abs=0.05)
    assert evidence(LIMIT - 0.5 * UNEVEN_NOISE) == pytest.approx(-0.77, abs=0.05)
    assert evidence(LIMIT + 4.0 * UNEVEN_NOISE) == pytest.approx(MOST, abs=0.1)


def test_what_was_not_read_says_nothing() -> None:
    assert evidence(float("nan")) == 0.0
