"""How often the motor lets one expect the strands to turn."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tsvision.measures.zone.fits import expected_rate

NAN = float("nan")


def looks(connector_px: float, zero_px: float) -> Any:
    """A zone of 1000 px; NaN: out of view."""
    return SimpleNamespace(
        ends=SimpleNamespace(connector_px=connector_px),
        zero_known=np.isfinite(zero_px),
        zero_px=zero_px,
        zone_px=1000.0,
    )


@pytest.mark.parametrize(
    ("connector_px", "zero_px", "length_px"),
    [
        (1100.0, 100.0, 900.0),
        (NAN, 100.0, 900.0),
        (NAN, NAN, 1000.0),  # a close-up: no longer than the zone is
    ],
)
def test_between_apex_and_connector(connector_px: float, zero_px: float, length_px: float) -> None:
    rate = expected_rate(looks(connector_px, zero_px), 10.25, 200.0)
    assert rate == pytest.approx(2.0 * np.pi * 10.0 / length_px)


def test_without_turns_nothing_is_expected() -> None:
    assert np.isnan(expected_rate(looks(1100.0, 100.0), NAN, 200.0))
