"""Medians and percentiles are numpy's, whatever the numbers are."""

from __future__ import annotations

import numpy as np
import pytest

from tsvision.images.percentiles import median, percentile, row_medians

SHARES = (0.0, 3.0, 25.0, 50.0, 70.0, 90.0, 97.0, 100.0)


def numbers(kind: str, count: int, seed: int) -> np.ndarray:
    found = np.random.default_rng(seed).normal(size=count)
    if kind == "repeated":
        return np.round(found, 1)
    if kind == "alike":
        return np.full(count, 0.3)
    if kind == "far_apart":
        return found * 10.0 ** np.linspace(-300.0, 300.0, count)
    return found


@pytest.mark.parametrize("kind", ["any", "repeated", "alike", "far_apart"])
@pytest.mark.parametrize("count", [1, 2, 3, 4, 11, 200, 3001])
def test_percentiles_are_those_of_numpy(kind: str, count: int) -> None:
    values = numbers(kind, count, count)
    for share in SHARES:
        assert percentile(values, share) == pytest.approx(np.percentile(values, share), rel=1e-9)
    assert median(values) == np.median(values)


def test_short_numbers_have_short_medians() -> None:
    values = numbers("any", 1000, 0).astype(np.float32)
    assert np.float32(median(values)) == median(values) == np.median(values)


def test_pictures_and_parts_of_them_are_taken_whole() -> None:
    picture = numbers("any", 600, 1).reshape(20, 30)
    assert median(picture) == np.median(picture)
    assert median(picture[::2, ::3]) == np.median(picture[::2, ::3])
    assert np.array_equal(row_medians(picture.T), np.median(picture, axis=0))


def test_the_numbers_stay_as_they_are() -> None:
    values = numbers("any", 99, 2)
    before = values.copy()
    median(values)
    assert np.array_equal(values, before)


def test_nothing_has_no_median() -> None:
    assert np.isnan(median(np.empty(0)))
