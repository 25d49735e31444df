"""Options that several commands share, written once as the parameters of a function.

`@with_options(ending=read_ending)` gives a typer command the options of `read_ending`, and calls it
with their values: the command gets what it returns as its keyword `ending`.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any

Command = Callable[..., Any]


def with_options(**shared: Command) -> Callable[[Command], Command]:
    """Replace each parameter named by the parameters of the function that makes its value."""

    def decorate(function: Command) -> Command:
        makers = {name: _parameters(maker) for name, maker in shared.items()}
        own = [p for p in _parameters(function) if p.name not in shared]
        added = [p for parameters in makers.values() for p in parameters]

        @functools.wraps(function)
        def command(**values: Any) -> Any:
            for name, parameters in makers.items():
                taken = {p.name: values.pop(p.name) for p in parameters}
                values[name] = shared[name](**taken)
            return function(**values)

        parameters = [p.replace(kind=inspect.Parameter.KEYWORD_ONLY) for p in own + added]
        command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        command.__annotations__ = {p.name: p.annotation for p in parameters}
        return command

    return decorate


def _parameters(function: Command) -> list[inspect.Parameter]:
    return list(inspect.signature(function, eval_str=True).parameters.values())
