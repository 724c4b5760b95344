"""Calls with arguments that a function does not take: the error says what was meant, and what it takes."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any, TypeVar

from .checks import shown, suggestion

T = TypeVar("T")

MEANT = {
    "euler": "orientation",
    "friction": "material=Material(friction=...)",
    "gains": "motor=Motor(...)",
    "gain": "kp",
    "damping_gain": "kd",
    "kv": "kd",
    "half_extents": "half",
    "half_size": "half",
    "height": "half_length",
    "length": "half_length",
    "mu": "friction",
    "parent": "b",
    "play": "clearance",
    "play_friction": "clearance_friction",
    "play_length": "guide_length",
    "play_normal": "guide_normal",
    "pos": "position",
    "quat": "orientation",
    "quaternion": "orientation",
    "r": "radius",
    "restitution": "material=Material(restitution=...)",
    "rotation": "orientation",
    "rpy": "orientation",
    "size": "half",
    "time_step": "dt",
    "timestep": "dt",
    "target": "control",
    "tol": "tolerance",
    "vel": "linear_velocity",
    "velocity": "linear_velocity",
    "xyz": "position",
}
"""Names of arguments in other engines, or in other functions of this package -> the name here."""


def guided(thing: T) -> T:
    """A decorator of functions, and of classes for the public functions that stand in their bodies.

    An argument outside the signature raises a TypeError, as usual; its message contains the remedy. Not for
    functions that warn, whose warnings are about the line that calls them: they would be one frame off.
    """
    if not isinstance(thing, type):
        return _guided_function(thing)  # type: ignore[arg-type,return-value]
    for name, value in list(vars(thing).items()):
        public = name == "__init__" or not name.startswith("_")
        if public and inspect.isfunction(value):
            setattr(thing, name, _guided_function(value))
    return thing


def former_names(**present: str) -> Callable[[type[T]], type[T]]:
    """A decorator of classes: an attribute of a former name raises an error with the present one."""

    def add(cls: type[T]) -> type[T]:
        def missing(_: object, name: str) -> Any:
            if name in present:
                raise AttributeError(f"{cls.__name__}.{name} is now {cls.__name__}.{present[name]}")
            raise AttributeError(f"{cls.__name__} has no attribute {name!r}{suggestion(name, dir(cls))}")

        cls.__getattr__ = missing  # type: ignore[attr-defined]
        return cls

    return add


def _guided_function(function: Any) -> Any:
    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        try:
            return function(*args, **kwargs)
        except TypeError as error:
            # One frame: the call itself failed, and no line of the function ran.
            if error.__traceback__ is None or error.__traceback__.tb_next is not None:
                raise
            raise TypeError(_explained(function, args, kwargs) or str(error)) from None

    return call


def _explained(function: Any, args: tuple[Any, ...], kwargs: dict[str, Any]) -> str | None:
    """Returns the fault of a call, and the remedy."""
    parameters = list(inspect.signature(function).parameters.values())
    name = function.__name__
    if "." in function.__qualname__:  # of a class
        parameters, args = parameters[1:], args[1:]
        if name == "__init__":
            name = function.__qualname__.split(".")[-2]
    takes = f"; it is {name}({_outline(parameters)})"
    positional = [p for p in parameters if p.kind is p.POSITIONAL_OR_KEYWORD]
    named = [p.name for p in parameters if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)]
    for given in kwargs:
        if given not in named:
            meant = _meant(given, named)
            return f"{name}: there is no argument {given!r}{meant or takes}"
    if len(args) > len(positional):
        return f"{name}: {_surplus(name, args, positional, named)}{takes}"
    filled = {p.name for p in positional[: len(args)]}
    if twice := filled & set(kwargs):
        return f"{name}: {', '.join(sorted(twice))} is given twice, by its place and by its name{takes}"
    needed = [p.name for p in parameters if p.name in named and p.default is p.empty]
    if missing := [n for n in needed if n not in filled | set(kwargs)]:
        return f"{name}: {' and '.join(missing)} {'is' if len(missing) == 1 else 'are'} missing{takes}"
    return None


def _surplus(name: str, args: tuple[Any, ...], positional: list[Any], named: list[str]) -> str:
    """Too many arguments without a name: numbers that belong together, or what must have a name."""
    if len(positional) == 1 and all(isinstance(a, int | float) for a in args):
        return f"{len(args)} numbers are given apart; write {name}({args!r})"
    surplus = shown(args[len(positional)])
    if len(named) > len(positional):
        return f"{surplus} stands where no argument without a name does; give it by name"
    return f"{surplus} is one argument too many"


def _meant(given: str, named: list[str]) -> str:
    meant = MEANT.get(given, "")
    if meant.partition("=")[0] in named:
        half = ", half of it" if meant.startswith("half") and not given.startswith("half") else ""
        return f"; did you mean {meant!r}{half}?"
    return suggestion(given, named).replace(" (", "; ").replace("?)", "?")


def _outline(parameters: list[inspect.Parameter]) -> str:
    """half; name=, *, position=, ...: what has a default ends with =."""
    words, starred = [], False
    for p in parameters:
        if p.kind is p.KEYWORD_ONLY and not starred:
            words.append("*")
            starred = True
        starred |= p.kind is p.VAR_POSITIONAL
        stars = {p.VAR_POSITIONAL: "*", p.VAR_KEYWORD: "**"}.get(p.kind, "")
        words.append(f"{stars}{p.name}" + ("" if stars or p.default is p.empty else "="))
    return ", ".join(words)
