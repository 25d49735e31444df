"""Models of cycles to failure, all of the form log(cycles) = offset + columns · parameters.

F is the load in N, n the turns and x the contraction of a cycle in mm. Scatter about the model is
log-normal: a string lives a FACTOR longer or shorter, which is how wear lives scatter.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tsvision.life.table import LifeTests

REFERENCE_N = 30.0  # logs are taken against round mid-range values, so that intercepts mean
REFERENCE_TURNS = 30.0  # "log cycles there" and are hardly correlated with the slopes
REFERENCE_MM = 30.0


@dataclass(frozen=True)
class LifeModel:
    """`columns(tests)` has shape (n, p), `offset(tests)` (n,); `parameters` names the p columns."""

    name: str
    title: str
    equation: str
    parameters: tuple[str, ...]
    columns: Callable[[LifeTests], np.ndarray]
    offset: Callable[[LifeTests], np.ndarray]
    source: str


def _one(tests: LifeTests) -> np.ndarray:
    return np.ones_like(tests.load_N)


def _load(tests: LifeTests) -> np.ndarray:
    return np.log(tests.load_N / REFERENCE_N)


def _turns(tests: LifeTests) -> np.ndarray:
    return np.log(tests.turns / REFERENCE_TURNS)


def _stroke(tests: LifeTests) -> np.ndarray:
    return np.log(tests.contraction_mm / REFERENCE_MM)


def _nothing(tests: LifeTests) -> np.ndarray:
    return np.zeros_like(tests.load_N)


def _stack(*parts: np.ndarray) -> np.ndarray:
    return np.column_stack(parts)


_MODELS = (
    LifeModel(
        "work_endured",
        "The string endures a fixed amount of work",
        "cycles · F · x = W",
        ("log_cycles_at_reference",),
        lambda t: _stack(_one(t)),
        lambda t: -_load(t) - _stroke(t),
        "the plainest wear law (Archard): damage grows with force times way",
    ),
    LifeModel(
        "contraction_endured",
        "Fixed contraction endured, less under load (a power)",
        "cycles · x = C F^-m",
        ("log_cycles_at_reference", "load_exponent"),
        lambda t: _stack(_one(t), -_load(t)),
        lambda t: -_stroke(t),
        "the paper's reading of its table: contraction endured depends on the load alone",
    ),
    LifeModel(
        "contraction_endured_exponential",
        "Fixed contraction endured, less under load (exponential)",
        "cycles · x = C exp(-k F)",
        ("log_cycles_at_reference", "load_rate_per_N"),
        lambda t: _stack(_one(t), -(t.load_N - REFERENCE_N)),
        lambda t: -_stroke(t),
        "as contraction_endured with a thermally activated (Zhurkov) load law",
    ),
    LifeModel(
        "power_turns",
        "Powers of load and turns",
        "cycles = C F^-m n^-k",
        ("log_cycles_at_reference", "load_exponent", "turns_exponent"),
        lambda t: _stack(_one(t), -_load(t), -_turns(t)),
        _nothing,
        "Basquin's law with the turns of a cycle as second stress",
    ),
    LifeModel(
        "power_contraction",
        "Powers of load and contraction",
        "cycles = C F^-m x^-k",
        ("log_cycles_at_reference", "load_exponent", "contraction_exponent"),
        lambda t: _stack(_one(t), -_load(t), -_stroke(t)),
        _nothing,
        "contraction_endured with a free power of x",
    ),
    LifeModel(
        "power_load_hastens",
        "Powers, the one of contraction rising with load",
        "cycles = C F^-m x^-(k + c log F)",
        ("log_cycles_at_reference", "load_exponent", "contraction_exponent", "load_by_contraction"),
        lambda t: _stack(_one(t), -_load(t), -_stroke(t), -_load(t) * _stroke(t)),
        _nothing,
        "the paper's claim that overtwist harms under heavy load only",
    ),
    LifeModel(
        "exponential_hastens",
        "Exponential in load, power of contraction rising with load",
        "cycles = C exp(-k F) x^-(1 + c F)",
        ("log_cycles_at_reference", "load_rate_per_N", "load_by_contraction_per_N"),
        lambda t: _stack(
            _one(t), -(t.load_N - REFERENCE_N), -(t.load_N - REFERENCE_N) * _stroke(t)
        ),
        lambda t: -_stroke(t),
        "contraction_endured_exponential with overtwist the worse the heavier the load",
    ),
)

LIFE_MODELS: dict[str, LifeModel] = {model.name: model for model in _MODELS}
