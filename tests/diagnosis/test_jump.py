"""A coil that snaps in: nothing at its onset's either side points to where it lies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.hidden import planted
from tsvision.diagnosis.candidates import pool
from tsvision.diagnosis.diagnose import diagnose
from tsvision.diagnosis.fit import fit
from tsvision.diagnosis.larger_sets import off_its_bounds
from tsvision.diagnosis.problem import prepare
from tsvision.diagnosis.select import _said_plainly
from tsvision.diagnosis.table import table_from_rows
from tsvision.mechanisms import MECHANISMS, Simulation
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


def test_what_stands_at_its_bound_is_tried_from_off_it() -> None:
    """A coil whose first length the fit has lost: the onset and the width have made up for it."""
    rng = np.random.default_rng(11)
    rows = []
    for turns in np.arange(0.0, 60.0, 0.25):
        coils = 1.5 * np.logaddexp(0.0, (turns - 22.0) / 1.5)
        across = 2.5 + 2.0 * np.pi * 0.235 * (turns - coils)
        drawn = np.hypot(23.2, across) - 23.2 + 1.2 * coils
        drawn += 0.9 * -np.expm1(-coils / 1.5) + 0.01 * rng.standard_normal()
        rows.append({"run": "one", "turns": turns, "load_N": 20.0, "displacement_mm": drawn})
    stated = {"strings": 2, "twisting_zone_mm": 23.2, "hole_distance_nominal_mm": 5.0}
    rows = [{**row, **stated, "bundle_diameter_mm": 0.47} for row in rows]
    asked = prepare(table_from_rows(list(rows[0]), rows, Rig()))
    coiling = MECHANISMS["coiling"].extend(Simulation(), "rounded_snap")
    found = fit(asked, coiling)
    lost = replace(found, u=np.where(np.arange(4) == 3, 0.0, found.u))
    (again,) = off_its_bounds(asked, lost)
    assert again.u[3] * 6.0 * 0.235 == pytest.approx(0.9, abs=0.1)
    assert off_its_bounds(asked, again) == []


def test_a_shape_that_drifts_is_not_said_where_a_plain_one_is_as_likely() -> None:
    rows = planted.plain_case("lost_turns", 960_001, planted.Setting(count=4, levels=9)).rows
    asked = prepare(table_from_rows(list(rows[0]), rows, Rig()))
    plain, drifting = (
        fit(asked, MECHANISMS["lost_turns"].extend(Simulation(), shape))
        for shape in ("sharp", "sharp_varying")
    )
    ahead = replace(drifting, log_evidence=plain.log_evidence + 1.3)  # 0.3 with its prior odds
    found = _said_plainly(pool(asked, ("lost_turns",), [plain, ahead]))
    assert found.best is plain and found.fits == (plain, ahead)
    far = replace(drifting, log_evidence=plain.log_evidence + 3.0)
    assert _said_plainly(pool(asked, ("lost_turns",), [plain, far])).best is far
