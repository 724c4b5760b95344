"""amontons fmu: a functional mock-up unit for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .choices import set_up
from .common import AsJson, one_line_errors, print_json, say
from .subject import Choices, Name, open_subject


@set_up("dt", "law", "method", "tolerance")
def fmu(
    subject: Name,
    output: Annotated[Path, typer.Option("--out", "--output", "-o", help="FMU file to write (.fmu).")],
    inputs: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Variable to make an input; * matches any letters. Repeatable."),
    ] = None,
    outputs: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Variable to make an output; * matches any letters. Repeatable."),
    ] = None,
    fmi: Annotated[str, typer.Option(help="Version of the interface: 3.0 or 2.0.")] = "3.0",
    wheels: Annotated[
        list[Path] | None,
        typer.Option(
            "--wheel", help="Wheel of amontons for another system, to add its library to the FMU. Repeatable."
        ),
    ] = None,
    *,
    choices: Choices,
    as_json: AsJson = False,
) -> None:
    """Write a simulation as a functional mock-up unit for co-simulation, which runs without Python.

    The exit code is 0, or 2 for input that could not be used.
    """
    from ..io import write_fmu

    with one_line_errors():
        chosen = open_subject(subject, choices)
        write_fmu(chosen.simulation, output, inputs=inputs, outputs=outputs, fmi=fmi, wheels=wheels or ())
    if as_json:
        print_json({"files": [str(output)]})
    else:
        say(f"wrote {output}")
