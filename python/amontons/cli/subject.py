"""The subject of `run` and `export`: a scene by name, a model file, or a saved simulation."""

from __future__ import annotations

import ast
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..checks import suggestion
from ..errors import InputError, ModelWarning
from ..model.model import Model
from ..model.parts import WORLD
from ..simulation.simulation import Simulation
from . import completion
from .common import working
from .completion import MODELS, SAVED

if TYPE_CHECKING:
    from ..scenes import Scene

DURATION = 5.0
"""Simulated time of models that do not say how long they are worth watching (s)."""

Name = Annotated[
    str,
    typer.Argument(
        metavar="MODEL_OR_SCENE",
        help="Scene (see `amontons scenes`), model (MJCF .xml, .urdf, .json) or saved simulation (.h5).",
        show_default=False,
        autocompletion=completion.subjects,
    ),
]


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


@dataclass(frozen=True)
class Choices:
    """The options of a command that belong to its subject."""

    settings: Sequence[str] = ()
    count: int | None = None
    strict: bool = False
    floating_base: bool | None = None
    keyframe: str | None = None
    self_overlaps: bool = False
    decompose: str | None = None
    loops: Path | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    """of `Simulation`, as far as they are given"""


def open_subject(name: str, choices: Choices) -> Subject:
    """Raises InputError or FileNotFoundError."""
    from .. import scenes  # takes long, and the commands on problem files do without

    options = choices.options
    if name in scenes.names():
        _require_model(name, choices)
        counts = () if choices.count is None else (f"count={choices.count}",)
        return _scene(name, [*choices.settings, *counts], options)
    if choices.count is not None:
        raise InputError(f"{name}: --count is for scenes; `amontons scenes` lists them")
    path = Path(name)
    suffix = path.suffix.lower()
    if suffix not in (*MODELS, *SAVED):
        if path.exists():
            known = ", ".join((*MODELS, *SAVED))
            raise InputError(f"{path}: unknown kind of file; known suffixes are {known}")
        raise InputError(
            f"there is no scene or file {name!r}{suggestion(name, scenes.names())}; "
            f"scenes are {', '.join(scenes.names())}"
        )
    if suffix in SAVED:
        _require_model(name, choices)
        if choices.settings:
            raise InputError(f"{name}: only scenes and models have parameters to --set")
    if not path.exists():
        raise FileNotFoundError(f"{path}: no such file")
    if suffix in SAVED:
        simulation = Simulation.load(path, on_failure="ignore", **options)
        return Subject(path.stem, str(path), simulation, DURATION)
    return _model(path, choices)


def _require_model(name: str, choices: Choices) -> None:
    wanted = {
        "--strict": choices.strict,
        "--floating-base": choices.floating_base is not None,
        "--self-overlaps": choices.self_overlaps,
        "--decompose": choices.decompose is not None,
        "--loops": choices.loops is not None,
        "--keyframe": choices.keyframe is not None,
    }
    for option in (option for option, given in wanted.items() if given):
        raise InputError(f"{name}: {option} is for model files ({', '.join(MODELS)})")


def _model(path: Path, choices: Choices) -> Subject:
    """The model of a file in its keyframe, with gravity and controls as they are set."""
    from .. import load_model

    with working(f"reading {path.name}"):
        model = load_model(
            path,
            strict=choices.strict,
            floating_base=choices.floating_base,
            self_overlaps=choices.self_overlaps,
            decompose=_error_of_parts(choices.decompose),
            loops=choices.loops,
        )
    values = dict(_key_and_text(setting) for setting in choices.settings)
    if (gravity := values.pop("gravity", None)) is not None:
        model = replace(model, gravity=_value(f"gravity={gravity}", gravity, model.gravity))
    if falls_freely(model):
        warnings.warn(
            f"{path}: nothing holds the bodies and nothing is there to fall on; write a floor into the file, "
            "or in Python amontons.on_floor(model)",
            ModelWarning,
            stacklevel=2,
        )
    simulation = Simulation(model, on_failure="ignore", **choices.options)
    if choices.keyframe is not None:
        simulation.apply_keyframe(choices.keyframe)
    _set_state(simulation, values)
    return Subject(path.stem, " ".join([str(path), *choices.settings]), simulation, DURATION)


