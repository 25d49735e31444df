"""Tables of bundle diameters: what d is and how well it is known, and which model is asked."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cli.main import run
from tsvision.diagnosis.bundle_table import Diameters, read_diameters
from tsvision.diagnosis.sources import diagnose_sources
from tsvision.errors import InputError
from tsvision.records import Rig

TABLE = """strings,diameter_mm,diameter_mm_sd
1,0.24,0.02
1,0.26,0.03
2,0.47,0.03
4,0.70,0.02
6,0.86,0.02
8,0.99,0.03
"""


def read(string_mm: float = float("nan")) -> Diameters:
    lines = [line.split(",") for line in TABLE.split()]
    rows = [dict(zip(lines[0], line, strict=True)) for line in lines[1:]]
    return read_diameters(lines[0], rows, string_mm, float("nan"), "the table")


def test_a_string_that_was_measured_is_known_as_well_as_its_readings() -> None:
    found = read()
    np.testing.assert_allclose(found.string_mm, 0.25)
    np.testing.assert_allclose(found.string_sd_mm, np.hypot(0.02, 0.03) / 2)
    assert found.count.tolist() == [2, 4, 6, 8]  # the single string is no bundle as well


def test_a_string_that_was_stated_is_known_to_a_hundredth() -> None:
    found = read(0.24)
    np.testing.assert_allclose(found.string_sd_mm, 0.0024)
    assert found.count.tolist() == [1, 1, 2, 4, 6, 8]


def test_the_section_that_is_questioned_is_chosen_by_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "diameters.csv"
    path.write_text(TABLE)
    assert diagnose_sources([path], Rig()).base["model"] == "pair_core"
    assert diagnose_sources([path], Rig(), "ring").base["model"] == "ring"
    with pytest.raises(InputError, match="no section model 'constant_radius'"):
        diagnose_sources([path], Rig(), "constant_radius")
    assert run(["diagnose", str(path), "--model", "ring"]) == 0
    assert "ring section" in capsys.readouterr().out
