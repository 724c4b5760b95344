"""The command `amontons`: simulations, and problem files."""

from __future__ import annotations

import inspect
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from typing import Annotated

import typer
from rich.markup import escape

from .. import __version__
from .common import NOT_CONVERGED, complain, out, show_log
from .compare import compare
from .doctor import doctor
from .export import export
from .fmu import fmu
from .info import info
from .plot import plot
from .run import run
from .scenes import scenes
from .solve import solve
from .stability import stability
from .sweep import sweep
from .view import view

app = typer.Typer(
    help="Rigid bodies with joints and frictional contacts, and the variational inequalities of their steps.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)
PANELS: dict[str, tuple[Callable[..., None], ...]] = {
    "Simulations": (run, view, scenes, export, fmu, plot, sweep, stability),
    "Problem files": (solve, compare, info),
    "Installation": (doctor,),
}
for panel, commands in PANELS.items():
    for command in commands:  # Rich would take the brackets of amontons[view] for markup
        app.command(rich_help_panel=panel, help=escape(inspect.getdoc(command) or ""))(command)


def main() -> None:
    """Entry point of the command."""
    _show_any_letter()
    try:
        app()
    except BrokenPipeError:  # the reader of our output has seen enough
        _let_go()
        sys.exit(NOT_CONVERGED)
    except OSError as error:  # standard output is full
        _let_go()
        complain(f"nothing more can be printed ({error.strerror or error})")
        sys.exit(NOT_CONVERGED)


def _show_any_letter() -> None:
    """An escape stands for a letter that the console has not: that of Windows may have 256 of them."""
    for stream in (sys.stdout, sys.stderr):
        if getattr(stream, "errors", "") == "strict":
            stream.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]


def _let_go() -> None:
    """Nothing is written to standard output any more, not even at the end of the process."""
    with suppress(OSError, ValueError, AttributeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _version(wanted: bool) -> None:
    if wanted:
        out.print(f"amontons {__version__}")
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
    verbose: Annotated[
        int,
        typer.Option(
            "--verbose", "-v", count=True, help="Log what is done to standard error; twice: every step too."
        ),
    ] = 0,
) -> None:
    if verbose:
        show_log(verbose)
