"""The contract that every model on the shelf keeps."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tsvision.errors import InputError
from tsvision.models import GEOMETRY, MODELS
from tsvision.models.choose import choose_model

KNOWN = {
    "twisting_zone_mm": 23.2,
    "hole_distance_mm": 5.0,
    "radius_mm": 0.235,
    "string_diameter_mm": 0.24,
    "centre_radius_mm": 0.115,
    "pitch_mm": 1.2,
}
TURNS = np.linspace(0.0, 60.0, 241)


@pytest.fixture(params=MODELS, ids=str)
def model(request: pytest.FixtureRequest):
    return MODELS[request.param]


def at(model, turns):
    return model.displacement_mm(turns, **model.geometry(KNOWN))


def test_words_and_parameters_are_there(model) -> None:
    assert model.title and model.equation and model.assumptions and model.source and model.fails
    assert set(model.parameters) <= set(GEOMETRY)
    assert MODELS[model.name] is model


def test_array_in_same_shape_out(model) -> None:
    assert at(model, TURNS).shape == TURNS.shape
    assert np.shape(at(model, 3.0)) == ()
    column = {k: np.full((3, 1), v) for k, v in model.geometry(KNOWN).items()}
    assert model.displacement_mm(TURNS, **column).shape == (3, TURNS.size)
    assert model.slope_mm_per_turn(TURNS, **column).shape == (3, TURNS.size)


def test_displacement_grows_with_turns_where_defined(model) -> None:
    x = at(model, TURNS)
    assert np.isfinite(x[:20]).all()
    assert np.all(np.diff(x[np.isfinite(x)]) >= 0)


def test_slope_is_the_derivative(model) -> None:
    keywords = model.geometry(KNOWN)
    step = 1e-5
    turns = TURNS[1:] + 0.0123
    up = model.displacement_mm(turns + step, **keywords)
    down = model.displacement_mm(turns - step, **keywords)
    numeric = (up - down) / (2 * step)
    sound = np.isfinite(numeric)
    assert sound.any()
    assert_allclose(model.slope_mm_per_turn(turns, **keywords)[sound], numeric[sound], rtol=2e-6)


def test_inverse_gives_the_turns_back(model) -> None:
    keywords = model.geometry(KNOWN)
    x = at(model, TURNS)
    sound = np.isfinite(x)
    back = model.turns_for_displacement(x[sound], **keywords)
    assert_allclose(back, TURNS[sound], atol=1e-8)


def test_inverse_has_no_answer_below_zero_turns(model) -> None:
    start = float(at(model, 0.0))
    assert np.isnan(model.turns_for_displacement(start - 0.5, **model.geometry(KNOWN)))


def test_winding_either_way_draws_alike(model) -> None:
    x, y = at(model, TURNS), at(model, -TURNS)
    assert_allclose(x, y)
    forth = model.slope_mm_per_turn(5.0, **model.geometry(KNOWN))
    back = model.slope_mm_per_turn(-5.0, **model.geometry(KNOWN))
    assert_allclose(forth, -back)


def test_lengths_scale_together(model) -> None:
    doubled = {name: 2 * value for name, value in model.geometry(KNOWN).items()}
    assert_allclose(model.displacement_mm(TURNS, **doubled), 2 * at(model, TURNS), rtol=1e-9)


def test_a_missing_keyword_is_named(model) -> None:
    with pytest.raises(InputError, match=model.parameters[0]):
        model.geometry({})


def test_unknown_model_names_the_nearest() -> None:
    with pytest.raises(InputError, match="did you mean 'constant_radius'"):
        choose_model("constant_radios")
