"""Bundles of bright and of faint strands: every lobe counts, whichever strand makes it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.measures.films import film_of, measured
from tsvision.measures.edges.strands import Silhouette, outline
from tsvision.measures.edges.tones import even_out, faint_tone

WIDTH_PX, STRAND_PX, HALF = 20.0, 10.0, 50
WHITE, NAVY, BLACK = (0.75, 0.75, 0.72), (0.02, 0.05, 0.16), (0.008, 0.008, 0.008)


def band(faint: float, noise: float = 0.01, seed: int = 1) -> np.ndarray:
    """Contrast (2 HALF + 1, 400) of a bundle whose sides show either strand for 20 px in turn."""
    n = np.arange(-HALF, HALF + 1)[:, None]
    s = np.arange(400)[None, :]
    bright = ((s // 20) % 2 == 0) ^ (n > 0)
    contrast = np.where(np.abs(n) <= 0.5 * WIDTH_PX, np.where(bright, 1.0, faint), 0.0)
    contrast += noise * np.random.default_rng(seed).standard_normal(contrast.shape)
    return contrast.astype(np.float32)


def outlined(contrast: np.ndarray, level: float = 0.35) -> Silhouette:
    return outline(contrast, WIDTH_PX, STRAND_PX, 0, level)


def test_the_fainter_strands_contrast_is_told() -> None:
    contrast = band(0.12)
    told = faint_tone([contrast], [outlined(contrast, 0.05)], WIDTH_PX)
    assert told == pytest.approx(0.12, abs=0.02)


@pytest.mark.parametrize("faint", [1.0, 0.5])
def test_strands_about_alike_need_no_help(faint: float) -> None:
    contrast = band(faint)
    assert faint_tone([contrast], [outlined(contrast)], WIDTH_PX) == 1.0


def test_what_is_no_more_than_ground_is_no_strand() -> None:
    """Half of the places show nothing but noise: gaps, or a bundle that swings off the axis."""
    contrast = band(0.0, noise=0.05)
    assert faint_tone([contrast], [outlined(contrast)], WIDTH_PX) == 1.0


def test_no_pictures_tell_no_tone() -> None:
    assert faint_tone([], [], WIDTH_PX) == 1.0


def test_faint_strands_come_to_show_as_much() -> None:
    """Their lobes are lost before, 5 px of the outline, and found after."""
    contrast = band(0.12)
    lost = outlined(contrast)
    assert np.nanmean(lost.high - lost.low) < WIDTH_PX - 4.0
    seen = outlined(even_out(contrast, WIDTH_PX, STRAND_PX, 0.12))
    assert np.nanmean(seen.high - seen.low) == pytest.approx(WIDTH_PX, abs=0.5)


@pytest.mark.parametrize("count", [4, 6])
def test_navy_beside_white_strings_before_black(tmp_path: Path, count: int) -> None:
    """In grey, navy shows a tenth of the contrast. By the white ones alone the bundle was found up
    to 7 px thin of 21 and 31, and outside of what was stated."""
    changes: dict[str, object] = {
        "look.strand_rgb": (WHITE, NAVY),
        "look.ground_rgb": BLACK,
        "sensor.grey": True,
    }
    measurer, error_px, sd_px = measured(tmp_path / "film", film_of(count, "front_lit", changes))
    assert measurer.looks is not None
    assert measurer.looks.sight.faint_tone < 0.2
    assert np.abs(error_px).max() < 0.75
    assert (np.abs(error_px) < 1.96 * sd_px).all()
