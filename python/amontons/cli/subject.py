"""What `run` and `export` simulate: a scene by name, a model file, or a saved simulation."""

from __future__ import annotations

import ast
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import InputError
from ..simulation.simulation import Simulation

if TYPE_CHECKING:
    from ..scenes import Scene

MODELS = (".xml", ".mjcf", ".urdf")
SAVED = (".h5", ".hdf5", ".hdf")
DURATION = 5.0
"""Simulated time of models that do not say how long they are worth watching (s)."""

Name = Annotated[
    str,
    typer.Argument(
        metavar="MODEL_OR_SCENE",
        help="A scene (see `amontons scenes`), a model (MJCF .xml, .urdf) or a saved simulation (.h5).",
        show_default=False,
    ),
]
Parameters = Annotated[
    list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="A parameter of the scene; repeatable.")
]
Step = Annotated[float | None, typer.Option(help="Time step (s); that of the scene, else 5e-3.")]
Law = Annotated[str | None, typer.Option(help="coulomb (default) or associated (convex relaxation).")]
Method = Annotated[
    str | None, typer.Option(help="auto (default), or one of the methods that 'compare' runs.")
]
Tolerance = Annotated[float | None, typer.Option(help="Natural residual of each step; 1e-6 by default.")]
MaxIterations = Annotated[int | None, typer.Option(help="Of the solve of each step.")]
Budget = Annotated[float | None, typer.Option(help="Wall clock of each step (s).")]


@dataclass
class Subject:
    """A simulation ready to run."""

    name: str
    """for titles: the scene or the stem of the file"""
    source: str
    """for recordings: with the parameters"""
    simulation: Simulation
    duration: float
    """simulated time worth watching (s)"""


def open_subject(name: str, settings: Sequence[str], given: dict[str, Any]) -> Subject:
    """given: options of `Simulation`; those that are None keep their defaults.

    Raises InputError or FileNotFoundError.
    """
    from .. import scenes  # takes long, and the commands on problem files do without

    options = {key: value for key, value in given.items() if value is not None}
    if name in scenes.names():
        return _scene(name, settings, options)
    path = Path(name)
    suffix = path.suffix.lower()
    if suffix not in (*MODELS, *SAVED):
        if path.exists():
            known = ", ".join((*MODELS, *SAVED))
            raise InputError(f"{path}: unknown kind of file; known suffixes are {known}")
        raise InputError(f"there is no scene or file {name!r}; scenes are {', '.join(scenes.names())}")
    if settings:
        raise InputError(f"{name}: only scenes have parameters to --set")
    if not path.exists():
        raise FileNotFoundError(f"{path}: no such file")
    if suffix in SAVED:
        simulation = Simulation.load(path, on_failure="ignore", **options)
        return Subject(path.stem, str(path), simulation, DURATION)
    from .. import load_model

    simulation = Simulation(load_model(path), on_failure="ignore", **options)
    return Subject(path.stem, str(path), simulation, DURATION)


def _scene(name: str, settings: Sequence[str], options: dict[str, Any]) -> Subject:
    from .. import scenes

    entry = scenes.get(name)
    parameters = scene_parameters(entry, settings)
    try:
        model = scenes.make(name, **parameters)
    except InputError:
        raise
    except (TypeError, ValueError, ArithmeticError, MemoryError) as error:
        raise InputError(f"scene {name!r}: {' '.join(settings)} cannot be made ({error})") from None
    simulation = Simulation(model, on_failure="ignore", **({"dt": entry.dt} | entry.options | options))
    return Subject(name, " ".join([name, *settings]), simulation, entry.duration)


def scene_parameters(entry: Scene, settings: Sequence[str]) -> dict[str, Any]:
    """The values of KEY=VALUE, of the kinds that the defaults of the parameters have."""
    parameters: dict[str, Any] = {}
    for setting in settings:
        key, equals, text = setting.partition("=")
        key = key.strip()
        if not equals or not key:
            raise InputError(f"--set {setting}: write KEY=VALUE")
        if key not in entry.parameters:
            known = ", ".join(entry.parameters) or "none"
            raise InputError(f"--set {setting}: scene {entry.name!r} has the parameters {known}")
        parameters[key] = _value(setting, text.strip(), entry.parameters[key])
    return parameters


def _value(setting: str, text: str, default: Any) -> Any:
    """A literal of Python, or true and false; a number where the default is one, and so on."""
    value: Any
    try:
        value = {"true": True, "false": False}.get(text.lower())
        value = ast.literal_eval(text) if value is None else value
    except (ValueError, SyntaxError):
        value = text
    if isinstance(value, list):
        value = tuple(value)
    kinds: tuple[type, ...] = (type(default),)
    if default is None:  # the scene chooses by itself
        kinds = (bool, int, float, tuple, str)
    elif isinstance(default, float):
        kinds = (int, float)
    wrong_flag = isinstance(value, bool) and bool not in kinds
    if wrong_flag or not isinstance(value, kinds):
        raise InputError(f"--set {setting}: the value must be like the default, {default!r}")
    return float(value) if isinstance(default, float) else value
