"""amontons scenes: what there is to run."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.box import SIMPLE_HEAD
from rich.table import Table

from .common import AsJson, one_line_errors, out, print_json, say
from .completion import scene_names

if TYPE_CHECKING:
    from ..scenes import Scene


def scenes(
    name: Annotated[
        str | None,
        typer.Argument(
            help="Scene whose parameters are shown; default: list all scenes.", autocompletion=scene_names
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """List the scenes, or the parameters of one, which `run` and `export` take by --set."""
    from .. import scenes as library

    if as_json:
        with one_line_errors():
            chosen = library.names() if name is None else [library.get(name).name]
        print_json([_as_dict(library.get(each)) for each in chosen])
        return
    if name is not None:
        with one_line_errors():
            _one(library.get(name))
        return
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    table.add_column("scene", no_wrap=True)
    table.add_column("", overflow="fold")
    for each in library.names():
        table.add_row(each, library.get(each).summary)
    out.print(table, highlight=False)


def _as_dict(scene: Scene) -> dict[str, Any]:
    told = {"name": scene.name, "summary": scene.summary, "dt": scene.dt, "duration": scene.duration}
    return told | {"parameters": scene.parameters, "options": scene.options}


def _one(scene: Scene) -> None:
    say(inspect.getdoc(scene.make))
    say("")
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    for column in ("parameter", "default"):
        table.add_column(column)
    for key, value in scene.parameters.items():
        table.add_row(key, repr(value))
    out.print(table, highlight=False, markup=False)
    say(f"dt {scene.dt:g} s, duration {scene.duration:g} s")
