"""Strings close before a ground on which their own shadow falls, from pictures to D."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.measures.films import film_of, measured

BESIDE: dict[str, object] = {
    "look.light": (0.0, 0.7, 0.7),
    "look.shadow_offset_mm": (0.0, -0.6),
    "camera.view": "closeup",
    "camera.px_per_mm": 50.0,
}
BLACK, GREY = (0.03, 0.03, 0.035), (0.18, 0.18, 0.19)


@pytest.mark.slow
@pytest.mark.parametrize("shadow", [0.35, 0.5])
def test_black_strings_that_gleam_before_grey(tmp_path: Path, shadow: float) -> None:
    """A shadow half as dark as they are was a part of them: no D, or 38 px more than 40."""
    changes: dict[str, object] = {
        "look.strand_rgb": (BLACK,),
        "look.ground_rgb": GREY,
        "look.ambient": 0.3,
        "look.specular": 0.3,
        "look.shadow": shadow,
    }
    _, error_px, sd_px = measured(tmp_path / "film", film_of(6, "front_lit", BESIDE | changes))
    assert np.abs(error_px).max() < 0.4
    assert sd_px.max() < 0.5
    assert (np.abs(error_px) < 1.96 * sd_px).all()
