"""amontons bench: the figures of the reference paper."""

from __future__ import annotations

import typer

bench = typer.Typer(no_args_is_help=True, help="Reproduce benchmarks.")


@bench.command()
def paper() -> None:
    """."""
