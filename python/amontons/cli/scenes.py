"""amontons scenes: what there is to run."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Annotated

import typer
from rich.box import SIMPLE_HEAD
from rich.table import Table

from .common import one_line_errors, out, say

if TYPE_CHECKING:
    from ..scenes import Scene


def scenes(
    name: Annotated[str | None, typer.Argument(help="A scene, to see its parameters.")] = None,
) -> None:
    """List the scenes, or the parameters of one, which `run` and `export` take by --set."""
    from .. import scenes as library

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
