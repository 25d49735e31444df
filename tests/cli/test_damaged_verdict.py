"""`--model verdict.json`: a damaged verdict is one clear line, whatever is wrong in it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from cli.model_option import choose
from tsvision.errors import InputError

MODEL: dict[str, Any] = {
    "base": "constant_radius",
    "parts": [],
    "reference": {
        "span_turns": 60.0,
        "gap_turns": 5.0,
        "span_s": None,
        "load_min_N": 9.8,
        "load_mean_N": 19.6,
        "load_max_N": 29.4,
        "tension_min_N": 5.0,
        "tension_mean_N": 10.0,
        "radius_mm": 0.24,
        "zone_mm": 23.2,
        "hole_mm": 5.0,
    },
    "nominal": {
        "strings": 2,
        "string_diameter_mm": 0.24,
        "twisting_zone_mm": 23.2,
        "hole_distance_mm": 5.0,
        "radius_mm": 0.24,
        "load_N": 19.6,
    },
    "shifts": [
        {
            "strings": 2,
            "radius_mm": 0.24,
            "radius_share": 0.0,
            "zone_change_mm": 0.0,
            "hole_change_mm": 0.0,
        }
    ],
    "zeroed_share": 0.0,
}
PLACES = [
    *((name,) for name in MODEL),
    *((name, key) for name in ("reference", "nominal") for key in MODEL[name]),
    *(("shifts", 0, key) for key in MODEL["shifts"][0]),
]
ODD = st.none() | st.booleans() | st.floats() | st.text(max_size=5) | st.just([]) | st.just({})


def chosen(path: Path, model: Any) -> Any:
    path.write_text(json.dumps({"model": model}))
    return choose(str(path))


def test_a_whole_verdict_is_taken(tmp_path: Path) -> None:
    whole = chosen(tmp_path / "v.json", MODEL)
    assert whole.displacement_mm([20.0])[0] > 10


@settings(
    max_examples=120,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(st.sampled_from(PLACES), ODD, st.booleans())
@example(("shifts", 0, "radius_share"), None, True)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_damaged_verdict_is_one_line(tmp_path: Path, place: Any, odd: Any, gone: bool) -> None:
    model = json.loads(json.dumps(MODEL))
    inside = model
    for step in place[:-1]:
        inside = inside[step]
    if gone:
        del inside[place[-1]]
    else:
        inside[place[-1]] = odd
    try:
        chosen(tmp_path / "v.json", model)
    except InputError as problem:
        assert "\n" not in str(problem) and "v.json" in str(problem)


@pytest.mark.parametrize("text", ["", "[", "null", "[]", "{}", '{"model": null}', "[" * 100_000])
def test_no_verdict_at_all_is_one_line(tmp_path: Path, text: str) -> None:
    path = tmp_path / "v.json"
    path.write_text(text)
    with pytest.raises(InputError, match=r"v\.json") as caught:
        choose(str(path))
    assert "\n" not in str(caught.value)
