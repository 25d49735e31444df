"""Bundle sections: drawn by hand first, then the paper's errors."""

from __future__ import annotations

import numpy as np
import pytest
from tsvision.data import table

from tsvision.errors import InputError
from tsvision.models import SECTIONS
from tsvision.models.packing_fraction import paper_widening
from tsvision.models.pair_core import smallest_circle_radius


def test_pair_core_widths_by_hand() -> None:
    widths = SECTIONS["pair_core"].bundle_diameter_mm(np.arange(1, 9), 0.24)
    expected = [0.24, 0.48, 0.517, 0.656, 0.72, 0.875, 0.875, 0.875]
    np.testing.assert_allclose(widths, expected, atol=0.0005)


def test_ring_widths_by_hand() -> None:
    widths = SECTIONS["ring"].bundle_diameter_mm(np.arange(1, 9), 0.24)
    expected = [0.24, 0.48, 0.517, 0.579, 0.648, 0.720, 0.793, 0.867]
    np.testing.assert_allclose(widths, expected, atol=0.0005)


@pytest.mark.parametrize("name", ["pair_core", "ring"])
@pytest.mark.parametrize("count", range(2, 9))
def test_strands_touch_and_never_overlap(name: str, count: int) -> None:
    points = SECTIONS[name].centres(count)
    gaps = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
    apart = gaps[np.triu_indices(count, 1)]
    assert apart.min() == pytest.approx(1.0, abs=1e-12)
    assert points.shape == (count, 2)
    width = SECTIONS[name].bundle_diameter_mm(count, 1.0)
    assert float(width) == pytest.approx(1 + 2 * smallest_circle_radius(points), abs=1e-9)


@pytest.mark.parametrize("count", [2, 4, 6, 8])
def test_even_pair_cores_have_two_fold_symmetry(count: int) -> None:
    points = SECTIONS["pair_core"].centres(count)
    turned = sorted(map(tuple, (-points + 0.0).round(9).tolist()))
    assert turned == sorted(map(tuple, (points + 0.0).round(9).tolist()))


@pytest.mark.parametrize("name", ["pair_core", "ring"])
def test_no_strings_is_an_error(name: str) -> None:
    with pytest.raises(InputError):
        SECTIONS[name].bundle_diameter_mm(0, 0.24)
    with pytest.raises(InputError):
        SECTIONS[name].centres(0)


def test_packing_fraction_meets_the_caliper() -> None:
    """0.023 mm RMSE over N = 2 to 8, inside the caliper's own scatter."""
    data = table("diameter")
    data = data[data["strings"] >= 2]
    found = SECTIONS["packing_fraction"].bundle_diameter_mm(data["strings"], 0.24)
    error = found - data["diameter_mm"].to_numpy()
    assert np.sqrt(np.mean(error**2)) == pytest.approx(0.023, abs=0.0006)
    assert paper_widening() == pytest.approx(1.47, abs=0.005)
