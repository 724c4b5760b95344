"""The list of scenes: name, function, and the step and duration that show what it is for."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

from ..checks import suggestion
from ..errors import InputError
from ..guidance import guided
from ..model.model import Model

Maker = Callable[..., Model]
M = TypeVar("M", bound=Maker)


@dataclass(frozen=True)
class Scene:
    """A scene of the library: a function that returns a built model, and how to run it."""

    name: str
    make: Maker
    dt: float
    """Time step, s."""
    duration: float
    """Simulated time that shows what the scene is for, s."""
    options: dict[str, Any] = field(default_factory=dict)
    """Options of `Simulation` that differ from the defaults."""

    @property
    def summary(self) -> str:
        """The first line of the function's documentation."""
        return (inspect.getdoc(self.make) or "").partition("\n")[0]

    @property
    def parameters(self) -> dict[str, Any]:
        """Names and defaults of the parameters."""
        return {name: p.default for name, p in inspect.signature(self.make).parameters.items()}


MOST = 1_000_000
"""Parts of a scene, as the product of its counts: so many take minutes to build."""
_scenes: dict[str, Scene] = {}


def scene(*, dt: float, duration: float, **options: Any) -> Callable[[M], M]:
    """Enters the decorated function in the list, under its own name."""

    def enter(make: M) -> M:
        make, name = guided(make), make.__name__
        _scenes[name] = Scene(name=name, make=make, dt=dt, duration=duration, options=options)
        return make

    return enter


def names() -> list[str]:
    """The names of all scenes, in alphabetical order."""
    return sorted(_scenes)


def get(name: str) -> Scene:
    """The entry of a scene; an unknown name is an InputError that lists those there are."""
    if name not in _scenes:
        raise InputError(
            f"there is no scene {name!r}{suggestion(name, names())}: use one of {', '.join(names())}"
        )
    return _scenes[name]


def make(name: str, **parameters: Any) -> Model:
    """The built model of a scene; an unknown parameter is an InputError that lists those there are."""
    entry = get(name)
    unknown = sorted(set(parameters) - set(entry.parameters))
    if unknown:
        known = ", ".join(entry.parameters)
        near = suggestion(unknown[0], entry.parameters)
        raise InputError(f"scene {name!r} has no parameter {unknown[0]!r}{near}: use one of {known}")
    _require_few(entry, parameters)
    return entry.make(**parameters)


def _is_count(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _require_few(entry: Scene, given: dict[str, Any]) -> None:
    """InputError for counts of a scene whose product nobody waits for."""
    counts = {
        name: value
        for name, value in (entry.parameters | given).items()
        if _is_count(value) and (entry.parameters[name] is None or _is_count(entry.parameters[name]))
        if name != "seed"
    }
    if math.prod(max(1, count) for count in counts.values()) > MOST:
        told = ", ".join(f"{name} = {count}" for name, count in counts.items() if count > 1)
        raise InputError(f"scene {entry.name!r}: {told}; a scene has at most {MOST} parts")
