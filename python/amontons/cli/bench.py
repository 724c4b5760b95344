"""amontons bench: the figures of the reference paper."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError
from ..problem import options
from . import completion
from .common import AsJson, make_folder, one_line_errors, print_json, progress, say

bench = typer.Typer(no_args_is_help=True, help="Reproduce benchmarks.")


@bench.callback()
def _bench() -> None:
    """Reproduce benchmarks."""


@bench.command()
def paper(
    output: Annotated[
        Path, typer.Option("--out", "--output", help="Folder of the figures and tables.")
    ] = Path("paper"),
    quick: Annotated[
        bool, typer.Option("--quick", help="Small scenes, to see that everything runs.")
    ] = False,
    law: Annotated[
        str,
        typer.Option(help="associated, that of the paper, or coulomb.", autocompletion=completion.law_names),
    ] = "associated",
    deadline: Annotated[
        float | None, typer.Option(help="Wall clock per method and problem (s), at full size 10 by default.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Reproduce the figures of the P-SPG-FB paper: PNG, CSV and a Markdown page in one folder.

    Objective of P-SPG-FB as published, residual of every method on B1 to B4, cost against size and mass
    ratio, pictures of the wall. At full size this takes several minutes.
    """
    from ..report.paper.cases import FULL, QUICK
    from ..report.paper.page import reproduce, steps

    plan = QUICK if quick else FULL
    with one_line_errors():
        options.chosen("law", law, options.LAWS)
        if deadline is not None:
            if not 0 < deadline < float("inf"):
                raise InputError(f"deadline = {deadline:g}; it must be positive and finite")
            shorter = min(plan.sweep_deadline, deadline)
            plan = replace(plan, deadline=deadline, sweep_deadline=shorter)
    with one_line_errors(output):
        make_folder(output)
        command = (
            "amontons bench paper"
            + (" --quick" if quick else "")
            + ("" if law == "associated" else f" --law {law}")
            + ("" if deadline is None else f" --deadline {deadline:g}")
        )
        with progress(steps(plan)) as advance:
            made = reproduce(plan, output, law=law, command=command, before=advance)
    if as_json:
        print_json({"files": made})
        return
    for path in made:
        say(path)
