"""amontons info: what there is to know about a problem file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from .common import BAD_INPUT, out, read


def info(file: Annotated[Path, typer.Argument(help="A problem file.")]) -> None:
    """Show sizes, cones, friction coefficients, symmetry, rank and conditioning of a problem."""
    from ..report.facts import facts

    problem = read(file)
    if problem is None:
        raise typer.Exit(BAD_INPUT)
    table = Table(show_header=False, box=None, pad_edge=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    for key, value in facts(problem):
        table.add_row(key, value)
    out.print(table, highlight=False)