def _error_of_parts(text: str | None) -> bool | float:
    """The value of --decompose for load_model."""
    if text is None or text == "auto":
        return text is not None
    try:
        return float(text)
    except ValueError:
        raise InputError(f"--decompose {text}: give auto, or the error in m, as in 0.001") from None


def falls_freely(model: Model) -> bool:
    """Whether gravity pulls bodies that no joint and no shape of the world can stop."""
    held = {WORLD} | {k for k, body in enumerate(model.bodies) if body.motion != "dynamic"}
    heavy = any(k not in held and body.gravity_scale != 0 for k, body in enumerate(model.bodies))
    jointed = any(joint.body_a in held or joint.body_b in held for joint in model.joints)
    floored = any(geom.body in held and (geom.category or geom.mask) for geom in model.geoms)
    return any(model.gravity) and heavy and not (jointed or floored)


def _set_state(simulation: Simulation, values: dict[str, str]) -> None:
    """Controls, and coordinates: q.NAME, or NAME where no control has it."""
    model = simulation.model
    start: dict[str, Any] = {}
    for key, text in values.items():
        coordinate = key.removeprefix("q.")
        if key in model.control_names:
            simulation.set_control(key, _value(f"{key}={text}", text, 0.0))
        elif coordinate in model.coordinates:
            several = model.coordinates[coordinate].dof < 0
            start[coordinate] = _value(f"{key}={text}", text, () if several else 0.0)
        else:
            known = ["gravity", *model.control_names, *(f"q.{name}" for name in model.coordinates)]
            shown = ", ".join(known[:20]) + (", ..." if len(known) > 20 else "")
            raise InputError(f"--set {key}={text}: the model has {shown} to set{suggestion(key, known)}")
    if start:
        simulation.set_q(start)


def _scene(name: str, settings: Sequence[str], options: Mapping[str, Any]) -> Subject:
    from .. import scenes

    entry = scenes.get(name)
    parameters = scene_parameters(entry, settings)
    try:
        model = scenes.make(name, **parameters)
    except InputError:
        raise
    except (TypeError, ValueError, ArithmeticError, MemoryError) as error:
        raise InputError(f"scene {name!r}: {' '.join(settings)} cannot be made ({error})") from None
    simulation = Simulation(model, on_failure="ignore", **({"dt": entry.dt} | entry.options | {**options}))
    return Subject(name, " ".join([name, *settings]), simulation, entry.duration)


def scene_parameters(entry: Scene, settings: Sequence[str]) -> dict[str, Any]:
    """The values of KEY=VALUE, of the kinds that the defaults of the parameters have."""
    parameters: dict[str, Any] = {}
    for setting in settings:
        key, text = _key_and_text(setting)
        if key not in entry.parameters:
            known = ", ".join(entry.parameters) or "none"
            near = suggestion(key, entry.parameters)
            raise InputError(f"--set {setting}: scene {entry.name!r} has the parameters {known}{near}")
        parameters[key] = _value(setting, text, entry.parameters[key])
    return parameters


def _key_and_text(setting: str) -> tuple[str, str]:
    key, equals, text = setting.partition("=")
    if not equals or not key.strip():
        raise InputError(f"--set {setting}: write KEY=VALUE")
    return key.strip(), text.strip()


def _kind(default: Any) -> str:
    """Name of the type of the default value, for messages."""
    match default:
        case bool():
            return "true or false"
        case int():
            return "a whole number"
        case float():
            return "a number"
        case tuple():
            return "numbers in parentheses"
        case _:
            return "a text"


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
        raise InputError(
            f"--set {setting}: the value must be {_kind(default)}, like the default, {default!r}"
        )
    return float(value) if isinstance(default, float) else value
