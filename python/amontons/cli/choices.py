"""The options that choose and set up a simulation: `run`, `view`, `export` and `fmu` share them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from . import completion
from .common import DeviceOfSteps, Threads
from .options import Options, grouped
from .subject import Choices

OF_SIMULATIONS: Options = {
    "dt": (
        Annotated[float | None, typer.Option(help="Time step (s); default: that of the scene, or 5e-3.")],
        None,
    ),
    "law": (
        Annotated[
            str | None,
            typer.Option(
                help="Law of friction: coulomb (exact, default) or associated (convex relaxation).",
                autocompletion=completion.law_names,
            ),
        ],
        None,
    ),
    "method": (
        Annotated[
            str | None,
            typer.Option(
                help="Method: auto (default), or a method that `amontons compare` lists.",
                autocompletion=completion.method_names,
            ),
        ],
        None,
    ),
    "tolerance": (
        Annotated[
            float | None, typer.Option(help="Tolerance of the natural residual of each step; default: 1e-6.")
        ],
        None,
    ),
    "max_iterations": (
        Annotated[int | None, typer.Option(help="Limit of iterations for the solve of each step.")],
        None,
    ),
    "threads": (Threads, None),
    "device": (DeviceOfSteps, None),
    "budget": (Annotated[float | None, typer.Option(help="Wall-clock limit for each step (s).")], None),
}
OF_MODELS: Options = {
    "settings": (
        Annotated[
            list[str] | None,
            typer.Option(
                "--set",
                metavar="KEY=VALUE",
                help="Parameter of the scene; for a model: control of an actuator, coordinate q.NAME of a "
                "joint, or gravity=x,y,z. Repeatable.",
            ),
        ],
        None,
    ),
    "count": (
        Annotated[
            int | None, typer.Option(help="Number of grains or parts of a scene: short for --set count=N.")
        ],
        None,
    ),
    "strict": (
        Annotated[
            bool,
            typer.Option(
                "--strict", help="Refuse a model if a part that affects its motion is not supported."
            ),
        ],
        False,
    ),
    "floating_base": (
        Annotated[
            bool | None,
            typer.Option(
                "--floating-base/--fixed-base",
                help="URDF only: the root link moves freely, or is fixed to the world.",
            ),
        ],
        None,
    ),
    "keyframe": (
        Annotated[
            str | None, typer.Option("--keyframe", help="Name of the keyframe of the model to start from.")
        ],
        None,
    ),
    "self_overlaps": (
        Annotated[
            bool,
            typer.Option("--self-overlaps", help="Keep contacts between links that overlap at the start."),
        ],
        False,
    ),
    "decompose": (
        Annotated[
            str | None,
            typer.Option(
                metavar="auto|METRES",
                help="Convex parts of meshes on bodies that move, in place of hulls: auto for an error of "
                "1 % of each mesh, or the error (m).",
            ),
        ],
        None,
    ),
    "loops": (
        Annotated[
            Path | None,
            typer.Option(help="URDF only: YAML file of its extended form with the pairs that close loops."),
        ],
        None,
    ),
}


def set_up(*names: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """A decorator: the command has the options of models, and of simulations those with these names (all if
    none is named). It gets them as its argument `choices`."""
    chosen = {name: OF_SIMULATIONS[name] for name in names or OF_SIMULATIONS}

    def make(settings: list[str] | None, **given: Any) -> Choices:
        options = {name: given.pop(name) for name in chosen}
        options = {name: value for name, value in options.items() if value is not None}
        return Choices(settings or (), **given, options=options)

    return grouped("choices", {**chosen, **OF_MODELS}, make)
