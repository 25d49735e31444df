"""What programs read is JSON, whatever the numbers are."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np

from tsvision.jsonable import jsonable, to_json


@dataclass(frozen=True)
class Noun:
    turns: float
    parts: tuple[float, ...]


def test_what_json_does_not_know_becomes_null_and_nouns_objects() -> None:
    told = {
        1: Noun(float("nan"), (1.0, float("-inf"))),
        "rows": np.array([[0.5, np.nan]]),
        "counts": np.arange(2),
        "single": np.float32(np.inf),
        "yes": np.True_,
    }
    assert json.loads(to_json(told)) == {
        "1": {"turns": None, "parts": [1.0, None]},
        "rows": [[0.5, None]],
        "counts": [0, 1],
        "single": None,
        "yes": True,
    }
    assert to_json(told) == to_json(jsonable(told))


def test_digits_are_rounded_where_asked() -> None:
    assert jsonable([np.float64(1 / 3), 123456.7, 7], digits=3) == [0.333, 123000.0, 7]
    assert jsonable(1 / 3) == 1 / 3


def test_a_name_that_is_no_unicode_is_told_all_the_same() -> None:
    assert json.loads(to_json({"name": "film\udcff"})) == {"name": "film\\xff"}
