"""Whatever stands in a verdict file, the page shows it as text or says that it is none."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tsvision.errors import InputError
from tsvision.report.confronted import confronted
from tsvision.report.page import _verdict_part

JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner),
    max_leaves=8,
)
KEYS = ("status", "causes", "equivalent", "base", "extended", "gain", "evidence", "residual")
VERDICTS = st.fixed_dictionaries({}, optional=dict.fromkeys((*KEYS, "next_experiment"), JSON))


@settings(max_examples=300, deadline=None)
@given(VERDICTS)
def test_any_json_is_shown_or_refused(verdict: dict[str, Any]) -> None:
    try:
        assert "What the model gets wrong" in _verdict_part(verdict)
    except InputError as problem:
        assert "diagnose" in str(problem)


@settings(max_examples=200, deadline=None)
@given(st.fixed_dictionaries({"rows": JSON}))
def test_any_rows_are_plotted_or_refused(verdict: dict[str, Any]) -> None:
    try:
        entries = confronted(verdict)
    except InputError as problem:
        assert "rows" in str(problem)
    else:
        assert all(len(e["turns"]) == len(e["base"]) == len(e["extended"]) for e in entries)


def test_residuals_are_measured_minus_model_and_apart_by_observable() -> None:
    rows = [
        {"observable": "displacement_mm", "turns": 5, "value": 3.0, "base": 4.0, "extended": 2.9},
        {"observable": "helix_angle_deg", "turns": 5, "value": 30, "base": None, "extended": 31},
    ]
    first, second = confronted({"rows": rows})
    assert (first["name"], first["unit"], first["base"]) == ("displacement", "mm", [-1.0])
    assert first["extended"] == [pytest.approx(0.1)]
    assert (second["name"], second["unit"], second["extended"]) == ("helix angle", "°", [-1.0])
    assert math.isnan(second["base"][0])


def test_text_in_a_verdict_stays_text() -> None:
    evil = "<script>alert(1)</script>"
    verdict = {
        "status": evil,
        "causes": [{"name": evil, "parameters": {evil: {"value": evil, "unit": evil}}}],
        "equivalent": [[evil], [evil]],
        "next_experiment": {"observable": evil, "separates": [evil], "unit": evil},
    }
    assert "<script" not in _verdict_part(verdict)
