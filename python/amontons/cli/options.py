"""Groups of options that several commands have: each command gets them as one argument."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from .common import one_line_errors

Command = Callable[..., None]
Options = Mapping[str, tuple[Any, Any]]
"""By name the annotation and the default."""


def grouped(argument: str, options: Options, make: Callable[..., Any]) -> Callable[[Command], Command]:
    """A decorator: the command has the options, and gets `make(**options)` as its keyword `argument`.

    InputError of `make` ends the command as one line.
    """

    def decorate(command: Command) -> Command:
        signature = inspect.signature(command, eval_str=True)
        kind = inspect.Parameter.KEYWORD_ONLY
        own = [
            inspect.Parameter(name, kind, default=default, annotation=annotation)
            for name, (annotation, default) in options.items()
        ]

        def in_place(parameter: inspect.Parameter) -> Iterable[inspect.Parameter]:
            return own if parameter.name == argument else [parameter]

        @functools.wraps(command)
        def with_options(**given: Any) -> None:
            with one_line_errors():
                made = make(**{name: given.pop(name) for name in options})
            command(**given, **{argument: made})

        parameters = [found for p in signature.parameters.values() for found in in_place(p)]
        with_options.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
        return with_options

    return decorate
