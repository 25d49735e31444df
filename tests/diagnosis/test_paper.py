"""The paper's own tables through the diagnosis."""

from __future__ import annotations

import pytest
from tsvision.data import table as paper_table

from tsvision.diagnosis.bundle_table import read_diameters
from tsvision.diagnosis.bundles import diagnose_bundles
from tsvision.diagnosis.diagnose import diagnose
from tsvision.diagnosis.table import table_from_rows
from tsvision.diagnosis.verdict import Verdict
from tsvision.records import Rig
from tsvision.units import kgf_to_newton

CONSTANT = {
    "strings": 2,
    "twisting_zone_mm": 23.20,
    "hole_distance_nominal_mm": 5.0,
    "bundle_diameter_mm": 0.47,
}
LOAD_EFFECTS = {"radial_compression", "axial_stretch", "creep"}


def life_cycle(with_load: bool) -> Verdict:
    rows = []
    for row in paper_table("life_cycle").to_dict("records"):
        load = {"load_N": float(kgf_to_newton(row["load_kgf"]))} if with_load else {}
        run = f"{row['load_kgf']} kgf" if with_load else "all"
        seen = {"observable": "displacement_mm", "value": row["contraction_mm"]}
        rows.append({"run": run, "turns": row["turns"], **seen, **load, **CONSTANT})
    return diagnose(table_from_rows(list(rows[0]), rows, Rig()))


@pytest.fixture(scope="module")
def loaded() -> Verdict:
    return life_cycle(with_load=True)


def test_the_constant_radius_model_is_four_and_a_half_mm_off(loaded: Verdict) -> None:
    assert loaded.base["model"] == "constant_radius"
    assert loaded.base["rmse_mm"] == pytest.approx(4.53, abs=0.005)


def test_tension_squeezing_the_bundle_explains_the_life_cycle_table(loaded: Verdict) -> None:
    """Found by hand before: r falls as a weak power of T = F/(N cos β)."""
    assert ("radial_compression",) in loaded.equivalent
    assert loaded.causes[0].name == "radial_compression"
    assert 0.04 < loaded.causes[0].parameters["exponent"].value < 0.09


def test_the_gain_on_the_load_left_out(loaded: Verdict) -> None:
    assert loaded.gain is not None and loaded.gain["scheme"] == "leave-one-load-out"
    # Least squares by hand, with D anchored at the caliper's digit: 0.58 to 0.60 mm.
    assert loaded.gain["held_out_rmse_extended_mm"] <= 0.60
    assert loaded.gain["low"] > 2.0


def test_without_the_load_column_no_load_effect_is_claimed() -> None:
    answer = life_cycle(with_load=False)
    assert not {name for names in answer.equivalent for name in names} & LOAD_EFFECTS
    assert not {cause.name for cause in answer.causes} & LOAD_EFFECTS


def test_the_section_model_is_too_thin_for_want_of_packing() -> None:
    rows = [
        {"strings": r["strings"], "value": r["diameter_mm"], "value_sd": r["diameter_sd_mm"]}
        for r in paper_table("diameter").to_dict("records")
    ]
    data = read_diameters(list(rows[0]), rows, 0.24, float("nan"), "the diameter table")
    answer = diagnose_bundles(data)
    assert answer.base["rmse_mm"] == pytest.approx(0.077, abs=0.001)
    assert answer.causes[0].name == "packing_fraction"
    constant = answer.causes[0].parameters["packing_constant"]
    assert constant.low < 1.47 < constant.high
    assert answer.gain is not None and answer.gain["scheme"] == "leave-one-N-out"
    assert answer.gain["held_out_rmse_extended_mm"] < 0.03
    ring = diagnose_bundles(data, base="ring")
    assert ring.base["rmse_mm"] == pytest.approx(0.127, abs=0.001)
