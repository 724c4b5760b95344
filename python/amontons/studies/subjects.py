"""Runs by name: a scene, a model file, a function in a Python file."""

from __future__ import annotations

import importlib
import inspect
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

import numpy as np

from ..checks import suggestion
from ..errors import FileError, InputError
from ..simulation.simulation import Simulation
from ..simulation.step_report import Report

MODELS = (".xml", ".mjcf", ".urdf")
DURATION = 5.0
"""s, of models, which do not say how long they are worth watching"""
OPTIONS = tuple(name for name in inspect.signature(Simulation).parameters if name != "model")


@dataclass(frozen=True)
class Subject:
    """A scene or a model file, simulated for `duration`; called with parameters of the scene, controls and
    coordinates of the model, and options of `Simulation`."""

    name: str

    def __call__(self, *, duration: float | None = None, **parameters: Any) -> dict[str, Any]:
        options: dict[str, Any] = {"on_failure": "ignore"}
        options |= {name: parameters.pop(name) for name in OPTIONS if name in parameters}
        simulation, usual = self._scene(parameters, options) or self._model(parameters, options)
        return measured(simulation, usual if duration is None else duration)

    @property
    def __signature__(self) -> inspect.Signature:
        """Permitted values of the grid."""
        names = ["duration", *OPTIONS, *(self._parameters())]
        named = [
            inspect.Parameter(n, inspect.Parameter.KEYWORD_ONLY, default=None) for n in dict.fromkeys(names)
        ]
        return inspect.Signature(named)

    def _parameters(self) -> list[str]:
        from .. import scenes

        if self.name in scenes.names():
            return list(scenes.get(self.name).parameters)
        path = Path(self.name)
        if path.suffix.lower() not in MODELS or not path.exists():
            near = suggestion(self.name, scenes.names())
            raise InputError(
                f"there is no scene or model file {self.name!r}{near}; scenes: {', '.join(scenes.names())}"
            )
        model = _model(self.name)
        return [*model.control_names, *(f"q.{name}" for name in model.coordinates), "keyframe"]

    def _scene(
        self, parameters: Mapping[str, Any], options: Mapping[str, Any]
    ) -> tuple[Simulation, float] | None:
        from .. import scenes

        if self.name not in scenes.names():
            return None
        scene = scenes.get(self.name)
        model = scenes.make(self.name, **parameters)
        return Simulation(model, **({"dt": scene.dt} | scene.options | options)), scene.duration

    def _model(self, parameters: Mapping[str, Any], options: Mapping[str, Any]) -> tuple[Simulation, float]:
        simulation = Simulation(_model(self.name), **options)
        if parameters.get("keyframe") is not None:
            simulation.apply_keyframe(parameters["keyframe"])
        start = {}
        for name, value in parameters.items():
            if name in simulation.model.control_names:
                simulation.set_control(name, value)
            elif name != "keyframe":
                start[name.removeprefix("q.")] = value
        if start:
            simulation.set_q(start)
        return simulation, DURATION


@cache
def _model(path: str) -> Any:
    """Read once in each process."""
    from ..io import load_model

    return load_model(path)


def measured(simulation: Simulation, duration: float) -> dict[str, Any]:
    """Simulates, and tells what any scene has: how far bodies went, energy, what the steps took."""
    begin = simulation.state.positions.copy()
    iterations, depth = 0, 0.0

    def look(_: Simulation, report: Report) -> None:
        nonlocal iterations, depth
        iterations += report.iterations
        depth = max(depth, report.penetration)

    last = simulation.run(duration, after_step=look)
    way = np.linalg.norm(simulation.state.positions - begin, axis=1)
    speed = np.linalg.norm(simulation.state.linear_velocities, axis=1)
    return {
        "time": simulation.time,
        "moved": float(way.max(initial=0.0)),
        "speed": float(speed.max(initial=0.0)),
        "energy": last.energy,
        "contacts": last.contacts,
        "penetration": depth,
        "iterations": iterations,
    }


@dataclass(frozen=True)
class FileRun:
    """A function in a Python file, which every worker reads itself."""

    path: str
    function: str

    @property
    def name(self) -> str:
        return self.function

    def __call__(self, **parameters: Any) -> Any:
        return _function(self.path, self.function)(**parameters)

    @property
    def __signature__(self) -> inspect.Signature:
        return inspect.signature(_function(self.path, self.function))


@cache
def _function(path: str, name: str) -> Callable[..., Any]:
    file = Path(path)
    if not file.is_file():
        raise FileError(f"{path}: no such file")
    spec = spec_from_file_location(f"amontons_study_{file.stem}", file)
    if spec is None or spec.loader is None:
        raise FileError(f"{path}: is not a Python file; its name must end in .py")
    module = module_from_spec(spec)
    sys.modules[spec.name] = module
    sys.path.insert(0, str(file.parent))  # modules beside it, as for a program
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise FileError(f"{path}: cannot be imported ({type(error).__name__}: {error})") from error
    finally:
        sys.path.remove(str(file.parent))
    return _callable(module, name, path)


def _callable(module: Any, name: str, where: str) -> Callable[..., Any]:
    found = getattr(module, name, None)
    if not callable(found):
        known = [key for key, value in vars(module).items() if inspect.isfunction(value) and key[0] != "_"]
        raise InputError(
            f"{where}: has no function {name!r}{suggestion(name, known)}; it has {', '.join(known) or 'none'}"
        )
    return found


def _allowed_run(text: str, module: str) -> Callable[..., Any]:
    from .. import scenes

    if text in scenes.names():
        return Subject(text)
    place, _, name = text.rpartition(":")
    refusal = InputError(f"run = {text!r}; allowed are scenes and functions of {module}: {module}:FUNCTION")
    if place != module or not name.isidentifier() or name.startswith("_"):
        raise refusal
    try:
        found = _callable(importlib.import_module(module), name, module)
    except ImportError as error:
        raise InputError(f"the module {module} cannot be imported ({error})") from None
    if (
        not inspect.isfunction(found) or found.__module__ != module
    ):  # only imported there, as os.system may be
        raise refusal
    return found


def named_run(text: str, folder: Path, module: str | None = None) -> Callable[..., Any]:
    """Returns the subject of a name: a scene, a model file, "file.py:function" or "package.module:function".

    module: the one module whose own functions may be named, beside scenes; InputError for all else, before
    anything is imported or read.
    """
    place, colon, function = text.rpartition(":")
    if module is not None:
        return _allowed_run(text, module)
    if not colon or not function.isidentifier():
        path = folder / text
        return Subject(str(path) if path.suffix.lower() in MODELS else text)
    if place.endswith(".py"):
        return FileRun(str((folder / place).resolve()), function)
    try:
        module = importlib.import_module(place)
    except ImportError as error:
        raise InputError(
            f"run = {text!r}: {place} cannot be imported ({error}); for a file write file.py:{function}"
        ) from None
    return _callable(module, function, place)
