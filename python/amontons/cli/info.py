"""amontons info: what there is to know about a problem file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .common import BAD_INPUT, AsJson, facts_table, print_json, read
from .completion import problems


def info(
    file: Annotated[Path, typer.Argument(help="Problem file.", autocompletion=problems)],
    as_json: AsJson = False,
) -> None:
    """Show sizes, cones, friction coefficients, symmetry, rank and conditioning of a problem."""
    from ..report.facts import as_dict, facts

    problem = read(file)
    if problem is None:
        raise typer.Exit(BAD_INPUT)
    if as_json:
        print_json({"file": str(file), **as_dict(problem)})
    else:
        facts_table(facts(problem))
