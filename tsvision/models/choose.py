"""Pick a model by name; an unknown name never falls back in silence."""

from __future__ import annotations

import difflib

from tsvision.errors import InputError
from tsvision.models import MODELS, DisplacementModel


def choose_model(name: str) -> DisplacementModel:
    """The model of that name; InputError lists the shelf and the nearest name otherwise."""
    if name in MODELS:
        return MODELS[name]
    near = difflib.get_close_matches(name, MODELS, n=1)
    hint = f"did you mean '{near[0]}'? " if near else ""
    raise InputError(f"no model '{name}'; {hint}there are: {', '.join(MODELS)}")


def check_strings(model: DisplacementModel, strings: int | None) -> None:
    """InputError where a model is asked about a number of strings that it does not hold for."""
    only = model.only_strings
    if only is not None and strings is not None and strings != only:
        raise InputError(
            f"model '{model.name}' holds for {only} strings only, not {strings}; choose another"
        )
