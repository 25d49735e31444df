"""A coil that snaps in: nothing at its onset's either side points to where it lies."""

from __future__ import annotations

import numpy as np
import pytest

from tsvision.diagnosis.diagnose import diagnose
from tsvision.diagnosis.table import table_from_rows
from tsvision.records import Rig


@pytest.mark.parametrize("onset_turns", [13.7, 21.2])
def test_the_onset_of_a_jump_is_found(onset_turns: float) -> None:
    """Two loads, the bundle's centre radius half of D/2, and at an onset the first coil draws
    0.9 mm at once, each further turn 1.2 mm."""
    rng = np.random.default_rng(7)
    rows = []
    zone_mm, hole_mm, radius_mm = 23.2, 5.0, 0.19
    for load_n, later in ((19.6, 1.0), (49.0, 1.25)):
        for turns in np.arange(0.0, 45.0, 0.5):
            begins = onset_turns * later
            twist = 2.0 * np.pi * min(turns, begins)
            string_mm = np.hypot(zone_mm, 0.5 * hole_mm)
            drawn = np.hypot(zone_mm, 0.5 * hole_mm + radius_mm * twist) - string_mm
            coils = max(turns - begins, 0.0)
            drawn += 1.2 * coils + 0.9 * (coils > 0.0) + 0.03 * rng.standard_normal()
            rows.append(
                {
                    "run": f"{load_n:g} N",
                    "turns": turns,
                    "load_N": load_n,
                    "displacement_mm": drawn,
                    "strings": 2,
                    "string_diameter_mm": 0.38,
                    "twisting_zone_mm": zone_mm,
                    "hole_distance_nominal_mm": hole_mm,
                    "bundle_diameter_mm": 0.76,
                }
            )
    answer = diagnose(table_from_rows(list(rows[0]), rows, Rig()))
    coiling = next(cause for cause in answer.causes if cause.name == "coiling")
    assert coiling.parameters["onset_turns"].value == pytest.approx(onset_turns, abs=0.7)
    assert coiling.parameters["jump_mm"].value == pytest.approx(0.9, abs=0.3)
